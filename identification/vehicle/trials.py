"""Vehicle recordings made ready: constant-velocity runs with an honest velocity, and trials to simulate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.recording import Channel, Floats, Recording
from identification.thruster.thrust_data import Unusable
from identification.vehicle.efficiency import AXES, Force, Installation, force_on
from identification.velocity.constant_velocity import LEAST_SAMPLES, Line, straight_line, velocities


@dataclass(frozen=True, eq=False)
class SteadyRun:
    """One run at constant command and constant velocity."""

    recording_id: str
    axis: str
    velocity: float
    """m/s (yaw: rad/s), slope of the straight line through the position (section 4.2.3)."""
    std: float
    """Honest under autocorrelated position noise, all runs lending each other degrees of freedom."""
    heading: float
    """rad, mean; NaN when it was not recorded."""
    force: Force
    """One instant."""
    straight: bool
    """False: curved even after the most that may be cut."""
    t_start: float
    t_end: float


@dataclass(frozen=True, eq=False)
class Trial:
    """One recording on one axis, to be simulated: n measurements, force on a grid of g even steps."""

    recording_id: str
    axis: str
    quantity: str
    """`position` (also depth and heading) or `speed`."""
    time: Floats
    """(n,) s of the measurements."""
    response: Floats
    """(n,) m, rad, m/s or rad/s."""
    heading: float
    start: float
    """s, start of the grid."""
    step: float
    """s of the grid."""
    force: Force
    """Mean over each step of the grid, (T, g)."""


def thruster_volts(recording: Recording, installation: Installation, time: Floats) -> dict[str, Floats] | Unusable:
    """Voltage (n,) of every thruster at `time`; a thruster without a command stays at 0. A command is held."""
    found = {c.thruster: c for c in recording.all_of("command_voltage") if c.thruster is not None}
    shared = [c for c in recording.all_of("command_voltage") if c.thruster is None]
    volts = {}
    for thruster in installation.thrusters:
        others = (c for c in shared if c.axis in thruster.arms)
        channel: Channel | None = found.get(thruster.name) or next(others, None)
        volts[thruster.name] = np.zeros(time.size) if channel is None else np.nan_to_num(channel.held_at(time))
    if not any(t.name in found for t in installation.thrusters) and not shared:
        names = ", ".join(thruster.name for thruster in installation.thrusters)
        return Unusable(f"{_who(recording)} has no command_voltage of any of the thrusters {names}")
    return volts


def response_of(recording: Recording, axis: str) -> Channel | None:
    """What was measured on an axis: position (depth for heave, heading for yaw) before speed."""
    if axis == "yaw":
        wanted = [recording.all_of("heading"), [c for c in recording.all_of("speed") if c.axis == "yaw"]]
    else:
        wanted = [
            [c for c in recording.all_of(q) if c.axis == axis or (q == "depth" and axis == "heave" and c.axis is None)]
            for q in ("depth", "position", "speed")
        ]
    return next((channel for group in wanted for channel in group), None)


AS_GOOD = 0.5
"""Share of the hardest push that an axis needs to be what a trial was for, because its motion alone was measured."""


def dominant_axis(recording: Recording, installation: Installation) -> str | None:
    """The axis on which the commands push hardest, as a share of what its thrusters give at the largest voltage.

    Thrusters at an angle push along several axes: one whose motion was measured comes before one whose was not. None
    when nothing was commanded. Used where a campaign does not say what each trial was for.
    """
    times = np.unique(np.concatenate([c.time for c in recording.all_of("command_voltage")] or [np.zeros(0)]))
    volts = thruster_volts(recording, installation, times) if times.size else Unusable("")
    if isinstance(volts, Unusable):
        return None
    shares = {axis: _pushed(installation, axis, volts) for axis in AXES}
    most = max(shares.values())
    if most == 0:
        return None
    seen = [axis for axis in AXES if shares[axis] >= AS_GOOD * most and response_of(recording, axis) is not None]
    return max(seen or AXES, key=lambda axis: round(shares[axis], 9))


def _pushed(installation: Installation, axis: str, volts: Mapping[str, Floats]) -> float:
    """Root mean square force as a share of all that the thrusters give on the axis at the largest voltage."""
    top = max(float(np.abs(V).max()) for V in volts.values())
    most = sum(
        float(np.abs(t.coefficients @ t.basis(np.array([top]))).max()) * abs(t.arms.get(axis, 0.0))
        for t in installation.thrusters
    )
    return float(np.sqrt(np.mean(force_on(installation, axis, volts).nominal() ** 2))) / most if most else 0.0


def _who(recording: Recording) -> str:
    return f"recording {recording.source or recording.recording_id}"


def _finite(channel: Channel, t_start: float, t_end: float) -> tuple[Floats, Floats]:
    time, value = channel.window(t_start, t_end)
    good = np.isfinite(value)
    return time[good], value[good]


def _heading(recording: Recording, t_start: float, t_end: float) -> float:
    channel = recording.first_of("heading")
    _, value = _finite(channel, t_start, t_end) if channel is not None else (None, np.zeros(0))
    return float(value.mean()) if value.size else float("nan")


def holds(recording: Recording) -> list[tuple[float, float]]:
    """Steps of phase `hold`; without a table, spans without a change of any command."""
    marked = [(s.t_start, s.t_end) for s in recording.steps if s.phase == "hold" and s.t_end > s.t_start]
    if marked or recording.steps:
        return marked
    edges = [0.0, recording.duration]
    for channel in recording.all_of("command_voltage"):
        moved = np.flatnonzero(np.diff(channel.value) != 0) + 1
        edges += [*channel.time[:1].tolist(), *channel.time[moved].tolist()]
    ordered = np.unique(edges)
    return list(zip(ordered[:-1].tolist(), ordered[1:].tolist(), strict=True))


@dataclass(frozen=True, eq=False)
class _Span:
    """One hold of one recording."""

    recording: Recording
    sensor: float | None
    force: Force
    line: Line


def _spans(recordings: Sequence[Recording], installation: Installation, axis: str) -> list[_Span]:
    out = []
    for recording in recordings:
        channel = response_of(recording, axis)
        if channel is None or channel.quantity == "speed":
            continue
        for t_start, t_end in holds(recording):
            time, value = _finite(channel, t_start, t_end)
            volts = thruster_volts(recording, installation, np.array([0.5 * (t_start + t_end)]))
            if time.size >= LEAST_SAMPLES and time[-1] > time[0] and not isinstance(volts, Unusable):
                force = force_on(installation, axis, volts)
                out.append(_Span(recording, channel.noise_std, force, straight_line(time, value)))
    return out


def steady_runs(recordings: Sequence[Recording], installation: Installation, axis: str) -> tuple[SteadyRun, ...]:
    """Every constant-velocity run of these recordings on one axis; recordings that do not have the axis give none."""
    spans = _spans(recordings, installation, axis)
    forces = np.array([float(span.force.nominal()[0]) for span in spans])
    found = velocities([span.line for span in spans], forces, [span.sensor for span in spans])
    runs = []
    for span, (velocity, std) in zip(spans, found, strict=True):
        start, end = float(span.line.time[0]), float(span.line.time[-1])
        heading, name = _heading(span.recording, start, end), span.recording.recording_id
        if std > 0:
            runs.append(SteadyRun(name, axis, velocity, std, heading, span.force, span.line.straight, start, end))
    return tuple(runs)


def trial(
    recording: Recording, installation: Installation, axis: str, step: float = 0.2, sub: int = 8
) -> Trial | Unusable:
    """One recording on one axis, its force averaged over steps of `step` s (`sub` looks at the command in each)."""
    channel = response_of(recording, axis)
    if channel is None:
        return Unusable(f"{_who(recording)} has no position, depth, heading or speed of axis {axis}")
    time, value = _finite(channel, -np.inf, np.inf)
    if time.size < LEAST_SAMPLES:
        return Unusable(f"{_who(recording)} has {time.size} measurements of axis {axis}; {LEAST_SAMPLES} are needed")
    steps = int(np.ceil((time[-1] - time[0]) / step - 1e-9))
    fine = time[0] + (np.arange(steps * sub) + 0.5) * step / sub
    volts = thruster_volts(recording, installation, fine)
    if isinstance(volts, Unusable):
        return volts
    found = force_on(installation, axis, volts)
    mean = found.signal.reshape(len(found.coefficients), steps, sub).mean(axis=2)
    force = Force(found.coefficients, found.etas, mean, found.values)
    quantity = "speed" if channel.quantity == "speed" else "position"
    heading = _heading(recording, time[0], np.inf)
    return Trial(recording.recording_id, axis, quantity, time, value, heading, float(time[0]), step, force)


def ballast_of(recording_ids: Sequence[str], experiments: Mapping[str, str]) -> dict[str, str]:
    """Name of the buoyancy parameter of each recording: recordings of one ballast share one.

    >>> ballast_of(["a", "b", "c"], {"a": "light", "b": "light"})
    {'a': 'buoyancy[light]', 'b': 'buoyancy[light]', 'c': 'buoyancy[c]'}
    """
    return {name: f"buoyancy[{experiments.get(name, name)}]" for name in recording_ids}
