"""The guard: asked before every command whether the motor may go on. Pure: readings and time are arguments.

It trips on a limit, on an emergency stop, on a value that is too old, NaN or frozen, on its own lateness, on a dead
link, on a recorder that is gone or late, and on an operator who is gone. Whoever gets a Trip commands 0 V at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isnan
from typing import Literal, NamedTuple

from drivers.protocols import LinkHealth, Stream
from rig.campaign.config import LimitConfig

Source = Literal[
    "limit", "emergency_stop", "nan", "stale", "frozen", "rate", "corrupt", "late", "link", "recorder", "lease"
]

MIN_AGE = 0.2
"""s, shortest default sample age (docs/reliability.md, promise 7: within max(3 sample periods, 0.2 s))."""
MIN_LATENESS = 0.25
"""s, shortest tolerated lateness of a loop tick."""
LEAST_FROZEN = 2.0
"""s, shortest default time for which a driven channel may keep the very same value."""
FROZEN_TIMES = 20.0
"""Default: this many times the longest such time in its earlier data. Noise that changes a digit ten times a second all
the same for 2 s is not believed; a coarse digit that stood still for 3 s at rest is allowed a minute."""
UNSEEN_FROZEN = 10.0
"""s, default while the value has never changed at all, so that its noise says nothing."""


@dataclass(frozen=True, slots=True)
class Trip:
    """Why the motor must stop. `kind` `cut`: zero at once, no ramp."""

    cause: str
    """One sentence: who, what was allowed, what came."""
    source: Source
    time: float
    """s, clock of the readings."""
    channel: str = ""
    value: float | None = None
    limit: float | None = None
    kind: Literal["cut"] = "cut"


@dataclass(frozen=True, slots=True)
class Watch:
    """One channel under guard, defaults resolved. Values in the channel's unit, `max_age` in s."""

    channel: str
    unit: str
    max_age: float
    min: float | None = None
    max: float | None = None
    max_frozen: float | None = None
    """s; None: not judged. 0: by its earlier variation (`frozen_limit`)."""
    stops: bool = False
    """An emergency stop input: anything but 0 is pressed."""


class Latest(NamedTuple):
    """Newest value of a channel and its arrival in s; for how many s up to then it has been the very same."""

    value: float
    time: float
    same: float = 0.0
    longest: float | None = None
    """s, longest time of the very same value that ended with a change; None: it has never changed."""


@dataclass(frozen=True, slots=True)
class Recorder:
    """What the controller knows of the recorder process."""

    alive: bool
    age: float = 0.0
    """s since its last sign of life."""
    overrun: bool = False
    """True: its queue was full and rows would be lost."""


@dataclass(frozen=True, slots=True)
class Vitals:
    """What is no reading: the rig's own state in this tick. `now` and `started` in s on the clock of the readings."""

    now: float
    started: float
    """When guarding began; a channel may be silent until `grace` s later."""
    lateness: float = 0.0
    """s this tick is behind its schedule."""
    links: Mapping[str, LinkHealth] | None = None
    """By device name."""
    recorder: Recorder | None = None
    """None: nothing is recorded now."""
    lease_age: float | None = None
    """s since an operator said `I am here`; None: unattended, no lease asked for."""
    driven: float = 0.0
    """s for which the command has been other than 0 V without a break; a sensor may stand still at rest."""


@dataclass(frozen=True, slots=True)
class Allowances:
    """How long what may be late. All in s."""

    lateness: float = MIN_LATENESS
    grace: float = 2.0
    recorder_age: float = 12.0
    """A flush may block 10 s on a slow disk (docs/reliability.md, promise 18) while the queue holds the rows."""
    lease_age: float = 2.0
    """Four leases missed at two a second."""


def allowances(loop_rate: float) -> Allowances:
    """Allowances for a loop of `loop_rate` Hz: 5 periods of lateness, 0.25 s at least."""
    return Allowances(lateness=max(5 / loop_rate, MIN_LATENESS))


def watches(
    limits: Iterable[LimitConfig], streams: Iterable[Stream], essential: Iterable[str] = (), thrust: str = ""
) -> tuple[Watch, ...]:
    """Resolve configured limits against the bench's streams; `essential` channels are watched for age and NaN anyway.
    The `thrust` channel is watched for a frozen value as well, by its own earlier variation if nothing is configured;
    an emergency stop input always, whatever is configured.

    Channels are `<stream>.<channel>`. Raises ValueError naming a channel that no stream has.
    """
    channels = {f"{s.name}.{c.name}": (s, c) for s in streams for c in s.channels}
    known = {name: (c.unit, max(3 * s.period_s, MIN_AGE)) for name, (s, c) in channels.items()}
    stops = [name for name, (_, c) in channels.items() if c.quantity == "emergency_stop"]
    wanted = {limit.channel: limit for limit in limits}
    wanted = {channel: wanted.get(channel, LimitConfig(channel)) for channel in (*wanted, *essential, *stops)}
    for channel in wanted:
        if channel not in known:
            raise ValueError(f"no device gives a channel {channel}; there are {', '.join(sorted(known))}")
    learned = {thrust: 0.0}
    return tuple(
        Watch(
            channel,
            known[channel][0],
            known[channel][1] if c.max_age is None else c.max_age,
            c.min,
            c.max,
            learned.get(channel) if c.max_frozen is None else c.max_frozen,
            channel in stops,
        )
        for channel, c in wanted.items()
    )


