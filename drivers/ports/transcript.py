"""Raw bytes with time stamps in a text file, so that a conversation with a real device can become a test.

One line per chunk: `<monotonic ns> < <hex>` for bytes that came, `>` for bytes that were sent.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal, NamedTuple

Direction = Literal["<", ">"]
_DIRECTIONS: dict[str, Direction] = {"<": "<", ">": ">"}


class Chunk(NamedTuple):
    """Bytes that came or went at one monotonic time in ns."""

    t_ns: int
    direction: Direction
    data: bytes


class Transcript:
    """Appends chunks to a file; each is one write, so two threads may share it. A full disk ends only this."""

    def __init__(self, path: Path) -> None:
        self.error: str | None = None
        self._file = path.open("ab", buffering=0)

    def write(self, t_ns: int, direction: Direction, data: bytes) -> None:
        if self.error is not None or self._file.closed:
            return
        try:
            self._file.write(f"{t_ns} {direction} {data.hex(' ')}\n".encode())
        except OSError as error:
            self.error = f"transcript {self._file.name} ended: {error}"

    def close(self) -> None:
        self._file.close()


def read_transcript(path: Path) -> Iterator[Chunk]:
    """The chunks of a transcript in order. Raises ValueError naming the line that is not one."""
    for number, line in enumerate(path.read_text(encoding="ascii").splitlines(), start=1):
        stamp, _, rest = line.partition(" ")
        direction, _, text = rest.partition(" ")
        if not stamp.isdigit() or direction not in _DIRECTIONS:
            raise ValueError(f"{path} line {number}: expected '<ns> < <hex>' or '<ns> > <hex>', came {line!r}")
        yield Chunk(int(stamp), _DIRECTIONS[direction], bytes.fromhex(text))
