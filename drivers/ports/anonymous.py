"""A transcript that says no longer whose device it is of: serial numbers become others of the same length and form.

What a kind's wire may say of its owner only that kind knows (`Kind.anonymise`); here are the parts of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from drivers.ports.transcript import Chunk, Direction

LINE = re.compile(rb"[^\r\n]+")


class Pseudonyms:
    """One for each serial number, the same wherever it comes again; it cannot be turned back."""

    def __init__(self) -> None:
        self.names: dict[bytes, bytes] = {}

    def of(self, serial: bytes) -> bytes:
        """Its letters and marks stay, its digits count the serial numbers of the file: `B021002593` is `B000000001`."""
        if serial not in self.names:
            digits = sum(48 <= byte <= 57 for byte in serial)
            count = iter(str(len(self.names) + 1).encode().rjust(digits, b"0")[-digits:] if digits else b"")
            self.names[serial] = bytes(next(count) if 48 <= byte <= 57 else byte for byte in serial)
        return self.names[serial]


def changed(chunks: Sequence[Chunk], direction: Direction, change: Callable[[bytes], bytes]) -> list[Chunk]:
    """The chunks, of which all of one `direction` went through `change` as one piece, which keeps its length."""
    whole = b"".join(chunk.data for chunk in chunks if chunk.direction == direction)
    made, at, out = change(whole), 0, []
    if len(made) != len(whole):
        raise ValueError(f"a change of {len(whole)} bytes gave {len(made)}")
    for chunk in chunks:
        if chunk.direction == direction:
            out.append(chunk._replace(data=made[at : at + len(chunk.data)]))
            at += len(chunk.data)
        else:
            out.append(chunk)
    return out


def with_pseudonyms(chunks: Sequence[Chunk], pattern: re.Pattern[bytes]) -> list[Chunk]:
    """Group 1 of each match in what came is a serial number."""
    names = Pseudonyms()

    def rename(data: bytes) -> bytes:
        return pattern.sub(lambda found: _replaced(found, names.of(found[1])), data)

    return changed(chunks, "<", rename)


def in_answers_to(chunks: Sequence[Chunk], question: re.Pattern[bytes], pattern: re.Pattern[bytes]) -> list[Chunk]:
    """Group 1 of `pattern` in the line that came next after each `question` was sent: of answers that do not say which
    question they answer."""
    names, asked, at = Pseudonyms(), list[int](), 0
    for chunk in chunks:
        if chunk.direction == "<":
            at += len(chunk.data)
        else:
            asked += [at] * len(question.findall(chunk.data))

    def rename(data: bytes) -> bytes:
        for begin in asked:
            line = LINE.search(data, begin)
            if line is not None and (found := pattern.search(line[0])):
                start = line.start() + found.start(1)
                data = data[:start] + names.of(found[1]) + data[start + len(found[1]) :]
        return data

    return changed(chunks, "<", rename)


def as_it_is(chunks: Sequence[Chunk]) -> list[Chunk]:
    """Of a wire on which nothing is ever said of whose device it is."""
    return list(chunks)


def _replaced(found: re.Match[bytes], name: bytes) -> bytes:
    start, end = found.start(1) - found.start(), found.end(1) - found.start()
    return found[0][:start] + name + found[0][end:]


def from_zero(chunks: Sequence[Chunk]) -> list[Chunk]:
    """Times since the earliest chunk: the machine's own clock counts from its start."""
    begin = min(chunk.t_ns for chunk in chunks)
    return [chunk._replace(t_ns=chunk.t_ns - begin) for chunk in chunks]
