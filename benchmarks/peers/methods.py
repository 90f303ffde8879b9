"""The peers: each says which columns it keeps. A setting is what was tuned; see `GRIDS` for what was tried.

- `stlsq`: PySINDy's sequentially thresholded ridge regression; threshold in sigmas, ridge in lengths of a column.
- `greedy`: PySINDy's FROLS, forward regression by orthogonal least squares. Its own choice of the number of terms
  (`kappa`) compares error reductions of single steps, so the number is chosen here on its path, by BIC with the penalty
  per term multiplied.
- `sysidentpy`: FROLS of SysIdentPy, no lags (NFIR of degree 1: the columns carry the dynamics), at most MOST terms,
  their number by its own information criterion.
- `stepwise`: forward selection by the p-value of statsmodels' OLS with HAC errors (Newey and West), divided by the
  number of columns; after each step what is no longer significant is dropped. Of all columns the NEAREST that correlate
  most with the residual are tried at each step.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import statsmodels.api as sm
from pysindy import optimizers
from sysidentpy import model_structure_selection
from sysidentpy.basis_function import Polynomial
from sysidentpy.parameter_estimation import LeastSquares

from peers.columns import Problem

MOST = 6
"""Terms, as in our search."""
NEAREST = 10

Method = Callable[..., list[int]]


def stlsq(p: Problem, threshold: float, alpha: float) -> list[int]:
    found = optimizers.STLSQ(threshold=threshold, alpha=alpha, max_iter=20, unbias=False).fit(p.A, p.y[:, None])
    return [int(j) for j in np.flatnonzero(found.coef_[0])]


def greedy(p: Problem, penalty: float) -> list[int]:
    paths = _greedy_paths(p)
    n = p.y.size
    costs = [n * np.log(_left(p, path) / n) + penalty * len(path) * np.log(n) for path in paths]
    return paths[int(np.argmin(costs))]


@lru_cache(maxsize=2)
def _greedy_paths(p: Problem) -> list[list[int]]:
    """The columns after each step: no penalty changes them."""
    found = optimizers.FROLS(max_iter=MOST, alpha=0.0, unbias=False)
    found.fit(p.A, p.y[:, None])
    return [[int(j) for j in np.flatnonzero(step[0])] for step in found.history_]


def _left(p: Problem, kept: list[int]) -> float:
    """Sum of squares that least squares on these columns leaves."""
    if not kept:
        return float(p.y @ p.y)
    rest = p.y - p.A[:, kept] @ np.linalg.lstsq(p.A[:, kept], p.y, rcond=None)[0]
    return float(rest @ rest)


def sysidentpy(p: Problem, criterion: str, weight: float = 1.0) -> list[int]:
    model = model_structure_selection.FROLS(
        order_selection=True,
        info_criteria=criterion,
        n_info_values=MOST,
        xlag=[[1]] * p.A.shape[1],
        ylag=1,
        model_type="NFIR",
        basis_function=Polynomial(degree=1),
        estimator=LeastSquares(),
        apress_lambda=weight,
    )
    ahead = np.vstack([p.A[1:], p.A[-1:]])  # its inputs act a row later
    model.fit(X=ahead, y=p.y[:, None])
    codes = np.asarray(model.final_model).ravel()
    return sorted({int(code) // 1000 - 2 for code in codes if code >= 2000})


def stepwise(p: Problem, p_in: float, lags: int) -> list[int]:
    kept: list[int] = []
    for _ in range(2 * MOST):
        step = _best(p, kept, lags)
        if step is None or step[1] * p.A.shape[1] > p_in or len(kept) >= MOST:
            break
        bigger = [*kept, step[0]]
        ps = _hac(p, bigger, lags)
        smaller = [j for j, value in zip(bigger, ps, strict=True) if value * p.A.shape[1] <= p_in]
        if set(smaller) == set(kept):
            break
        kept = smaller
    return kept


def _best(p: Problem, kept: list[int], lags: int) -> tuple[int, float] | None:
    """The column of smallest p-value beside those kept."""
    Q = np.linalg.qr(p.A[:, kept])[0] if kept else np.empty((p.y.size, 0))
    rest = p.A - Q @ (Q.T @ p.A)
    size = np.linalg.norm(rest, axis=0)
    score = np.where(size > 1e-4, np.abs(rest.T @ p.y) / np.maximum(size, 1e-12), 0.0)
    score[kept] = 0.0
    near = np.argsort(-score)[:NEAREST]
    found = [(int(j), float(_hac(p, [*kept, int(j)], lags)[-1])) for j in near if score[j] > 0]
    return min(found, key=lambda each: (each[1], -score[each[0]]), default=None)


def _hac(p: Problem, columns: list[int], lags: int) -> np.ndarray:
    most = lags or int(4 * (p.y.size / 100) ** (2 / 9))  # 0: the rule of Newey and West
    fitted = sm.OLS(p.y, p.A[:, columns]).fit(cov_type="HAC", cov_kwds={"maxlags": most})
    return np.asarray(fitted.pvalues)


METHODS: dict[str, Method] = {
    "PySINDy STLSQ": stlsq,
    "PySINDy FROLS": greedy,
    "SysIdentPy FROLS": sysidentpy,
    "stepwise HAC": stepwise,
}
GRIDS: dict[str, tuple[dict[str, Any], ...]] = {
    "PySINDy STLSQ": (
        *({"threshold": t, "alpha": a} for t in (20.0, 50.0, 100.0, 200.0) for a in (1e-3, 1.0)),
        *({"threshold": 50.0, "alpha": a} for a in (0.1, 10.0)),
    ),
    "PySINDy FROLS": tuple({"penalty": k} for k in (1.0, 4.0, 16.0, 64.0, 256.0)),
    "SysIdentPy FROLS": (
        {"criterion": "bic"},
        *({"criterion": "apress", "weight": w} for w in (100.0, 300.0, 1000.0)),
    ),
    "stepwise HAC": (
        *({"p_in": p, "lags": k} for p in (0.05, 1e-6) for k in (0, 200)),
        {"p_in": 1e-12, "lags": 0},
        {"p_in": 1e-6, "lags": 30},
    ),
}
TUNED: dict[str, dict[str, Any]] = {
    "PySINDy STLSQ": {"threshold": 50.0, "alpha": 0.1},
    "PySINDy FROLS": {"penalty": 16.0},
    "SysIdentPy FROLS": {"criterion": "apress", "weight": 1000.0},
    "stepwise HAC": {"p_in": 1e-6, "lags": 30},
}
"""The best of each grid on 18 recordings: STLSQ 7 right (its other settings 6 or 7), FROLS 10 (7 to 9), SysIdentPy 6
(2 to 5), stepwise 13 (6 to 12)."""


def names(p: Problem, method: str, setting: dict[str, Any]) -> tuple[frozenset[str], list[int]]:
    """Effects whose columns are kept, and the columns."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        kept = METHODS[method](p, **setting)
    return frozenset(p.names[j] for j in kept), kept
