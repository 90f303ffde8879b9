"""Force sensor: a load cell, or its amplifier, on CANopen by the profile CiA 404 (measuring devices).

Source: CiA 404 (0x6130/0x7130/0x9130 process value, 0x6131 unit, 0x6132 decimal digits, 0x6150 status, 0x6125 auto
zero), as in the manuals of Axiomatic AX030301 (page 35), FMS EMGZ480 (15.2: status 3 is a positive, 5 a negative
overload) and esd CAN-CBX (8.10.9: bit 0 not valid, 1 positive, 2 negative overload).
"""

from __future__ import annotations

import contextlib
import json
import struct
from math import isfinite, nan

from drivers.canopen.cia404_options import VALUES, Options
from drivers.canopen.frames import (
    BOOTED,
    EMERGENCY,
    HEARTBEAT,
    NMT_STATES,
    OPERATIONAL,
    SEND_PDO,
    SYNC,
    Field,
    as_emergency,
    as_heartbeat,
    service,
    unpack,
)
from drivers.canopen.node import BY_EVENT, CanopenNode
from drivers.errors import DeviceError, LinkError
from drivers.force_units import NEWTONS_PER_UNIT
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords
from drivers.protocols import QUARTZ, Channel, LinkHealth, Sample, Stream

PROFILE = 404
NEWTON = 0x210000
"""0x6131 without its prefix (CiA 303-2: 21 newton); the prefix, a power of ten, is in the highest byte."""
EACH_SYNC = 1
"""Transmission type."""
ZERO = int.from_bytes(b"zero", "little")
"""What 0x6125 is written with."""
INVALID, OVER, UNDER = 0x01, 0x02, 0x04
"""Bits of 0x6150."""
LOST_HEARTBEATS = 3.5
"""Periods without a heartbeat of the device after which it is dead."""


