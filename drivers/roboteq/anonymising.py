"""What a Roboteq controller says of its owner: the number of its processor (`?UID`), where somebody asked for it."""

from __future__ import annotations

import re
from collections.abc import Sequence

from drivers.ports.anonymous import with_pseudonyms
from drivers.ports.transcript import Chunk

UID = re.compile(rb"(?:^|[\r\n])UID=([-:\d]+)")
"""Manual V2.1, `?UID`. FID and TRN are firmware and model. There is no checksum."""


def anonymise(chunks: Sequence[Chunk]) -> list[Chunk]:
    return with_pseudonyms(chunks, UID)
