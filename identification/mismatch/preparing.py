"""From a recording to its history: which channel drives, and intervals that are short where things change."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.physics.history import History
from identification.recording import Channel, Floats, Recording

DRIVERS = ("command_voltage", "motor_voltage", "rotation_rate")
"""What may explain the thrust, best first."""
FINEST = 0.01
"""s, the shortest interval."""
COARSEST = 0.25
"""s, the longest one while levels are held."""
FINEST_AFTER_STEP = 0.0025
"""s: motor lags of some milliseconds are as steep as this."""
GROWTH_AFTER_STEP = 0.12
WINDOW = 0.0015
"""s before and after a sample that stands for its time."""
WINDOW_ZONE = 0.1
"""s after a change of the command in which samples have windows."""
LEAST_WINDOWED = 0.008
"""s between samples: where they are denser, intervals are short enough."""
GROWTH = 0.06
"""Length of an interval per time since the last change."""
MOVES = 0.01
"""Share of the largest driver that counts as a change."""
STEP = 0.02
"""Share of the largest driver: a change of a command that is a step."""
JITTER_BEFORE, JITTER_AFTER = 0.002, 0.003
"""s round a step within which a sample may belong to either level: time stamps are not better."""
MOST_INTERVALS = 12000
LEAST_DWELL = 0.5
"""s of a level in a static table."""
FEW_SAMPLES = 3
"""Samples of a level, at most, that make a static table."""
LEAST_SAMPLES = 5
CALMED = ("flow_speed", "motor_temperature", "water_temperature")
CALM = 4
"""Samples on either side that are averaged."""
LOADS = 6
"""Columns of the supply's load."""
FOLLOWED = ("bus_voltage", "flow_speed", "current", "torque", "motor_temperature", "water_temperature", "rotation_rate")
"""Quantities that terms and tests may look at."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a recording cannot be diagnosed, in one sentence."""

    reason: str


def history_of(recording: Recording, most_intervals: int = MOST_INTERVALS) -> History | Refusal:
    """The run on at most about `most_intervals` intervals."""
    name = recording.source or recording.recording_id
    recording = _own_first(recording)
    thrust = recording.first_of("thrust")
    if thrust is None:
        return Refusal(f"{name} has no thrust channel (quantity thrust): there is no response to explain")
    good = np.isfinite(thrust.value) & np.isfinite(thrust.time)
    time, force = _distinct(thrust.time[good], thrust.value[good])
    if time.size < LEAST_SAMPLES:
        return Refusal(f"{name} has {time.size} finite thrust samples; at least {LEAST_SAMPLES} are needed")
    driver = _driver(recording)
    if isinstance(driver, str):
        return Refusal(f"{name} {driver}")
    held = _Held(driver, float(time[-1]))
    time, force = _driven(time, force, held)
    if time.size < LEAST_SAMPLES:
        return Refusal(f"{name}: thrust and {driver.quantity} share no stretch of time; are both on one clock?")
    time, force = _clear_of_steps(time, force, held)
    if time.size < LEAST_SAMPLES:
        return Refusal(f"{name}: almost every thrust sample coincides with a change of the driver")
    edges = _edges(time, held, most_intervals)
    return _filled(recording, driver, held, edges, time, force)


def _own_first(recording: Recording) -> Recording:
    """A neighbour's channels behind those of the thruster itself, whichever were written first."""
    own = sorted(recording.channels, key=lambda c: c.thruster not in (None, "", recording.thruster))
    return replace(recording, channels=tuple(own))


def _distinct(time: Floats, value: Floats) -> tuple[Floats, Floats]:
    """Samples that share one time become their mean."""
    if time.size < 2 or np.all(np.diff(time) > 0):
        return time, value
    unique, index = np.unique(time, return_inverse=True)
    mean: Floats = np.bincount(index, weights=value) / np.bincount(index)
    return unique, mean


