"""Noise of the diagnosis: the fast factorisation is the dense one, the likelihood is the textbook's, and variances
that were put in come out."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.noise.covariance import Noise, Rows, Whitener, rows_of
from identification.mismatch.noise.restricted_likelihood import Response, likelihood
from identification.mismatch.noise.variances import fit_noise

MIXED = Noise(0.04, 0.0009, (0.15, 4.0), (0.05, 0.3), ((3.0, 4.0),), (0.2,))
SLOW = Noise(0.04, 0.0009, (0.15, 4.0), (0.05, 0.3))
BAND = Noise(0.04, 0.0009, (), (), ((3.0, 4.0), (0.4, 1.5)), (0.2, 0.1))
WHITE = Noise(0.04, 0.0009)


def rows(n=200, seed=1, most=6, spacing=0.01):
    """Rows of one to `most` samples at uneven times, some with outliers."""
    rng = np.random.default_rng(seed)
    count = rng.integers(1, most + 1, n).astype(float)
    width = count * spacing
    time = np.cumsum(width + rng.exponential(0.05, n)) - 0.5 * width
    extra = np.where(rng.random(n) < 0.05, 9.0, 1.0)
    return Rows(time, count, extra, width)


def kernel(noise, lag):
    """(components, ...) correlation functions at `lag` s, each 1 at 0."""
    lag = np.abs(lag)
    out = [np.exp(-lag / T) for T in noise.scales]
    for f, Q in noise.bands:  # damped harmonic oscillator
        w = 2 * np.pi * f
        root = np.sqrt(1 - 1 / (4 * Q**2))
        out.append(np.exp(-w * lag / (2 * Q)) * (np.cos(w * root * lag) + np.sin(w * root * lag) / (2 * Q * root)))
    return np.array(out)


def dense(noise, r, size):
    """Covariance of the rows' means, sample by sample; samples lie evenly within each row."""
    variances = np.array([*noise.slow, *noise.band])
    index = np.repeat(np.arange(r.time.size), r.count.astype(int))
    within = np.concatenate([np.arange(m) - 0.5 * (m - 1) for m in r.count])
    at = r.time[index] + within * (r.width / r.count)[index]
    each = np.tensordot(variances, kernel(noise, at[:, None] - at[None, :]), 1) if variances.size else 0.0
    mean = (index[None, :] == np.arange(r.time.size)[:, None]) / r.count[:, None]
    out: np.ndarray = mean @ np.broadcast_to(each, (at.size, at.size)) @ mean.T
    return out + np.diag((noise.white + noise.proportional * size**2) * r.extra / r.count)


def sizes(n, seed=2):
    return np.random.default_rng(seed).uniform(0.0, 30.0, n)


@pytest.mark.parametrize("noise", [WHITE, SLOW, BAND, MIXED], ids=["white", "slow", "band", "all"])
def test_whitening_is_the_inverse_of_the_dense_cholesky_factor(noise):
    r, size = rows(), sizes(200)
    K = dense(noise, r, size)
    columns = np.random.default_rng(3).standard_normal((200, 4))
    fast = Whitener(noise, r, size)
    slow = np.linalg.solve(np.linalg.cholesky(K), columns)
    assert fast.whiten(columns) == pytest.approx(slow, abs=1e-9 * np.abs(slow).max())
    assert fast.whiten(columns[:, 1]) == pytest.approx(slow[:, 1], abs=1e-9 * np.abs(slow).max())
    assert fast.log_det == pytest.approx(np.linalg.slogdet(K)[1], abs=1e-8)
    white = np.random.default_rng(4).standard_normal(200)
    assert columns.T @ fast.weighed(white) == pytest.approx(fast.whiten(columns).T @ white, abs=1e-9)


