"""Pulses of the gain that come back: a share of the thrust that is lost, or won, for L s every P s.

Each pulse alone is what slow noise does now and then, and a noise estimated without them is as loud as they are; that
they come back is what no noise does. So every period, phase and length is looked at, roughly first: a window's score is
a difference of sums, its sigmas go as the force squared within it. Those that look likeliest are then whitened.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.tails import normal_sf
from identification.mismatch import policy
from identification.mismatch.estimate.estimate import forces
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.recording import Floats

LENGTHS = (180, 125, 87, 60, 42, 29)
"""Shares of a run that a pulse lasts."""
SHORTEST, LONGEST = 3.0, 0.2
"""Periods: so many lengths, and this share of the run."""
PARTS = 4
"""Of a length, between the beginnings of two windows."""
SIZED = 24
"""Windows of each length whose sigmas are worked out."""
TRIED = 8
"""Periods of each length whose sigmas are worked out."""
OFTENER = (1, 2, 3, 4)
"""Times as often as looked likeliest: every second pulse is a train too."""
PHASES = 12
"""Bins of a period, in which the plan's own repetition is looked for: finer than the widest pulse."""
ROUNDS = 7
"""In which period, beginning and length are moved by ever smaller steps."""


@dataclass(frozen=True, eq=False, slots=True)
class Pulses:
    """Of one run."""

    run: int
    period: float
    """s."""
    begin: float
    """s, of the first."""
    length: float
    """s."""
    share: float
    """Of the thrust, that comes on top."""
    sigmas: float
    """Over what the gain does elsewhere in as long."""
    looked_at: int
    """Periods, phases and lengths."""
    column: Floats
    """(n,) of length 1: such a change of the thrust, whitened, beside what the model can follow."""

    @property
    def p_value(self) -> float:
        """Of so many sigmas among all that was looked at."""
        return min(1.0, 2 * self.looked_at * float(normal_sf(self.sigmas)))

    def during(self, time: Floats) -> Floats:
        """(n,) 1 within a pulse, 0 elsewhere."""
        return ((time - self.begin) % self.period < self.length).astype(np.float64)

    @property
    def statement(self) -> str:
        way = "more" if self.share > 0 else "less"
        size, length = 100 * abs(self.share), self.length
        return f"thrust is {size:.2g} % {way} for {length:.2g} s every {self.period:.4g} s"


@dataclass(frozen=True, eq=False, slots=True)
class _Run:
    """One run's rows, and how to whiten a column on them."""

    number: int
    time: Floats
    force: Floats
    score: Floats
    """(n,) what a row of 1 N adds to the score of a column."""
    data: Data
    weights: Weights
    basis: Floats
    residual: Floats

    @property
    def duration(self) -> float:
        return float(self.time[-1] - self.time[0])

    def columns(self, during: Floats) -> Floats:
        """(n, k) `during` times the force, whitened, beside what the model can follow."""
        made = [np.zeros((r.size, during.shape[1])) for r in self.data.rows]
        made[self.number] = during * self.force[:, None]
        columns = self.weights.whiten(made, [])
        columns -= self.basis @ (self.basis.T @ columns)
        return columns

    def judged(self, during: Floats) -> tuple[Floats, Floats]:
        """Scores and squared lengths of these columns."""
        columns = self.columns(during)
        return columns.T @ self.residual, np.einsum("ij,ij->j", columns, columns)


def likeliest_pulses(fitted: Fit, data: Data, weights: Weights, residual: Floats | None = None) -> Pulses | None:
    """The pulses of the most sigmas; None in tables and where nothing could come back.

    `residual`: whitened, in the place of that of the fit.
    """
    if any(h.static for h in data.histories):
        return None
    found = [p for run in _runs(fitted, data, weights, residual) if (p := _of_run(run)) is not None]
    return max(found, key=lambda p: p.sigmas, default=None)


def _runs(fitted: Fit, data: Data, weights: Weights, residual: Floats | None) -> Iterator[_Run]:
    n = data.size
    basis = orthogonal_basis(fitted.jacobian[:n])
    left = fitted.residual[:n] if residual is None else residual
    thrust = Weights(weights.thrust)
    ends = np.cumsum([0, *(r.size for r in data.rows)])
    size = forces(fitted.model, fitted.theta, data)
    for i, (h, rows, force) in enumerate(zip(data.histories, data.rows, size, strict=True)):
        score = force * thrust.thrust[i].weighed(left[ends[i] : ends[i + 1]])
        yield _Run(i, h.sampled[rows], force, score, data, thrust, basis, left)


