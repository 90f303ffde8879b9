"""The rotor: n' = beta T - alpha n|n| (section 4.2.2), with the torque T that a voltage V makes.

    n' = alpha ((k V)|k V| - n|n|) + gamma (k V - n),     beta = alpha k^2

Its rest point is n = k V, so tau = C_t n|n| and tau = C V|V| (eq. 4.14) say the same with C = C_t k^2. gamma is the
motor's own pull (back-EMF over winding resistance); without it this is the text's model with T = V|V|. A delay between
command and motor is estimated beside them: unseen, it would pass for slowness.

Output error: the model is simulated from the recorded voltage and compared with the recorded rate, whose noise then
biases nothing. The covariance is a jackknife over spans of 2 s (MacKinnon and White, J. Econometrics 1985, HC3 in
clusters): right under correlated noise, and under misfit that is larger in transients than in holds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identification.estimation.maximum_likelihood import Gaussian
from identification.estimation.regression import least_squares
from identification.estimation.tails import student_quantile
from identification.estimation.verdicts import Significance, Whiteness, significance, whiteness
from identification.recording import Floats, Recording
from identification.thruster.rotor_data import STEP, Drive, drive
from identification.thruster.rotor_simulation import lanes, simulate
from identification.thruster.thrust_data import Unusable

UNITS = {"alpha": "1/rev", "k": "rev/(s.V)", "gamma": "1/s", "delay": "s", "beta": "rev/(s^2.V^2)"}
PULLS = (0.5, 100.0)
"""1/s, between which a descent starts: time constants of 2 s and 10 ms."""
MOST_STEPS = 40
DAMPING = (0.0, 1e-3, 1e-1, 1.0, 30.0)
"""Relative to the curvature; all are tried, the best is taken."""
ENOUGH = 1e-3
"""A step that lowers chi-square by less is the last."""
SLOPE_STEP = 1e-4
"""Of a parameter's scale, for central differences."""
WORST_CONDITION = 1e6
DELAYED = 0.03
"""s, the scale of a delay; no step of the descent is longer than a parameter's scale."""
PIECES_TOGETHER = 2
"""Pieces that the jackknife leaves out at once: noise slower than these 2 s is not seen."""
SETTLED = 8.0
"""Time constants after a change of voltage until a hold's rate counts as steady."""


@dataclass(frozen=True, slots=True)
class Level:
    """One voltage that was held."""

    voltage: float
    rate: float
    """rev/s measured once settled; NaN when no hold was long enough."""
    model_rate: float
    """k V, rev/s."""
    time_constant: float
    """1 / (gamma + 2 alpha |k V|), s."""
    std: float


@dataclass(frozen=True, eq=False)
class DynamicsFit:
    """The rotor model of one thruster. `dof`, `significance` by name; `beta` follows from alpha and k."""

    thruster: str
    recordings: tuple[str, ...]
    with_gamma: bool
    estimate: Gaussian
    """Names, values and covariance, corrected for correlation."""
    uncorrected: Floats
    """(p,) standard deviations if samples were independent."""
    dof: dict[str, float]
    significance: dict[str, Significance]
    rmse: float
    """rev/s"""
    rmse_without_gamma: float
    """rev/s; `rmse` again when gamma was dropped."""
    whiteness: Whiteness | None
    levels: tuple[Level, ...]
    offset: Significance | None
    """Of c in n = k V + c sign(V) over settled holds: h0 says that the steady rate is proportional to the voltage."""
    drives: tuple[Drive, ...] = field(repr=False)
    residual: Floats = field(repr=False)
    """(n,) rev/s, measured less simulated, in the order of the drives."""

    @property
    def model(self) -> str:
        return "n' = beta V|V| - alpha n|n|" + (" + gamma (k V - n)" if self.with_gamma else "")

    @property
    def beta(self) -> tuple[float, float]:
        """Value alpha k^2 and its standard deviation, rev/(s^2.V^2)."""
        alpha, k = self.estimate["alpha"], self.estimate["k"]
        return alpha * k * k, _std(self.estimate, {"alpha": k * k, "k": 2 * alpha * k})

    def interval(self, name: str) -> tuple[float, float]:
        """95 %."""
        value, std = self.estimate[name], self.estimate.std_of(name)
        half = float(student_quantile(0.975, self.dof[name])) * std
        return value - half, value + half


def _std(known: Gaussian, slope: dict[str, float]) -> float:
    row = np.array([slope.get(name, 0.0) for name in known.names])
    return float(np.sqrt(max(row @ known.cov @ row, 0.0)))


