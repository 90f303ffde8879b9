"""What an slcan (LAWICEL) adapter sends, as frames. Pure: bytes in, frames out.

python-can opens such an adapter and writes to it, but reads byte by byte: 110 to 340 us a frame, where a full bus of
1 Mbit/s has one every 110 us. Here a frame costs some 1 us (benchmarks/controller/full_buses.py).
Source: LAWICEL CANUSB manual v1.0D, section 3; lines end with CR, and BEL stands for a refusal.
"""

from __future__ import annotations

import re
from typing import Final

from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords

FRAME: Final = re.compile(rb"(?:([Tx])([01][0-9A-Fa-f]{7})|t([0-7][0-9A-Fa-f]{2}))([0-8])([0-9A-Fa-f]*)")
"""`x` is the T of a CANDapter."""
STAMP: Final = 4
"""Hex digits that an adapter may add, ms of its own clock (command Z1)."""
ANSWERS: Final = re.compile(rb"[zZ]?|V[0-9A-Fa-f]{4}|v\w*|N\w{4}|F[0-9A-Fa-f]{2}")
"""To what was sent: done, or what was asked for."""
LONGEST: Final = 64
"""Bytes; the longest line has 30. What is longer without an end is none."""


class SlcanLines:
    """Keeps half a line until the rest of it comes; what is no line it knows goes to `bad`."""

    def __init__(self, bad: BadRecords) -> None:
        self._bad = bad
        self._rest = b""

    def feed(self, data: bytes) -> list[Frame]:
        """The frames whose last byte is in `data`, in the order in which they came."""
        *lines, self._rest = (self._rest + data.replace(b"\a", b"\r")).split(b"\r")
        if len(self._rest) > LONGEST:
            self._refuse(self._rest)
            self._rest = b""
        return [frame for line in lines if (frame := self._frame(line)) is not None]

    def _frame(self, line: bytes) -> Frame | None:
        found = FRAME.fullmatch(line)
        if found is None:
            if ANSWERS.fullmatch(line) is None:
                self._refuse(line)
            return None
        long, extended, standard, length, digits = found.groups()
        size = 2 * int(length)
        if len(digits) not in (size, size + STAMP):
            self._refuse(line)
            return None
        return Frame(int(extended or standard, 16), long is not None, bytes.fromhex(digits[:size].decode()))

    def _refuse(self, line: bytes) -> None:
        self._bad.add(line[:LONGEST].decode("ascii", "backslashreplace"))
