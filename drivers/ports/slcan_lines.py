"""What an slcan (LAWICEL) adapter sends, as frames. Pure: bytes in, frames out.

python-can opens such an adapter and writes to it, but reads byte by byte: 110 to 340 us a frame, where a full bus of
1 Mbit/s has one every 110 us. Here a frame costs some 1.5 us, and one that nobody wants half of it
(benchmarks/decoders.py).
Source: LAWICEL CANUSB manual v1.0D, section 3; lines end with CR, and BEL stands for a refusal.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords

HEX: Final = b"[0-9A-Fa-f]"
DATA: Final = b"|".join(b"%d%b{%d}" % (size, HEX, 2 * size) for size in range(1, 9))
FRAME: Final = b"(?:t[0-7]%b{2}|[Tx][01]%b{7})(?:0|%b)(?:%b{4})?" % (HEX, HEX, DATA, HEX)
"""`x` is the T of a CANDapter. An adapter may add four digits, ms of its own clock (command Z1)."""
ONE_FRAME: Final = re.compile(FRAME)
FRAMES: Final = re.compile(b"(?:%b\r)*+" % FRAME)
"""As nearly all that comes together is: its lines need not be looked at one by one."""
STANDARD: Final = ord("t")
ANSWERS: Final = re.compile(rb"[zZ]?|V[0-9A-Fa-f]{4}|v\w*|N\w{4}|F[0-9A-Fa-f]{2}")
"""To what was sent: done, or what was asked for."""
LONGEST: Final = 64
"""Bytes; the longest line has 30. What is longer without an end is none."""
REMEMBERED: Final = 10_000
"""Identifiers; of a bus with more (noise, or somebody who means harm) all are asked about anew now and then."""


class SlcanLines:
    """Keeps half a line until the rest of it comes; what is no line it knows goes to `bad`."""

    def __init__(self, bad: BadRecords, wanted: Callable[[int, bool], bool] | None = None) -> None:
        """`wanted(identifier, extended)`: whether somebody takes such frames, others are only counted; None: all."""
        self.sound = 0
        """Frames so far, wanted or not."""
        self._bad, self._wanted = bad, wanted
        self._remembered: dict[bytes, bool] = {}
        self._rest = b""

    def feed(self, data: bytes) -> list[Frame]:
        """The frames whose last byte is in `data` and that are wanted, in the order in which they came."""
        whole, end, self._rest = (self._rest + data.replace(b"\a", b"\r")).rpartition(b"\r")
        lines = whole.split(b"\r") if end else []
        if FRAMES.fullmatch(whole + end) is None:
            lines = [line for line in lines if self._is_frame(line)]
        if len(self._rest) > LONGEST:
            self._refuse(self._rest)
            self._rest = b""
        self.sound += len(lines)
        return self._of_interest(lines)

    def forget(self) -> None:
        """What is wanted has become something else."""
        self._remembered = {}

    def _is_frame(self, line: bytes) -> bool:
        if ONE_FRAME.fullmatch(line) is not None:
            return True
        if ANSWERS.fullmatch(line) is None:
            self._refuse(line)
        return False

    def _of_interest(self, lines: list[bytes]) -> list[Frame]:
        frames = []
        for line in lines:
            head = line[:4] if line[0] == STANDARD else line[:9]
            wanted = self._remembered.get(head)
            if wanted or (wanted is None and self._ask(head)):
                start = len(head) + 1
                digits = line[start : start + 2 * int(line[start - 1 : start])]
                frames.append(Frame(int(head[1:], 16), line[0] != STANDARD, bytes.fromhex(digits.decode())))
        return frames

    def _ask(self, head: bytes) -> bool:
        if len(self._remembered) >= REMEMBERED:
            self.forget()
        remembered = self._remembered  # that of before `forget`, if it comes while somebody is asked
        wanted = self._wanted is None or self._wanted(int(head[1:], 16), head[0] != STANDARD)
        return remembered.setdefault(head, wanted)

    def _refuse(self, line: bytes) -> None:
        self._bad.add(line[:LONGEST].decode("ascii", "backslashreplace"))