def test_rows_far_longer_than_a_correlation_keep_their_variance():
    """A second of samples a row beside a correlation of 2 ms, whose exponential no float holds: sum of a geometric
    series."""
    count = np.full(50, 20_000.0)
    r = Rows(40.0 * np.arange(50.0), count, np.ones(50), 40.0 + 0 * count)
    noise = Noise(1e-6, 0.0, (0.002,), (1.0,))
    rho = np.exp(-1.0)
    z = Whitener(noise, r, np.zeros(50)).whiten(np.eye(50))
    assert np.diag(z) ** -2 == pytest.approx((1e-6 + (1 + rho) / (1 - rho)) / 20_000, rel=1e-3)
    assert z - np.diag(np.diag(z)) == pytest.approx(0.0, abs=1e-2)


def test_white_noise_of_a_mean_falls_with_its_samples():
    r = rows()
    z = Whitener(WHITE, r, np.zeros(200)).whiten(np.ones(200))
    assert z == pytest.approx(np.sqrt(r.count / (0.04 * r.extra)))


def test_means_of_simulated_samples_are_white_when_whitened():
    """Samples at 100 Hz of white and slow noise, binned into rows of uneven length."""
    rng = np.random.default_rng(4)
    noise = Noise(0.3, 0.0, (0.5,), (1.0,))
    n, a = 40_000, np.exp(-0.01 / 0.5)
    e = rng.standard_normal(n) * np.sqrt(1 - a**2)
    slow = np.empty(n)
    now = rng.standard_normal()
    for i in range(n):
        now = a * now + e[i]
        slow[i] = now
    y = slow + np.sqrt(0.3) * rng.standard_normal(n)
    count = rng.integers(1, 15, 5000)
    count = count[np.cumsum(count) <= n]
    edges = np.concatenate([[0], np.cumsum(count)])
    mean = np.add.reduceat(y, edges[:-1])[: count.size] / count
    mean[-1] = y[edges[-2] : edges[-1]].mean()
    time = 0.01 * 0.5 * (edges[1:] + edges[:-1] - 1)
    z = Whitener(noise, Rows(time, count.astype(float), np.ones(count.size), 0.01 * count), np.zeros(count.size))
    white = z.whiten(mean)
    assert np.std(white) == pytest.approx(1.0, abs=3 / np.sqrt(2 * count.size))
    for lag in (1, 2, 5, 20):
        assert abs(np.mean(white[lag:] * white[:-lag])) < 4 / np.sqrt(count.size)
    narrow = np.std(white[count <= 3])
    assert narrow == pytest.approx(1.0, abs=0.06)


# ---------------------------------------------------------------- restricted likelihood


def two_runs(p=3, n=120):
    rng = np.random.default_rng(5)
    runs = [rows(n, 6), rows(n - 30, 7)]
    return (
        runs,
        [rng.standard_normal(r.time.size) for r in runs],
        [rng.standard_normal((r.time.size, p)) for r in runs],
        [sizes(r.time.size, 8) for r in runs],
    )


