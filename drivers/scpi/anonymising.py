"""What a SCPI instrument says of its owner: the third field of the answer to `*IDN?`."""

from __future__ import annotations

import re
from collections.abc import Sequence

from drivers.ports.anonymous import in_answers_to
from drivers.ports.transcript import Chunk

QUESTION = re.compile(rb"\*IDN\?", re.IGNORECASE)
SERIAL = re.compile(rb"[^,]*,[^,]*,([^,]+)")
"""IEEE 488.2, 10.14: maker, model, serial number, firmware."""


def anonymise(chunks: Sequence[Chunk]) -> list[Chunk]:
    return in_answers_to(chunks, QUESTION, SERIAL)
