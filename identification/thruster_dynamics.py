"""The rotor: n' = beta T - alpha n|n| (section 4.2.2), with the torque T that a voltage V makes.

    n' = alpha ((k V)|k V| - n|n|) + gamma (k V - n),     beta = alpha k^2

Its rest point is n = k V, so tau = C_t n|n| and tau = C V|V| (eq. 4.14) say the same with C = C_t k^2. gamma is the
motor's own pull (back-EMF over winding resistance); without it this is the text's model with T = V|V|. A delay between
command and motor is estimated beside them: unseen, it would pass for slowness.

Output error: the model is simulated from the recorded voltage and compared with the recorded rate, whose noise then
biases nothing. The covariance is a jackknife over pieces of 2 s (MacKinnon and White, J. Econometrics 1985, HC3 in
clusters): right under correlated noise, and under misfit that is larger in transients than in holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import t as student

from identification.maximum_likelihood import Gaussian, Maximum, maximise
from identification.recording import Floats, Recording
from identification.regression import least_squares
from identification.rotor_data import STEP, Drive, drive, steps_of
from identification.thrust_data import Unusable
from identification.verdicts import Significance, Whiteness, significance, whiteness

UNITS = {"alpha": "1/rev", "k": "rev/(s.V)", "gamma": "1/s", "delay": "s", "beta": "rev/(s^2.V^2)"}
SETTLED = 8.0
"""Time constants after a change of voltage until a hold's rate counts as steady."""
FASTEST = 1e4
"""rev/s: beyond it a trial step of the optimiser is no rotor."""


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
        half = float(student.ppf(0.975, self.dof[name])) * std
        return value - half, value + half


def _std(known: Gaussian, slope: dict[str, float]) -> float:
    row = np.array([slope.get(name, 0.0) for name in known.names])
    return float(np.sqrt(max(row @ known.cov @ row, 0.0)))


def simulate(drives: Sequence[Drive], alpha: Floats, k: Floats, gamma: Floats, delay: Floats) -> Floats:
    """Rate (s, n) at the samples of all drives for s parameter sets (s,): Runge and Kutta, Hermite between steps."""
    steps, sets = steps_of(drives), alpha.size
    inputs = [[d.mean_input(steps, float(late)) for d in drives] for late in delay]
    square = np.array([np.concatenate([q for q, _ in row]) for row in inputs])
    plain = np.array([np.concatenate([v for _, v in row]) for row in inputs])
    push = (alpha * k * np.abs(k))[:, None, None] * square + (gamma * k)[:, None, None] * plain
    first = np.concatenate([d.first for d in drives])
    rate, slope = _integrate(np.tile(first, (sets, 1)), push, alpha[:, None], gamma[:, None])
    return np.concatenate([_sampled(d, rate, slope, at) for d, at in zip(drives, _lanes(drives), strict=True)], axis=1)


def _lanes(drives: Sequence[Drive]) -> list[int]:
    """First lane of each drive's pieces."""
    return [sum(d.starts.size for d in drives[:i]) for i in range(len(drives))]


def _integrate(n: Floats, push: Floats, alpha: Floats, gamma: Floats) -> tuple[Floats, Floats]:
    """Rates and their slopes (steps + 1, s, c) at the step ends; push (s, c, steps) rev/s^2, constant in each step."""
    steps = push.shape[2]
    rates, slopes = np.empty((steps + 1, *n.shape)), np.empty((steps + 1, *n.shape))

    def pull(x: Floats) -> Floats:
        out: Floats = (alpha * np.abs(x) + gamma) * x
        return out

    for i in range(steps):
        p = push[:, :, i]
        a = p - pull(n)
        rates[i], slopes[i] = n, a
        b = p - pull(n + 0.5 * STEP * a)
        c = p - pull(n + 0.5 * STEP * b)
        d = p - pull(n + STEP * c)
        n = np.clip(n + STEP / 6 * (a + 2 * b + 2 * c + d), -FASTEST, FASTEST)
    rates[steps], slopes[steps] = n, push[:, :, -1] - pull(n)
    return rates, slopes


def _sampled(d: Drive, rate: Floats, slope: Floats, lane: int) -> Floats:
    """(s, n) by cubic Hermite interpolation; the slope at a step's end is that of its own force."""
    where = (d.time - d.starts[d.piece]) / STEP
    i = np.minimum(where.astype(np.intp), rate.shape[0] - 2)
    x, lanes = where - i, lane + d.piece
    y0, y1, m0 = rate[i, :, lanes].T, rate[i + 1, :, lanes].T, STEP * slope[i, :, lanes].T
    m1 = 2 * (y1 - y0) - m0  # parabola through both ends with the first slope: the force jumps at step ends
    out: Floats = y0 + x * (m0 + x * (3 * (y1 - y0) - 2 * m0 - m1 + x * (2 * (y0 - y1) + m0 + m1)))
    return out


