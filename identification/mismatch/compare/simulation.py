"""What a twin predicts: thrust, and the rotor's rate, of any drive; with its noise where a seed is given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import exp, pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import lfilter

from identification.mismatch.compare.saved_model_baseline import given
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import predict
from identification.mismatch.periodic.rotor_angle import turned
from identification.mismatch.prepare.binned import binned
from identification.mismatch.prepare.channels import neighbour_at
from identification.mismatch.prepare.preparing import FOLLOWED, Refusal
from identification.physics.term import Scale
from identification.recording import Floats, Recording
from identification.run_history.filters import within_intervals
from identification.run_history.history import TURNING, History
from identification.run_history.remembered import RememberedRun
from identification.twin import Twin, TwinNoise

FINE = 0.0025
"""s, the longest interval of the prediction: motor lags of some milliseconds are as steep as this."""
CLOSE = 1e-9
"""s: edges nearer than this are one."""


@dataclass(frozen=True, eq=False, slots=True)
class Drive:
    """What drives the thruster. `stepwise`: a command, which holds until its next row; otherwise a straight line."""

    time: Floats
    """(n,) s, ascending."""
    value: Floats
    """(n,) in the unit of the twin's driver."""
    stepwise: bool = True
    others: Mapping[str, tuple[Floats, Floats]] = field(default_factory=dict)
    """quantity -> (time, value): flow_speed, bus_voltage and what else the twin's terms look at."""


@dataclass(frozen=True, eq=False, slots=True)
class Prediction:
    """At the times asked for, (n,) each; without a tare."""

    time: Floats
    thrust: Floats
    """N"""
    rate: Floats | None
    """rev/s, where the twin knows the rotor's rate."""


def simulate(twin: Twin, drive: Drive, times: Floats, rng: np.random.Generator | None = None) -> Prediction | Refusal:
    """Thrust of the twin at `times` (n,) s, ascending and even. `rng`: the twin's noise is added."""
    for term in twin.terms:
        lacking = sorted(set(term.term.needs) - set(drive.others))
        if lacking:
            return Refusal(
                f"the twin's {term.effect} needs {', '.join(lacking)}, which is not given; replay a recording that "
                "holds it"
            )
    history, at = _history(twin, drive, times)
    scale = Scale(twin.highest_driver or 1.0, "", 0.0, float(times[-1] - times[0]), FINE)
    theta = Theta(twin.C, (), (0.0,), k=twin.rate_per_driver or 1.0)
    force, x = predict(Model((), given(twin)), theta, RememberedRun(history), scale)
    thrust = force[at] + waves(twin, history, x, times)
    if rng is not None and times.size > 1:
        thrust = thrust + drawn(twin.noise, thrust, float(np.median(np.diff(times))), rng)
    return Prediction(times, thrust, None if twin.rate_per_driver is None else twin.rate_per_driver * x[at])


def waves(twin: Twin, history: History, x: Floats, times: Floats) -> Floats:
    """(n,) N, the twin's periodic disturbances; `x` (M,) the rotor's rate in units of the driver. A phase that is not
    known is 0."""
    out = np.zeros(times.size)
    rate = within_intervals(np.abs(x), history.edges, times)
    turning = rate > TURNING * (twin.highest_driver or 1.0)
    for line in twin.lines:
        scale = 1.0 if line.turns == "V s" else twin.rate_per_driver or 1.0
        moving = line.ratio is not None
        cycles = line.frequency * times if line.ratio is None else line.ratio * turned(history.edges, scale * x, times)
        size = line.amplitude * ((scale * rate / line.at_speed) ** line.growth if line.at_speed > 0 else 1.0)
        out += np.where(turning | (not moving), size * np.sin(2 * pi * cycles + (line.phase or 0.0)), 0.0)
    return out


def wave_notes(twin: Twin) -> tuple[str, ...]:
    """What a reader of a prediction should know of its periodic disturbances, a sentence each."""
    out = []
    for line in twin.lines:
        what = f"{line.frequency:.4g} Hz" if line.ratio is None else f"{line.ratio:.4g} periods per {line.turns}"
        phase = "its phase is not known: 0 here" if line.phase is None else "phase of the first recording's clock"
        out.append(f"A line of {line.amplitude:.3g} N at {what} is in it ({phase}).")
    return tuple(out)


