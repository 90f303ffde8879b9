"""Channels that lie: swapped, rescaled, reversed, frozen, unsigned, or silent. To be looked for before any physics.

Each channel is judged against the driver and the others over cells of time (fault_cells); what is said must be far
beyond what any physics of a thruster does, and hold in many stretches of the run. Nothing is repaired silently:
`repaired` gives the recording as it must have been meant, for who wants it.

What cannot be known and is never claimed: a constant factor or a swap of channels that follow the same law (thrust and
current), for C or the torque constant absorbs it. That a drive gives the size of its current only is told, but `grave`
is false: no model of the thrust stands on it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from identification.mismatch import policy
from identification.mismatch.faults.bad_values import Stuck, missing, stuck
from identification.mismatch.faults.cells import cells_of, own
from identification.mismatch.faults.driver_laws import (
    impossible,
    midway,
    reversed_channels,
    unsigned,
)
from identification.mismatch.faults.leaps import leaps
from identification.mismatch.faults.swaps import swapped_voltages, swaps
from identification.mismatch.value import Value
from identification.recording import Channel, Recording

EFFECT = "channel_fault"
"""Its id: it has no term, for a channel that lies is put right before any physics."""
Kind = Literal["swapped", "rescaled", "reversed", "frozen", "unsigned", "nan", "leap", "driver", "strange"]
"""leap: a rate that nothing follows for a moment; driver: the motor controller makes something else of the command;
strange: it goes with no other channel."""


@dataclass(frozen=True, eq=False)
class Fault:
    """One lie of one channel."""

    recording_id: str
    channel: str
    """Quantity."""
    kind: Kind
    statement: str
    p_value: float
    parameters: Mapping[str, Value] = field(default_factory=dict)
    other: str = ""
    """The quantity it was swapped with."""
    grave: bool = True
    """Whether a model of the thrust would be wrong with it."""
    done: str = ""
    """What was done about it, where runs were compared; the statement then says which run it is."""

    @property
    def repairable(self) -> bool:
        return self.kind in _REPAIRS or self.kind == "swapped"


def find_faults(recordings: Sequence[Recording]) -> tuple[Fault, ...]:
    """Every fault of every recording by itself, in order of recording; empty for vehicles.

    What is changed between runs: wiring.py.
    """
    return tuple(fault for recording in recordings if recording.kind != "vehicle" for fault in _of_one(recording))


def _of_one(recording: Recording) -> list[Fault]:
    alarm = policy.faults.CHANNEL_FALSE_ALARM
    name = recording.recording_id
    out = [Fault(name, q, "nan", says, 0.0, values) for q, says, values in missing(recording)]
    first = cells_of(recording)
    if first is None:
        return out
    held: dict[str, Stuck] = {q: s for q, s in stuck(recording, first) if s.p_value < alarm}
    out += [
        Fault(name, q, "frozen", s.statement, s.p_value, {"start": s.start_value, "end": s.end_value, "value": s.at})
        for q, s in held.items()
    ]
    cells = cells_of(recording, {q: (s.start, s.end) for q, s in held.items()})
    if cells is None:
        return out
    out += [Fault(name, q, "leap", says, p, values) for q, says, p, values in leaps(cells) if p < alarm]
    exchanged = [*swapped_voltages(recording), *swaps(cells)]
    exchanged = [s for s in exchanged if s[3] < alarm][:1]
    out += [Fault(name, a, "swapped", says, p, other=b) for a, b, says, p in exchanged]
    done = {q for s in exchanged for q in s[:2]}
    if "command_voltage" in done:
        return out
    scaled = [r for r in midway(cells) if r[2] < alarm and r[0] not in done]
    out += [Fault(name, q, "rescaled", says, p, values) for q, says, p, values in scaled]
    done |= {r[0] for r in scaled}
    absurd = [i for i in impossible(cells) if i[0] not in done]
    out += [Fault(name, q, "rescaled", says, p, values) for q, says, p, values in absurd]
    signless = [u for u in unsigned(cells) if u[2] < alarm and u[0] not in done]
    out += [Fault(name, q, "unsigned", says, p, grave=q != "current") for q, says, p in signless]
    done |= {u[0] for u in signless}
    backwards = [r for r in reversed_channels(cells, done) if r[2] < alarm]
    out += [Fault(name, q, "reversed", says, p, values) for q, says, p, values in backwards]
    return out


def repaired(recording: Recording, fault: Fault) -> Recording:
    """The recording as it must have been meant, were the fault true. Other recordings are returned as they are.

    swapped: exchanged back. rescaled: divided by the factor from `start` on. reversed: sign changed. unsigned: sign of
    the driver at each sample. frozen, leap: NaN while it stood still, or leapt. nan: nothing can be done, returned as
    it is.
    """
    if recording.recording_id != fault.recording_id or not fault.repairable:
        return recording
    channel = own(recording, fault.channel)
    if channel is None:
        return recording
    if fault.kind == "swapped":
        other = own(recording, fault.other)
        if other is None:
            return recording
        swap = {
            id(channel): replace(channel, time=other.time, value=other.value),
            id(other): replace(other, time=channel.time, value=channel.value),
        }
        return replace(recording, channels=tuple(swap.get(id(c), c) for c in recording.channels))
    new = _REPAIRS[fault.kind](recording, channel, fault)
    return replace(recording, channels=tuple(new if c is channel else c for c in recording.channels))


def _rescaled(_recording: Recording, channel: Channel, fault: Fault) -> Channel:
    start = fault.parameters["start"].value if "start" in fault.parameters else -np.inf
    factor = fault.parameters["factor"].value
    return replace(channel, value=np.where(channel.time >= start, channel.value / factor, channel.value))


def _reversed(_recording: Recording, channel: Channel, _fault: Fault) -> Channel:
    return replace(channel, value=-channel.value)


def _unsigned(recording: Recording, channel: Channel, _fault: Fault) -> Channel:
    driver = next(c for q in ("command_voltage", "motor_voltage", "rotation_rate") if (c := own(recording, q)))
    sign = np.sign(np.nan_to_num(driver.held_at(channel.time)))
    last = np.maximum.accumulate(np.where(sign != 0, np.arange(sign.size), 0))
    return replace(channel, value=np.where(sign[last] < 0, -channel.value, channel.value))


def _unread(_recording: Recording, channel: Channel, fault: Fault) -> Channel:
    start, end = fault.parameters["start"].value, fault.parameters["end"].value
    return replace(channel, value=np.where((channel.time >= start) & (channel.time <= end), np.nan, channel.value))


_REPAIRS: Mapping[str, Callable[[Recording, Channel, Fault], Channel]] = {
    "rescaled": _rescaled,
    "reversed": _reversed,
    "unsigned": _unsigned,
    "frozen": _unread,
    "leap": _unread,
}
