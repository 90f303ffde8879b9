"""From a recording to its history: which channel drives, and what was measured in each interval (grid.py)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.calibration.bend import CellBend, bend_left
from identification.mismatch import policy
from identification.mismatch.prepare.binned import binned, untorn
from identification.mismatch.prepare.chain.quantum import quantum_of
from identification.mismatch.prepare.channels import coarseness, followed, jumps, neighbour_at, step_of, torque
from identification.mismatch.prepare.grid import Held, distinct, edges_of
from identification.mismatch.prepare.supply import supply
from identification.mismatch.prepare.thermometer import warmed
from identification.recording import Channel, Floats, Recording
from identification.run_history.converter import Converter
from identification.run_history.history import CHANGED, History
from identification.run_history.ticks.sub_interval_leads import with_leads
from identification.thruster.thrust_data import curve_behind

DRIVERS = ("command_voltage", "motor_voltage", "rotation_rate")
"""What may explain the thrust, best first."""
MOST_INTERVALS = 6000
"""Intervals of one run: predictions cost time in proportion, and after steps they are still 2.5 ms."""
MOST_MOVING = 10000
"""The same where the driver hardly ever stands still: within an interval a kink of the curve is not seen."""
MANY_CHANGES = 1500
"""Changes of the driver, above which it hardly ever stands still."""
MOST_LEVELS = 300
"""Of a measured driver, whose errors are told from noise."""
FOLLOWED = ("bus_voltage", "flow_speed", "current", "torque", "motor_temperature", "water_temperature", "rotation_rate")
"""Quantities that terms and tests may look at."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a recording cannot be diagnosed, in one sentence."""

    reason: str


def history_of(recording: Recording, most_intervals: int = MOST_INTERVALS, early: float = 0.0) -> History | Refusal:
    """The run on at most about `most_intervals` intervals; `early`: s by which the force comes before its command."""
    name = recording.source or recording.recording_id
    recording = _own_first(recording)
    thrust = recording.first_of("thrust")
    if thrust is None:
        return Refusal(f"{name} has no thrust channel (quantity thrust): there is no response to explain")
    good = np.isfinite(thrust.value) & np.isfinite(thrust.time)
    time, force = distinct(thrust.time[good], thrust.value[good])
    if time.size < policy.prepare.THRUST_SAMPLES:
        return Refusal(
            f"{name} has {time.size} finite thrust samples; at least {policy.prepare.THRUST_SAMPLES} are needed"
        )
    driver = _driver(recording)
    if isinstance(driver, str):
        return Refusal(f"{name} {driver}")
    held = Held(driver, float(time[-1]))
    time, force = _driven(time, force, held)
    if time.size < policy.prepare.THRUST_SAMPLES:
        return Refusal(f"{name}: thrust and {driver.quantity} share no stretch of time; are both on one clock?")
    time, force = _clear_of_steps(time, force, held)
    if time.size < policy.prepare.THRUST_SAMPLES:
        return Refusal(f"{name}: almost every thrust sample coincides with a change of the driver")
    edges = edges_of(time, held, MOST_MOVING if held.changes().size > MANY_CHANGES else most_intervals, early)
    return replace(_filled(recording, driver, held, edges, time, force), quantum=quantum_of(thrust))


def _own_first(recording: Recording) -> Recording:
    """A neighbour's channels behind those of the thruster itself, whichever were written first."""
    own = sorted(recording.channels, key=lambda c: c.thruster not in (None, "", recording.thruster))
    return replace(recording, channels=tuple(own))


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


def _driven(time: Floats, force: Floats, held: Held) -> tuple[Floats, Floats]:
    """Without what was measured before the first row of the driver, while it was unknown (and a little longer, the
    rotor coasts), and, for a measured driver, after its last row."""
    slack = 0.5 * float(np.median(np.diff(time)))
    end = np.inf if held.stepwise else held.time[-1] + slack
    inside = (time >= held.time[0] - slack) & (time <= end) & _commanded(time, held)
    return time[inside], force[inside]


def _commanded(time: Floats, held: Held) -> NDArray[np.bool_]:
    """(n,) false while nobody knows what was commanded, as where a watchdog is proved, and until the rotor rests."""
    known = np.ones(time.size, dtype=np.bool_)
    for begun, ended in held.unknown:
        known &= (time < begun) | (time > ended + policy.prepare.AFTER_UNKNOWN_COMMAND)
    return known


