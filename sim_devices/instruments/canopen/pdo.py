"""PDOs of a simulated CANopen device: their parameters in the dictionary, when one is sent, what one received writes.

CiA 301, 7.5.2.36 to 38: the mapping may be written while its count is 0, and the PDO is switched off by bit 31 of its
identifier; transmission types 1 to 240 follow SYNC, 254 and 255 the event timer and events, no closer than the inhibit
time.
"""

from __future__ import annotations

import struct
from math import inf

from sim_devices.instruments.canopen.objects import NO_OBJECT, NOT_NOW, Abort, Dictionary, Object

DISABLED = 1 << 31
CANNOT_BE_MAPPED, TOO_LONG = 0x06040041, 0x06040042


class Pdo:
    """One PDO, its parameters at `index` and `index` + 0x200."""

    def __init__(self, objects: Dictionary, index: int, cob_id: int, mapped: tuple[int, ...] = ()) -> None:
        """`mapped`: as delivered; none: switched off."""
        self._objects, self._index = objects, index
        self._next = self._allowed = inf
        self._syncs = 0
        self._running = self._event = False
        objects[index, 0] = Object("B", 5)
        objects[index, 1] = Object("I", cob_id if mapped else cob_id | DISABLED, writable=True)
        objects[index, 2] = Object("B", 255, writable=True)
        objects[index, 3] = Object("H", 0, writable=True, check=lambda _: 0 if self._is_off() else NOT_NOW)
        objects[index, 5] = Object("H", 0, writable=True)
        objects[index + 0x200, 0] = Object("B", len(mapped), writable=True, check=self._may_count)
        for sub in range(1, 9):
            entry = mapped[sub - 1] if sub <= len(mapped) else 0
            objects[index + 0x200, sub] = Object("I", entry, writable=True, check=self._may_map)

    @property
    def cob_id(self) -> int | None:
        """None: it is switched off."""
        return None if self._is_off() else self._objects.number(self._index, 1) & 0x7FF

    def _is_off(self) -> bool:
        return bool(self._objects.number(self._index, 1) & DISABLED)

    def _may_map(self, entry: int) -> int:
        if not self._is_off() or self._objects.number(self._index + 0x200, 0):
            return NOT_NOW
        return 0 if (entry >> 16, entry >> 8 & 0xFF) in self._objects else NO_OBJECT

    def _may_count(self, count: int) -> int:
        if not self._is_off() or count > 8:
            return NOT_NOW
        entries = [self._objects.number(self._index + 0x200, sub + 1) for sub in range(count)]
        if any((entry >> 16, entry >> 8 & 0xFF) not in self._objects for entry in entries):
            return CANNOT_BE_MAPPED
        return TOO_LONG if sum(entry & 0xFF for entry in entries) > 64 else 0

    def _mapped(self) -> list[tuple[int, int]]:
        entries = [
            self._objects.number(self._index + 0x200, sub + 1)
            for sub in range(self._objects.number(self._index + 0x200, 0))
        ]
        return [(entry >> 16, entry >> 8 & 0xFF) for entry in entries]

    # -- sent --------------------------------------------------------------------------------------------------------

    def start(self, t: float) -> None:
        """The device has become operational."""
        self._running, self._next, self._allowed, self._syncs, self._event = True, t, t, 0, True

    def stop(self) -> None:
        self._running = self._event = False

    def touch(self) -> None:
        """Something in it has changed of itself: it is sent as soon as it may be."""
        self._event = True

    @property
    def due(self) -> float:
        if not self._running or self._is_off() or self._objects.number(self._index, 2) < 254:
            return inf
        return self._allowed if self._event else self._next

    def payload(self, t: float) -> bytes:
        """It is sent at t."""
        timer = 1e-3 * self._objects.number(self._index, 5)
        in_time = not self._event and t - self._next <= 1.0  # s: switched off meanwhile, nothing to catch up
        self._next = ((self._next if in_time else t) + timer) if timer else inf
        self._allowed = t + 1e-4 * self._objects.number(self._index, 3)
        self._event = False
        return b"".join(self._objects.at(*place).packed() for place in self._mapped())

    def follows_sync(self) -> bool:
        """A SYNC came: whether it is sent now."""
        kind = self._objects.number(self._index, 2)
        if self._is_off() or not 1 <= kind <= 240:
            return False
        self._syncs += 1
        return self._syncs % kind == 0

    # -- received ----------------------------------------------------------------------------------------------------

    def write(self, data: bytes) -> list[tuple[int, int]] | None:
        """Objects that it wrote; None: it is too short for its mapping."""
        places = self._mapped()
        sizes = [struct.calcsize(f"<{self._objects.at(*place).form}") for place in places]
        if len(data) < sum(sizes):
            return None
        written = []
        for place, size in zip(places, sizes, strict=True):
            part, data = data[:size], data[size:]
            try:
                self._objects.at(*place).take(part)
            except Abort:  # a PDO has nobody to tell: what is refused is not written
                continue
            written.append(place)
        return written