def _start(drives: Sequence[Drive]) -> Floats:
    """Start of alpha, k, gamma, either pull half of it at the fastest rate: k from all samples, the pull from
    increments of n over 0.1 s (integral form of the equation).
    """
    V = np.concatenate(
        [np.interp(d.time + STEP, d.edges, d.plain) - np.interp(d.time, d.edges, d.plain) for d in drives]
    )
    n = np.concatenate([d.rate for d in drives])
    fastest = float(np.abs(n).max())
    if fastest == 0 or not V.any():
        return np.full(3, np.nan)
    k = float(V @ n) / float(V @ V) * STEP
    push, rise = 0.0, 0.0
    for d in drives:
        apart = max(1, round(0.1 / max(float(np.median(np.diff(d.time))), 1e-4)))
        same = d.piece[apart:] == d.piece[:-apart]
        width = np.diff(d.time, prepend=d.time[0])
        square, plain = (np.interp(d.time, d.edges, y) for y in (d.square, d.plain))
        quadratic = k * abs(k) * square - np.cumsum(d.rate * np.abs(d.rate) * width)
        both = (k * plain - np.cumsum(d.rate * width) + quadratic / fastest) / 2
        x, y = (both[apart:] - both[:-apart])[same], (d.rate[apart:] - d.rate[:-apart])[same]
        push, rise = push + float(x @ x), rise + float(x @ y)
    pull = float(np.clip(rise / max(push, 1e-300), *PULLS))
    return np.array([pull / (2 * fastest), k, pull / 2])


def _clusters(drives: Sequence[Drive]) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    return np.concatenate([d.piece + at for d, at in zip(drives, lanes(drives), strict=True)]) // PIECES_TOGETHER


@dataclass(frozen=True, eq=False)
class Descent:
    """Where the misfit is least. `misfit` (n,) rev/s, `J` (n, p) its slope by the parameters."""

    names: tuple[str, ...]
    theta: Floats
    misfit: Floats
    J: Floats
    converged: bool

    @property
    def seen(self) -> bool:
        """Every parameter changes the rate in a way of its own."""
        size = np.linalg.norm(self.J, axis=0)
        return bool(np.all(size > 0) and np.linalg.cond(self.J / size) < WORST_CONDITION)


def descend(names: tuple[str, ...], start: Floats, scale: Floats, misfit: Callable[[Floats], Floats]) -> Descent:
    """Levenberg and Marquardt's descent from `start` (p,); a simulation of many sets (s, p) costs hardly more than one.

    >>> x = np.array([1.0, 2.0, 3.0])
    >>> found = descend(("a",), np.array([0.5]), np.ones(1), lambda sets: np.exp(2.0 * x) - np.exp(sets * x))
    >>> round(float(found.theta[0]), 6), found.converged
    (2.0, True)
    """
    theta, step, p = start, SLOPE_STEP * scale, start.size
    for _ in range(MOST_STEPS):
        near = misfit(np.vstack([theta, theta + np.diag(step), theta - np.diag(step)]))
        left, J = near[0], (near[1 : p + 1] - near[p + 1 :]).T / (2 * step)
        A = J * scale
        normal, slope, cost = A.T @ A, A.T @ left, float(left @ left)
        damped = [normal + much * np.diag(np.diag(normal)) for much in DAMPING]
        moves = np.array([-scale * (np.linalg.pinv(matrix, hermitian=True) @ slope) for matrix in damped])
        moves = np.clip(moves, -scale, scale)
        costs = np.sum(misfit(theta + moves) ** 2, axis=1)
        best = int(np.argmin(costs))
        if not cost - float(costs[best]) > ENOUGH * cost / left.size:
            return Descent(names, theta, left, J, converged=True)
        theta = theta + moves[best]
    return Descent(names, theta, left, J, converged=False)


def jackknife(found: Descent, cluster: np.ndarray[tuple[int], np.dtype[np.intp]]) -> tuple[Floats, Floats]:
    """Covariance (p, p) and dof (p,) from leaving out one cluster (n,) of samples at a time, to first order."""
    J = found.J
    bread, gain = J.T @ J, np.linalg.pinv(J)
    moved, share = [], []
    for c in np.unique(cluster):
        here = cluster == c
        rest = bread - J[here].T @ J[here]
        moved.append(np.linalg.pinv(rest, rcond=1e-12, hermitian=True) @ (J[here].T @ found.misfit[here]))
        share.append(np.sum(gain[:, here] ** 2, axis=1))
    count, away, shares = len(moved), np.array(moved), np.array(share)
    effective = shares.sum(axis=0) ** 2 / np.sum(shares**2, axis=0)
    return (count - 1) / count * away.T @ away, np.maximum(effective - 1, 1.0)