class Cia404:
    """A force sensor: stream `<name>` with `thrust` [N]; `status`, and `raw` of an integer value."""

    def __init__(self, name: str, options: Options, bus: CanBus) -> None:
        self.name = name
        self._options = options
        self._bus = bus
        self._node = CanopenNode(name, options.node_id, bus, options.timeout)
        self._open = False
        self._bad = BadRecords()
        self._fault: str | None = None
        self._heard_ns = self._asked_ns = 0
        self._newtons = nan if options.unit is None else NEWTONS_PER_UNIT[options.unit]
        self._decimals = options.decimals or 0

    @property
    def streams(self) -> tuple[Stream, ...]:
        o = self._options
        whole = o.value != "float32"
        step = 10.0**-self._decimals * self._newtons if whole and isfinite(self._newtons) else None
        thrust = Channel(
            "thrust", "thrust", "N", noise_std=o.noise_std, quantum=step if whole else o.resolution,
            delay=o.delay, delay_std=o.delay_std, window=o.window, low_pass=o.low_pass, filter=o.filter,
            range_min=o.range_min, range_max=o.range_max, calibration=json.dumps(self._calibration()),
        )  # fmt: skip
        status = Channel("status", None, "1", integer=True, description="0x6150: 1 not valid, 2 over, 4 under range")
        raw = Channel("raw", None, "1", integer=True, description="process value as sent")
        channels = (thrust, *((status,) if o.status else ()), *((raw,) if whole else ()))
        clock = None if o.sync else QUARTZ
        return (Stream(self.name, "cia404", channels, 1.0 / o.rate if o.sync else 1e-3 * o.period_ms, clock),)

    def open(self) -> str:
        """Needs the bus open. Unit and decimals are read, the PDO laid out, each setting read back."""
        self.close()
        self._bad, self._fault = BadRecords(), None
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._node.open()
            self._node.hold()
            self._node.require_profile(PROFILE)
            identity = self._node.identity()
            self._read_scale()
            self._lay_out()
            undo.pop_all()
        self._heard_ns = self._bus.now_ns()
        self._open = True
        return identity

    def drain(self) -> list[Sample]:
        samples = [sample for t_ns, frame in self._node.inbox.take_all() for sample in self._take(t_ns, frame)]
        if self._open:
            self._judge_silence()
            self._ask()
        return samples

    def health(self) -> LinkHealth:
        bus, inbox = self._bus.health(), self._node.inbox
        error = bus.error or self._fault
        alive = self._open and bus.alive and error is None
        first = (*self._bad.first, *bus.first_bad)[:5]
        return LinkHealth(alive, inbox.received, bus.bad + self._bad.count, first, error, inbox.dropped)

    def tare(self) -> None:
        """Auto zero (0x6125). Raises DeviceError, LinkError."""
        self._node.write(Field(0x6125, self._options.channel, 32), ZERO, "auto zero")

    def close(self) -> None:
        """Leave the bus; the bus itself belongs to whoever opened it."""
        self._node.close()
        self._open = False

    # -- at opening --------------------------------------------------------------------------------------------------

    def _read_scale(self) -> None:
        o, channel = self._options, self._options.channel
        code = self._node.number_if_there(0x6131, channel)
        told = None
        if code is not None and code & 0x00FFFFFF == NEWTON:
            power = code >> 24
            told = 10.0 ** (power - 256 if power > 127 else power)
        if o.unit is None and told is None:
            shown = "missing" if code is None else f"0x{code:08X}"
            raise DeviceError(
                f"{self.name}: the device's unit (0x6131:{channel}) is {shown}, which is no force by its code: set it"
                " to N, or say in the bench file which it is (unit)"
            )
        newtons = told if o.unit is None else NEWTONS_PER_UNIT[o.unit]
        if told is not None and newtons is not None and abs(told / newtons - 1.0) > 1e-9:
            raise DeviceError(
                f"{self.name}: the device measures in {told:g} N (0x6131:{channel}), the bench file says {o.unit}:"
                " change one of them"
            )
        self._newtons = newtons or nan
        if o.value == "float32":
            return
        digits = self._node.number_if_there(0x6132, channel)
        if digits is None and o.decimals is None:
            raise DeviceError(f"{self.name}: the device tells no decimal digits (0x6132): give decimals")
        if None not in (digits, o.decimals) and digits != o.decimals:
            raise DeviceError(
                f"{self.name}: the device has {digits} decimal digits (0x6132:{channel}), the bench file says"
                f" {o.decimals}: change one of them"
            )
        self._decimals = o.decimals if digits is None and o.decimals is not None else digits or 0

    def _lay_out(self) -> None:
        o, node = self._options, self._node
        node.set(Field(0x1017, 0, 16), round(1e3 * o.heartbeat), "its heartbeat, ms")
        node.lay_out_sent(1, o.fields, None if o.sync else o.period_ms, EACH_SYNC if o.sync else BY_EVENT)
        node.start()
        cob, operational = HEARTBEAT + node.id, bytes((OPERATIONAL,))
        node.expect(
            lambda frame: frame.id == cob and frame.data == operational,
            o.timeout + 3.0 * o.heartbeat,
            f"no heartbeat of an operational device comes, which was set to {o.heartbeat:g} s (0x1017)",
        )
        if o.sync:
            self._bus.send(Frame(SYNC, False, b""))
        length = sum(field.bits for field in o.fields) // 8
        pdo = SEND_PDO[0] + node.id
        node.expect(
            lambda frame: frame.id == pdo and len(frame.data) == length,
            o.timeout + 3e-3 * o.period_ms,
            f"no TPDO 1 of {length} bytes comes, which was laid out {'for each SYNC' if o.sync else 'by a timer'}",
        )
        node.inbox.take_all()  # what it sent while it was being set up

    def _calibration(self) -> dict[str, object]:
        o, newtons = self._options, self._newtons if isfinite(self._newtons) else None
        return {
            "formula": "thrust = sign * process value / 10^decimals * newtons per unit",
            "sign": o.sign, "gain_std": o.gain_std, "newtons_per_unit": newtons,
            "object": f"0x{VALUES[o.value][0]:04X}:{o.channel}", "decimals": self._decimals,
        }  # fmt: skip

    # -- what comes --------------------------------------------------------------------------------------------------

    def _take(self, t_ns: int, frame: Frame) -> list[Sample]:
        function = service(frame)
        if function == SEND_PDO[0] and (values := unpack(self._options.fields, frame.data)):
            return [self._row(t_ns, *values)]
        if function == EMERGENCY and (told := as_emergency(frame)):
            if told.code & 0xFF00:
                self._trip(f"reports emergency {told}")
        elif function == HEARTBEAT and (beat := as_heartbeat(frame)):
            self._heard_ns = t_ns
            if beat.state == BOOTED:
                self._trip("has started anew: it lost its supply or was reset, and its settings with it")
            elif beat.state != OPERATIONAL:
                self._trip(f"is {NMT_STATES.get(beat.state, 'in an unknown state')}, no longer operational")
        else:
            self._bad.add(str(frame))
        return []

    def _row(self, t_ns: int, number: int, status: int = 0) -> Sample:
        o = self._options
        if o.value == "float32":
            (shown,) = struct.unpack("<f", number.to_bytes(4, "little"))
        else:
            shown = number / 10.0**self._decimals
        usable = isfinite(shown) and not status & (INVALID | OVER | UNDER)
        thrust = o.sign * shown * self._newtons if usable else nan
        if status & (INVALID | OVER | UNDER) == INVALID:
            self._trip(f"reports a fault of cell or converter (status 0x{status:02X})")
        told = (float(status),) if o.status else ()
        return Sample(self.name, t_ns, (thrust, *told, *(() if o.value == "float32" else (float(number),))))

    def _judge_silence(self) -> None:
        silence = (self._bus.now_ns() - self._heard_ns) * 1e-9
        if silence > LOST_HEARTBEATS * self._options.heartbeat:
            self._trip(f"is silent: its last heartbeat is {silence:.2f} s old")

    def _ask(self) -> None:
        """SYNC, at most `rate` times a second."""
        now_ns = self._bus.now_ns()
        if self._options.sync and (now_ns - self._asked_ns) * 1e-9 >= 0.75 / self._options.rate:
            self._asked_ns = now_ns
            with contextlib.suppress(LinkError):  # health says why the bus is gone
                self._bus.send(Frame(SYNC, False, b""))

    def _trip(self, what: str) -> None:
        self._fault = self._fault or f"{self.name} {what}: clear its cause, then open again"
