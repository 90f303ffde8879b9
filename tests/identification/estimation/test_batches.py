"""Standard errors from batches: against theory for white noise, and honest for correlated noise."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import t as student

from identification.estimation.batches import BATCHES, BatchSums, sandwich

THETA = np.array([0.4, 1.5])


def regressor(n, period=2000):
    V = 12 * np.sin(2 * np.pi * np.arange(n) / period)
    return np.column_stack([V * np.abs(V), np.ones(n)])


def gathered(H, y, size, shift=(0.39, 1.0)):
    sums = BatchSums(np.array(shift))
    for start in range(0, len(y), size):
        sums.add(H[start : start + size], y[start : start + size])
    return sums


def test_batches_are_the_same_however_the_rows_come_and_lose_none():
    H = regressor(20_000)
    y = H @ THETA + np.random.default_rng(0).normal(size=len(H))
    A = np.column_stack([H, y - H @ np.array([0.39, 1.0])])
    grams = [gathered(H, y, size).gram for size in (1, 700, 20_000)]
    assert BATCHES // 2 <= len(grams[0]) <= BATCHES
    assert grams[0].sum(axis=0) == pytest.approx(A.T @ A, rel=1e-9, abs=1e-6)
    for gram in grams[1:]:
        assert gram == pytest.approx(grams[0], rel=1e-9, abs=1e-6)


def test_a_last_batch_of_a_few_rows_is_put_to_the_one_before():
    H = np.ones((70, 1))
    assert gathered(H, np.zeros(70), 70, (0.0,)).gram[:, 0, 0].tolist() == [32, 38]
    assert gathered(H[:50], np.zeros(50), 50, (0.0,)).gram[:, 0, 0].tolist() == [32, 18]
    assert gathered(H[:9], np.zeros(9), 9, (0.0,)).gram[:, 0, 0].tolist() == [9]


def test_correction_makes_it_exact_for_the_mean():
    """One column of ones in B equal batches: the sandwich is the textbook variance of a mean of B numbers."""
    y = np.random.default_rng(1).normal(size=40 * 32)
    H = np.ones((y.size, 1))
    found = sandwich(np.array([[np.sqrt(y.size)]]), np.array([y.mean()]), [(gathered(H, y, 999, (0.3,)), (0,))])
    means = y.reshape(40, 32).mean(axis=1)
    assert found.batches == 40
    assert found.cov[0, 0] == pytest.approx(means.var(ddof=1) / 40)
    assert found.dof[0] == pytest.approx(39)


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_coverage(memory):
    """400 runs: the binomial deviation of a coverage near 95 % is 1.1 points, near 68 % 2.3; three of them allowed."""
    rng = np.random.default_rng(7)
    n, runs = 4096, 400
    H = regressor(n)
    R, solver = np.linalg.qr(H, mode="r"), np.linalg.pinv(H)
    inside = np.zeros((2, 2))
    for _ in range(runs):
        e = lfilter([np.sqrt(1 - memory**2)], [1, -memory], rng.standard_normal(n + 300))[300:]
        y = H @ THETA + e
        theta = solver @ y
        found = sandwich(R, theta, [(gathered(H, y, 4096), (0, 1))])
        far = np.abs(theta - THETA) / np.sqrt(np.diag(found.cov))
        inside += [far < student.ppf(0.5 + level / 2, found.dof) for level in (0.6827, 0.95)]
    assert inside[0] / runs == pytest.approx([0.68, 0.68], abs=0.07)
    assert inside[1] / runs == pytest.approx([0.95, 0.95], abs=0.033)


def test_two_recordings_share_a_coefficient_and_have_a_tare_each():
    rng = np.random.default_rng(3)
    sizes, tares = (9000, 5000), (1.5, -4.0)
    parts = [regressor(n) for n in sizes]
    ys = [H @ np.array([0.4, tare]) + rng.normal(size=len(H)) for H, tare in zip(parts, tares, strict=True)]
    H = np.zeros((sum(sizes), 3))
    H[:, 0] = np.concatenate([part[:, 0] for part in parts])
    H[: sizes[0], 1] = H[sizes[0] :, 2] = 1.0
    theta = np.linalg.lstsq(H, np.concatenate(ys), rcond=None)[0]
    series = [(gathered(parts[k], ys[k], 1000), (0, k + 1)) for k in (0, 1)]
    found = sandwich(np.linalg.qr(H, mode="r"), theta, series)
    white = np.sqrt(np.diag(np.linalg.inv(H.T @ H)))
    assert np.sqrt(np.diag(found.cov)) == pytest.approx(white, rel=0.5)
    assert np.all(found.dof > 10)
    assert not found.slow


def test_noise_that_outlasts_a_batch_is_noticed():
    rng = np.random.default_rng(4)
    H = regressor(20_000)
    y = H @ THETA + lfilter([0.02], [1, -0.9995], rng.standard_normal(len(H)))
    theta = np.linalg.lstsq(H, y, rcond=None)[0]
    found = sandwich(np.linalg.qr(H, mode="r"), theta, [(gathered(H, y, 5000), (0, 1))])
    assert found.slow
    assert found.serial > 0.3


def test_no_noise_and_too_few_batches():
    H = regressor(5000)
    exact = sandwich(np.linalg.qr(H, mode="r"), np.zeros(2), [(gathered(H, np.zeros(5000), 999, (0.0, 0.0)), (0, 1))])
    assert exact.cov.tolist() == [[0.0, 0.0], [0.0, 0.0]]
    assert (exact.serial, exact.slow) == (0.0, False)
    with pytest.raises(ValueError, match="2 batches cannot tell"):
        sandwich(np.linalg.qr(H[:60], mode="r"), THETA, [(gathered(H[:60], H[:60] @ THETA, 60), (0, 1))])
