"""What of a recording goes into a thrust fit: points of holds or even samples, with the reason when nothing can."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.calibration.curve import Curve, curve_of
from identification.estimation.even_noise import MIN_SAMPLES
from identification.recording import Channel, Floats, Recording, calibration_text
from identification.steady_state.points import FALLBACK, Points, find_windows, reduce_to_points, voltage_channel
from identification.steady_state.steady import settled_estimates

REST_SHARE = 0.05
"""Slower than this share of the fastest rotation counts as rest."""
SIGN_SHARE = 0.2
"""Thrust above this share of the largest has a direction."""
MIN_SIDE = 0.05
"""Each direction must hold this share of the samples at speed."""
MOVING = 2.0
"""A flow counts as one when it is this many times the noise of its sensor."""


@dataclass(frozen=True, slots=True)
class Unusable:
    """A sentence for the operator: which recording, what was expected, what came."""

    reason: str


@dataclass(frozen=True, eq=False)
class Flow:
    """Velocity of advance, m/s: at each thrust sample (n,) and, as a mean over it, at each point (k,)."""

    samples: Floats
    points: Floats | None
    moves: bool
    """It is more than its sensor's noise about zero."""


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
    flow: Flow | None = None
    level_std: Floats | None = None
    """Standard error of each point's voltage or rate (k,) when it was measured; None for a command."""
    calibration: str = ""
    """Which cell under which calibration: recordings that agree in it share the error of its gain."""
    curve: Curve | None = None
    """By which the thrust was read, with its covariance; None: the calibration says `gain_std` at most."""


def gain_std(thrust: Channel) -> float:
    """`gain_std` of the calibration; 0 when it is absent or no number.

    >>> gain_std(Channel("f", "cell", "thrust", "N", np.zeros(1), np.zeros(1), calibration={"gain_std": 0.0005}))
    0.0005
    """
    found = thrust.calibration.get("gain_std", 0.0)
    good = isinstance(found, int | float) and np.isfinite(found) and found >= 0
    return float(found) if good and isinstance(found, int | float) else 0.0


def curve_behind(thrust: Channel) -> Curve | None:
    """The curve of `rig calibrate` that the values went through; None where there is none, or none that is whole."""
    facts = thrust.calibration.get("curve")
    try:
        return None if facts is None else curve_of(facts)
    except ValueError:
        return None  # written by who knows whom: its `gain_std` still counts


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


def calibration_of(thrust: Channel) -> str:
    """The cell and the facts of its calibration as one text; its role in the recording is no part of it.

    >>> none, facts = np.zeros(1), {"gain_std": 0.1, "role": "primary"}
    >>> calibration_of(Channel("thrust", "cell", "thrust", "N", none, none, calibration=facts))
    'cell/thrust {"gain_std": 0.1}'
    """
    return calibration_text(thrust.stream, thrust.name, thrust.calibration)


def flow_of(recording: Recording, times: Floats, points: Points | None) -> Flow | None:
    """Flow at `times` (n,) and over the windows of `points`; None when none was recorded. Ends are held.

    Noise of the sensor: from differences of neighbouring rows, which a slow flow does not touch.
    """
    channel = recording.first_of("flow_speed")
    good = np.isfinite(channel.value) if channel is not None else np.zeros(0, dtype=np.bool_)
    if channel is None or not good.any():
        return None
    t, u = channel.time[good], channel.value[good]
    samples = np.interp(times, t, u)
    noise = float(np.sqrt(np.mean(np.diff(u) ** 2) / 2)) if u.size > 1 else 0.0
    power = float(np.sqrt(np.mean(samples**2)))
    means = None
    if points is not None:
        windows = [(point.thrust.t_start, point.thrust.t_end) for point in points.points]
        means = np.array([_mean_flow(t, u, *window) for window in windows])
    return Flow(samples, means, power > MOVING * noise and power > 0)


def _mean_flow(t: Floats, u: Floats, t_start: float, t_end: float) -> float:
    inside = u[(t >= t_start) & (t <= t_end)]
    return float(inside.mean()) if inside.size else float(np.interp((t_start + t_end) / 2, t, u))


def measured_levels(recording: Recording, source: Channel, points: Points) -> tuple[Points, Floats]:
    """Points at the level that a measured voltage or rate settles to in their holds, and its standard error (k,).

    A thrust that is still settling is extrapolated to where it goes; the rate beside it must be too.
    """
    kept: list[tuple[int, tuple[Floats, Floats]]] = []
    thrust = recording.first_of("thrust")
    windows = find_windows(recording, source, thrust) if thrust is not None else ()
    for at, point in enumerate(points.points):
        e = point.thrust
        span = next(((w.t_start, w.t_end) for w in windows if w.t_start <= e.t_start and e.t_end <= w.t_end), None)
        low, high = span or (e.t_start, float(np.nextafter(e.t_end, np.inf)))
        time, value = source.window(low, high)
        good = np.isfinite(value)
        if good.sum() >= MIN_SAMPLES:
            kept.append((at, (time[good], value[good])))
    levels, std = points.voltage, np.zeros(len(points.points))
    for (at, _), found in zip(kept, settled_estimates([samples for _, samples in kept]), strict=True):
        if np.isfinite(found.mean) and np.isfinite(found.std_error):
            levels[at], std[at] = found.mean, found.std_error
    moved = tuple(replace(point, voltage=float(v)) for point, v in zip(points.points, levels, strict=True))
    return replace(points, points=moved), std


def _refusal(recording: Recording, who: str) -> Unusable | None:
    """What no fit can be made of, before any number is looked at."""
    if recording.kind == "calibration":
        return Unusable(f"{who} is a calibration of a load cell with dead weights; `rig fit` takes runs of a thruster")
    if recording.kind == "vehicle":
        return Unusable(f"{who} is a vehicle trial; `rig fit` takes tunnel or bollard runs of one thruster")
    of = sorted({channel.thruster for channel in recording.all_of("thrust") if channel.thruster})
    if len(of) > 1:
        return Unusable(f"{who} holds the thrust of {' and '.join(of)}; expected one thruster in one recording")
    return None


def _stuck(thrust: Floats, who: str) -> Unusable | None:
    if thrust.size > 1 and float(np.ptp(thrust)) == 0.0:
        return Unusable(
            f"{who}: the thrust is {thrust[0]:g} N in all of {thrust.size} samples, it has no variance; "
            "ask whether the load cell was alive"
        )
    return None


def prepare(recording: Recording, voltage: str = "command_voltage") -> Run | Unusable:
    """Select channels, drop what is not a number, reduce holds to points."""
    who = f"recording {recording.source or recording.recording_id}"
    refused = _refusal(recording, who)
    if refused is not None:
        return refused
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
    stuck = _stuck(thrust.value[good], who)
    if stuck is not None:
        return stuck
    quantity = source.quantity or voltage
    points, level_std = reduce_to_points(recording, source, thrust), None
    if points is not None and quantity != "command_voltage":
        points, level_std = measured_levels(recording, source, points)
    return Run(
        recording.recording_id,
        recording.thruster,
        quantity,
        at[good],
        thrust.value[good],
        int(good.size - good.sum()),
        points,
        gain_std(thrust),
        thrust.noise_std if thrust.noise_std is not None and thrust.noise_std > 0 else None,
        quantity == "rotation_rate" and lacks_sign(at[good], thrust.value[good]),
        flow_of(recording, thrust.time[good], points),
        level_std,
        calibration_of(thrust),
        curve_behind(thrust),
    )
