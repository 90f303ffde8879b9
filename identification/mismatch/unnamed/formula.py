"""Sparse regression over a small grammar of recorded quantities: a formula for what is left, if one agrees everywhere.

Products and powers up to the third degree of at most two quantities, added or times the thrust; one or two of them, by
BIC with the estimate's coloured noise and a price for how many were looked at (Chen and Chen, Biometrika 95, 2008). It
is accepted only when data that were not fitted are predicted nearly as well as by the free shape, when both halves of
the runs give the same coefficients, and when nothing of any shape is left over the formula's own covariates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.flexible_terms.flexible import Flexible
from identification.flexible_terms.formula import (
    CHANNELS,
    MEMORIES,
    Formula,
    Monomial,
    Times,
    driver_symbol,
    product_of,
    quantity,
)
from identification.flexible_terms.formula import times as multiplied
from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.predictor import predict
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.unexplained import FormulaFound
from identification.mismatch.unnamed.flexible import Extended
from identification.mismatch.unnamed.flexible_knots import best_over
from identification.mismatch.unnamed.formula_words import legend, told
from identification.mismatch.validate.held_out import Score
from identification.mismatch.validate.train_test_split import better, train_test_split
from identification.recording import Floats
from identification.run_history.history import History

MOST_DEGREE = 3
"""Highest degree of a product of powers: a term of a higher one is told from a lower one by no plan."""
TIMES: tuple[Times, ...] = ("1", "F", "|F|")
MOST_ALIKE = 1 - 1e-7
"""Squared correlation of two columns that are taken to be one."""
MOST_EQUALS = 3
"""Formulas of other symbols that are told beside the plainest: a reader wants no more."""


@dataclass(frozen=True, eq=False)
class _Grid:
    """Whitened unit columns of all monomials, orthogonal to the present model."""

    monomials: tuple[Monomial, ...]
    sizes: tuple[tuple[str, float], ...]
    gram: Floats
    score: Floats
    logn: float

    @property
    def price(self) -> float:
        """Of one monomial, in BIC."""
        return self.logn + 2 * float(np.log(len(self.monomials)))


def find_formula(extended_by: Extended, data: Data, others: Sequence[History]) -> FormulaFound | None:
    """The formula in the place of the flexible terms; None where none agrees with what was not fitted."""
    bare = without_flexible(extended_by, data)
    split = train_test_split(bare, data, others)
    part, judge, begin = split.data, split.judge, split.estimate
    grid = _grid(begin, part)
    if grid is None:
        return None
    near = _near(grid)
    if not near:
        return None
    plainest = min(near, key=_plainness)
    term = term_of(plainest, dict(grid.sizes), data)
    before, after = judge(begin.fit), judge(_with(term, begin, part).fit)
    free = judge(_fitted_shapes(extended_by, begin, part))
    if not _predicts(before, after, free):
        return None
    whole = _with(term, bare, data)
    p = halves(term, whole, data)
    if p < policy.unnamed.FORMULA_HALVES_P or _left_over(term, whole, data, extended_by.terms):
        return None
    text, coefficients = told(term, whole.fit, data)
    same = {frozenset(q for m in plainest for q, _ in m.powers)}
    equals: list[str] = []
    for other in near:
        symbols = frozenset(q for m in other for q, _ in m.powers)
        if symbols not in same and len(equals) < MOST_EQUALS:
            same.add(symbols)
            equals.append(Formula(other, ()).form)
    return FormulaFound(text, legend(term), coefficients, near[plainest], before.rmse, after.rmse, p, tuple(equals))


def term_of(monomials: tuple[Monomial, ...], sizes: dict[str, float], data: Data) -> Formula:
    """As a term, its gain counted from the middle of the data. `sizes`: of each symbol."""
    symbols = dict.fromkeys(q for m in monomials for q, _ in m.powers)
    rows = list(zip(data.histories, data.rows, strict=True))
    unit = {q: np.concatenate([quantity(q, h)[r] for h, r in rows]) / sizes[q] for q in symbols}
    middles = tuple(float(np.mean(product_of(m, unit))) for m in monomials)
    return Formula(monomials, tuple((q, sizes[q]) for q in symbols), middles)


def without_flexible(found: Extended, data: Data) -> Estimate:
    """The final model without its flexible terms, with its noise."""
    estimate = found.estimate
    pairs = [
        (t, v)
        for t, v in zip(estimate.fit.model.terms, estimate.fit.theta.terms, strict=True)
        if not isinstance(t, Flexible)
    ]
    model = replace(estimate.fit.model, terms=tuple(t for t, _ in pairs))
    theta = replace(estimate.fit.theta, terms=tuple(v for _, v in pairs))
    return replace(estimate, fit=fit(model, theta, data, estimate.weights))


def _with(term: Formula, estimate: Estimate, data: Data) -> Estimate:
    bigger, theta = estimate.fit.more(term, (0.0,) * len(term.monomials))
    return replace(estimate, fit=fit(bigger, theta, data, estimate.weights))


def _fitted_shapes(found: Extended, estimate: Estimate, data: Data) -> Fit:
    """The flexible terms beside the same model, on the same rows."""
    fitted = estimate.fit
    for term in found.terms:
        fitted = fit(*fitted.more(term, found.estimate.fit.values[term]), data, estimate.weights)
    return fitted


def _predicts(before: Score, after: Score, free: Score) -> bool:
    """Whether what was not fitted is predicted nearly as well as by the free shape."""
    fall = before.chi2 - free.chi2
    return better(after, before, MOST_DEGREE) and before.chi2 - after.chi2 > policy.unnamed.FORMULA_PREDICTS * fall


def symbols_of(data: Data) -> dict[str, list[Floats]]:
    """Symbol -> per run (M,), of what moves."""
    own = driver_symbol(data.histories[0])
    names = [own, "t", *(f"lp{tau:g}({own}|{own}|)" for tau in MEMORIES), *(f"lp{tau:g}(|{own}|)" for tau in MEMORIES)]
    names += [q for q, (c, _) in CHANNELS.items() if q != own and all(c in h.others for h in data.histories)]
    if any(h.static for h in data.histories):
        names = [own, *(n for n in names if n in CHANNELS and n != own)]
    out = {}
    for name in names:
        values = [quantity(name, h) for h in data.histories]
        every = np.concatenate(values)
        if float(np.ptp(every)) > 1e-6 * max(float(np.max(np.abs(every))), 1e-12):
            out[name] = values
    return out


def monomials_of(symbols: Sequence[str]) -> list[tuple[tuple[str, int], ...]]:
    """Powers of one and products of two, up to MOST_DEGREE.

    >>> monomials_of(["a", "b"])
    [(('a', 1),), (('a', 2),), (('a', 3),), (('b', 1),), (('b', 2),), (('b', 3),), (('a', 1), ('b', 1)), \
(('a', 1), ('b', 2)), (('a', 2), ('b', 1))]
    """
    single: list[tuple[tuple[str, int], ...]] = [((q, p),) for q in symbols for p in range(1, MOST_DEGREE + 1)]
    double: list[tuple[tuple[str, int], ...]] = [
        ((a, p), (b, r))
        for a, b in combinations(symbols, 2)
        for p in range(1, MOST_DEGREE)
        for r in range(1, MOST_DEGREE + 1 - p)
    ]
    return single + double


def _grid(estimate: Estimate, data: Data) -> _Grid | None:
    known = symbols_of(data)
    sizes = {q: float(max(np.max(np.abs(v)) for v in values)) for q, values in known.items()}
    found = [Monomial(powers, m) for powers in monomials_of(list(known)) for m in TIMES]
    raw = []
    now = estimate.fit
    for i, (run, r, tare) in enumerate(zip(data.runs, data.rows, now.theta.tares, strict=True)):
        F, _ = predict(now.model, now.theta, run, data.scale, tare)
        unit = {q: values[i][r] / sizes[q] for q, values in known.items()}
        raw.append(np.column_stack([_column(m, unit, F[r]) for m in found]))
    n = data.size
    white = Weights(estimate.weights.thrust).whiten(raw, [])
    first = np.linalg.norm(white, axis=0)
    basis = orthogonal_basis(estimate.fit.jacobian[:n])
    white -= basis @ (basis.T @ white)
    size = np.linalg.norm(white, axis=0)
    kept = size > 1e-5 * np.maximum(first, 1e-300)
    if not kept.any():
        return None
    white = white[:, kept] / size[kept]
    names = tuple(m for m, k in zip(found, kept, strict=True) if k)
    score = white.T @ estimate.fit.residual[:n]
    return _Grid(names, tuple(sizes.items()), white.T @ white, score, float(np.log(max(n, 2))))


def _column(m: Monomial, unit: dict[str, Floats], force: Floats) -> Floats:
    return multiplied(m.times, force) * product_of(m, unit)


def _near(grid: _Grid) -> dict[tuple[Monomial, ...], float]:
    """One or two monomials with their gain, best first: those within FORMULAS_EQUAL_BIC of the best.

    Time does what any quantity that drifts with it does: where only formulas of time are left, those of recorded
    quantities that fit as well are given, though they may be longer.
    """
    s, many = grid.score, len(grid.monomials)
    single = s**2 - grid.price
    i, j = np.triu_indices(many, 1)
    rho = grid.gram[i, j]
    rest = 1 - rho**2
    apart = rest > 1 - MOST_ALIKE
    fall = np.where(apart, (s[i] ** 2 + s[j] ** 2 - 2 * rho * s[i] * s[j]) / np.where(apart, rest, 1.0), 0.0)
    double = fall - 2 * grid.price
    best = max(float(single.max()), float(double.max(initial=-np.inf)))
    if best < policy.unnamed.FORMULA_GAIN_BIC:
        return {}
    own = np.array([any(q == "t" for q, _ in m.powers) for m in grid.monomials])
    timed = own[i] | own[j]
    one, two = single > best - policy.unnamed.FORMULAS_EQUAL_BIC, double > best - policy.unnamed.FORMULAS_EQUAL_BIC
    if not (one & ~own).any() and not (two & ~timed).any():
        most = max(float(np.max(s**2, where=one, initial=0.0)), float(np.max(fall, where=two, initial=0.0)))
        one |= ~own & (s**2 > most - policy.unnamed.FORMULAS_EQUAL_BIC)
        two |= ~timed & (fall > most - policy.unnamed.FORMULAS_EQUAL_BIC)
    out = {(grid.monomials[k],): float(single[k]) for k in np.flatnonzero(one)}
    out |= {(grid.monomials[i[k]], grid.monomials[j[k]]): float(double[k]) for k in np.flatnonzero(two)}
    return dict(sorted(out.items(), key=lambda each: -each[1]))


def _plainness(found: tuple[Monomial, ...]) -> tuple[bool, int, int, int, int]:
    """Of a recorded quantity rather than of time, of few quantities, of one kind, short, of a low degree."""
    symbols = {q for m in found for q, _ in m.powers}
    kinds = {m.times for m in found}
    return "t" in symbols, len(symbols), len(kinds), len(found), sum(m.degree for m in found)


def halves(term: Formula, estimate: Estimate, data: Data) -> float:
    """p-value of the same coefficients in the first and the second half of each run."""
    n, q = data.size, len(term.monomials)
    smaller, theta = estimate.fit.less(term)
    first, second = [], []
    for run, r, tare in zip(data.runs, data.rows, theta.tares, strict=True):
        h = run.history
        F, _ = predict(smaller, theta, run, data.scale, tare)
        sizes = dict(term.sizes)
        unit = {name: quantity(name, h)[r] / size for name, size in sizes.items()}
        columns = np.column_stack([_column(m, unit, F[r]) for m in term.monomials])
        late = (h.middle[r] > 0.5 * (h.middle[r][0] + h.middle[r][-1]))[:, None]
        first.append(np.column_stack([columns * ~late, np.where(late, 0.0, F[r][:, None])]))
        second.append(columns * late)
    weights = Weights(estimate.weights.thrust)
    split_columns = np.column_stack([weights.whiten(first, []), weights.whiten(second, [])])
    base = orthogonal_basis(estimate.fit.jacobian[:n, :])
    rest = split_columns[:, : q + 1] - base @ (base.T @ split_columns[:, : q + 1])
    # beyond common coefficients: those of the first half, with another C there
    Q, C = rest[:, :q], orthogonal_basis(rest[:, q:])
    Q = orthogonal_basis(Q - C @ (C.T @ Q))
    score = Q.T @ estimate.fit.residual[:n]
    return float(chi2_sf(float(score @ score), Q.shape[1])) if Q.shape[1] else 1.0


def _left_over(term: Formula, estimate: Estimate, data: Data, flexible: Sequence[Flexible]) -> bool:
    """Whether a free shape over the formula's own covariates, or the located one, still gains anything."""
    own = dict.fromkeys((*term.covariates, *(f.quantity for f in flexible)))
    return any((found := best_over(q, estimate, data)) is not None and found.gain > 0 for q in own)
