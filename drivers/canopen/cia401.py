"""Motor controller: an analogue output of CiA 401 on CANopen as the control voltage of a servo amplifier.

ROMEO's arrangement (thesis, chapter 4): a module's +-10 V go to an amplifier, which turns the thruster. The command is
that control voltage. Nothing comes back: no rotation rate, no current, no fault of the amplifier.

What the module does when nobody commands it (CiA 301, 0x1016 and 0x1029; CiA 401, 0x6443 and 0x6444): it waits for our
heartbeat, which goes out with each set-point and by nothing else; without it it is "stopped", and there its output goes
to its error value, which is 0 V. **As delivered it would keep the last voltage for ever** (0x6443 = 0). It obeys no
set-point before it is started again.
"""

from __future__ import annotations

import contextlib

from drivers.canopen.cia401_conduct import Conduct
from drivers.canopen.cia401_options import Options, streams
from drivers.canopen.frames import (
    EMERGENCY,
    HEARTBEAT,
    OPERATIONAL,
    PRE_OPERATIONAL,
    RECEIVE_PDO,
    SDO_REPLY,
    SDO_REQUEST,
    START,
    STOP,
    Field,
    as_emergency,
    as_heartbeat,
    heartbeat,
    nmt,
    service,
)
from drivers.canopen.node import BY_EVENT, COB_ID, DISABLED, CanopenNode
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords
from drivers.protocols import LinkHealth, Sample, Stream, Watchdog

PROFILE = 401
OUTPUT, ERROR_MODE, ERROR_VALUE = 0x6411, 0x6443, 0x6444
TO_ERROR_VALUE = 1
"""0x6443: the output goes to 0x6444 when the module fails or is stopped."""
STOPPED_BY_ERROR = 2
"""0x1029:1: a lost heartbeat stops the module."""
PDO = 2
"""The RPDO of analogue outputs in CiA 401, four of them as delivered."""


