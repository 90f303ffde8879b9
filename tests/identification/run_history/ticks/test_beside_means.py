"""The gram by sums over intervals is the gram of the columns written at each sample."""

import numpy as np
from scipy.sparse import csr_array

from identification.run_history.ticks.beside_means import Samples

KEPT = np.array([False, True, True, False, True, True, False, True])
EMPTY = 3


def beside(column, time, interval):
    """One column less mean and line, interval by interval."""
    mean = {k: column[interval == k].mean() for k in set(interval)}
    middle = {k: time[interval == k].mean() for k in set(interval)}
    out = np.empty_like(column)
    for n, k in enumerate(interval):
        slope = 0.0
        if k - 1 in mean and k + 1 in mean:
            slope = (mean[k + 1] - mean[k - 1]) / (middle[k + 1] - middle[k - 1])
        out[n] = column[n] - mean[k] - slope * (time[n] - middle[k])
    return out


def test_gram_is_that_of_the_columns_at_each_sample():
    rng = np.random.default_rng(3)
    interval = np.sort(rng.choice([k for k in range(KEPT.size) if k != EMPTY], 300))
    time = np.sort(interval + rng.uniform(size=interval.size))
    levels = 200.0 + 30 * time[:, None] + rng.standard_normal((time.size, 2))
    sparse = rng.standard_normal((time.size, 5)) * (rng.uniform(size=(time.size, 5)) < 0.3)
    found = Samples(time, interval).gram(levels, csr_array(sparse), KEPT)
    columns = np.array([beside(c, time, interval) for c in np.hstack([levels, sparse]).T])
    there = columns[:, KEPT[interval]]
    np.testing.assert_allclose(found, there @ there.T, rtol=1e-9, atol=1e-9)
    everywhere = columns @ columns.T
    assert not np.allclose(found, everywhere, rtol=0.1), "intervals that are not kept would count"


def test_levels_far_from_zero_lose_no_digits():
    time = np.linspace(0.0, 3.0, 90, endpoint=False)
    interval = np.floor(time).astype(np.intp)
    ripple = 1e-4 * np.sin(40 * time)
    level = 1e6 + ripple
    found = Samples(time, interval).gram(np.column_stack([level, level]), csr_array((90, 1)), np.array([1, 1, 1], bool))
    expected = beside(ripple, time, interval)
    np.testing.assert_allclose(found[0, 0], expected @ expected, rtol=1e-4)