def _clear_of_steps(time: Floats, force: Floats, held: Held) -> tuple[Floats, Floats]:
    """Without samples so near to a step of the command that the clocks cannot say which level they belong to, or of
    which a measured driver does not say what drove them."""
    if held.measured is not None:
        known = held.measured.known(time, force)
        return time[known], force[known]
    size = float(np.max(np.abs(held.value)))
    big = (
        np.abs(np.diff(held.value, prepend=0.0)) > policy.prepare.COMMAND_STEP * size
    )  # the first row is a step from nothing
    steps = held.time[big]
    if not steps.size or time.size < 4 * steps.size:
        return time, force
    least = jitter_of(time)
    after = np.searchsorted(steps, time + min(policy.prepare.JITTER_BEFORE, least), side="right") - 1
    late = time - steps[np.maximum(after, 0)]
    clear = (after < 0) | (late > min(policy.prepare.JITTER_AFTER, least))
    return time[clear], force[clear]


def jitter_of(time: Floats) -> float:
    """Time in s by which stamps may be off, as their own spacing tells: a share of it, or its scatter."""
    step = np.diff(time)
    spacing = float(np.median(step))
    return max(
        policy.prepare.JITTER_SHARE * spacing,
        policy.prepare.JITTER_SIGMA * float(np.median(np.abs(step - spacing))) / 0.6745,
    )


def _clear_of_jumps(recording: Recording, time: Floats, force: Floats) -> tuple[Floats, Floats]:
    """Without samples between two samples of the flow of which nobody knows when it changed."""
    flow = recording.first_of("flow_speed")
    if flow is None or np.count_nonzero(np.isfinite(flow.value)) < 3:
        return time, force
    good = np.isfinite(flow.value)
    at, value = flow.time[good], flow.value[good]
    found = np.flatnonzero(jumps(value) & (np.abs(np.diff(value)) > policy.prepare.FLOW_JUMP * np.ptp(value)))
    gap = np.searchsorted(at, time, side="right") - 1
    clear = ~np.isin(gap, found)
    return (
        (time[clear], force[clear])
        if np.count_nonzero(clear) > policy.prepare.SAMPLES_CLEAR_OF_FLOW_JUMPS * time.size
        else (time, force)
    )


def _within(time: Floats, value: Floats, edges: Floats, mean: Floats) -> Floats:
    """Sum of squares about the mean of each interval."""
    index = np.searchsorted(edges, time, side="right") - 1
    inside = (index >= 0) & (index < mean.size)
    index = index[inside]
    squares = (value[inside] - mean[index]) ** 2
    return np.asarray(np.bincount(index, weights=squares, minlength=mean.size), dtype=np.float64)


def _delay_std(recording: Recording, driver: Channel) -> float:
    """S by which the recording itself is not sure how long after its driver the thrust was stamped."""
    thrust = recording.first_of("thrust")
    assert thrust is not None
    return float(np.hypot(thrust.acquisition.delay_std or 0.0, driver.acquisition.delay_std or 0.0))


def _converter(recording: Recording) -> Converter:
    """Of the thrust, as far as the recording says."""
    thrust = recording.first_of("thrust")
    assert thrust is not None
    return Converter(thrust.acquisition.window or 0.0, thrust.acquisition.low_pass or 0.0)


def _cell(recording: Recording) -> CellBend:
    """How straight the cell is known to be over the forces of the run, as its dead weights say."""
    thrust = recording.first_of("thrust")
    assert thrust is not None
    force = thrust.value[np.isfinite(thrust.value)]
    return bend_left(curve_behind(thrust), force)


@dataclass(frozen=True, eq=False, slots=True)
class _Turning:
    """The rate as it was measured, over the intervals; fields as of History."""

    time: Floats
    rate: Floats | None
    count: NDArray[np.int64] | None
    sampled: Floats | None
    per_driver: float
    spacing: float


def _turning(recording: Recording, others: Mapping[str, Floats], held: Held, driven: Floats, edges: Floats) -> _Turning:
    channel = recording.first_of("rotation_rate")
    spacing = 0.0 if channel is None or channel.time.size < 2 else float(np.median(np.diff(channel.time)))
    if channel is None or "rotation_rate" not in others:
        return _Turning(np.empty(0), None, None, None, 1.0, spacing)
    good = np.isfinite(channel.value) & _commanded(channel.time, held)
    time = channel.time[good]
    per_driver = _rate_per_driver(driven, others["rotation_rate"], edges)
    return _Turning(time, *binned(time, channel.value[good], edges), per_driver, spacing)