def _driver(recording: Recording) -> Channel | str:
    """The best channel that moves; otherwise what is wrong, as the end of a sentence."""
    seen: list[str] = []
    for quantity in DRIVERS:
        channel = recording.first_of(quantity)
        if channel is None:
            continue
        value = channel.value[np.isfinite(channel.value)]
        if value.size and float(np.ptp(value)) > 1e-9 * max(float(np.max(np.abs(value))), 1e-300):
            return channel
        seen.append(f"{quantity} is {value[0]:g} throughout" if value.size else f"{quantity} holds no number")
    if not seen:
        return f"has none of {', '.join(DRIVERS)}: nothing tells what drove the thruster"
    return f"cannot be diagnosed: {', '.join(seen)}; at least two levels are needed"


class _Held:
    """The driver as a function of time: constant between rows of a command, a straight line between measurements."""

    def __init__(self, channel: Channel, end: float) -> None:
        good = np.isfinite(channel.value)
        self.time, self.value = _distinct(channel.time[good], channel.value[good])
        self.quantity = str(channel.quantity)
        self.stepwise = channel.quantity == "command_voltage"
        last = max(end, float(self.time[-1]))
        knots = np.append(self.time, last + 1.0)
        if self.stepwise:
            area = self.value * np.diff(knots)
        else:
            padded = np.append(self.value, self.value[-1])
            area = 0.5 * (padded[1:] + padded[:-1]) * np.diff(knots)
        self._knots, self._area = knots, np.concatenate([[0.0], np.cumsum(area)])

    def mean(self, edges: Floats) -> Floats:
        """(M,) mean over each interval. A command before its first row is 0."""
        total = np.interp(edges, self._knots, self._area)
        if not self.stepwise:
            index = np.clip(np.searchsorted(self._knots, edges, side="right") - 1, 0, self.time.size - 1)
            padded = np.append(self.value, self.value[-1])
            span = self._knots[index + 1] - self._knots[index]
            part = np.clip(edges - self._knots[index], 0.0, span)
            slope = (padded[index + 1] - padded[index]) / span
            total = self._area[index] + padded[index] * part + 0.5 * slope * part**2
        out: Floats = np.diff(total) / np.diff(edges)
        return out

    def changes(self) -> Floats:
        """Times at which it has moved by MOVES of its size since the last such time."""
        step = MOVES * float(np.max(np.abs(self.value)))
        index, last = [0], self.value[0]
        if self.value.size < 200_000:
            for i, v in enumerate(self.value.tolist()):
                if abs(v - last) > step:
                    index.append(i)
                    last = v
        out: Floats = self.time[np.array(index, dtype=np.intp)]
        return out


def _driven(time: Floats, force: Floats, held: _Held) -> tuple[Floats, Floats]:
    """Without what was measured before the first and, for a measured driver, after the last row of the driver."""
    slack = 0.5 * float(np.median(np.diff(time)))
    end = np.inf if held.stepwise else held.time[-1] + slack
    inside = (time >= held.time[0] - slack) & (time <= end)
    return time[inside], force[inside]


def _clear_of_steps(time: Floats, force: Floats, held: _Held) -> tuple[Floats, Floats]:
    """Without samples so near to a step of the command that the clocks cannot say which level they belong to."""
    size = float(np.max(np.abs(held.value)))
    big = np.abs(np.diff(held.value, prepend=0.0)) > STEP * size  # the first row is a step from nothing
    steps = held.time[big]
    if not (held.stepwise and steps.size) or time.size < 4 * steps.size:
        return time, force
    after = np.searchsorted(steps, time + JITTER_BEFORE, side="right") - 1
    late = time - steps[np.maximum(after, 0)]
    clear = (after < 0) | (late > JITTER_AFTER)
    return time[clear], force[clear]


def _clear_of_jumps(recording: Recording, time: Floats, force: Floats) -> tuple[Floats, Floats]:
    """Without samples between two samples of the flow of which nobody knows when it changed."""
    flow = recording.first_of("flow_speed")
    if flow is None or np.count_nonzero(np.isfinite(flow.value)) < 3:
        return time, force
    good = np.isfinite(flow.value)
    at, value = flow.time[good], flow.value[good]
    jumps = np.flatnonzero(_jumps(value) & (np.abs(np.diff(value)) > 0.03 * np.ptp(value)))
    gap = np.searchsorted(at, time, side="right") - 1
    clear = ~np.isin(gap, jumps)
    return (time[clear], force[clear]) if np.count_nonzero(clear) > 0.7 * time.size else (time, force)