def _start(drives: Sequence[Drive]) -> Floats:
    """alpha, k, gamma to start from: k from all samples, the rest from increments of n over 0.1 s (integral form)."""
    V = np.concatenate(
        [np.interp(d.time + STEP, d.edges, d.plain) - np.interp(d.time, d.edges, d.plain) for d in drives]
    )
    n = np.concatenate([d.rate for d in drives])
    k = float(V @ n) / float(V @ V) * STEP
    rows, rises = [], []
    for d in drives:
        apart = max(1, round(0.1 / max(float(np.median(np.diff(d.time))), 1e-4)))
        same = d.piece[apart:] == d.piece[:-apart]
        width = np.diff(d.time, prepend=d.time[0])
        square, plain = (np.interp(d.time, d.edges, y) for y in (d.square, d.plain))
        quadratic = k * abs(k) * square - np.cumsum(d.rate * np.abs(d.rate) * width)
        linear = k * plain - np.cumsum(d.rate * width)
        rises.append((d.rate[apart:] - d.rate[:-apart])[same])
        rows.append(np.column_stack([(x[apart:] - x[:-apart])[same] for x in (quadratic, linear)]))
    (alpha, gamma), *_ = np.linalg.lstsq(np.vstack(rows), np.concatenate(rises), rcond=None)
    return np.array([max(float(alpha), 1e-3), k, max(float(gamma), 0.1)])


def _clusters(drives: Sequence[Drive]) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    return np.concatenate([d.piece + at for d, at in zip(drives, _lanes(drives), strict=True)])


def jackknife(found: Maximum, cluster: np.ndarray[tuple[int], np.dtype[np.intp]]) -> tuple[Floats, Floats]:
    """Covariance (p, p) and dof (p,) from leaving out one cluster (n,) of samples at a time, to first order."""
    gain = found.gain
    bread = np.linalg.inv(gain @ gain.T)
    J = (bread @ gain).T
    moved, share = [], []
    for c in range(int(cluster.max()) + 1):
        here = cluster == c
        rest = bread - J[here].T @ J[here]
        moved.append(np.linalg.pinv(rest, rcond=1e-12, hermitian=True) @ (J[here].T @ found.misfit[here]))
        share.append(np.sum(gain[:, here] ** 2, axis=1))
    count = len(moved)
    away = np.array(moved)
    shares = np.array(share)
    effective = shares.sum(axis=0) ** 2 / np.sum(shares**2, axis=0)
    return (count - 1) / count * away.T @ away, np.maximum(effective - 1, 1.0)


def _fitted(drives: Sequence[Drive], start: Floats, with_gamma: bool) -> Maximum:
    rate = np.concatenate([d.rate for d in drives])
    names = ("alpha", "k", "gamma", "delay") if with_gamma else ("alpha", "k", "delay")
    begin = np.array([*start[: 3 if with_gamma else 2], 0.0])

    def misfit(theta: Floats) -> Floats:
        gamma = theta[:, 2] if with_gamma else np.zeros(theta.shape[0])
        out: Floats = rate - simulate(drives, theta[:, 0], theta[:, 1], gamma, theta[:, -1])
        return out

    scale = np.array([*np.abs(start[: 3 if with_gamma else 2]), 0.02])
    return maximise(names, begin, scale, misfit)


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
    fits = [_told(recordings, drives, found) for found in (full, plain)]
    rich, poor = fits
    gamma = rich.significance.get("gamma")
    keep = full.deficiency is None and gamma is not None and gamma.significant and gamma.value > 0
    return replace(rich if keep else poor, rmse_without_gamma=poor.rmse)


def _told(recordings: Sequence[Recording], drives: Sequence[Drive], found: Maximum) -> DynamicsFit:
    names = found.estimate.names
    cov, dof = jackknife(found, _clusters(drives))
    known = Gaussian(names, found.estimate.mean, cov)
    n, p = found.misfit.size, len(names)
    sigma = float(np.sqrt(found.misfit @ found.misfit / max(n - p, 1)))
    levels, offset = _levels(drives, known)
    by_name = dict(zip(names, dof.tolist(), strict=True))
    return DynamicsFit(
        recordings[0].thruster,
        tuple(r.recording_id for r in recordings),
        "gamma" in names,
        known,
        sigma * np.linalg.norm(found.gain, axis=1),
        by_name,
        {name: significance(known[name], known.std_of(name), by_name[name]) for name in names},
        float(np.sqrt(found.misfit @ found.misfit / n)),
        float("nan"),
        whiteness(found.misfit),
        levels,
        offset,
        tuple(drives),
        found.misfit,
    )