@pytest.mark.parametrize(
    "noise",
    [
        replace(SLOW, scales=(), slow=()),
        SLOW,
        BAND,
        replace(MIXED, scales=(0.15,), slow=(0.05,)),
        replace(MIXED, scales=(0.02, 0.15, 0.5, 3.0), slow=(0.1, 0.05, 0.2, 0.1)),
    ],
    ids=["white", "slow", "band", "all", "many"],
)
@pytest.mark.parametrize("p", [0, 3])
def test_the_restricted_likelihood_and_its_slope(noise, p):
    """Patterson and Thompson's formula by dense algebra; its slope by finite differences."""
    runs, residuals, columns, size = two_runs(p)

    def by_definition(values):
        now = noise.with_variances(values)
        n = sum(r.time.size for r in runs)
        K, at = np.zeros((n, n)), 0
        for r, s in zip(runs, size, strict=True):
            K[at : at + r.time.size, at : at + r.time.size] = dense(now, r, s)
            at += r.time.size
        y, X = np.concatenate(residuals), np.concatenate(columns)
        inner = X.T @ np.linalg.solve(K, X)
        left = y - X @ np.linalg.solve(inner, X.T @ np.linalg.solve(K, y)) if p else y
        inner_det = np.linalg.slogdet(inner)[1] if p else 0.0
        return 0.5 * (np.linalg.slogdet(K)[1] + inner_det + left @ np.linalg.solve(K, left))

    v = noise.variances
    responses = [Response(*each) for each in zip(runs, residuals, columns, size, strict=True)]
    found = likelihood(noise, responses)
    value, slope = found.value, found.slope
    assert value == pytest.approx(by_definition(v), rel=1e-8)
    for j in range(v.size):
        step = np.zeros(v.size)
        step[j] = 1e-4 * v[j]
        expected = (by_definition(v + step) - by_definition(v - step)) / (2e-4 * v[j])
        assert slope[j] == pytest.approx(expected, rel=1e-4, abs=1e-3)
        moved = likelihood(noise.with_variances(v + step), responses).squares - found.squares
        assert -moved / (2e-4 * v[j]) == pytest.approx(found.information[j], rel=1e-3, abs=1e-6 / v[j])
    larger = likelihood(noise.with_variances(1.7 * v), responses)
    assert found.scaled(1.7).value == pytest.approx(larger.value, rel=1e-10)
    assert found.scaled(1.7).slope == pytest.approx(larger.slope, rel=1e-4)  # by differences beyond four columns
    assert found.scaled(1.7).information == pytest.approx(larger.information, rel=1e-8)


# ---------------------------------------------------------------- variances that were put in


def simulated(noise, n=1500, seed=9, most=4, size=None):
    """Residuals drawn from the law itself."""
    r = replace(rows(n, seed, most), extra=np.ones(n))
    s = np.zeros(n) if size is None else size
    return r, np.linalg.cholesky(dense(noise, r, s)) @ np.random.default_rng(seed + 1).standard_normal(n)


def fitted(r, y, size=None, columns=None, **how):
    columns = np.ones((y.size, 1)) if columns is None else columns
    return fit_noise([r], [y], [columns], [np.zeros(y.size) if size is None else size], **how)


def test_white_noise_is_found_white():
    """A scale shorter than the rows' spacing is as good as white: what counts is what the rows are given."""
    r, y = simulated(Noise(0.09, 0.0))
    found = fitted(r, y)
    K = dense(found, r, np.zeros(y.size))
    assert np.mean(np.diag(K) * r.count) == pytest.approx(0.09, rel=0.1)
    assert np.max(np.abs(np.mean(K - np.diag(np.diag(K)), axis=0))) < 0.02 * 0.09
    z = Whitener(found, r, np.zeros(y.size)).whiten(y)
    assert np.mean(z**2) == pytest.approx(1.0, abs=0.1)


def test_slow_noise_is_found_beside_white():
    r, y = simulated(Noise(0.04, 0.0, (1.0,), (0.25,)), n=2000)
    found = fitted(r, y)
    assert found.white == pytest.approx(0.04, rel=0.12)
    assert sum(found.slow) == pytest.approx(0.25, rel=0.4)
    centre = np.exp(np.dot(found.slow, np.log(found.scales)) / sum(found.slow))
    assert 0.3 < centre < 3.0
    z = Whitener(found, r, np.zeros(y.size)).whiten(y)
    assert np.mean(z**2) == pytest.approx(1.0, abs=0.1)
    assert abs(np.mean(z[1:] * z[:-1])) < 0.1


def test_noise_in_proportion_to_the_force_is_found():
    size = np.tile([0.0, 30.0], 750)
    r, y = simulated(Noise(0.04, 0.0004), size=size)
    found = fitted(r, y, size)
    assert found.proportional == pytest.approx(0.0004, rel=0.2)
    at_rest = np.diag(dense(found, r, np.zeros(size.size)))  # any share of it may be on the shortest scale
    assert np.mean(at_rest * r.count) == pytest.approx(0.04, rel=0.2)