def _edges(time: Floats, held: _Held, most: int) -> Floats:
    """Edges between samples, dense after changes; big steps of the command are edges too."""
    spacing = float(np.median(np.diff(time)))
    between = 0.5 * (time[1:] + time[:-1])
    candidates = np.concatenate([[time[0] - 0.5 * spacing], between, [time[-1] + 0.5 * spacing]])
    changes = held.changes()
    index = np.searchsorted(changes, candidates, side="right") - 1
    since = np.where(index >= 0, candidates - changes[np.maximum(index, 0)], COARSEST / GROWTH)
    finest = max(FINEST, spacing)
    width = np.clip(GROWTH * since, finest, max(COARSEST, finest))
    wanted = np.concatenate([[0.0], np.cumsum(np.diff(candidates) / width[1:])])
    shrink = min(1.0, most / max(float(wanted[-1]), 1.0))
    number = np.floor(wanted * shrink + 1e-6)
    edges = candidates[np.concatenate([[True], np.diff(number) > 0])]
    edges[-1] = candidates[-1]
    return _with_windows(_with_steps(edges, held, spacing, most), time, held, spacing, most)


def _with_steps(edges: Floats, held: _Held, spacing: float, most: int) -> Floats:
    """Each step of a command is an edge, followed by intervals that begin at FINEST_AFTER_STEP and grow."""
    size = float(np.max(np.abs(held.value)))
    steps = held.time[1:][np.abs(np.diff(held.value)) > STEP * size]
    steps = steps[(steps > edges[0]) & (steps < edges[-1])]
    if not (held.stepwise and steps.size):
        return edges
    after = [0.0]
    while (width := max(FINEST_AFTER_STEP, GROWTH_AFTER_STEP * after[-1])) < spacing:
        after.append(after[-1] + width)
    if steps.size * len(after) > most:
        after = [0.0]
    gap = np.diff(np.append(steps, edges[-1]))
    added = (steps[:, None] + np.array(after)[None, :])[np.array(after)[None, :] < gap[:, None] - 1e-4]
    last = np.searchsorted(steps, edges, side="right") - 1
    since = np.where(last >= 0, edges - steps[np.maximum(last, 0)], np.inf)
    until = np.where(last + 1 < steps.size, steps[np.minimum(last + 1, steps.size - 1)] - edges, np.inf)
    free = (since > after[-1] + 0.3 * spacing) & (until > min(0.3 * spacing, FINEST_AFTER_STEP))
    free[[0, -1]] = True
    out = np.union1d(edges[free], added)
    result: Floats = out[np.concatenate([[True], np.diff(out) > 1e-6])]
    return result


def _with_windows(edges: Floats, time: Floats, held: _Held, spacing: float, most: int) -> Floats:
    """Shortly after every change of a command, each sample gets a short interval of its own."""
    if not held.stepwise or spacing < LEAST_WINDOWED:
        return edges
    changes = held.time[1:][np.diff(held.value) != 0]
    changes = changes[(changes > edges[0]) & (changes < edges[-1])]
    if not changes.size or changes.size > most:
        return edges
    zone = max(WINDOW_ZONE, 5 * spacing)
    last = np.searchsorted(changes, time, side="right") - 1
    own = time[(last >= 0) & (time - changes[np.maximum(last, 0)] < zone)]
    if own.size > most:
        return edges
    nearest = np.searchsorted(changes, own)
    before = changes[np.maximum(nearest - 1, 0)]
    after = changes[np.minimum(nearest, changes.size - 1)]
    low = np.where((before <= own) & (own - before < WINDOW), before, own - WINDOW)
    high = np.where((after > own) & (after - own < WINDOW), after, own + WINDOW)
    windows = np.column_stack([low, high])
    inside = np.searchsorted(windows[:, 0], edges, side="right") - 1
    covered = (inside >= 0) & (edges > windows[np.maximum(inside, 0), 0]) & (edges < windows[np.maximum(inside, 0), 1])
    covered[[0, -1]] = False
    out = np.union1d(np.union1d(edges[~covered], windows.ravel()), changes)
    out = out[(out >= edges[0]) & (out <= edges[-1])]
    result: Floats = out[np.concatenate([[True], np.diff(out) > 1e-5])]
    return result


