"""The object dictionary of a simulated CANopen device, and what its SDO server answers (CiA 301, 7.2.4)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

TOGGLE, NO_SUCH_COMMAND = 0x05030000, 0x05040001
WRITE_ONLY, READ_ONLY, NO_OBJECT, NO_SUB = 0x06010001, 0x06010002, 0x06020000, 0x06090011
WRONG_LENGTH, OUT_OF_RANGE, NOT_NOW = 0x06070010, 0x06090030, 0x08000022
"""Abort codes."""
Value = int | float | bytes


class Abort(Exception):
    """A transfer that the server gives up, with its code."""

    def __init__(self, code: int) -> None:
        self.code = code


@dataclass(slots=True)
class Object:
    """`form`: a struct code (b B h H i I f) or s, a text."""

    form: str
    value: Value = 0
    writable: bool = False
    check: Callable[[int], int] | None = None
    """Given the new value, the abort code that it is refused with; 0: it is taken."""

    def packed(self) -> bytes:
        if isinstance(self.value, bytes):
            return self.value
        return struct.pack(f"<{self.form}", self.value)

    def take(self, data: bytes) -> None:
        """Raises Abort."""
        if not self.writable:
            raise Abort(READ_ONLY)
        if self.form == "s" or len(data) != struct.calcsize(f"<{self.form}"):
            raise Abort(WRONG_LENGTH)
        (value,) = struct.unpack(f"<{self.form}", data)
        if self.check is not None and (code := self.check(value)):
            raise Abort(code)
        self.value = value

    @property
    def number(self) -> int:
        assert isinstance(self.value, int)
        return self.value


class Dictionary(dict[tuple[int, int], Object]):
    """Objects by index and sub-index."""

    def at(self, index: int, sub: int) -> Object:
        """Raises Abort."""
        if (index, sub) in self:
            return self[index, sub]
        raise Abort(NO_SUB if any(known == index for known, _ in self) else NO_OBJECT)

    def number(self, index: int, sub: int = 0, otherwise: int = 0) -> int:
        found = self.get((index, sub))
        return otherwise if found is None else found.number


class SdoServer:
    """Expedited transfers both ways, and segments for what is longer than four bytes and read."""

    def __init__(self, objects: Dictionary, written: Callable[[int, int], None]) -> None:
        self._objects, self._written = objects, written
        self._left: bytes | None = None
        self._toggle = 0

    def reply(self, request: bytes) -> bytes | None:
        """Eight bytes for eight bytes; None: nothing is said to an abort, or to a frame that is no request."""
        if len(request) != 8 or request[0] >> 5 == 4:  # abort
            self._left = None
            return None
        index, sub = struct.unpack("<HB", request[1:4])
        try:
            match request[0] >> 5:
                case 1:
                    return self._download(request, index, sub)
                case 2:
                    return self._upload(request, index, sub)
                case 3 if self._left is not None:
                    return self._segment(request[0] >> 4 & 1)
            raise Abort(NO_SUCH_COMMAND)
        except Abort as abort:
            self._left = None
            return b"\x80" + request[1:4] + struct.pack("<I", abort.code)

    def _download(self, request: bytes, index: int, sub: int) -> bytes:
        target, command = self._objects.at(index, sub), request[0]
        if not command & 2:  # a transfer in segments: nothing here is longer than four bytes and writable
            raise Abort(WRONG_LENGTH if target.writable else READ_ONLY)
        whole = struct.calcsize(f"<{target.form}") if target.form != "s" else 4
        length = 4 - (command >> 2 & 3) if command & 1 else whole
        target.take(request[4 : 4 + length])
        self._written(index, sub)
        return b"\x60" + request[1:4] + bytes(4)

    def _upload(self, request: bytes, index: int, sub: int) -> bytes:
        data = self._objects.at(index, sub).packed()
        if len(data) <= 4:
            return bytes((0x43 | (4 - len(data)) << 2,)) + request[1:4] + data.ljust(4, b"\0")
        self._left, self._toggle = data, 0
        return b"\x41" + request[1:4] + struct.pack("<I", len(data))

    def _segment(self, toggle: int) -> bytes:
        if toggle != self._toggle:
            raise Abort(TOGGLE)
        part, rest = (self._left or b"")[:7], (self._left or b"")[7:]
        head = toggle << 4 | (7 - len(part)) << 1 | (0 if rest else 1)
        self._left, self._toggle = rest or None, toggle ^ 1
        return bytes((head,)) + part.ljust(7, b"\0")
