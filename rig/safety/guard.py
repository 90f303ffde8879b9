"""The guard: asked before every command whether the motor may go on. Pure: readings and time are arguments.

It trips on a limit, on an emergency stop, on a value that is too old, NaN or frozen, on its own lateness, on a dead
link, on a recorder that is gone or late, and on an operator who is gone. Whoever gets a Trip commands 0 V at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isnan
from typing import Literal, NamedTuple

from drivers.protocols import LinkHealth
from rig.campaign.limits import GuardedChannel

Source = Literal[
    "limit",
    "emergency_stop",
    "nan",
    "stale",
    "frozen",
    "rate",
    "corrupt",
    "late",
    "slept",
    "link",
    "following",
    "inconsistent",
    "recorder",
    "lease",
]

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


class Latest(NamedTuple):
    """Newest value of a channel and its arrival in s; for how many s up to then it has been the very same."""

    value: float
    time: float
    same: float = 0.0
    longest: float | None = None
    """s, longest time of the very same value that ended with a change; None: it has never changed."""


@dataclass(frozen=True, slots=True)
class Recorder:
    """What the controller knows of the recorder process, from the messages between them."""

    failed: str = ""
    """Why nothing is saved any more (it has ended, its queue is full, its disk refused); empty while it lives."""
    silence: float = 0.0
    """s since it was last heard of, while it has a file open; every flush is told."""
    free_bytes: int | None = None
    """On its disk at the last flush; None: no file is open, or none was flushed yet."""


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
    recorder: Recorder = Recorder()
    ledger_error: str = ""
    """Why facts are no longer written; empty while they are."""
    lease_age: float | None = None
    """s since an operator said `I am here`; None: unattended, no lease asked for."""
    driven: float = 0.0
    """s for which the command has been other than 0 V without a break; a sensor may stand still at rest."""
    slept: float = 0.0
    """s that the machine slept since the last tick."""


@dataclass(frozen=True, slots=True)
class Allowances:
    """How long what may be late, in s; and how little disk there may be left."""

    lateness: float = MIN_LATENESS
    grace: float = 2.0
    recorder_silence: float = 15.0
    """A flush may block 10 s on a slow disk (docs/reliability.md, promise 18) while the queue holds the rows."""
    free_bytes: int = 64 * 2**20
    """Not s: disk space below which the run ends, while the file can still be closed (promise 17)."""
    lease_age: float = 2.0
    """Four leases missed at two a second."""


def allowances(loop_rate: float, motor_timeout: float | None = None) -> Allowances:
    """Allowances for a loop of `loop_rate` Hz: 5 periods of lateness, 0.25 s at least, and never so much that the
    motor's own timeout (s) has let go meanwhile: it would be driven again without having been armed."""
    late = max(5 / loop_rate, MIN_LATENESS)
    return Allowances(
        lateness=late if motor_timeout is None else min(late, max(motor_timeout, 2 / loop_rate) - 1 / loop_rate)
    )


def check(
    channels: Iterable[GuardedChannel], latest: Mapping[str, Latest | None], vitals: Vitals, allowed: Allowances
) -> Trip | None:
    """First reason to stop, or None.

    Sleep comes before all: nothing that was known before it holds. Then the records: a stale value or a late tick is
    passed over while nothing is driven, and must not hide that nothing is saved. Then limits, which name what happened
    to the bench, then the rest of the rig.
    """
    if vitals.slept > allowed.lateness:
        cause = f"this machine slept for {vitals.slept:.1f} s; look at the bench, then start anew"
        return Trip(cause, "slept", vitals.now, value=vitals.slept, limit=allowed.lateness)
    if trip := _records_trip(vitals, allowed):
        return trip
    readings = (assess(guarded, latest.get(guarded.channel), vitals, allowed) for guarded in channels)
    return next((trip for trip in readings if trip), None) or _rig_trip(vitals, allowed)


def assess(guarded: GuardedChannel, newest: Latest | None, vitals: Vitals, allowed: Allowances) -> Trip | None:
    """What is wrong with one channel, or None."""
    if newest is None:
        return _silent(guarded, vitals, allowed)
    if isnan(newest.value):
        cause = f"{guarded.channel} is NaN: the device sent a row without a usable value"
        return Trip(cause, "nan", vitals.now, guarded.channel, newest.value)
    if guarded.stops and newest.value != 0.0:
        cause = f"EMERGENCY STOP: {guarded.channel} is {newest.value:g}, released is 0"
        return Trip(cause, "emergency_stop", vitals.now, guarded.channel, newest.value, 0.0)
    return (
        _outside(guarded, newest.value, vitals.now)
        or _stale(guarded, newest, vitals.now)
        or _frozen(guarded, newest, vitals)
    )


