"""From a vehicle's recording to a run: measured motion, and volts of every thruster on an even grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.mismatch import policy
from identification.mismatch.noise.covariance import Rows
from identification.mismatch.prepare.preparing import Refusal
from identification.mismatch.vehicle.setup import ANY_AXIS, Stated, VehicleSetup, thrust_known
from identification.physics.vehicle.term import Scale, VehicleContext
from identification.recording import Channel, Floats, Recording
from identification.vehicle.efficiency import Installation
from identification.vehicle.trials import response_of, thruster_volts

LOOKS = 2
"""At the command in each step of the grid."""
FINEST, COARSEST = 0.02, 0.2
"""s, steps of the grid: vehicles have time constants of seconds."""
MOST_ROWS = 4000
"""Of one run; faster recordings are averaged."""


@dataclass(frozen=True, eq=False)
class Run:
    """One recording on one axis: n rows of measured motion, g steps of the grid, T thrusters."""

    recording_id: str
    quantity: str
    """`position` (also depth and heading) or `speed`."""
    time: Floats
    """(n,) s."""
    response: Floats
    """(n,) m, rad, m/s or rad/s."""
    rows: Rows
    start: float
    """s, beginning of the grid."""
    arms: Floats
    """(T,)"""
    basis: tuple[tuple[int, ...], ...]
    """Of each thruster: where its coefficients stand among all."""
    moment: VehicleContext
    installation: Installation

    @property
    def steps(self) -> int:
        return int(self.moment.volts.shape[1])

    @property
    def edges(self) -> Floats:
        """(g + 1,) s."""
        return np.asarray(self.start + self.moment.step * np.arange(self.steps + 1), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Prepared:
    """All runs, and the sizes that bounds are made of."""

    runs: tuple[Run, ...]
    scale: Scale
    installation: Installation
    """Thrusters that push along the axis."""
    mass: Stated | None


def prepare(
    recordings: Sequence[Recording], installation: Installation, axis: str, setup: VehicleSetup
) -> Prepared | Refusal:
    """Every recording on the axis; a Refusal says what is wrong with the first that cannot be used."""
    pushing = _pushing(installation, axis)
    if isinstance(pushing, Refusal):
        return pushing
    measured = [_measured(one, axis) for one in recordings]
    for found in measured:
        if isinstance(found, Refusal):
            return found
    channels = [found for found in measured if not isinstance(found, Refusal)]
    if len({quantity for quantity, _, _ in channels}) > 1:
        return Refusal("some recordings have a position and others a speed; diagnose those with one kind of motion")
    ballasts = tuple(dict.fromkeys(setup.ballast.get(one.recording_id, one.recording_id) for one in recordings))
    mass = setup.mass.get(ANY_AXIS, setup.mass.get(axis))
    grids = [_volts(one, pushing, time) for one, (_, time, _) in zip(recordings, channels, strict=True)]
    for grid in grids:
        if isinstance(grid, Refusal):
            return grid
    volts = [grid for grid in grids if not isinstance(grid, Refusal)]
    scale = _scale(recordings, pushing, axis, channels, volts, mass, ballasts)
    if isinstance(scale, Refusal):
        return scale
    runs = tuple(
        _run(one, pushing, axis, channel, grid, scale, setup.ballast.get(one.recording_id, one.recording_id))
        for one, channel, grid in zip(recordings, channels, volts, strict=True)
    )
    return Prepared(runs, scale, pushing, mass)


def _pushing(installation: Installation, axis: str) -> Installation | Refusal:
    """Those thrusters that have an arm on the axis, and their interactions."""
    kept = tuple(t for t in installation.thrusters if t.arms.get(axis, 0.0) != 0)
    if not kept:
        return Refusal(f"no thruster of the installation pushes along {axis}")
    names = [name for t in kept for name in t.names]
    at = [installation.names.index(name) for name in names]
    there = {t.name for t in kept}
    inter = tuple(
        i for i in installation.interactions if there & set(i.thrusters) and set(i.thrusters) | set(i.partner) <= there
    )
    return Installation(kept, installation.cov[np.ix_(at, at)], inter)


Measured = tuple[str, Floats, Floats]
"""quantity, time, value"""


def _measured(recording: Recording, axis: str) -> Measured | Refusal:
    name = recording.source or recording.recording_id
    channel = response_of(recording, axis)
    if channel is None:
        return Refusal(f"{name} has no position, depth, heading or speed of {axis}: there is no motion to explain")
    time, value = _finite(channel)
    if time.size < policy.vehicle.MOTION_SAMPLES:
        return Refusal(
            f"{name} has {time.size} finite samples of {channel.name}; "
            f"at least {policy.vehicle.MOTION_SAMPLES} are needed"
        )
    if float(np.ptp(value)) == 0:
        return Refusal(f"{name}: {channel.name} is {value[0]:g} throughout; the vehicle did not move")
    return "speed" if channel.quantity == "speed" else "position", time, value


def _finite(channel: Channel) -> tuple[Floats, Floats]:
    good = np.isfinite(channel.value) & np.isfinite(channel.time)
    time, value = channel.time[good], channel.value[good]
    kept = np.diff(time, prepend=-np.inf) > 0
    return time[kept], value[kept]


@dataclass(frozen=True, eq=False)
class _Grid:
    start: float
    step: float
    volts: Mapping[str, Floats]
    """(g, S) of each thruster."""


def _volts(recording: Recording, installation: Installation, time: Floats) -> _Grid | Refusal:
    name = recording.source or recording.recording_id
    span = float(time[-1] - time[0])
    step = min(max(float(np.median(np.diff(time))), FINEST, span / 20000), COARSEST)
    count = max(int(np.ceil(span / step - 1e-9)), 1)
    fine = time[0] + (np.arange(count * LOOKS) + 0.5) * step / LOOKS
    for channel in recording.all_of("command_voltage"):
        if not np.all(np.isfinite(channel.value)):
            lost = float(channel.time[int(np.argmin(np.isfinite(channel.value)))])
            return Refusal(f"{name}: {channel.name} is missing from {lost:g} s on: the force is not known there")
    volts = thruster_volts(recording, installation, fine)
    if not isinstance(volts, dict):
        return Refusal(volts.reason)
    if all(np.ptp(V) == 0 and V[0] == 0 for V in volts.values()):
        return Refusal(f"{name}: every command is 0 V throughout: nothing drives the vehicle")
    return _Grid(float(time[0]), step, {k: V.reshape(count, LOOKS) for k, V in volts.items()})


def _scale(
    recordings: Sequence[Recording],
    installation: Installation,
    axis: str,
    measured: Sequence[Measured],
    grids: Sequence[_Grid],
    mass: Stated | None,
    ballasts: tuple[str, ...],
) -> Scale | Refusal:
    force = volts = 0.0
    for grid in grids:
        push = np.zeros(next(iter(grid.volts.values())).shape)
        for thruster in installation.thrusters:
            V = grid.volts[thruster.name]
            volts = max(volts, float(np.abs(V).max()))
            thrust = thruster.coefficients @ thruster.basis(V.ravel())
            push = push + thruster.arms[axis] * thrust.reshape(V.shape)
        force = max(force, float(np.abs(push).max()))
    if force == 0:
        return Refusal(f"no command pushes along {axis}: nothing drives the vehicle there")
    if max(float(np.ptp(V)) for grid in grids for V in grid.volts.values()) == 0 and len(grids) == 1:
        return Refusal("the command is constant: what is left out shows in how the motion changes with it; vary it")
    known = thrust_known(installation)
    spacing = min(grid.step for grid in grids)
    return Scale(
        axis=axis,
        volts=volts,
        force=force,
        speed=max(_speed(*one) for one in measured),
        length=max(_length(*one) for one in measured),
        duration=max(float(t[-1] - t[0]) for _, t, _ in measured),
        interval=spacing,
        mass=mass.value if mass is not None else None,
        thrust_known=known,
        heading_spread=_spread([_heading(one, t) for one, (_, t, _) in zip(recordings, measured, strict=True)]),
        ballasts=ballasts if axis == "heave" else (),
        per_kg=mass is None and not known,
    )


def _speed(quantity: str, time: Floats, value: Floats) -> float:
    """Largest speed: of a position, over a fiftieth of the run, so that noise does not count."""
    if quantity == "speed":
        return float(np.quantile(np.abs(value), 0.99))
    width = max((time[-1] - time[0]) / 50, 4 * float(np.median(np.diff(time))))
    later = np.interp(time + width, time, value)
    inside = time + width <= time[-1]
    return float(np.abs(later - value)[inside].max() / width) if inside.any() else float(np.ptp(value))


def _length(quantity: str, time: Floats, value: Floats) -> float:
    if quantity == "position":
        return float(np.abs(value - value[0]).max())
    way = np.concatenate([[0.0], np.cumsum(0.5 * (value[1:] + value[:-1]) * np.diff(time))])
    return float(np.abs(way).max())


def _heading(recording: Recording, time: Floats) -> Floats:
    """(n,) rad at `time`; NaN where it was not recorded."""
    channel = recording.first_of("heading")
    if channel is None:
        return np.full(time.size, np.nan)
    t, psi = _finite(channel)
    return np.interp(time, t, psi) if t.size else np.full(time.size, np.nan)


def _spread(headings: Sequence[Floats]) -> float:
    """1 - length of the mean direction: 0 at one heading, 1 all round."""
    psi = np.concatenate(headings)
    psi = psi[np.isfinite(psi)]
    return float(1 - np.hypot(np.cos(psi).mean(), np.sin(psi).mean())) if psi.size else float("nan")


def _run(
    recording: Recording,
    installation: Installation,
    axis: str,
    measured: Measured,
    grid: _Grid,
    scale: Scale,
    ballast: str,
) -> Run:
    quantity, time, value = measured
    time, value, count, width = _averaged(time, value)
    names = [t.name for t in installation.thrusters]
    middle = np.asarray(
        grid.start + (np.arange(next(iter(grid.volts.values())).shape[0]) + 0.5) * grid.step, dtype=np.float64
    )
    active = {}
    for name in installation.etas:
        on = [
            np.any([i.active(t, grid.volts) for i in installation.interactions if i.name == name], axis=0)
            for t in names
        ]
        active[name] = np.array(on)
    at, ends = [], 0
    for thruster in installation.thrusters:
        at.append(tuple(range(ends, ends + len(thruster.names))))
        ends += len(thruster.names)
    heading = np.full(middle.size, np.nan) if axis == "yaw" else _heading(recording, middle)
    moment = VehicleContext(
        scale,
        grid.step,
        np.array([grid.volts[name] for name in names]),
        active,
        heading,
        ballast,
        recording.recording_id,
    )
    rows = Rows(time, count, np.ones(time.size), width)
    arms = np.array([t.arms[axis] for t in installation.thrusters])
    return Run(recording.recording_id, quantity, time, value, rows, grid.start, arms, tuple(at), moment, installation)


def _averaged(time: Floats, value: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Time, mean, number and width of rows: neighbours averaged until there are at most MOST_ROWS."""
    m = int(np.ceil(time.size / MOST_ROWS))
    spacing = float(np.median(np.diff(time)))
    if m == 1:
        one = np.ones(time.size)
        return time, value, one, spacing * one
    cuts = np.arange(0, time.size, m)
    count = np.diff(np.append(cuts, time.size)).astype(np.float64)
    return (
        np.add.reduceat(time, cuts) / count,
        np.add.reduceat(value, cuts) / count,
        count,
        spacing * count,
    )
