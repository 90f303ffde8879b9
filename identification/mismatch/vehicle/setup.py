"""What is known of a vehicle before its recordings are diagnosed: thrusters, mass, ballast, which axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from identification.mismatch import policy
from identification.mismatch.prepare.preparing import Refusal
from identification.recording import Recording
from identification.vehicle.efficiency import Installation, Thruster
from identification.vehicle.trials import dominant_axis

ANY_AXIS = ""
"""Key of a mass that holds for the axis that is diagnosed, whichever that is."""


@dataclass(frozen=True, slots=True)
class Stated:
    """A number from elsewhere; `std` 0: exact."""

    value: float
    std: float = 0.0


@dataclass(frozen=True, eq=False)
class VehicleSetup:
    """None of it is needed; what is not known is fitted, or said to be not determined."""

    installation: Installation | None = None
    """Thrusters with their models and where they push; None: each pushes straight along the measured axis."""
    mass: Mapping[str, Stated] = field(default_factory=dict)
    """axis, or ANY_AXIS -> stated inertia, kg (yaw: kg.m^2)."""
    ballast: Mapping[str, str] = field(default_factory=dict)
    """recording id -> ballast, heave; a recording that is not named is a ballast of its own."""
    axis: str = ""
    """Which axis is diagnosed; empty: the one that all recordings drive."""
    axes: Mapping[str, str] = field(default_factory=dict)
    """recording id -> axis, where the campaign says so."""
    current: bool = True
    """Whether there may be a current: false in a tank."""


def thrust_known(installation: Installation) -> bool:
    """Whether the thrusters' models are measured ones: a stated 1 +- 10 N/V^2 is none."""
    values, std = np.abs(installation.coefficients), np.sqrt(np.diag(installation.cov))
    return bool(np.all(std <= policy.vehicle.THRUST_KNOWN * np.maximum(values, 1e-300) + 1e-300))


def straight_ahead(recordings: Sequence[Recording]) -> Installation | Refusal:
    """Thrusters that the recordings' own commands name, each pushing straight, of unknown strength."""
    arms: dict[str, dict[str, float]] = {}
    for recording in recordings:
        moving = {c.axis for c in recording.channels if c.quantity in {"position", "speed"}} - {None}
        moving |= {"heave" for c in recording.channels if c.quantity == "depth"}
        only = next(iter(moving)) if len(moving) == 1 else None
        for channel in recording.all_of("command_voltage"):
            axis = channel.axis or only
            if axis is not None and np.any(np.nan_to_num(channel.value) != 0):
                arms.setdefault(channel.thruster or "thrusters", {})[axis] = 1.0
    if not arms:
        return Refusal(
            "the recordings do not tell along which axis each thruster pushes: give an installation file, or commands "
            "with the attributes thruster and axis"
        )
    thrusters = tuple(Thruster(name, np.array([1.0]), where) for name, where in arms.items())
    return Installation(thrusters, 100.0 * np.eye(len(thrusters)))


def driven_axis(recording: Recording, installation: Installation, setup: VehicleSetup) -> str | None:
    """What the campaign says, else the axis that the commands push hardest; None: nothing is commanded."""
    return setup.axes.get(recording.recording_id) or dominant_axis(recording, installation)


def axis_of(recordings: Sequence[Recording], installation: Installation, setup: VehicleSetup) -> str | Refusal:
    """The axis that all of them drive."""
    if setup.axis:
        return setup.axis
    driven: dict[str, list[str]] = {}
    for recording in recordings:
        axis = driven_axis(recording, installation, setup)
        name = recording.source or recording.recording_id
        if axis is None:
            return Refusal(f"{name}: no thruster of the installation is commanded in it: nothing drives the vehicle")
        driven.setdefault(axis, []).append(name)
    if len(driven) > 1:
        told = "; ".join(f"{axis} in {len(names)}" for axis, names in driven.items())
        return Refusal(f"the recordings drive several axes ({told}); diagnose one axis at a time")
    return next(iter(driven))