def _filled(recording: Recording, driver: Channel, held: Held, edges: Floats, time: Floats, force: Floats) -> History:
    _, whole, _ = binned(time, force, edges)
    time, force = _clear_of_jumps(recording, time, force)
    mean, count, sampled = untorn(binned(time, force, edges), whole)
    within = _within(time, force, edges, mean)
    driven = held.mean(edges)
    others, begun_error = warmed(recording, edges, driven, _explaining(recording, driver, held, edges, driven))
    inside = (time >= edges[0]) & (time < edges[-1])
    turning = _turning(recording, others, held, driven, edges)
    history = History(
        recording_id=recording.recording_id,
        driver_quantity=held.quantity,
        edges=edges,
        driver=driven,
        excess=held.excess(edges),
        thrust=mean,
        count=count,
        sampled=sampled,
        within=within,
        tick=max(float(np.median(np.diff(held.time))), 1e-6) if held.time.size > 1 else 1.0,
        driver_noise=held.noise,
        level_errors=_level_errors(held, edges),
        ticks=(held.time, held.value) if held.stepwise else None,
        sample_time=time[inside],
        sample_thrust=force[inside],
        rate_time=turning.time,
        rate=turning.rate,
        begun_error=begun_error,
        rate_count=turning.count,
        rate_sampled=turning.sampled,
        others=others,
        quanta={q: step for q in others if (step := step_of(recording.first_of(q)))},
        coarse={q: hidden for q in others if (hidden := coarseness(recording.first_of(q), others[q]))},
        rate_per_driver=turning.per_driver,
        spacing=float(np.median(np.diff(time))),
        jitter=jitter_of(time),
        delay_std=_delay_std(recording, driver),
        converter=_converter(recording),
        cell=_cell(recording),
        rate_spacing=turning.spacing,
        static=_is_table(held, time.size),
    )
    return with_leads(history, None if held.measured is None else held.measured.at(history.thrust_samples.time))


def _level_errors(held: Held, edges: Floats) -> Floats:
    """(M, k) of each level at which a measured driver stood still: the error of its mean, which all of it shares."""
    middle = 0.5 * (edges[1:] + edges[:-1])
    levels = () if held.measured is None else held.measured.levels
    if not 0 < len(levels) <= MOST_LEVELS:
        return np.empty((middle.size, 0))
    columns = [np.where((middle >= v.begun) & (middle <= v.ended), v.error, 0.0) for v in levels]
    return np.column_stack(columns)


def _rate_per_driver(driven: Floats, rate: Floats, edges: Floats) -> float:
    """Weighted median of rate over driver in the second half of each level that was held, or of everything."""
    dt = np.diff(edges)
    size = float(np.max(np.abs(driven), initial=0.0))
    new = np.abs(np.diff(driven, prepend=np.nan)) > CHANGED * size
    new[0] = True
    starts = np.flatnonzero(new)
    which = np.searchsorted(starts, np.arange(dt.size), side="right") - 1
    begun, ended = edges[starts][which], np.append(edges[starts[1:]], edges[-1])[which]
    held = (edges[:-1] > 0.5 * (begun + ended)) & (ended - begun > policy.prepare.STEADY_LEVEL)
    weight = driven**2 * dt * held
    if not weight.any():
        weight = driven**2 * dt
    at = np.flatnonzero(weight)
    if at.size == 0:
        return 1.0
    ratio = rate[at] / driven[at]
    order = np.argsort(ratio)
    total = np.cumsum(weight[at][order])
    return float(ratio[order[np.searchsorted(total, 0.5 * total[-1])]]) or 1.0


def _explaining(recording: Recording, driver: Channel, held: Held, edges: Floats, driven: Floats) -> dict[str, Floats]:
    """Quantity -> (M,) of what terms and tests may look at beside the driver."""
    middle = 0.5 * (edges[1:] + edges[:-1])
    out: dict[str, Floats] = {}
    for quantity in FOLLOWED:
        channel = recording.first_of(quantity)
        if channel is None or channel is driver:
            continue
        if quantity == "bus_voltage":
            values = supply(channel, held, middle, driven, np.diff(edges))
        elif quantity == "torque":
            values = torque(channel, held, edges, driven)
        else:
            values = followed(channel, middle)
        if values is not None:
            out[quantity] = values
    neighbour = neighbour_at(recording, middle)
    if neighbour is not None:
        out["neighbour_thrust"] = neighbour
    return out


def _is_table(held: Held, samples: int) -> bool:
    """Levels held for long with hardly a sample each: a table of levels, not a course of time."""
    changes = held.time[np.concatenate([[True], np.diff(held.value) != 0])]
    if not held.stepwise or changes.size < 2 or samples > policy.prepare.TABLE_SAMPLES * changes.size:
        return False
    return float(np.median(np.diff(changes))) >= policy.prepare.TABLE_DWELL