def test_a_band_is_found():
    r, y = simulated(Noise(0.04, 0.0, (), (), ((3.0, 5.0),), (0.3,)), most=1)
    found = fitted(r, y, bands=((3.0, 5.0),))
    assert found.bands == ((3.0, 5.0),)
    assert found.band[0] == pytest.approx(0.3, rel=0.25)
    assert found.white == pytest.approx(0.04, rel=0.35)
    again = fitted(r, y, bands=((3.0, 5.0),), start=found)
    assert again.variances == pytest.approx(found.variances, rel=0.05, abs=1e-3)


def test_columns_that_were_fitted_do_not_make_the_noise_look_smaller():
    """60 columns on 150 rows take 40 % of the sum of squares; restricted likelihood gives it back."""
    ratio = []
    for seed in range(6):
        r, y = simulated(Noise(0.09, 0.0), n=150, seed=seed, most=1)
        X = np.random.default_rng(seed).standard_normal((150, 60))
        left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
        found = fitted(r, left, columns=X)
        ratio.append((found.white + sum(found.slow)) / 0.09)
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.15)


def test_few_rows_are_white_by_the_unbiased_estimate():
    ratio = []
    for seed in range(40):
        r, y = simulated(Noise(0.09, 0.0), n=30, seed=seed)
        X = np.random.default_rng(seed).standard_normal((30, 10))
        found = fitted(r, y, columns=X)
        assert (found.proportional, found.slow) == (0.0, ())
        ratio.append(found.white / 0.09)
    assert np.mean(ratio) == pytest.approx(1.0, abs=3 * np.sqrt(2 / 20 / 40))


def test_a_second_run_shares_the_variances():
    first, second = simulated(Noise(0.04, 0.0), seed=11, n=600), simulated(Noise(0.16, 0.0), seed=12, n=600)
    found = fit_noise([first[0], second[0]], [first[1], second[1]], [np.ones((600, 1))] * 2, [np.zeros(600)] * 2)
    assert found.white == pytest.approx(0.10, rel=0.12)


@pytest.mark.parametrize("n", [20, 400])
def test_no_noise_at_all_is_no_error(n):
    r = rows(n)
    found = fit_noise([r], [np.zeros(n)], [np.ones((n, 1))], [np.zeros(n)])
    assert np.all(np.isfinite(found.variances))
    assert np.all(np.isfinite(Whitener(found, r, np.zeros(n)).whiten(np.zeros(n))))


def test_a_short_run_has_one_slow_scale_at_most():
    r = Rows(np.linspace(0, 0.5, 120), np.ones(120), np.ones(120), np.full(120, 0.1))
    y = np.random.default_rng(13).standard_normal(120)
    assert len(fitted(r, y).scales) <= 1


def test_rows_of_samples_in_bursts_have_a_covariance():
    """A log may write four samples at once: at the usual spacing its rows would lie over each other."""
    time = np.array([0.0, 0.67, 1.49, 1.55, 1.70, 2.07])
    count = np.array([4.0, 1.0, 1.0, 1.0, 1.0, 4.0])
    quick = Noise(1e-6, 0.0, (0.15,), (1.6,))
    time = np.concatenate([time + 2.2 * k for k in range(40)])
    count = np.tile(count, 40)
    rows = rows_of(time, count, 0.344)
    assert np.all(np.isfinite(Whitener(quick, rows, np.zeros(time.size)).whiten(np.ones(time.size))))
    reach = np.where(count > 1, rows.width, 0.0)
    assert np.all(0.5 * (reach[1:] + reach[:-1]) <= np.diff(time) * (1 + 1e-12))


def test_rows_of_even_samples_are_as_wide_as_these_say():
    rows = rows_of(0.02 * np.arange(30.0), np.full(30, 2.0), 0.01)
    assert np.all(rows.width == 0.02)
    for size in (0, 1):
        assert rows_of(np.zeros(size), np.full(size, 3.0), 0.01).width.tolist() == [0.03] * size