def _of_run(run: _Run) -> Pulses | None:
    if run.time.size < policy.locate.PULSE_ROWS or not np.any(run.force):
        return None
    rough = [_of_length(run, run.duration / share) for share in LENGTHS]
    best = max((p for _, found in rough for p in found), key=lambda p: abs(p.sigmas), default=None)
    if best is None:
        return None
    looked_at = sum(many for many, _ in rough)
    oftener = _sized(run, [replace(best, period=best.period / k) for k in OFTENER])
    best = max(oftener, key=lambda p: abs(p.sigmas))
    step = np.array([0.25 * best.length / run.duration * best.period, 0.25 * best.length, 0.25 * best.length])
    for _ in range(ROUNDS):
        moves = np.vstack([np.zeros(3), np.diag(step), -np.diag(step)])
        best = max(_sized(run, [_moved(best, run, *move) for move in moves]), key=lambda p: abs(p.sigmas))
        step /= 1.6
    column = run.columns(best.during(run.time)[:, None])[:, 0]
    column /= float(np.linalg.norm(column))
    best = replace(best, looked_at=looked_at, column=column)
    return replace(best, sigmas=abs(best.sigmas) / _restless(run, best))


def _moved(p: Pulses, run: _Run, period: float, begin: float, length: float) -> Pulses:
    """By a little; another period leaves the pulse in the middle of the run where it is."""
    before = round(0.5 * run.duration / p.period)
    return replace(p, period=p.period + period, begin=p.begin + begin - before * period, length=p.length + length)


def _of_length(run: _Run, length: float) -> tuple[int, list[Pulses]]:
    """How many periods and phases of one length were looked at, and the likeliest with their sigmas."""
    step = length / PARTS
    at = run.time[0] + step * np.arange(int(run.duration / step) - PARTS)
    low, high = np.searchsorted(run.time, at), np.searchsorted(run.time, at + length)
    score, power = (np.concatenate([[0.0], np.cumsum(x)]) for x in (run.score, run.force**2))
    score, power = score[high] - score[low], power[high] - power[low]
    some = np.unique(np.linspace(0, at.size - 1, SIZED).astype(int))
    _, size = run.judged(_within(run.time, at[some], length))
    size = power * float(size.sum() / max(power[some].sum(), 1e-300))
    found, looked_at = [], 0
    period = SHORTEST * length
    while period < LONGEST * run.duration:
        comb = np.rint(np.arange(0, at.size, period / step)).astype(int)
        phases = np.arange(int(period / step) + 1)
        index = phases[:, None] + comb
        there = index < at.size
        index = np.minimum(index, at.size - 1)
        total, expected = (score[index] * there).sum(axis=1), (size[index] * there).sum(axis=1)
        sigmas = np.abs(total) / np.sqrt(np.maximum(expected, 1e-6 * size.max()))
        sigmas[there.sum(axis=1) < policy.locate.PULSES] = 0.0
        likely = int(np.argmax(sigmas))
        looked_at += sigmas.size
        found.append((float(sigmas[likely]), period, float(at[likely])))
        period *= 1 + 0.6 * length / run.duration  # the last pulse is a third of a length off at most
    tops = [b for a, b, c in zip([(0.0,), *found], found, [*found[1:], (0.0,)], strict=False) if a[0] <= b[0] >= c[0]]
    tried = [Pulses(run.number, p, begin, length, 0.0, 0.0, 0, np.empty(0)) for _, p, begin in sorted(tops)[-TRIED:]]
    return looked_at, _sized(run, tried)


def _sized(run: _Run, tried: list[Pulses]) -> list[Pulses]:
    """With their shares and sigmas, whitened."""
    possible = [p for p in tried if 0 < p.length < 0.5 * p.period and not _repeated(run, p.period)]
    if not possible:
        return []
    score, size = run.judged(np.column_stack([p.during(run.time) for p in possible]))
    size = np.where(size > 0, size, np.inf)
    return [
        replace(p, share=float(s / q), sigmas=float(s / np.sqrt(q)))
        for p, s, q in zip(possible, score, size, strict=True)
    ]


def _repeated(run: _Run, period: float) -> bool:
    """Whether the plan itself comes back with this period: what follows the command does so too."""
    phase = (PHASES * ((run.time / period) % 1.0)).astype(int)
    rows = np.maximum(np.bincount(phase, minlength=PHASES), 1)
    for force in (run.force, np.abs(run.force), np.sign(run.force)):
        mean = np.bincount(phase, weights=force, minlength=PHASES) / rows
        if float(np.var(mean[phase])) > policy.locate.PLAN_IN_STEP * float(np.var(force)):
            return True
    return False


def _restless(run: _Run, found: Pulses) -> float:
    """By which factor, 1 at least, the gain varies beside the pulses more than its noise says, in windows as long.

    A gain that is restless everywhere (turbulence, in proportion to the thrust) is no pulse.
    """
    begin = np.arange(run.time[0] + (found.begin - run.time[0]) % found.length, run.time[-1], found.length)
    rest = run.residual - found.column * (found.column @ run.residual)
    columns = run.columns(_within(run.time, begin, found.length))
    score, size = columns.T @ rest, np.einsum("ij,ij->j", columns, columns)
    return max(1.0, float(np.sqrt(score @ score / max(size.sum(), 1e-300))))


def _within(time: Floats, begin: Floats, length: float) -> Floats:
    """(n, k) 1 in each window, 0 elsewhere."""
    return ((time[:, None] >= begin) & (time[:, None] < begin + length)).astype(np.float64)
