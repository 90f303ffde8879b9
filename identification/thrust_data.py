"""What of a recording goes into a thrust fit: points of holds or even samples, with the reason when nothing can."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.points import FALLBACK, Points, reduce_to_points, voltage_channel
from identification.recording import Channel, Floats, Recording

REST_SHARE = 0.05
"""Slower than this share of the fastest rotation counts as rest."""
SIGN_SHARE = 0.2
"""Thrust above this share of the largest has a direction."""
MIN_SIDE = 0.05
"""Each direction must hold this share of the samples at speed."""


@dataclass(frozen=True, slots=True)
class Unusable:
    """A sentence for the operator: which recording, what was expected, what came."""

    reason: str


@dataclass(frozen=True, eq=False)
class Run:
    """One recording made ready. `points` is None when it has no holds; the samples are always there."""

    recording_id: str
    thruster: str
    voltage_quantity: str
    voltage: Floats
    """V (rev/s when the quantity is `rotation_rate`) at each thrust sample, (n,)."""
    thrust: Floats
    """N, (n,), NaN-free."""
    skipped: int
    """Thrust samples left out: not a number, infinite, or before the first voltage."""
    points: Points | None
    gain_std: float
    """Relative standard uncertainty of the cell's calibration; 0 when not stated."""
    noise_std: float | None
    unsigned: bool = False
    """The rotation rate never turns negative while the thrust changes sign: the tachometer does not tell direction."""


def gain_std(thrust: Channel) -> float:
    """`gain_std` of the calibration; 0 when it is absent or no number.

    >>> gain_std(Channel("f", "cell", "thrust", "N", np.zeros(1), np.zeros(1), calibration={"gain_std": 0.0005}))
    0.0005
    """
    found = thrust.calibration.get("gain_std", 0.0)
    good = isinstance(found, int | float) and np.isfinite(found) and found >= 0
    return float(found) if good and isinstance(found, int | float) else 0.0


def voltage_at(channel: Channel, times: Floats) -> Floats:
    """A command is held until its next row; a measured voltage runs straight between its rows. NaN where unknown.

    >>> seen = Channel("u", "motor", "motor_voltage", "V", np.array([0.0, 1.0]), np.array([0.0, 4.0]))
    >>> voltage_at(seen, np.array([0.5, 2.0])).tolist()
    [2.0, nan]
    """
    held = channel.held_at(times)
    good = np.isfinite(channel.value)
    if channel.quantity == "command_voltage" or good.sum() < 2:
        return held
    straight = np.interp(times, channel.time[good], channel.value[good], left=np.nan, right=np.nan)
    out: Floats = np.where(np.isfinite(held), straight, np.nan)
    return out


def lacks_sign(rate: Floats, thrust: Floats) -> bool:
    """Does thrust (n,) go both ways while the rotation rate (n,) keeps one sign? Zero thrust is that of slow turning.

    >>> n = np.array([0.0, 5.0, 10.0, 0.0, 5.0, 10.0])
    >>> force = np.array([3.0, 5.0, 11.0, 3.0, 1.0, -5.0])
    >>> lacks_sign(n, force), lacks_sign(np.copysign(n, force - 3), force), lacks_sign(n, abs(force))
    (True, False, False)
    """
    most = float(np.abs(rate).max())
    if most == 0 or min(-float(rate.min()), float(rate.max())) > REST_SHARE * most:
        return False
    slow = np.abs(rate) < REST_SHARE * most
    driven = thrust[np.abs(rate) > 0.5 * most] - (float(np.median(thrust[slow])) if slow.any() else 0.0)
    large = SIGN_SHARE * float(np.abs(driven).max())
    return bool(np.mean(driven > large) > MIN_SIDE and np.mean(driven < -large) > MIN_SIDE)


def prepare(recording: Recording, voltage: str = "command_voltage") -> Run | Unusable:
    """Select channels, drop what is not a number, reduce holds to points."""
    who = f"recording {recording.source or recording.recording_id}"
    if recording.kind == "vehicle":
        return Unusable(f"{who} is a vehicle trial; `rig fit` takes tunnel or bollard runs of one thruster")
    thrust = recording.first_of("thrust")
    if thrust is None:
        return Unusable(f"{who} has no channel of quantity thrust; without a measured force nothing can be fitted")
    source = voltage_channel(recording, voltage)
    if source is None:
        wanted = " nor ".join(FALLBACK) if voltage == FALLBACK[0] else voltage
        return Unusable(f"{who} has no {wanted} channel with numbers in it; the thrust is to be explained by one")
    at = voltage_at(source, thrust.time)
    good = np.isfinite(thrust.value) & np.isfinite(at)
    if not good.any():
        return Unusable(f"{who} has no thrust sample at a known {source.quantity}: all of {good.size} are missing")
    quantity = source.quantity or voltage
    return Run(
        recording.recording_id,
        recording.thruster,
        quantity,
        at[good],
        thrust.value[good],
        int(good.size - good.sum()),
        reduce_to_points(recording, source, thrust),
        gain_std(thrust),
        thrust.noise_std if thrust.noise_std is not None and thrust.noise_std > 0 else None,
        quantity == "rotation_rate" and lacks_sign(at[good], thrust.value[good]),
    )
