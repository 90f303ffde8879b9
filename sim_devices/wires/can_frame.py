"""One classic CAN frame, as it is on the bus."""

from __future__ import annotations

from typing import NamedTuple


class CanFrame(NamedTuple):
    """`extended`: 29-bit id. A remote frame has no data; `length` is what it asks for."""

    id: int
    data: bytes = b""
    extended: bool = True
    remote: bool = False
    length: int = 0
