"""Which levels to hold, and how long: D- and A-optimal experiments under limits of time and of heating.

A design puts the share w_i of the time on level i; its information a second is M(w) = sum w_i x_i x_i' / sigma_i^2. The
shares that keep the mean heating below a limit form a polytope whose corners are one level, or two levels mixed so
that the limit is just met. A mixture of corners is improved by moving weight from the worst corner in use to the best
one of all (vertex exchange: Fedorov 1972, Wynn 1970, Böhning 1986), with an exact line search. Optimal is it when no
corner is better than the mixture: the equivalence theorem of Kiefer and Wolfowitz (1960), whose excess is the
`gap` reported here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq

from identification.estimation.information import excitation
from identification.estimation.regression import Deficiency
from identification.recording import Floats

Criterion = Literal["D", "A"]
"""D: least det of the covariance (whatever the units). A: least sum of variances, each over its `size` squared."""

GAP = 1e-5
"""Excess over the equivalence theorem at which a design counts as optimal: its efficiency is above 1 - gap."""
MOST_EXCHANGES = 2000
INSIDE = 10
"""Exchanges among the corners in use after each one among all."""
LEAST_WEIGHT = 1e-4
"""Levels with a smaller share are left out at the end, if the design stays within GAP_AFTER."""
GAP_AFTER = 1e-3


@dataclass(frozen=True, eq=False)
class Candidates:
    """What may be held: n levels."""

    levels: Floats
    """(n,) V, or whatever is set."""
    H: Floats
    """(n, p) row of the regressor at each level."""
    names: tuple[str, ...]
    sigma: float | Floats = 1.0
    """Standard deviation of one second of measurement, one number or (n,)."""
    heat: Floats | None = None
    """(n,) heating at each level, see `copper_heat`."""

    @property
    def rows(self) -> Floats:
        """(n, p) whitened."""
        out: Floats = self.H / np.broadcast_to(self.sigma, self.levels.shape)[:, None]
        return out


@dataclass(frozen=True, eq=False)
class Design:
    """Levels in use, ascending, their shares and seconds."""

    names: tuple[str, ...]
    criterion: Criterion
    levels: Floats
    weights: Floats
    """Shares of the time, sum 1."""
    dwells: Floats
    """s at each level, altogether."""
    cov: Floats
    """(p, p) of the parameters after the whole time."""
    gap: float
    """Excess over the equivalence theorem, 0 for the optimum."""
    mean_heat: float | None

    @property
    def std(self) -> Floats:
        out: Floats = np.sqrt(np.diag(self.cov))
        return out

    @property
    def statement(self) -> str:
        held = ", ".join(f"{t:.3g} s at {level:.3g}" for level, t in zip(self.levels, self.dwells, strict=True))
        return f"{self.criterion}-optimal within {100 * self.gap:.2g} %: {held}"


@dataclass(frozen=True, slots=True)
class Impossible:
    """No design satisfies the limits."""

    statement: str


def copper_heat(levels: Floats, V_max: float) -> Floats:
    """Heating (n,) relative to that at V_max: torque and current go with V^2 (eq. 4.14), copper loss with V^4.

    >>> copper_heat(np.array([0.0, -10.0, 20.0]), 20.0).tolist()
    [0.0, 0.0625, 1.0]
    """
    out: Floats = (levels / V_max) ** 4
    return out


def optimal_levels(
    candidates: Candidates,
    total_time: float,
    criterion: Criterion = "D",
    max_mean_heat: float = float("inf"),
    size: Floats | None = None,
    prior: Floats | None = None,
    gap: float = GAP,
) -> Design | Deficiency | Impossible:
    """Shares of `total_time` (s) over the candidates; a Deficiency when no choice of levels tells the parameters apart.

    `size` (p,): expected magnitude of each parameter, for criterion A (default 1 each, inf: it does not count).
    `max_mean_heat` limits the mean of candidates.heat over the time. `prior` (p, p): information there is anyhow, from
    tares or an earlier run. `gap`: how far from the optimum is good enough, see GAP. Raises ValueError for arrays that
    do not fit.

    >>> V = np.linspace(-20, 20, 41)
    >>> plan = optimal_levels(Candidates(V, np.column_stack([V * abs(V), np.ones(41)]), ("C", "tare")), 60.0)
    >>> plan.levels.tolist(), plan.dwells.round(3).tolist()
    ([-20.0, 20.0], [30.0, 30.0])
    """
    _checked(candidates, total_time, max_mean_heat)
    rows, heat = candidates.rows, candidates.heat
    n, p = rows.shape
    corners = _corners(n, heat, max_mean_heat)
    if not corners.size:
        return Impossible(f"every level heats more than the limit of {max_mean_heat:g}")
    given = np.zeros((p, p)) if prior is None else np.asarray(prior, dtype=np.float64) / total_time
    used = np.flatnonzero(corners.any(axis=0))
    seen = excitation(np.vstack([rows[used], root_of(given)]), candidates.names)
    if seen.deficiency is not None:
        return seen.deficiency
    scale = np.ones(p) if size is None else np.asarray(size, dtype=np.float64)
    target = np.diag(1 / scale**2) if criterion == "A" else None
    information = np.einsum("vi,ij,ik->vjk", corners, rows, rows) + given
    weights = _exchange(information, target, gap) @ corners
    kept = _pruned(weights, heat, max_mean_heat)
    M = rows.T @ (kept[:, None] * rows) + given
    if np.linalg.cond(M) >= 1e15 or _excess(information, M, target) > max(2 * gap, GAP_AFTER):
        kept = weights
    M = rows.T @ (kept[:, None] * rows) + given
    on = np.flatnonzero(kept)
    cov: Floats = np.asarray(np.linalg.inv(M) / total_time, dtype=np.float64)
    return Design(
        candidates.names,
        criterion,
        candidates.levels[on],
        kept[on],
        kept[on] * total_time,
        cov,
        _excess(information, M, target),
        None if heat is None else float(kept @ heat),
    )


def root_of(information: Floats) -> Floats:
    """R (p, p) with R'R = information, which may be singular.

    >>> R = root_of(np.array([[4.0, 2.0], [2.0, 1.0]]))
    >>> (R.T @ R).round(9).tolist()
    [[4.0, 2.0], [2.0, 1.0]]
    """
    values, vectors = np.linalg.eigh(information)
    out: Floats = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return out


def _checked(candidates: Candidates, total_time: float, max_mean_heat: float) -> None:
    n, p = candidates.H.shape
    heat = candidates.heat
    if candidates.levels.shape != (n,) or len(candidates.names) != p or (heat is not None and heat.shape != (n,)):
        raise ValueError(
            f"optimal_levels: levels {candidates.levels.shape}, H {(n, p)}, {len(candidates.names)} names and the heat "
            "do not fit together"
        )
    if not (np.isfinite(total_time) and total_time > 0):
        raise ValueError(f"optimal_levels: total_time must be finite and above 0 s, got {total_time}")
    if heat is None and np.isfinite(max_mean_heat):
        raise ValueError("optimal_levels: max_mean_heat needs the heat of each candidate")


def _corners(n: int, heat: Floats | None, limit: float) -> Floats:
    """(v, n) extreme points of {w >= 0, sum w = 1, w @ heat <= limit}."""
    single = np.eye(n)
    if heat is None:
        return single
    cool, hot = np.flatnonzero(heat <= limit), np.flatnonzero(heat > limit)
    low, high = (part.ravel() for part in np.meshgrid(cool, hot, indexing="ij"))
    share = (limit - heat[low]) / (heat[high] - heat[low])
    mixed = np.zeros((low.size, n))
    at = np.arange(low.size)
    mixed[at, low], mixed[at, high] = 1 - share, share
    return np.vstack([single[cool], mixed[share > 0]])


def _gradient(information: Floats, M: Floats, target: Floats | None) -> Floats:
    """(v,) gain of each corner, normalised: 1 is the mean over the design, at most 1 everywhere at the optimum."""
    inverse = np.linalg.inv(M)
    kernel = inverse if target is None else inverse @ target @ inverse
    out: Floats = np.einsum("vij,ji->v", information, kernel) / np.sum(M * kernel)
    return out


def _excess(information: Floats, M: Floats, target: Floats | None) -> float:
    return float(max(_gradient(information, M, target).max() - 1, 0.0))


def _exchange(information: Floats, target: Floats | None, gap: float) -> Floats:
    """Weights (v,) of the corners."""
    weights = _start(information, target)
    for _ in range(MOST_EXCHANGES):
        M = np.einsum("v,vij->ij", weights, information)
        gain = _gradient(information, M, target)
        if gain.max() - 1 <= gap:
            break
        _move(weights, M, information, target, int(np.argmax(gain)), gain)
        used = np.flatnonzero(weights)
        some, inside = information[used], weights[used]
        for _ in range(INSIDE):
            M = np.einsum("v,vij->ij", inside, some)
            gain = _gradient(some, M, target)
            _move(inside, M, some, target, int(np.argmax(gain)), gain)
        weights[used] = inside
    return weights


def _start(information: Floats, target: Floats | None) -> Floats:
    """Uniform, then multiplied by the gain (Titterington 1976): the good corners grow; the others are left out."""
    weights = np.full(len(information), 1 / len(information))
    for _ in range(60):
        gain = _gradient(information, np.einsum("v,vij->ij", weights, information), target)
        weights *= gain if target is None else np.sqrt(np.maximum(gain, 0.0))  # a gain of 0 may round below
        weights /= weights.sum()
    kept: Floats = np.where(weights >= 0.05 * weights.max(), weights, 0.0)
    few = np.linalg.cond(np.einsum("v,vij->ij", kept, information))
    all_of_them = np.linalg.cond(np.einsum("v,vij->ij", weights, information))
    return kept / kept.sum() if few < 1e3 * all_of_them else weights


def _move(weights: Floats, M: Floats, information: Floats, target: Floats | None, best: int, gain: Floats) -> None:
    """From the worst corner in use to the best one, as far as it pays; changes `weights`."""
    used = np.flatnonzero(weights)
    worst = int(used[np.argmin(gain[used])])
    if worst == best:
        return
    most = float(weights[worst])
    moved = _line_search(M, information[best] - information[worst], target, most)
    weights[best] += moved
    weights[worst] = most - moved


def _line_search(M: Floats, change: Floats, target: Floats | None, most: float) -> float:
    """How far, up to `most`, to go from M along `change`; the slope of the criterion falls all the way."""
    rate, vector = eigh(change, M)
    share = np.ones(rate.size) if target is None else np.einsum("ji,jk,ki->i", vector, target, vector)
    power = 1 if target is None else 2

    def slope(far: float) -> float:
        return float(np.sum(share * rate / (1 + far * rate) ** power))

    if rate.min() * most <= -1 + 1e-9:
        most *= 1 - 1e-9
    elif slope(most) >= 0:
        return most
    return float(brentq(slope, 0.0, most, rtol=1e-12)) if slope(0.0) > 0 > slope(most) else 0.0


def _pruned(weights: Floats, heat: Floats | None, limit: float) -> Floats:
    """Without the traces that the exchange leaves behind; what they had goes to all, or to what heats least."""
    kept = np.where(weights >= LEAST_WEIGHT, weights, 0.0)
    out: Floats = kept / kept.sum()
    if heat is None or out @ heat <= limit:
        return out
    used = np.flatnonzero(kept)
    kept[used[np.argmin(heat[used])]] += 1.0 - kept.sum()
    return kept if kept @ heat <= limit else weights