def _silent(guarded: GuardedChannel, vitals: Vitals, allowed: Allowances) -> Trip | None:
    silence = vitals.now - vitals.started
    if silence <= allowed.grace:
        return None
    cause = f"{guarded.channel} gave no sample in {silence:.2f} s since the start, {allowed.grace:g} s are allowed"
    return Trip(cause, "stale", vitals.now, guarded.channel, limit=allowed.grace)


def _outside(guarded: GuardedChannel, value: float, now: float) -> Trip | None:
    low, high, unit = guarded.min, guarded.max, guarded.unit
    if high is not None and not value <= high:
        cause = f"{guarded.channel} is {value:.6g} {unit}, above its limit of {high:g} {unit}"
        return Trip(cause, "limit", now, guarded.channel, value, high)
    if low is not None and not value >= low:
        cause = f"{guarded.channel} is {value:.6g} {unit}, below its limit of {low:g} {unit}"
        return Trip(cause, "limit", now, guarded.channel, value, low)
    return None


def _stale(guarded: GuardedChannel, newest: Latest, now: float) -> Trip | None:
    age = now - newest.time
    if age <= guarded.max_age:
        return None
    cause = f"{guarded.channel} is stale: its last sample is {age:.2f} s old, {guarded.max_age:g} s are allowed"
    return Trip(cause, "stale", now, guarded.channel, newest.value, guarded.max_age)


def frozen_limit(guarded: GuardedChannel, longest: float | None) -> float:
    """How long in s a driven channel may keep the very same value: as configured, or by its earlier variation."""
    if guarded.max_frozen:
        return guarded.max_frozen
    return UNSEEN_FROZEN if longest is None else max(LEAST_FROZEN, FROZEN_TIMES * longest)


def _frozen(guarded: GuardedChannel, newest: Latest, vitals: Vitals) -> Trip | None:
    """Judged while the motor is driven only: water at rest may leave a coarse digit alone."""
    if guarded.max_frozen is None or not vitals.driven:
        return None
    same, limit = min(newest.same, vitals.driven), frozen_limit(guarded, newest.longest)
    if same <= limit:
        return None
    cause = (
        f"{guarded.channel} is frozen: {newest.value:.6g} {guarded.unit} without any change for {same:.1f} s of "
        f"driving, {limit:.3g} s are allowed"
    )
    return Trip(cause, "frozen", vitals.now, guarded.channel, newest.value, limit)


def _rig_trip(vitals: Vitals, allowed: Allowances) -> Trip | None:
    """Links, own lateness, operator, in this order."""
    now = vitals.now
    for name, link in (vitals.links or {}).items():
        if not link.alive:
            return Trip(f"the link to {name} is gone: {link.error or 'its reader has ended'}", "link", now, name)
    if vitals.lateness > allowed.lateness:
        cause = f"the control loop is {vitals.lateness:.2f} s late, {allowed.lateness:g} s are allowed"
        return Trip(cause, "late", now, value=vitals.lateness, limit=allowed.lateness)
    if vitals.lease_age is not None and vitals.lease_age > allowed.lease_age:
        cause = (
            f"no operator was seen for {vitals.lease_age:.1f} s, {allowed.lease_age:g} s are allowed in an attended run"
        )
        return Trip(cause, "lease", now, value=vitals.lease_age, limit=allowed.lease_age)
    return None


def _records_trip(vitals: Vitals, allowed: Allowances) -> Trip | None:
    """Recorder, then ledger."""
    recorder, now = vitals.recorder, vitals.now
    if recorder.failed:
        return Trip(f"recorder: {recorder.failed}", "recorder", now)
    if recorder.silence > allowed.recorder_silence:
        cause = f"recorder: nothing was flushed for {recorder.silence:.0f} s; its disk may be stuck"
        return Trip(cause, "recorder", now, value=recorder.silence, limit=allowed.recorder_silence)
    if recorder.free_bytes is not None and recorder.free_bytes < allowed.free_bytes:
        left = recorder.free_bytes / 2**20
        cause = f"recorder: only {left:.0f} MiB left on the disk; the run ends while the file can still be closed"
        return Trip(cause, "recorder", now, value=recorder.free_bytes, limit=allowed.free_bytes)
    return Trip(vitals.ledger_error, "recorder", now) if vitals.ledger_error else None
