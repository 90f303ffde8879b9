"""Velocity of runs at constant command: a straight line through the position (section 4.2.3), and what spoils it.

A vehicle gathers way for many time constants, and a good depth-meter sees the last of it. A run that is curved is cut
at its start. What is left over is too small to be seen in one run but not in all of them together: if it is there,
every line gets the exponential end of an approach beside it, with the time constant m / (k + 2 k2 |v|) of eq. 4.13.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from identification.estimation.even_noise import fit_noise, leverage
from identification.estimation.tails import chi2_sf, normal_quantile, student_sf
from identification.estimation.verdicts import significance
from identification.recording import Floats
from identification.steady_state.pooling import moderate
from identification.steady_state.shared_noise import fit_noise_jointly

LEAST_SAMPLES = 12
"""Position samples that a constant-velocity run needs."""
CURVED = 0.01
"""Level at which a run counts as curved, and all runs together as still gathering way."""
CUT = 0.1
"""Share of a curved run left out at its start, again and again, until it is straight."""
MOST_CUT = 0.6
APPROACHES = np.geomspace(0.02, 1.0, 30)
"""Longest time constant of the runs as a share of the longest run: the grid that is searched."""
SLOWEST = 0.5
"""Time constants above this share of a run are no end of an approach: line and exponential are then alike."""


@dataclass(frozen=True, eq=False)
class Line:
    """The part of one run that is used, (n,)."""

    time: Floats
    position: Floats
    straight: bool
    """False: curved even after the most that may be cut."""

    @property
    def slope(self) -> float:
        u = self.time - self.time.mean()
        return float(u @ self.position / (u @ u))


def straight_line(time: Floats, position: Floats) -> Line:
    """The longest late part of the run that is not curved.

    >>> t = np.arange(0.0, 60.0, 0.5)
    >>> noise = 0.01 * np.random.default_rng(0).standard_normal(t.size)
    >>> line = straight_line(t, 0.5 * t + 2.0 * np.exp(-t / 4) + noise)
    >>> line.straight, bool(line.time[0] > 5), bool(abs(line.slope - 0.5) < 0.005)
    (True, True, True)
    """
    cut = 0.0
    while True:
        keep = time >= time[0] + cut * (time[-1] - time[0])
        t, x = time[keep], position[keep]
        u = t - t.mean()
        basis = np.vander(u / np.abs(u).max(), 3, increasing=True)
        straight = not significance(*_last_coefficient(basis, x), CURVED).significant
        if straight or cut + CUT > MOST_CUT or keep.sum() * (1 - CUT) < LEAST_SAMPLES:
            return Line(t, x, straight)
        cut += CUT


def _last_coefficient(H: Floats, y: Floats) -> tuple[float, float, float]:
    """Least-squares coefficient of the last column, its standard deviation under autocorrelated noise, its dof.

    White noise taken for granted, slow noise is curved: runs were cut to less than half and lost that much information.
    """
    Q, R = np.linalg.qr(H)
    weights = Q[:, -1] / R[-1, -1]
    std, dof = fit_noise(y - Q @ (Q.T @ y), leverage(Q)).combination_std(weights)
    return float(weights @ y), std, dof


def _columns(line: Line, approach: float) -> Floats:
    """1, time, and with a time constant `approach` > 0 s the end of an exponential approach."""
    t = line.time - line.time[0]
    columns = [np.ones(t.size), t - t.mean()]
    if approach > 0:
        columns.append(np.exp(-t / approach))
    return np.column_stack(columns)


def _residual(line: Line, columns: Floats) -> Floats:
    Q, _ = np.linalg.qr(columns)
    out: Floats = line.position - Q @ (Q.T @ line.position)
    return out


def approaches(lines: Sequence[Line], forces: Floats) -> Floats:
    """Time constant (r,) s of each run's approach; 0 for all when together they show none.

    `forces` (r,) N as calibrated: with the slopes they tell k2 from k, hence how much sooner fast runs settle.
    """
    none = np.zeros(len(lines))
    v = np.abs([line.slope for line in lines])
    if len(lines) < 3 or not np.any(v > 0) or not np.any(forces != 0):
        return none
    (k, k2), _ = nnls(np.column_stack([v, v**2]), np.abs(forces))
    rate = k + 2 * k2 * v
    length = np.array([line.time[-1] - line.time[0] for line in lines])
    if not np.all(rate > 0):
        return none
    plain = [_residual(line, _columns(line, 0.0)) for line in lines]
    power = np.array([max(float(r @ r) / max(r.size - 3, 1), 1e-300) for r in plain])
    before = np.array([float(r @ r) for r in plain])
    best, gained = none, 0.0
    for share in APPROACHES:
        T = share * length.max() * rate.min() / rate
        T = np.where(SLOWEST * length > T, T, 0.0)
        after = np.array([float(r @ r) for r in (_residual(x, _columns(x, t)) for x, t in zip(lines, T, strict=True))])
        gain = float(np.sum((before - after) / power))
        if gain > gained:
            best, gained = T, gain
    return best if np.any(best > 0) and _seen(lines, best) else none


def _seen(lines: Sequence[Line], T: Floats) -> bool:
    """Do all runs together show an approach, slow noise allowed for? A t deviate counts as the normal one as rare."""
    power, runs = 0.0, 0
    for line, constant in zip(lines, T, strict=True):
        if constant > 0:
            value, std, dof = _last_coefficient(_columns(line, constant), line.position)
            rare = student_sf(abs(value) / std, dof) if std > 0 else 0.5
            power, runs = power + float(-normal_quantile(max(float(rare), 1e-300))) ** 2, runs + 1
    return bool(chi2_sf(power, runs + 1) * APPROACHES.size < CURVED)


def velocities(
    lines: Sequence[Line], forces: Floats, sensors: Sequence[float | None]
) -> tuple[tuple[float, float], ...]:
    """Velocity and its standard error of each run, honest under autocorrelated noise.

    Runs share the kind of their noise and lend each other degrees of freedom. `sensors`: known noise of the position,
    used where a run leaves no residual of its own to tell.
    """
    if not lines:
        return ()
    designs = [_columns(line, t) for line, t in zip(lines, approaches(lines, forces), strict=True)]
    weights = [np.linalg.pinv(H)[1] for H in designs]
    residuals = [_residual(line, H) for line, H in zip(lines, designs, strict=True)]
    lost = [leverage(np.linalg.qr(H)[0]) for H in designs]
    one = len(lines) == 1
    models = (fit_noise(residuals[0], lost[0]),) if one else fit_noise_jointly(residuals, lost)
    found = [model.combination_std(w) for model, w in zip(models, weights, strict=True)]
    size = np.array([float(np.linalg.norm(w)) for w in weights])
    single = np.array([std for std, _ in found]) / size
    known = np.array([sensor or 0.0 for sensor in sensors])
    single = np.where(single > 0, single, known)
    shared = moderate(single, np.array([dof for _, dof in found]), np.zeros(len(lines)))
    std = shared.std_error * size
    slopes = [float(w @ line.position) for w, line in zip(weights, lines, strict=True)]
    return tuple(zip(slopes, std.tolist(), strict=True))