def _history(twin: Twin, drive: Drive, times: Floats) -> tuple[History, NDArray[np.intp]]:
    """Intervals no longer than FINE, a sample in the middle of one, and the index of the interval of each sample."""
    gap = float(np.median(np.diff(times))) if times.size > 1 else FINE
    parts = max(int(np.ceil(gap / FINE)), 1)
    offsets = (np.arange(parts) + 0.5) * gap / parts
    edges = np.concatenate([[min(times[0], drive.time[0]) - gap], (times[:, None] - offsets[None, :]).ravel()])
    edges = np.union1d(edges, [*times[-1:] + 0.5 * gap / parts])
    if drive.stepwise:
        edges = np.union1d(edges, drive.time[(drive.time > edges[0]) & (drive.time < edges[-1])])
    edges = edges[np.concatenate([[True], np.diff(edges) > CLOSE])]
    middle = 0.5 * (edges[1:] + edges[:-1])
    others = {name: np.interp(middle, *series) for name, series in drive.others.items()}
    M = middle.size
    turning = drive.others.get("rotation_rate")
    rate, rate_count, rate_sampled = (None, None, None) if turning is None else binned(*turning, edges)
    history = History(
        recording_id="",
        driver_quantity=twin.driver_quantity,
        edges=edges,
        driver=held(drive, middle),
        thrust=np.zeros(M),
        count=np.ones(M, dtype=np.int64),
        sampled=middle,
        within=np.zeros(M),
        others=others,
        rate=rate,
        rate_count=rate_count,
        rate_sampled=rate_sampled,
        rate_per_driver=twin.slip_rate or 1.0,
    )
    index = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, M - 1)
    return history, index


def others_of(recording: Recording) -> dict[str, tuple[Floats, Floats]]:
    """What a recording holds beside command and thrust, for the twin's terms; a neighbour's thrust or V|V| with it."""
    found = {}
    for quantity in FOLLOWED:
        channel = recording.first_of(quantity)
        good = np.empty(0, dtype=bool) if channel is None else np.isfinite(channel.value)
        if channel is not None and np.count_nonzero(good) > 1:
            found[quantity] = (channel.time[good], channel.value[good])
    if recording.channels:
        times = np.unique(np.concatenate([c.time for c in recording.channels]))
        neighbour = neighbour_at(recording, times)
        if neighbour is not None:
            found["neighbour_thrust"] = (times, neighbour)
    return found


def held(drive: Drive, at: Floats) -> Floats:
    """Value of the drive; a command before its first row is 0."""
    if not drive.stepwise:
        line: Floats = np.interp(at, drive.time, drive.value)
        return line
    index = np.searchsorted(drive.time, at, side="right") - 1
    out: Floats = np.where(index >= 0, drive.value[np.maximum(index, 0)], 0.0)
    return out


def drawn(noise: TwinNoise, thrust: Floats, interval: float, rng: np.random.Generator) -> Floats:
    """Noise of samples `interval` s apart, N; the law of identification.mismatch.noise.covariance.

    >>> n = TwinNoise(0.0, 0.0, (1.0,), (4.0,), ((5.0, 3.0),), (9.0,))
    >>> x = drawn(n, np.zeros(200_000), 0.01, np.random.default_rng(1))
    >>> bool(abs(x.var() / 13 - 1) < 0.1)
    True
    """
    n = thrust.size
    total = np.sqrt(noise.white + noise.proportional * thrust**2) * rng.standard_normal(n)
    for variance, scale in zip(noise.slow, noise.scales, strict=True):
        keep = exp(-interval / scale)
        pushes = sqrt(variance) * rng.standard_normal(n)
        pushes[1:] *= sqrt(1 - keep * keep)
        total = total + lfilter([1.0], [1.0, -keep], pushes)
    for variance, (frequency, quality) in zip(noise.band, noise.bands, strict=True):
        total = total + _oscillation(variance, frequency, quality, interval, n, rng)
    return np.asarray(total, dtype=np.float64)


def _oscillation(
    variance: float, frequency: float, quality: float, interval: float, n: int, rng: np.random.Generator
) -> Floats:
    """A mass on a spring pushed by white noise, of that variance: exact from sample to sample."""
    w = 2 * pi * frequency
    step = expm(np.array([[0.0, 1.0], [-w * w, -w / quality]]) * interval)
    still = variance * np.diag([1.0, w * w])
    left = still - step @ still @ step.T
    values, vectors = np.linalg.eigh(left)
    pushes = rng.standard_normal((n, 2)) @ (vectors * np.sqrt(np.maximum(values, 0.0))).T
    pushes[0] = np.sqrt(np.diag(still)) * rng.standard_normal(2)
    # x_k = step x_{k-1} + push: the first component alone is an ARMA of second order
    driven = pushes[:, 0].copy()
    driven[1:] += step[0, 1] * pushes[:-1, 1] - step[1, 1] * pushes[:-1, 0]
    out: Floats = lfilter([1.0], [1.0, -np.trace(step), np.linalg.det(step)], driven)
    return out
