"""Motor controller: a CiA 402 drive on CANopen, in profile velocity or profile torque; rotation, current, supply.

CiA 402 has no mode that sets a voltage. A command in volts is a set-point of rotation here, `rate_per_volt` of it (or
of torque, `torque_per_volt`): a control voltage, as at the analogue input of a servo amplifier. The drive closes its
own loop, so that what a supply, a cold winding or a worn bearing would do to a voltage is not seen in the thrust.

What the drive does when nobody commands it (CiA 301 object 0x1016, CiA 402 object 0x6007): it waits for our heartbeat,
which goes out with each set-point and by nothing else, and without it stops by `on_silence`. It does not go on by
itself: its state machine has left "operation enabled". A set-point after such a silence is refused and 0 goes in its
place; commands of 0 then bring the drive up again, to "switched on", where the motor has no torque. Only a set-point
other than 0 enables it.
"""

from __future__ import annotations

import contextlib
from math import copysign, nan
from typing import Literal

from drivers.canopen import cia402_opening as opening
from drivers.canopen.cia402_conduct import Conduct
from drivers.canopen.cia402_options import CONTROLWORD, MODES, TARGET_TORQUE, TARGET_VELOCITY, Options, streams
from drivers.canopen.frames import (
    EMERGENCY,
    HEARTBEAT,
    RECEIVE_PDO,
    SEND_PDO,
    as_emergency,
    as_heartbeat,
    heartbeat,
    pack,
    service,
    unpack,
)
from drivers.canopen.node import CanopenNode
from drivers.canopen.state402 import QUICK_STOP
from drivers.errors import LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords
from drivers.protocols import LinkHealth, Sample, Stream, Watchdog

ACTIONS: dict[str, Literal["brake", "coast", "disarm"]] = {"quick_stop": "brake", "coast": "coast", "fault": "disarm"}


class Cia402:
    """A motor controller: streams `<name>` (TPDO 1) and `<name>_state` (TPDO 2)."""

    def __init__(self, name: str, options: Options, bus: CanBus) -> None:
        self.name = name
        self._options = options
        self._bus = bus
        self._node = CanopenNode(name, options.node_id, bus, options.timeout)
        self._target = TARGET_VELOCITY if options.mode == "velocity" else TARGET_TORQUE
        self._open = False
        self._bad = BadRecords()
        self._conduct = Conduct(name, options, bus.now_ns())

    @property
    def streams(self) -> tuple[Stream, ...]:
        return streams(self.name, self._options)

    @property
    def watchdog(self) -> Watchdog:
        """CiA 301, 0x1016: fed by our heartbeat alone; CiA 402, 0x6007: the drive leaves "operation enabled"."""
        o = self._options
        fed = "our heartbeat (0x1016), which goes out with each command"
        return Watchdog(o.watchdog_timeout, fed_by=fed, action=ACTIONS[o.on_silence], resumes_by_itself=False)

    @property
    def max_voltage(self) -> float:
        return self._options.max_voltage

    def open(self) -> str:
        """Needs the bus open. Power stage off first; then identity, settings (each read back), PDOs. No set-point."""
        self.close()
        self._bad = BadRecords()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._node.open()
            identity = opening.prepare(self.name, self._node, self._options)
            undo.pop_all()
        self._conduct = Conduct(self.name, self._options, self._bus.now_ns())
        self._open = True
        return identity

    def drain(self) -> list[Sample]:
        samples = [sample for t_ns, frame in self._node.inbox.take_all() for sample in self._take(t_ns, frame)]
        if self._open:
            self._conduct.judge_silence(self._bus.now_ns())
        return samples

    def health(self) -> LinkHealth:
        bus, inbox = self._bus.health(), self._node.inbox
        error = bus.error or self._conduct.fault
        return LinkHealth(
            alive=self._open and bus.alive and error is None,
            received=inbox.received,
            bad=bus.bad + self._bad.count,
            first_bad=(*self._bad.first, *bus.first_bad)[:5],
            error=error,
            dropped=inbox.dropped,
        )

    def told(self, volts: float) -> float:
        return self._options.volts(self._options.counts(volts))

    def command(self, volts: float) -> None:
        """Our heartbeat and one RPDO of controlword and set-point. Raises ValueError beyond max_voltage; LinkError from
        the bus, and for a set-point that the drive is not ready for: 0 is sent in its place."""
        if not abs(volts) <= self.max_voltage:
            raise ValueError(f"{self.name}: command must be within +-{self.max_voltage:g} V, not {volts}")
        word, feeds, refusal = self._conduct.decide(volts, self._bus.now_ns())
        if feeds:
            self._bus.send(heartbeat(self._options.master_id))
        self._send(word, 0.0 if refusal else volts)
        if refusal is not None:
            raise LinkError(f"{self.name}: {refusal}: 0 V was sent in the place of {volts:g} V; command 0 V first")

    def release(self) -> None:
        """Quick stop (controlword 0x0002), whatever the set-point; then the power stage is off. Raises LinkError."""
        self._conduct.let_go(self._bus.now_ns())
        self._send(QUICK_STOP, 0.0)

    def close(self) -> None:
        """Quick stop, and leave the bus; the bus itself belongs to whoever opened it."""
        if self._open and self._bus.alive:
            with contextlib.suppress(LinkError):  # the bus is gone; the drive stops by its own watchdog
                self.release()
        self._node.close()
        self._open = False

    def _send(self, word: int, volts: float) -> None:
        data = pack((CONTROLWORD, self._target), (word, self._options.counts(volts)))
        self._bus.send(Frame(RECEIVE_PDO[0] + self._options.node_id, False, data))

    # -- what comes --------------------------------------------------------------------------------------------------

    def _take(self, t_ns: int, frame: Frame) -> list[Sample]:
        function = service(frame)
        if function == SEND_PDO[0] and (values := unpack(self._options.motor_fields, frame.data)):
            return [self._motor_row(t_ns, *values)]
        if function == SEND_PDO[1] and (values := unpack(self._options.state_fields, frame.data)):
            return [self._state_row(t_ns, *values)]
        if function == EMERGENCY and (emergency := as_emergency(frame)):
            self._conduct.note_emergency(t_ns, emergency)
        elif function == HEARTBEAT and (beat := as_heartbeat(frame)):
            self._conduct.note_heartbeat(t_ns, beat.state)
        else:
            self._bad.add(str(frame))
        return []

    def _motor_row(self, t_ns: int, statusword: int, velocity: int, *current: int) -> Sample:
        o = self._options
        self._conduct.note_state(t_ns, statusword)
        amps = [copysign(1.0, velocity) * each * 1e-3 * (o.rated_current or nan) for each in current]
        return Sample(self.name, t_ns, (velocity * o.rate_per_count, float(statusword), *amps))

    def _state_row(self, t_ns: int, mode: int, *others: int) -> Sample:
        o = self._options
        self._conduct.note_mode(t_ns, mode, MODES[o.mode])
        scales = [o.bus_voltage_unit] if o.bus_voltage_unit else []
        scales += [] if o.rated_torque is None else [1e-3 * o.rated_torque]
        scaled = (value * scale for value, scale in zip(others, scales, strict=True))
        return Sample(f"{self.name}_state", t_ns, (float(mode), *scaled))