def _fitted(drives: Sequence[Drive], start: Floats, with_gamma: bool) -> Descent:
    rate = np.concatenate([d.rate for d in drives])
    count = 3 if with_gamma else 2
    names = ("alpha", "k", "gamma", "delay") if with_gamma else ("alpha", "k", "delay")

    def misfit(theta: Floats) -> Floats:
        gamma = theta[:, 2] if with_gamma else np.zeros(theta.shape[0])
        out: Floats = rate - simulate(drives, theta[:, 0], theta[:, 1], gamma, theta[:, -1])
        return out

    return descend(names, np.array([*start[:count], 0.0]), np.array([*np.abs(start[:count]), DELAYED]), misfit)


def _levels(drives: Sequence[Drive], known: Gaussian) -> tuple[tuple[Level, ...], Significance | None]:
    """Each held level, and whether the settled rates are proportional to the voltage."""
    alpha, k = known["alpha"], known["k"]
    gamma = known["gamma"] if "gamma" in known.names else 0.0
    settled: list[tuple[float, float]] = []
    for d in drives:
        for V, low, high in d.holds:
            slow = 1 / max(gamma + 2 * alpha * abs(k * V), 1e-9)
            inside = (d.time >= low + SETTLED * slow) & (d.time < high)
            settled.append((V, float(d.rate[inside].mean()) if inside.sum() > 3 else float("nan")))
    found = []
    for V in sorted({round(V, 3) for V, _ in settled}):
        pull = gamma + 2 * alpha * abs(k * V)
        slope = {"alpha": 2 * abs(k * V), "k": 2 * alpha * abs(V), "gamma": 1.0}
        rates = [n for level, n in settled if round(level, 3) == V and np.isfinite(n)]
        std = _std(known, slope) / pull**2
        found.append(Level(V, float(np.mean(rates)) if rates else float("nan"), k * V, 1 / pull, std))
    return tuple(found), _offset([(V, n) for V, n in settled if np.isfinite(n)])


def _offset(settled: Sequence[tuple[float, float]]) -> Significance | None:
    if len(settled) < 4 or len({abs(round(V, 3)) for V, _ in settled}) < 2:
        return None
    V, n = np.array(settled).T
    fit = least_squares(np.column_stack([V, np.sign(V)]), n, ("k", "c"))
    return None if fit.deficiency else significance(float(fit.theta[1]), float(fit.std[1]), float(fit.dof))


def fit_dynamics(recordings: Sequence[Recording]) -> DynamicsFit | Unusable:
    """Rotor model of one thruster from all its recordings. Input that cannot be used comes back as `Unusable`."""
    if not recordings:
        return Unusable("no recording was given; expected at least one")
    drives = []
    for recording in recordings:
        found = drive(recording)
        if isinstance(found, Unusable):
            return found
        drives.append(found)
    start = _start(drives)
    if not (np.all(np.isfinite(start)) and start[1] != 0):
        return Unusable(f"recording {recordings[0].recording_id}: the rotation rate does not follow the voltage at all")
    full, plain = _fitted(drives, start, with_gamma=True), _fitted(drives, start, with_gamma=False)
    rich = _told(recordings, drives, full) if full.seen and full.converged else None
    keep = rich is not None and rich.significance["gamma"].significant and rich.significance["gamma"].value > 0
    chosen = full if keep else plain
    if not (chosen.seen and chosen.converged):
        why = "comes to fit it" if chosen.seen else "shows in it, for its rate hardly follows the voltage"
        return Unusable(f"recording {recordings[0].recording_id}: no rotor model n' = beta T - alpha n|n| {why}")
    told = rich if keep and rich is not None else _told(recordings, drives, plain)
    return replace(told, rmse_without_gamma=_rms(plain.misfit))


def _rms(misfit: Floats) -> float:
    return float(np.sqrt(misfit @ misfit / misfit.size))


def _told(recordings: Sequence[Recording], drives: Sequence[Drive], found: Descent) -> DynamicsFit:
    names = found.names
    cov, dof = jackknife(found, _clusters(drives))
    known = Gaussian(names, found.theta, cov)
    n, p = found.misfit.size, len(names)
    sigma = float(np.sqrt(found.misfit @ found.misfit / max(n - p, 1)))
    levels, offset = _levels(drives, known)
    by_name = dict(zip(names, dof.tolist(), strict=True))
    return DynamicsFit(
        recordings[0].thruster,
        tuple(r.recording_id for r in recordings),
        "gamma" in names,
        known,
        sigma * np.linalg.norm(np.linalg.pinv(found.J), axis=1),
        by_name,
        {name: significance(known[name], known.std_of(name), by_name[name]) for name in names},
        _rms(found.misfit),
        float("nan"),
        whiteness(found.misfit),
        levels,
        offset,
        tuple(drives),
        found.misfit,
    )