class Cia401:
    """A motor controller: stream `<name>` with the module's state, at each of its heartbeats."""

    def __init__(self, name: str, options: Options, bus: CanBus) -> None:
        self.name = name
        self._options = options
        self._bus = bus
        self._node = CanopenNode(name, options.node_id, bus, options.timeout)
        self._open = False
        self._bad = BadRecords()
        self._places: tuple[int, ...] = (options.channel,)
        """Outputs in the RPDO, by sub-index."""
        self._conduct = self._new_conduct()

    def _new_conduct(self) -> Conduct:
        return Conduct(self.name, self._options.watchdog_timeout, self._options.heartbeat, self._bus.now_ns())

    @property
    def streams(self) -> tuple[Stream, ...]:
        return streams(self.name, self._options)

    @property
    def watchdog(self) -> Watchdog:
        """CiA 301, 0x1016 and 0x1029; CiA 401, 0x6443: 0 V at the output; what the motor does is the amplifier's."""
        o = self._options
        fed = "our heartbeat (0x1016), which goes out with each command"
        return Watchdog(o.watchdog_timeout, fed_by=fed, action=o.at_zero, resumes_by_itself=False)

    @property
    def max_voltage(self) -> float:
        return self._options.max_voltage

    def open(self) -> str:
        """Needs the bus open. Stops the module and sets its output to 0 before anything else; each setting is read
        back. No set-point."""
        self.close()
        self._bad = BadRecords()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._node.open()
            identity = self._prepare()
            undo.pop_all()
        self._conduct = self._new_conduct()
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
        alive = self._open and bus.alive and error is None
        first = (*self._bad.first, *bus.first_bad)[:5]
        return LinkHealth(alive, inbox.received, bus.bad + self._bad.count, first, error, inbox.dropped)

    def told(self, volts: float) -> float:
        return (self._options.counts(volts) - self._options.offset) / self._options.counts_per_volt

    def command(self, volts: float) -> None:
        """Our heartbeat and one RPDO. Raises ValueError beyond max_voltage; LinkError from the bus, and for a voltage
        that the module is not ready for: 0 is sent in its place."""
        if not abs(volts) <= self.max_voltage:
            raise ValueError(f"{self.name}: command must be within +-{self.max_voltage:g} V, not {volts}")
        starts, refusal = self._conduct.decide(volts, self._bus.now_ns())
        if starts:
            self._start_at_zero()
        self._bus.send(heartbeat(self._options.master_id))
        self._send(0.0 if refusal else volts)
        if refusal is not None:
            raise LinkError(f"{self.name}: {refusal}: 0 V was sent in the place of {volts:g} V; command 0 V first")

    def release(self) -> None:
        """NMT stop: the output goes to its error value, 0 V, whatever it was told. Raises LinkError."""
        self._conduct.stopped()
        self._bus.send(nmt(STOP, self._options.node_id))

    def close(self) -> None:
        """0 V, NMT stop, and leave the bus; the bus itself belongs to whoever opened it."""
        if self._open and self._bus.alive:
            with contextlib.suppress(LinkError):  # the bus is gone; the module stops by its own watchdog
                self._send(0.0)
                self.release()
        self._node.close()
        self._open = False

    def _send(self, volts: float) -> None:
        """The other outputs of the RPDO are set to 0."""
        own = self._options.counts(volts).to_bytes(2, "little", signed=True)
        data = b"".join(own if place == self._options.channel else b"\0\0" for place in self._places)
        self._bus.send(Frame(RECEIVE_PDO[PDO - 1] + self._options.node_id, False, data))

    def _start_at_zero(self) -> None:
        """Not to what its output had before it was stopped: 0 is written while it obeys no PDO. A module that is
        stopped takes no SDO, so that one which remembers shows its old voltage for the time of a frame, 0.3 ms."""
        node_id, counts = self._options.node_id, self._options.counts(0.0).to_bytes(2, "little", signed=True)
        write = bytes((0x2B, OUTPUT & 0xFF, OUTPUT >> 8, self._options.channel)) + counts + b"\0\0"
        self._bus.send(nmt(PRE_OPERATIONAL, node_id))
        self._bus.send(Frame(SDO_REQUEST + node_id, False, write))
        self._bus.send(nmt(START, node_id))

    # -- at opening --------------------------------------------------------------------------------------------------

    def _prepare(self) -> str:
        o, node = self._options, self._node
        self._bus.send(nmt(STOP, o.node_id))
        node.hold()
        node.require_profile(PROFILE)
        zero = o.counts(0.0)
        node.set(Field(OUTPUT, o.channel, 16, True), zero, "output")
        node.set(Field(ERROR_MODE, o.channel, 8), TO_ERROR_VALUE, "output goes to its error value when it is stopped")
        bits = 8 * node.size(ERROR_VALUE, o.channel)  # 16 or 32, by maker
        node.set(Field(ERROR_VALUE, o.channel, bits, True), zero, "error value")
        node.set(
            Field(0x1016, 1, 32), o.master_id << 16 | round(1e3 * o.watchdog_timeout), "heartbeat that it waits for"
        )
        node.set(Field(0x1029, 1, 8), STOPPED_BY_ERROR, "stopped when that heartbeat is lost")
        node.set(Field(0x1017, 0, 16), round(1e3 * o.heartbeat), "its own heartbeat, ms")
        self._find_output()
        node.start()
        cob, operational = HEARTBEAT + node.id, bytes((OPERATIONAL,))
        node.expect(
            lambda frame: frame.id == cob and frame.data == operational,
            o.timeout + 3.0 * o.heartbeat,
            f"no heartbeat of an operational module comes, which was set to {o.heartbeat:g} s (0x1017)",
        )
        node.inbox.take_all()  # what it sent while it was being set up
        return node.identity()

    def _find_output(self) -> None:
        """The RPDO as it is, where the output is in it: in many modules its mapping is fixed. Else it is laid out."""
        channel, node = self._options.channel, self._node
        entries = [node.number(0x1600 + PDO - 1, sub + 1) for sub in range(node.number(0x1600 + PDO - 1))]
        outputs = tuple(entry >> 8 & 0xFF for entry in entries if entry >> 16 == OUTPUT and entry & 0xFF == 16)
        if channel not in outputs or len(outputs) != len(entries):
            self._places = (channel,)
            node.lay_out_received(PDO, (Field(OUTPUT, channel, 16, True),))
            return
        self._places = outputs
        cob = RECEIVE_PDO[PDO - 1] + node.id
        found = node.number(0x1400 + PDO - 1, 1)
        if found & (DISABLED | COB_ID) != cob:
            node.set(Field(0x1400 + PDO - 1, 1, 32), cob, "identifier of RPDO 2", DISABLED | COB_ID)
        kind = node.number(0x1400 + PDO - 1, 2)
        if kind < BY_EVENT - 1:
            raise DeviceError(
                f"{self.name}: RPDO 2 of the module waits for SYNC (transmission type {kind}, 0x1401:2), and no"
                " set-point would be obeyed: set it to 255"
            )

    # -- what comes --------------------------------------------------------------------------------------------------

    def _take(self, t_ns: int, frame: Frame) -> list[Sample]:
        function = service(frame)
        if function == HEARTBEAT and (beat := as_heartbeat(frame)):
            self._conduct.note_heartbeat(t_ns, beat.state)
            return [Sample(self.name, t_ns, (float(beat.state),))]
        if function == EMERGENCY and (told := as_emergency(frame)):
            self._conduct.note_emergency(t_ns, told)
        elif function != SDO_REPLY:  # to what was written when it was started anew
            self._bad.add(str(frame))
        return []
