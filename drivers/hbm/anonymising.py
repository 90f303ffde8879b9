"""What AED electronics say of their owner: the serial number in the answer to `IDN?`."""

from __future__ import annotations

import re
from collections.abc import Sequence

from drivers.ports.anonymous import with_pseudonyms
from drivers.ports.transcript import Chunk

SERIAL = re.compile(rb"HBM,[^,\r\n]*,([^,\r\n]*)")
"""Maker, type, serial number, version (ba_aed104_8, IDN). There is no checksum."""


def anonymise(chunks: Sequence[Chunk]) -> list[Chunk]:
    return with_pseudonyms(chunks, SERIAL)