def _binned(time: Floats, value: Floats, edges: Floats) -> tuple[Floats, NDArray[np.int64], Floats]:
    """Mean value (NaN where none), number of samples and mean time in each interval."""
    M = edges.size - 1
    index = np.searchsorted(edges, time, side="right") - 1
    inside = (index >= 0) & (index < M)
    index = index[inside]
    count = np.bincount(index, minlength=M)
    some = np.maximum(count, 1)
    mean = np.where(count > 0, np.bincount(index, weights=value[inside], minlength=M) / some, np.nan)
    when = np.bincount(index, weights=time[inside], minlength=M) / some
    middle = 0.5 * (edges[1:] + edges[:-1])
    return mean, count, np.where(count > 0, when, middle)


def _within(time: Floats, value: Floats, edges: Floats, mean: Floats) -> Floats:
    """Sum of squares about the mean of each interval."""
    index = np.searchsorted(edges, time, side="right") - 1
    inside = (index >= 0) & (index < mean.size)
    index = index[inside]
    squares = (value[inside] - mean[index]) ** 2
    return np.asarray(np.bincount(index, weights=squares, minlength=mean.size), dtype=np.float64)


def _filled(recording: Recording, driver: Channel, held: _Held, edges: Floats, time: Floats, force: Floats) -> History:
    time, force = _clear_of_jumps(recording, time, force)
    mean, count, sampled = _binned(time, force, edges)
    within = _within(time, force, edges, mean)
    middle = 0.5 * (edges[1:] + edges[:-1])
    others: dict[str, Floats] = {}
    driven = held.mean(edges)
    for quantity in FOLLOWED:
        channel = recording.first_of(quantity)
        if channel is None or channel is driver:
            continue
        values = (
            _supply(channel, held, middle, driven, np.diff(edges))
            if quantity == "bus_voltage"
            else _followed(channel, middle)
        )
        if values is not None:
            others[quantity] = values
    neighbour = _neighbour(recording, middle)
    if neighbour is not None:
        others["neighbour_thrust"] = neighbour
    rate = rate_count = rate_sampled = None
    turning_time = np.empty(0)
    per_driver = 1.0
    turning = recording.first_of("rotation_rate")
    if "rotation_rate" in others and turning is not None:
        good = np.isfinite(turning.value)
        turning_time = turning.time[good]
        rate, rate_count, rate_sampled = _binned(turning.time[good], turning.value[good], edges)
        weighted = driven * np.diff(edges)
        power = float(weighted @ driven)
        per_driver = float(weighted @ others["rotation_rate"]) / power if power > 0 else 1.0
    return History(
        recording_id=recording.recording_id,
        driver_quantity=held.quantity,
        edges=edges,
        driver=driven,
        thrust=mean,
        count=count,
        sampled=sampled,
        within=within,
        lead=_lead(held, time, edges, driven, count),
        rate_lead=np.zeros(1) if rate_count is None else _lead(held, turning_time, edges, driven, rate_count),
        sample_time=time[(time >= edges[0]) & (time < edges[-1])],
        sample_thrust=force[(time >= edges[0]) & (time < edges[-1])],
        rate=rate,
        rate_count=rate_count,
        rate_sampled=rate_sampled,
        others=others,
        rate_per_driver=per_driver or 1.0,
        spacing=float(np.median(np.diff(time))),
        rate_spacing=0.0 if turning is None or turning.time.size < 2 else float(np.median(np.diff(turning.time))),
        static=_is_table(held, time.size),
    )


