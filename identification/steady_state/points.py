"""Steady-state reduction: a recording becomes one point per hold, each with a standard error that can be believed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.recording import Channel, Floats, Recording
from identification.steady_state.holds import Window, from_steps, from_voltage, overlap_free, without_waiting
from identification.steady_state.steady import MeanEstimate, settled_estimates

MIN_HOLD_SAMPLES = 8
"""Fewer thrust samples in an unmarked window make no hold: it may be a slow sine or a ramp sampled slowly."""
MIN_SHARE = 0.5
"""Unmarked holds must cover this share of the thrust samples, else the run is no staircase."""
MATERIAL_DRIFT = 0.005
"""A drift counts against a point when, over its window, it moves the mean by this share of the run's largest thrust."""

FALLBACK = ("command_voltage", "motor_voltage", "rotation_rate")
"""What the thrust is explained by, in this order, when nothing is asked for."""


@dataclass(frozen=True, slots=True)
class Point:
    """One hold."""

    voltage: float
    """V"""
    thrust: MeanEstimate
    """N, N/s"""
    phase: str
    steady: bool
    """Settled, and without a drift that is both significant and material."""


@dataclass(frozen=True, eq=False)
class Points:
    """All holds of one recording, in time order, as arrays (k,) where arrays are wanted."""

    recording_id: str
    points: tuple[Point, ...]
    skipped: int
    """Thrust samples in the windows that were NaN or infinite."""

    @property
    def voltage(self) -> Floats:
        return np.array([p.voltage for p in self.points])

    @property
    def thrust(self) -> Floats:
        return np.array([p.thrust.mean for p in self.points])

    @property
    def std_error(self) -> Floats:
        """N; NaN where too few samples say nothing."""
        return np.array([p.thrust.std_error for p in self.points])

    @property
    def dof(self) -> Floats:
        return np.array([p.thrust.dof for p in self.points])

    @property
    def unsteady(self) -> int:
        return sum(not p.steady for p in self.points)


def voltage_channel(recording: Recording, quantity: str = "command_voltage") -> Channel | None:
    """The channel asked for. `command_voltage` falls back to `motor_voltage`, then to `rotation_rate` (rev/s)."""
    wanted = FALLBACK if quantity == FALLBACK[0] else (quantity,)
    for name in wanted:
        found = recording.first_of(name)
        if found is not None and bool(np.any(np.isfinite(found.value))):
            return found
    return None


def find_windows(recording: Recording, voltage: Channel, thrust: Channel) -> tuple[Window, ...]:
    """Windows of constant voltage worth a point each; empty when the run is a sine, a ramp or a plain level table.

    Steps are believed when they are there and name at least two levels. Without them, holds are runs of the command
    (of the measured voltage only if there is no command) that are long enough and make up most of the run. A rotation
    rate alone makes no holds: it is a response, which lingers wherever the rotor is slow.
    """
    marked = without_waiting(from_steps(recording))
    if len({w.voltage for w in marked}) > 1 and overlap_free(marked):
        return marked
    command = recording.first_of("command_voltage")
    usable = command is not None and bool(np.any(np.isfinite(command.value)))
    source = command if command is not None and usable else voltage
    if source.quantity == "rotation_rate":
        return ()
    good = thrust.time[np.isfinite(thrust.value)]
    runs = from_voltage(source, good, MIN_HOLD_SAMPLES)
    covered = sum(int(np.diff(np.searchsorted(good, (w.t_start, w.t_end)))[0]) for w in runs)
    return runs if len(runs) > 1 and covered >= MIN_SHARE * good.size else ()


def reduce_to_points(recording: Recording, voltage: Channel, thrust: Channel) -> Points | None:
    """One point per hold (settling left out), or None when the run has no holds and must be fitted on its samples.

    When `voltage` is a measured channel, a point's voltage is its mean over the window that was kept.
    """
    windows, samples, skipped = [], [], 0
    for window in find_windows(recording, voltage, thrust):
        time, value = thrust.window(window.t_start, window.t_end)
        good = np.isfinite(value)
        skipped += int(good.size - good.sum())
        if good.any():
            windows.append(window)
            samples.append((time[good], value[good]))
    step = resolution([value for _, value in samples])
    estimates = [_not_below(e, step) for e in settled_estimates(samples, thrust.noise_std)]
    levels = [_level(window, voltage, e) for window, e in zip(windows, estimates, strict=True)]
    largest = max((abs(e.mean) for e in estimates), default=0.0)
    points = tuple(
        Point(level, e, window.phase, _steady(e, largest))
        for window, level, e in zip(windows, levels, estimates, strict=True)
        if np.isfinite(level)
    )
    return Points(recording.recording_id, points, skipped) if points else None


def resolution(windows: Sequence[Floats]) -> float:
    """Smallest step between neighbouring samples inside the windows, N: the cell's least digit. 0 when none differ.

    >>> resolution([np.array([1.0, 1.5, 1.0]), np.array([9.0, 9.0])])
    0.5
    """
    moved = [np.abs(np.diff(value)) for value in windows]
    return min((float(m[m > 0].min()) for m in moved if np.any(m > 0)), default=0.0)


def _not_below(estimate: MeanEstimate, step: float) -> MeanEstimate:
    """Samples that do not leave one digit do not average it away: the error is the digit's own, step / sqrt(12)."""
    spread = estimate.std_error * np.sqrt(max(estimate.n_effective, 1.0))
    if spread >= 0.5 * step or not np.isfinite(spread):
        return estimate
    return replace(estimate, std_error=max(estimate.std_error, step / float(np.sqrt(12.0))))


def _level(window: Window, voltage: Channel, estimate: MeanEstimate) -> float:
    if voltage.quantity == "command_voltage":
        return window.voltage
    _, inside = voltage.window(estimate.t_start, float(np.nextafter(estimate.t_end, np.inf)))
    inside = inside[np.isfinite(inside)]
    if inside.size:
        return float(inside.mean())
    return float(voltage.held_at(np.array([estimate.t_start]))[0])


def _steady(estimate: MeanEstimate, largest: float) -> bool:
    moved = abs(estimate.drift) * (estimate.t_end - estimate.t_start)
    return estimate.settled and not (estimate.drifting and moved > MATERIAL_DRIFT * largest)