def check(
    watched: Iterable[Watch], latest: Mapping[str, Latest | None], vitals: Vitals, allowed: Allowances
) -> Trip | None:
    """First reason to stop, or None. Limits come first: they name what happened to the bench, the rest to the rig."""
    readings = (assess(watch, latest.get(watch.channel), vitals, allowed) for watch in watched)
    return next((trip for trip in readings if trip), None) or _rig_trip(vitals, allowed)


def assess(watch: Watch, newest: Latest | None, vitals: Vitals, allowed: Allowances) -> Trip | None:
    """What is wrong with one channel, or None."""
    if newest is None:
        return _silent(watch, vitals, allowed)
    if isnan(newest.value):
        cause = f"{watch.channel} is NaN: the device sent a row without a usable value"
        return Trip(cause, "nan", vitals.now, watch.channel, newest.value)
    if watch.stops and newest.value != 0.0:
        cause = f"EMERGENCY STOP: {watch.channel} is {newest.value:g}, released is 0"
        return Trip(cause, "emergency_stop", vitals.now, watch.channel, newest.value, 0.0)
    return (
        _outside(watch, newest.value, vitals.now) or _stale(watch, newest, vitals.now) or _frozen(watch, newest, vitals)
    )


def _silent(watch: Watch, vitals: Vitals, allowed: Allowances) -> Trip | None:
    silence = vitals.now - vitals.started
    if silence <= allowed.grace:
        return None
    cause = f"{watch.channel} gave no sample in {silence:.2f} s since the start, {allowed.grace:g} s are allowed"
    return Trip(cause, "stale", vitals.now, watch.channel, limit=allowed.grace)


def _outside(watch: Watch, value: float, now: float) -> Trip | None:
    low, high, unit = watch.min, watch.max, watch.unit
    if high is not None and not value <= high:
        cause = f"{watch.channel} is {value:.6g} {unit}, above its limit of {high:g} {unit}"
        return Trip(cause, "limit", now, watch.channel, value, high)
    if low is not None and not value >= low:
        cause = f"{watch.channel} is {value:.6g} {unit}, below its limit of {low:g} {unit}"
        return Trip(cause, "limit", now, watch.channel, value, low)
    return None


def _stale(watch: Watch, newest: Latest, now: float) -> Trip | None:
    age = now - newest.time
    if age <= watch.max_age:
        return None
    cause = f"{watch.channel} is stale: its last sample is {age:.2f} s old, {watch.max_age:g} s are allowed"
    return Trip(cause, "stale", now, watch.channel, newest.value, watch.max_age)


def frozen_limit(watch: Watch, longest: float | None) -> float:
    """How long in s a driven channel may keep the very same value: as configured, or by its earlier variation."""
    if watch.max_frozen:
        return watch.max_frozen
    return UNSEEN_FROZEN if longest is None else max(LEAST_FROZEN, FROZEN_TIMES * longest)


def _frozen(watch: Watch, newest: Latest, vitals: Vitals) -> Trip | None:
    """Judged while the motor is driven only: water at rest may leave a coarse digit alone."""
    if watch.max_frozen is None or not vitals.driven:
        return None
    same, limit = min(newest.same, vitals.driven), frozen_limit(watch, newest.longest)
    if same <= limit:
        return None
    cause = (
        f"{watch.channel} is frozen: {newest.value:.6g} {watch.unit} without any change for {same:.1f} s of driving, "
        f"{limit:.3g} s are allowed"
    )
    return Trip(cause, "frozen", vitals.now, watch.channel, newest.value, limit)


def _rig_trip(vitals: Vitals, allowed: Allowances) -> Trip | None:
    """Links, own lateness, recorder, operator, in this order."""
    now = vitals.now
    for name, link in (vitals.links or {}).items():
        if not link.alive:
            return Trip(f"the link to {name} is gone: {link.error or 'its reader has ended'}", "link", now, name)
    if vitals.lateness > allowed.lateness:
        cause = f"the control loop is {vitals.lateness:.2f} s late, {allowed.lateness:g} s are allowed"
        return Trip(cause, "late", now, value=vitals.lateness, limit=allowed.lateness)
    if vitals.recorder is not None and (trip := _recorder_trip(vitals.recorder, now, allowed)):
        return trip
    if vitals.lease_age is not None and vitals.lease_age > allowed.lease_age:
        cause = (
            f"no operator was seen for {vitals.lease_age:.1f} s, {allowed.lease_age:g} s are allowed in an attended run"
        )
        return Trip(cause, "lease", now, value=vitals.lease_age, limit=allowed.lease_age)
    return None


def _recorder_trip(recorder: Recorder, now: float, allowed: Allowances) -> Trip | None:
    if not recorder.alive:
        return Trip("the recorder process is gone: nothing more would be saved", "recorder", now)
    if recorder.overrun:
        return Trip("recorder overrun: its queue is full and samples would be lost", "recorder", now)
    if recorder.age > allowed.recorder_age:
        cause = f"the recorder gave no sign of life for {recorder.age:.1f} s, {allowed.recorder_age:g} s are allowed"
        return Trip(cause, "recorder", now, value=recorder.age, limit=allowed.recorder_age)
    return None
