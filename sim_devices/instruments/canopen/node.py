"""A simulated CANopen device as CiA 301 has it: NMT, SDO, PDO, heartbeats both ways, emergencies. No clock of its own.

Written from the standard's frames; it shares nothing with the driver, nor with the library behind that.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from math import inf

from sim_devices.instruments.canopen.objects import OUT_OF_RANGE, Dictionary, Object, SdoServer, Value
from sim_devices.instruments.canopen.pdo import Pdo
from sim_devices.wires.can_frame import CanFrame

BOOT_TIME = 1.0
"""s"""
OPERATIONAL, STOPPED, PRE_OPERATIONAL = 0x05, 0x04, 0x7F
NMT_COMMANDS = {0x01: OPERATIONAL, 0x02: STOPPED, 0x80: PRE_OPERATIONAL}
HEARTBEAT_LOST, PDO_TOO_SHORT = 0x8130, 0x8210
"""Emergency codes."""


class Node:
    """`refresh` brings the dictionary up to now before it is read; `written(index, sub, t)` hears what was written;
    `lost(t)` that the heartbeat it waits for has stopped; `reset()` that it starts anew."""

    def __init__(
        self,
        node_id: int,
        device_type: int,
        name: str,
        refresh: Callable[[], None],
        written: Callable[[int, int, float], None],
        lost: Callable[[float], None],
        reset: Callable[[], None],
    ) -> None:
        self.id, self.objects = node_id, Dictionary()
        self._refresh, self._hear, self._lost, self._restart = refresh, written, lost, reset
        self._now = 0.0
        self.state = PRE_OPERATIONAL
        self.beats, self.deaf = True, False
        """Whether it sends its heartbeat; whether it hears and says nothing."""
        self.waits = True
        """Whether it misses the heartbeat that it waits for."""
        self._sent: list[Pdo] = []
        self._received: list[Pdo] = []
        self._queue: list[CanFrame] = []
        self._boots_at = self._expires = inf
        self._beat_at = inf
        self.heard = -inf
        """s: when the heartbeat it waits for came last."""
        for index, form, value in ((0x1000, "I", device_type), (0x1001, "B", 0), (0x1008, "s", name.encode("ascii"))):
            self.objects[index, 0] = Object(form, value)
        for sub, value in enumerate((4, 0x53494D, device_type, 0x10000, 20)):
            self.objects[0x1018, sub] = Object("I" if sub else "B", value)
        self.objects[0x1016, 0] = Object("B", 1)
        self.objects[0x1016, 1] = Object("I", 0, writable=True)
        self.objects[0x1017, 0] = Object("H", 0, writable=True)
        self.objects[0x1029, 0] = Object("B", 1)
        self.objects[0x1029, 1] = Object("B", 0, writable=True, check=lambda v: OUT_OF_RANGE if v > 2 else 0)
        self._sdo = SdoServer(self.objects, self._was_written)
        self._delivered: dict[tuple[int, int], Value] = {}

    def deliver(self) -> None:
        """Its dictionary is whole: this is what it has after each start."""
        self._delivered = {place: each.value for place, each in self.objects.items()}

    def add_sent(self, mapped: tuple[int, ...] = ()) -> Pdo:
        """The next TPDO."""
        number = len(self._sent)
        self._sent.append(Pdo(self.objects, 0x1800 + number, 0x180 + 0x100 * number + self.id, mapped))
        return self._sent[-1]

    def add_received(self, mapped: tuple[int, ...] = ()) -> Pdo:
        """The next RPDO."""
        number = len(self._received)
        self._received.append(Pdo(self.objects, 0x1400 + number, 0x200 + 0x100 * number + self.id, mapped))
        return self._received[-1]

    # -- time --------------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        if self._boots_at < inf:
            return self._boots_at
        if self._queue:
            return self._now
        pdos = (pdo.due for pdo in self._sent) if self.state == OPERATIONAL else ()
        return min(self._beat_at, self._expires, min(pdos, default=inf))

    def tick(self, t: float) -> list[CanFrame]:
        """Everything it does by itself until t."""
        self._now = t
        if t >= self._boots_at:
            self._boots_at, self._beat_at = inf, t
            self._queue.append(CanFrame(0x700 + self.id, b"\0", extended=False))
        elif self._boots_at < inf:
            return []
        if t >= self._expires:
            self._expires = inf
            if self.waits:
                self._expire(t)
        if t >= self._beat_at:
            self._beat(t)
        if self.state == OPERATIONAL:
            for pdo in self._sent:
                if pdo.due <= t:
                    self._send(pdo, t)
        frames, self._queue = self._queue, []
        return [] if self.deaf else frames

    def _expire(self, t: float) -> None:
        self.emergency(HEARTBEAT_LOST, 0x11)
        self.state = {0: PRE_OPERATIONAL, 2: STOPPED}.get(self.objects.number(0x1029, 1), self.state)
        self._lost(t)

    def _beat(self, t: float) -> None:
        period = 1e-3 * self.objects.number(0x1017)
        self._beat_at = t + period if period else inf
        if period and self.beats:
            self._queue.append(CanFrame(0x700 + self.id, bytes((self.state,)), extended=False))

    def _send(self, pdo: Pdo, t: float) -> None:
        self._refresh()
        cob_id, payload = pdo.cob_id, pdo.payload(t)
        if cob_id is not None:
            self._queue.append(CanFrame(cob_id, payload, extended=False))

    def emergency(self, code: int, register: int) -> None:
        """Told at once; `register` is what 0x1001 has from now on."""
        self.objects[0x1001, 0].value = register
        self._queue.append(CanFrame(0x080 + self.id, struct.pack("<HB5x", code, register), extended=False))

    def boot(self, t: float) -> None:
        """Off now, its boot-up message in a second; all that was set is lost."""
        self.state, self._boots_at, self._expires, self._beat_at = PRE_OPERATIONAL, t + BOOT_TIME, inf, inf
        self._queue.clear()
        for place, value in self._delivered.items():
            self.objects[place].value = value
        for pdo in self._sent:
            pdo.stop()
        self._restart()

    # -- frames ------------------------------------------------------------------------------------------------------

    def receive(self, frame: CanFrame, t: float) -> list[CanFrame]:
        """A frame from the bus; returns the answers."""
        self._now = t
        if frame.extended or frame.remote or self.deaf or self._boots_at < inf:
            return []
        if frame.id == 0x000 and len(frame.data) == 2 and frame.data[1] in (0, self.id):
            self._command(frame.data[0], t)
        elif frame.id == 0x080 and self.state == OPERATIONAL:
            for pdo in self._sent:
                if pdo.follows_sync():
                    self._send(pdo, t)
        elif frame.id == 0x600 + self.id and self.state != STOPPED:
            self._refresh()
            if reply := self._sdo.reply(frame.data):
                self._queue.append(CanFrame(0x580 + self.id, reply, extended=False))
        elif frame.id >> 7 == 0x700 >> 7:
            self._note_heartbeat(frame.id & 0x7F, t)
        elif self.state == OPERATIONAL:
            self._take_pdo(frame, t)
        answers, self._queue = self._queue, []
        return answers

    def _command(self, command: int, t: float) -> None:
        if command in (0x81, 0x82):
            self.boot(t)
            return
        state = NMT_COMMANDS.get(command, self.state)
        if state != self.state:
            self.state = state
            for pdo in self._sent:
                if state == OPERATIONAL:
                    pdo.start(t)
                else:
                    pdo.stop()

    def _note_heartbeat(self, node_id: int, t: float) -> None:
        """Waiting begins with the first of them (CiA 301, 7.2.8.2.2.3)."""
        awaited, time_ms = divmod(self.objects.number(0x1016, 1), 1 << 16)
        if self.waits and time_ms and node_id == awaited:
            self.heard, self._expires = t, t + 1e-3 * time_ms

    def _take_pdo(self, frame: CanFrame, t: float) -> None:
        for pdo in self._received:
            if pdo.cob_id == frame.id:
                places = pdo.write(frame.data)
                if places is None:
                    self.emergency(PDO_TOO_SHORT, 0x11)
                for index, sub in places or ():
                    self._hear(index, sub, t)

    def _was_written(self, index: int, sub: int) -> None:
        if index == 0x1016:
            self._expires = inf
        if index == 0x1017:
            self._beat_at = self._now
        self._hear(index, sub, self._now)

    def touch(self) -> None:
        """Something has changed of itself: what tells of it is sent as soon as it may be."""
        for pdo in self._sent:
            pdo.touch()
