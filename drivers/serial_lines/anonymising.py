"""What lines of text say of the device's owner, and how they say it no longer."""

from __future__ import annotations

import re
from collections.abc import Sequence

from drivers.ports.anonymous import Pseudonyms, changed, in_answers_to, with_pseudonyms
from drivers.ports.transcript import Chunk
from drivers.serial_lines.nortek_nmea import checksum

MT_SICS_SERIAL = re.compile(rb'(?:^|[\r\n])I4 A "([^"\r\n]*)"')
"""Manual 11780711, I4."""
LOADSTAR_ID = re.compile(rb"(?:^|\r)ID\r")
MANTRACOURT_SERIAL = re.compile(rb"!\d{3}:SER[LH]\?")
"""DCell & DSC user manual, table of commands."""
SARTORIUS_SERIAL = re.compile(rb"\x1bx2_")
NORTEK = re.compile(rb"\$(PNOR[A-Z0-9]*)([^$*\r\n]*)\*[0-9A-Fa-f]{2}")
NORTEK_VALUES = (b"PNORC", b"PNORS")
"""Sentences of velocities and sensors; Signature Integrator's Guide p. 68-77."""
NORTEK_HEAD = re.compile(rb"\d{4,}")
"""The number in `PNORI`: type and serial number of the head."""


def mt_sics(chunks: Sequence[Chunk]) -> list[Chunk]:
    """I4 gives the serial number. There is no checksum."""
    return with_pseudonyms(chunks, MT_SICS_SERIAL)


def loadstar(chunks: Sequence[Chunk]) -> list[Chunk]:
    """`ID` asks for the serial number."""
    return in_answers_to(chunks, LOADSTAR_ID, re.compile(rb"(.+)"))


def mantracourt(chunks: Sequence[Chunk]) -> list[Chunk]:
    """SERL and SERH are the serial number; a number keeps its form."""
    return in_answers_to(chunks, MANTRACOURT_SERIAL, re.compile(rb"[+-](\d+)"))


def sartorius(chunks: Sequence[Chunk]) -> list[Chunk]:
    """ESC x2_ asks for the serial number."""
    return in_answers_to(chunks, SARTORIUS_SERIAL, re.compile(rb"(\S+)\s*$"))


def nortek(chunks: Sequence[Chunk]) -> list[Chunk]:
    """PNORI has the serial number of the head; checksums are made anew. Raises ValueError for unknown sentences."""
    names = Pseudonyms()

    def rename(found: re.Match[bytes]) -> bytes:
        identifier, fields = found[1], found[2]
        if identifier.startswith(NORTEK_VALUES):
            return found[0]
        if not identifier.startswith(b"PNORI"):
            raise ValueError(f"it is not known what a {identifier.decode()} says of the instrument")
        body = identifier + NORTEK_HEAD.sub(lambda number: names.of(number[0]), fields)
        return b"$%s*%02X" % (body, checksum(body))

    return changed(chunks, "<", lambda data: NORTEK.sub(rename, data))


def numbers(chunks: Sequence[Chunk]) -> list[Chunk]:
    """Lines of a number and a unit say nothing. Raises ValueError for any other."""
    lines = b"".join(chunk.data for chunk in chunks if chunk.direction == "<").replace(b"\r", b"\n").split(b"\n")[1:-1]
    for line in lines:
        if re.fullmatch(rb"[-+.,;:\s\d]*[A-Za-z/]{0,6}\s*", line) is None:
            raise ValueError(f"a line such as {line[:40]!r} may say more than a number, and nobody knows what")
    return list(chunks)
