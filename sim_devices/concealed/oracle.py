"""How visible an effect is: the sigma at which an oracle sees it that knows effect, shape and noise covariance.

d'^2 = x' K^-1 x - x' K^-1 B (B' K^-1 B)^-1 B' K^-1 x with x the noise-free difference that the effect makes, K the
covariance of the noise and B the baseline's own columns: V|V| of the command and one zero per run. Student's t noise is
taken as Gaussian of the same variance: an oracle that knew the tails would see a little more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft

from sim_devices.concealed.definition import Case, Concealed, history, thrust_of
from sim_devices.concealed.plans import held
from sim_devices.concealed.shapes import LEAST
from sim_devices.concealed.whitening import Whitening
from sim_devices.world.history import clock
from sim_devices.world.noise_law import scaled, spectrum

Floats = NDArray[np.float64]

CLOSE = 0.03
"""relative error of d' at which the search for the amount ends; the noise then takes up the rest."""
QUIETEST, LOUDEST = 3e-5, 0.05
"""Noise of the cell as a share of the largest thrust: what can still be called a load cell."""
EVALUATIONS = 14


class OutOfReach(ValueError):
    """Such a run cannot show this effect at this strength with any noise that a cell has: draw another."""


def strength(case: Case, effect: str) -> float:
    """Sigma (d') of `effect` in this case, in the presence of the others. Raises ValueError when it is not there."""
    if effect not in {c.effect for c in case.effects}:
        raise ValueError(f"strength: expected one of {[c.effect for c in case.effects]}, got {effect!r}")
    without = _signals(case, frozenset({effect}))
    return _Projection(case, _signals(case)).strength(_signals(case), without)


def measured(case: Case) -> Case:
    """The case with the strength of each of its effects written beside it."""
    return replace(case, effects=tuple(replace(c, seen=strength(case, c.effect)) for c in case.effects))


def scaled_to(case: Case, effect: str, d_prime: float) -> Case:
    """The case with as much of `effect` as the oracle sees at `d_prime` sigma.

    The amount is searched within its physical bounds with noise taken as stationary (frequency domain, fast); then the
    noise is scaled so that the exact strength is met, also where the amount jumps over it or its bounds end before.
    Raises OutOfReach when that noise would be no load cell's.
    """
    without = _signals(case, frozenset({effect}))
    screen = Screen(case, without)
    shape = next(c.shape for c in case.effects if c.effect == effect)

    def seen(amount: float) -> float:
        return screen.strength(_signals(with_amount(case, effect, amount)), without)

    lowest = shape.lowest or LEAST * shape.highest
    found = with_amount(case, effect, _searched(seen, d_prime, lowest, shape.highest))
    reached = _Projection(found, without).strength(_signals(found), without)
    return _with_noise(found, effect, reached / d_prime)


def with_amount(case: Case, effect: str, amount: float) -> Case:
    """The case with another amount of one effect."""
    changed = tuple(Concealed(c.shape, amount) if c.effect == effect else c for c in case.effects)
    return replace(case, effects=changed)


def loudness(case: Case) -> float:
    """Noise of the cell at a third of the largest thrust, as a share of the largest thrust."""
    law = case.noise
    variance = law.white**2 + (law.proportional * case.scale.thrust / 3.0) ** 2 + sum(s.std**2 for s in law.slow)
    return float(np.sqrt(variance + (law.peak.std**2 if law.peak else 0.0)) / case.scale.thrust)


def _with_noise(case: Case, effect: str, factor: float) -> Case:
    """Strength falls in exact proportion to the noise."""
    loud = loudness(case) * factor
    if not QUIETEST < loud < LOUDEST:
        raise OutOfReach(
            f"{effect} needs noise of {loud:.2g} of the largest thrust to be seen as asked; expected {QUIETEST:.2g} to "
            f"{LOUDEST:.2g}: draw another case"
        )
    louder = replace(case, noise=scaled(case.noise, factor))
    return louder if len(case.effects) > 1 else measured(louder)


def _searched(seen: Callable[[float], float], target: float, lowest: float, highest: float) -> float:
    """Amount that is seen at `target`: false position on log d' against log amount, which is nearly a straight line."""
    low, high, best = _Point(0.0, 0.0), _Point(np.inf, np.inf), _Point(lowest, 0.0)
    amount = min(max(0.05 * highest, lowest), highest)
    for _ in range(EVALUATIONS):
        point = _Point(amount, seen(amount))
        if abs(point.log_ratio(target)) <= abs(best.log_ratio(target)):
            best = point
        at_bound = amount >= highest if point.seen < target else amount <= lowest
        if abs(point.seen / target - 1.0) < CLOSE or at_bound:
            break
        low, high = (point, high) if point.seen < target else (low, point)
        amount = min(max(_next(low, high, target), lowest), highest)
        if high.amount - low.amount < 1e-3 * high.amount:
            break
    return best.amount


