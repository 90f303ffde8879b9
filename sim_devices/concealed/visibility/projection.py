"""Energy of a difference that neither the baseline's columns nor the noise account for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.signal import lfilter

from sim_devices.concealed.cases.definition import Amplifier, Case, history, thrust_of
from sim_devices.concealed.cases.plans import held
from sim_devices.concealed.visibility.whitening import Whitening
from sim_devices.world.history import clock
from sim_devices.world.noise_law import spectrum, stationary

Floats = NDArray[np.float64]


def signals(case: Case, without: frozenset[str] = frozenset()) -> list[Floats]:
    """Noise-free thrust of each run, as its amplifier hands it on."""
    found = []
    for run in case.runs:
        h = history(case, run, without=without)
        seen = replace(h, reading=amplified(h.reading, case.dt, case.amplifier))
        found.append(thrust_of(case, run, seen, without=without))
    return found


def amplified(force: Floats, dt: float, how: Amplifier) -> Floats:
    """A force on a grid of `dt` (s), behind the low pass and the mean of an amplifier; at rest before it began."""
    if how.low_pass > 0:
        keep = math.exp(-dt / how.low_pass)
        force = lfilter([1.0 - keep], [1.0, -keep], force, zi=np.array([keep * force[0]]))[0]
    pieces = max(round(how.window / dt), 1)
    before = np.full(pieces - 1, force[0])
    return np.convolve(np.concatenate([before, force]), np.full(pieces, 1.0 / pieces), "valid")


class Projection:
    """Exact whitening and baseline columns of all runs; made once, asked for differences.

    `beside`: further columns that may take a difference, each run by run.
    """

    def __init__(self, case: Case, values: list[Floats], beside: Sequence[list[Floats]] = ()) -> None:
        self._runs, grams = [], []
        known = [np.column_stack(own) for own in zip(_baseline(case, values), *beside, strict=True)]
        for run, value, columns in zip(case.runs, values, known, strict=True):
            whitening = Whitening(case.noise, value - run.tare, case.rate)
            self._runs.append((whitening, whitening.solve(columns)))
            grams.append(columns.T @ self._runs[-1][1])
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
            law = stationary(case.noise, value - run.tare, case.rate)
            frequency = np.asarray(np.fft.rfftfreq(n, 1.0 / case.rate), dtype=np.float64)
            # one-sided density S: sum over the positive lines of 4 |X|^2 / (n rate S) is x' K^-1 x
            self._weights.append(4.0 / (n * case.rate * spectrum(law, frequency, case.rate)))
            self._weights[-1][0] *= 0.5
            self._columns.append(rfft(columns, n, axis=0))
            self._length.append(n)
        grams = [(c.conj().T * w @ c).real for c, w in zip(self._columns, self._weights, strict=True)]
        self._gram = np.sum(grams, axis=0)

    def strength(self, with_effect: list[Floats], without: list[Floats]) -> float:
        return float(np.sqrt(max(self.product(with_effect, with_effect, without), 0.0)))

    def product(self, one: list[Floats], other: list[Floats], without: list[Floats]) -> float:
        """Inner product of two differences from `without`, both freed of the baseline's columns."""
        total, left, right = 0.0, np.zeros(len(self._gram)), np.zeros(len(self._gram))
        runs = zip(self._columns, self._weights, self._length, one, other, without, strict=True)
        for columns, weights, length, a, b, base in runs:
            x = rfft(a - base, length)
            y = x if a is b else rfft(b - base, length)
            total += float(np.real(np.vdot(x, weights * y)))
            left += (columns.conj().T @ (weights * x)).real
            right += (columns.conj().T @ (weights * y)).real
        return total - float(left @ np.linalg.solve(self._gram, right))


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
