import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.estimation.regression import least_squares
from identification.estimation.streaming import stream_least_squares

NAMES = ("a", "b", "c")
ROWS = 4096


def problem(seed, n=5000, p=3):
    rng = np.random.default_rng(seed)
    H = rng.normal(size=(n, p)) * np.array([1.0, 30.0, 0.1])
    return H, H @ (np.arange(p) + 1.0) + 0.1 * rng.normal(size=n)


def blocks(H, y, size):
    return ((H[i : i + size], y[i : i + size]) for i in range(0, len(y), size))


def same(found, expected, rel=1e-9):
    fit = found.fit
    assert fit.theta == pytest.approx(expected.theta, rel=rel)
    assert fit.cov == pytest.approx(expected.cov, rel=rel * 10)
    assert fit.singular_values == pytest.approx(expected.singular_values, rel=rel)
    assert fit.condition == pytest.approx(expected.condition, rel=rel)
    assert (fit.sigma2, fit.chi2) == (pytest.approx(expected.sigma2), pytest.approx(expected.chi2))
    assert fit.dof == expected.dof
    assert fit.names == NAMES
    assert (fit.residual.shape, fit.solver.shape) == ((0,), (3, 0))


@settings(deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([7, 500, 3000, 5000]), st.booleans(), st.sampled_from([None, 0.1]))
def test_agrees_with_everything_in_memory(seed, size, sampled, sigma):
    H, y = problem(seed)
    sample = (H[::10], y[::10]) if sampled else None
    found = stream_least_squares(blocks(H, y, size), NAMES, sigma, sample)
    same(found, least_squares(H, y, NAMES, sigma))
    assert found.rows == 5000
    assert found.statement.startswith("5000 rows in one pass by Gram")


def test_a_misleading_start_is_found_out_and_nothing_is_lost():
    rng = np.random.default_rng(1)
    n = 40_000
    V = np.where(np.arange(n) < 10_000, 1 + 1e-4 * rng.normal(size=n), rng.uniform(-20, 20, n))
    H = np.column_stack([V * np.abs(V), V, np.ones(n)])
    y = H @ np.array([0.4, 0.1, -2.0]) + rng.normal(size=n)
    found = stream_least_squares(blocks(H, y, 10_000), NAMES)
    assert found.method == "Gram, then TSQR"
    same(found, least_squares(H, y, NAMES), rel=1e-8)
    spread = stream_least_squares(blocks(H, y, 8000), NAMES, sample=(H[::20], y[::20]))
    assert spread.method == "Gram"
    same(spread, least_squares(H, y, NAMES))


def test_a_start_without_any_excitation_uses_tsqr():
    H, y = problem(2, n=20_000)
    H[:10_000] = 0.0
    found = stream_least_squares(blocks(H, y, 5000), NAMES)
    assert found.method == "TSQR"
    same(found, least_squares(H, y, NAMES))


def nearly_dependent(n=60_000, apart=1e-10):
    """Condition 2 / apart; integers and powers of two, so that H and H theta are exact in float64."""
    rng = np.random.default_rng(3)
    a, b = rng.integers(-8, 9, n).astype(float), rng.integers(-8, 9, n).astype(float)
    return np.column_stack([a, a + 2.0 ** np.round(np.log2(apart)) * b]), np.array([1.0, 2.0])


def test_condition_of_1e10_where_normal_equations_fail():
    H, theta = nearly_dependent()
    y = H @ theta
    found = stream_least_squares(blocks(H, y, 4096), ("a", "b"), sample=(H[::10], y[::10]))
    assert found.method == "preconditioned Gram"
    assert found.fit.deficiency is not None or found.fit.condition > 1e9
    G = H.T @ H
    normal = np.linalg.lstsq(G, H.T @ y, rcond=None)[0]
    assert np.abs(normal - theta).max() > 0.1
    H, theta = nearly_dependent(apart=1e-9)
    y = H @ theta
    found = stream_least_squares(blocks(H, y, 4096), ("a", "b"), sample=(H[::10], y[::10]))
    assert found.fit.theta == pytest.approx(theta, abs=1e-5)
    assert np.abs(np.linalg.lstsq(H.T @ H, H.T @ y, rcond=None)[0] - theta).max() > 0.1


def test_dependent_columns_are_named():
    H, y = problem(4)
    H[:, 2] = 2 * H[:, 0]
    found = stream_least_squares(blocks(H, y, 1000), NAMES)
    expected = least_squares(H, y, NAMES)
    assert found.method == "TSQR"
    assert found.fit.deficiency is not None
    assert set(found.fit.deficiency.names) == {"a", "c"}
    assert found.fit.dof == expected.dof == 4998
    assert found.fit.sigma2 == pytest.approx(expected.sigma2)
    assert found.fit.std[1] == pytest.approx(expected.std[1])


def test_data_without_noise():
    H, _ = problem(5)
    y = H @ np.array([1.0, 2.0, 3.0])
    found = stream_least_squares(blocks(H, y, 1000), NAMES)
    assert found.fit.theta == pytest.approx([1, 2, 3], rel=1e-9)
    assert found.fit.sigma2 == pytest.approx(0.0, abs=1e-18)


def test_fewer_rows_than_parameters_and_as_many():
    H, y = problem(6, n=3)
    found = stream_least_squares([(H[:2], y[:2])], NAMES)
    assert found.fit.deficiency is not None
    assert found.fit.dof == 0
    assert np.isnan(stream_least_squares([(H, y)], NAMES).fit.sigma2)


def test_memory_does_not_grow_with_the_rows():
    def rows(n):
        rng = np.random.default_rng(7)
        for _ in range(n):
            H = rng.normal(size=(ROWS, 3))
            yield H, H[:, 0] + rng.normal(size=ROWS)

    peaks = []
    for n in (20, 200):
        tracemalloc.start()
        found = stream_least_squares(rows(n), NAMES)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert found.rows == n * ROWS
    assert peaks[1] < 1.1 * peaks[0] < 2e6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"blocks": []}, "no rows"),
        ({"blocks": [(np.ones((0, 3)), np.ones(0))]}, "no rows"),
        ({"blocks": [(np.ones((4, 2)), np.ones(4))]}, "do not fit"),
        ({"blocks": [(np.ones((4, 3)), np.ones(3))]}, "do not fit"),
        ({"sigma": 0.0}, "above zero"),
        ({"sample": (np.full((9, 3), np.nan), np.ones(9))}, "finite"),
    ],
)
def test_misuse_is_told(arguments, message):
    H, y = problem(8)
    with pytest.raises(ValueError, match=message):
        stream_least_squares(**{"blocks": [(H, y)], "names": NAMES} | arguments)


@pytest.mark.parametrize("column", [0, 3])
def test_a_missing_sample_is_told_wherever_it_is(column):
    H, y = problem(9)
    (y if column == 3 else H[:, column])[4321] = np.nan
    with pytest.raises(ValueError, match="finite"):
        stream_least_squares(blocks(H, y, 1000), NAMES)


def test_a_sample_of_other_rows_is_told():
    H, y = problem(10)
    with pytest.raises(ValueError, match="rows of the blocks"):
        stream_least_squares(blocks(1e-3 * H, 1e-3 * y, 1000), NAMES, sample=(H, y))