@dataclass(frozen=True, slots=True)
class _Point:
    amount: float
    seen: float

    def log_ratio(self, target: float) -> float:
        return float(np.log(self.seen / target)) if self.seen > 0.0 else -np.inf


def _next(low: _Point, high: _Point, target: float) -> float:
    if low.seen <= 0.0:  # nothing seen below: in proportion, and not above half
        return high.amount * min(max(target / high.seen, 1e-4), 0.5) if np.isfinite(high.seen) else 5.0 * low.amount
    if not np.isfinite(high.seen):
        return low.amount * min(target / low.seen * 1.02, 20.0)
    slope = np.log(high.amount / low.amount) / np.log(high.seen / low.seen)
    share = np.log(target / low.seen) * slope / np.log(high.amount / low.amount)
    return float(low.amount * (high.amount / low.amount) ** min(max(share, 0.1), 0.9))


def _signals(case: Case, without: frozenset[str] = frozenset()) -> list[Floats]:
    """Noise-free thrust of each run."""
    return [thrust_of(case, run, history(case, run, without=without), without=without) for run in case.runs]


class _Projection:
    """Exact whitening and baseline columns of all runs; made once, asked for differences."""

    def __init__(self, case: Case, values: list[Floats]) -> None:
        self._runs = []
        for run, value, columns in zip(case.runs, values, _baseline(case, values), strict=True):
            whitening = Whitening(case.noise, value - run.tare, case.rate)
            self._runs.append((whitening, whitening.solve(columns)))
        grams = [c.T @ solved for c, (_, solved) in zip(_baseline(case, values), self._runs, strict=True)]
        self._gram = np.sum(grams, axis=0)

    def strength(self, with_effect: list[Floats], without: list[Floats]) -> float:
        energy, shared = 0.0, np.zeros(len(self._gram))
        for (whitening, solved), one, other in zip(self._runs, with_effect, without, strict=True):
            x = one - other
            energy += float(x @ whitening.solve(x[:, None])[:, 0])
            shared += solved.T @ x
        return _projected(energy, shared, self._gram)


class Screen:
    """The same with the noise taken as stationary and periodic: a Fourier transform a question. Good to some per cent
    where the noise is not slower than the run.
    """

    def __init__(self, case: Case, values: list[Floats]) -> None:
        self._weights: list[Floats] = []
        self._columns: list[NDArray[np.complex128]] = []
        self._length: list[int] = []
        for run, value, columns in zip(case.runs, values, _baseline(case, values), strict=True):
            n = next_fast_len(value.size, real=True)
            white = np.mean(case.noise.white_std(value - run.tare) ** 2)
            law = replace(case.noise, white=float(np.sqrt(white)), proportional=0.0)
            frequency = np.asarray(np.fft.rfftfreq(n, 1.0 / case.rate), dtype=np.float64)
            # one-sided density S: sum over the positive lines of 4 |X|^2 / (n rate S) is x' K^-1 x
            self._weights.append(4.0 / (n * case.rate * spectrum(law, frequency, case.rate)))
            self._weights[-1][0] *= 0.5
            self._columns.append(rfft(columns, n, axis=0))
            self._length.append(n)
        grams = [(c.conj().T * w @ c).real for c, w in zip(self._columns, self._weights, strict=True)]
        self._gram = np.sum(grams, axis=0)

    def strength(self, with_effect: list[Floats], without: list[Floats]) -> float:
        energy, shared = 0.0, np.zeros(len(self._gram))
        runs = zip(self._columns, self._weights, self._length, with_effect, without, strict=True)
        for columns, weights, length, one, other in runs:
            x = rfft(one - other, length)
            energy += float(weights @ np.abs(x) ** 2)
            shared += (columns.conj().T @ (weights * x)).real
        return _projected(energy, shared, self._gram)


def _projected(energy: float, shared: Floats, gram: Floats) -> float:
    """Square root of the energy that the baseline's columns do not take."""
    left = energy - float(shared @ np.linalg.solve(gram, shared))
    return float(np.sqrt(max(left, 0.0)))


def _baseline(case: Case, values: list[Floats]) -> list[Floats]:
    """V|V| and one zero per run, (n, 1 + runs) for each run."""
    found = []
    for index, value in enumerate(values):
        volts = history_volts(case, index)
        columns = np.zeros((value.size, 1 + len(values)))
        columns[:, 0], columns[:, 1 + index] = volts * np.abs(volts), 1.0
        found.append(columns)
    return found


def history_volts(case: Case, index: int) -> Floats:
    """The command at the thrust samples of run `index`, V."""
    profile = case.runs[index].profile
    t = clock(int(profile.duration / case.dt), case.dt)[case.first :: case.every]
    return held(profile.time, profile.volts, t)
