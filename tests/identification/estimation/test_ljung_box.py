"""The statistic of Ljung and Box: by its formula, and by its law on white noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from identification.estimation.ljung_box import ljung_box


def test_parts_add_up_and_each_is_its_formula() -> None:
    rng = np.random.default_rng(0)
    parts = [rng.standard_normal(n) for n in (40, 7, 300)]
    lags = [8, 1, 20]
    wanted = 0.0
    for e, most in zip(parts, lags, strict=True):
        r = np.correlate(e, e, "full")[e.size : e.size + most] / float(e @ e)
        wanted += e.size * (e.size + 2) * float(np.sum(r**2 / (e.size - np.arange(1, most + 1))))
    assert ljung_box(parts, lags) == pytest.approx(wanted, rel=1e-12)
    assert ljung_box([np.zeros(9)], [3]) == 0.0


def test_white_noise_has_its_law_and_slow_noise_has_not() -> None:
    rng = np.random.default_rng(1)
    white = rng.standard_normal((400, 200))
    p = [chi2.sf(ljung_box([e - e.mean()], [10]), 10) for e in white]
    assert kstest(p, "uniform").pvalue > 0.01
    slow = white + 0.5 * np.roll(white, 1, axis=1)
    assert np.median([chi2.sf(ljung_box([e - e.mean()], [10]), 10) for e in slow]) < 1e-3
