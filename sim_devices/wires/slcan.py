"""Device side of CAN adapters that speak LAWICEL (slcan): any number of them on one bus.

Source: LAWICEL CANUSB manual v1.0D and python-can can/interfaces/slcan.py. ASCII lines ended by CR; the adapter
answers CR (done) or BEL (refused). `t`/`T`/`r`/`R` frames are acknowledged `z`/`Z` CR. Frames before `O`, and
bit-rate changes after it, are refused.
"""

from __future__ import annotations

from sim_devices.wires.can_frame import CanFrame

CR, BEL = b"\r", b"\a"
MAX_LINE = 64
"""characters: the longest command has 27; what is longer is garbage and is refused."""
SPEEDS = b"0123456789"
"""S0 (10 kbit/s) .. S8 (1 Mbit/s); S9 is python-can's 83.3 kbit/s."""


def encode(frame: CanFrame) -> bytes:
    """The line an adapter sends for a frame it received."""
    kind = ("R" if frame.remote else "T") if frame.extended else ("r" if frame.remote else "t")
    identifier = f"{frame.id:08X}" if frame.extended else f"{frame.id:03X}"
    length = frame.length if frame.remote else len(frame.data)
    return f"{kind}{identifier}{length:d}{frame.data.hex().upper()}".encode("ascii") + CR


def decode(line: bytes) -> CanFrame | None:
    """A t/T/r/R line without CR as a frame; None: it is not one."""
    kind = line[:1]
    extended, remote = kind in b"TR", kind in b"rR"
    digits = 8 if extended else 3
    try:
        identifier = int(line[1 : 1 + digits], 16)
        length = int(line[1 + digits : 2 + digits], 16)
        data = bytes.fromhex(line[2 + digits :].decode("ascii"))
    except ValueError:
        return None
    if identifier > (0x1FFFFFFF if extended else 0x7FF) or length > 8 or len(data) != (0 if remote else length):
        return None
    return CanFrame(identifier, data, extended, remote, length if remote else 0)


class Adapter:
    """One adapter: a state (closed, open, listening) and half a line."""

    def __init__(self) -> None:
        self._buffer = b""
        self.open = False
        self._listen_only = False

    def feed(self, data: bytes) -> tuple[bytes, list[CanFrame]]:
        """What the host sent: (answer to it, frames that go on the bus)."""
        self._buffer += data
        answer, frames = b"", []
        while (end := self._buffer.find(CR)) >= 0:
            line, self._buffer = self._buffer[:end], self._buffer[end + 1 :]
            line = line.lstrip(b"\n")
            if line[:1] and line[:1] in b"tTrR":
                frame = decode(line) if self.open and not self._listen_only else None
                if frame is not None:
                    frames.append(frame)
                answer += BEL if frame is None else (b"Z" if frame.extended else b"z") + CR
            else:
                answer += self._command(line)
        if len(self._buffer) > MAX_LINE:
            self._buffer = b""
            answer += BEL
        return answer, frames

    def deliver(self, frame: CanFrame) -> bytes:
        """A frame of somebody else on the bus, as the host of this adapter sees it."""
        return encode(frame) if self.open else b""

    def _command(self, line: bytes) -> bytes:
        match line[:1]:
            case b"":
                return CR
            case b"S" if len(line) == 2 and line[1:] in SPEEDS:
                return BEL if self.open else CR
            case b"s" if len(line) == 5:
                return BEL if self.open else CR
            case b"O" | b"L" if len(line) == 1:
                return self._open(listen_only=line == b"L")
            case b"C" if len(line) == 1:
                self.open = False
                return CR
            case b"V":
                return b"V1013" + CR
            case b"N":
                return b"NSIM1" + CR
            case b"F":
                return (b"F00" + CR) if self.open else BEL
            case _:
                return BEL

    def _open(self, *, listen_only: bool) -> bytes:
        """Open the channel. Opening an open channel is answered CR: python-can opens twice."""
        self._listen_only = listen_only
        self.open = True
        return CR