def _lead(held: _Held, time: Floats, edges: Floats, driven: Floats, count: NDArray[np.int64]) -> Floats:
    """Command at the samples less its mean over their interval where it ticks; 0 at steps and for measured drivers."""
    if not held.stepwise:
        return np.zeros(1)
    now = held.value[np.clip(np.searchsorted(held.time, time, side="right") - 1, 0, held.time.size - 1)]
    mean, _, _ = _binned(time, now, edges)
    lead = np.where(count > 0, mean - driven, 0.0)
    out: Floats = np.where(np.abs(lead) < STEP * float(np.max(np.abs(driven))), lead, 0.0)
    return out


def _is_table(held: _Held, samples: int) -> bool:
    """Levels held for long with hardly a sample each: a table of levels, not a course of time."""
    changes = held.time[np.concatenate([[True], np.diff(held.value) != 0])]
    if not held.stepwise or changes.size < 2 or samples > FEW_SAMPLES * changes.size:
        return False
    return float(np.median(np.diff(changes))) >= LEAST_DWELL


def _followed(channel: Channel, at: Floats) -> Floats | None:
    """Interpolated, its noise averaged between its jumps: noise in what explains makes effects look smaller."""
    good = np.isfinite(channel.value)
    if np.count_nonzero(good) < 2:
        return None
    time, value = channel.time[good], channel.value[good]
    out: Floats = np.interp(at, time, _calm(value) if channel.quantity in CALMED else value)
    return out


def _jumps(value: Floats) -> NDArray[np.bool_]:
    """(n-1,) where neighbouring samples differ by far more than their noise."""
    step = np.abs(np.diff(value))
    noise = float(np.median(step)) / 0.6745
    return step > max(6 * noise, 1e-9 * float(np.max(np.abs(value), initial=0.0)))


def _calm(value: Floats) -> Floats:
    """Running mean over up to CALM samples on either side, never across a jump."""
    starts = np.concatenate([[0], np.flatnonzero(_jumps(value)) + 1, [value.size]])
    index = np.arange(value.size)
    which = np.searchsorted(starts, index, side="right") - 1
    reach = np.minimum(np.minimum(index - starts[which], starts[which + 1] - 1 - index), CALM)
    total = np.concatenate([[0.0], np.cumsum(value - value[0])])
    out: Floats = value[0] + (total[index + reach + 1] - total[index - reach]) / (2 * reach + 1)
    return out


def _supply(channel: Channel, held: _Held, at: Floats, driven: Floats, dt: Floats) -> Floats | None:
    """Supply voltage: what the load makes of it, and the slow rest, so that it is known between its samples."""
    good = np.isfinite(channel.value)
    if np.count_nonzero(good) < 2 * LOADS:
        return _followed(channel, at)
    time, value = channel.time[good], channel.value[good]
    size = float(np.max(np.abs(driven))) or 1.0
    index = np.clip(np.searchsorted(held.time, time, side="right") - 1, 0, held.time.size - 1)
    then = held.value[index] if held.stepwise else np.interp(time, held.time, held.value)
    charge = np.cumsum(np.abs(driven / size) ** 3 * dt)
    drawn = np.interp(time, at, charge)

    def columns(v: Floats, q: Floats) -> Floats:
        u = np.abs(v) / size
        return np.column_stack([np.ones(u.size), u, u**2, u**3, u**4, q / max(float(charge[-1]), 1e-12)])

    H = columns(then, drawn)
    theta = np.linalg.lstsq(H, value, rcond=None)[0]
    rest = value - H @ theta
    out: Floats = columns(driven, charge) @ theta + np.interp(at, time, _calm(rest))
    return out


def _neighbour(recording: Recording, at: Floats) -> Floats | None:
    """Thrust of another thruster, or its command squared, where one was recorded beside this one."""
    for quantity in ("thrust", "command_voltage"):
        for channel in recording.all_of(quantity):
            if channel.thruster not in (None, "", recording.thruster):
                if quantity == "thrust":
                    return _followed(channel, at)
                value = channel.held_at(at)
                out: Floats = np.where(np.isfinite(value), value * np.abs(value), 0.0)
                return out
    return None
