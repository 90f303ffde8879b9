"""Where a hold that still settles is going, and how well that is known: at any noise."""

import numpy as np
import pytest

from identification.steady_state.asymptote import asymptote


@pytest.mark.parametrize("noise", [0.001, 0.01, 0.1, 0.5])
def test_what_is_stated_is_what_it_scatters_by(noise):
    rng, i, off = np.random.default_rng(7), np.arange(60), []
    for _ in range(300):
        values = 5 + 3 * np.exp(-i / rng.uniform(4, 25)) + noise * rng.standard_normal(i.size)
        found = asymptote(values)
        off.append((found.value - 5) / np.hypot(found.spread, noise * np.linalg.norm(found.weights)))
    assert np.std(off) == pytest.approx(1.0, abs=0.25), "a grid that is too coarse was off by a hundred times that"
    assert abs(np.mean(off)) < 0.3
