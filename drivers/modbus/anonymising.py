"""What Modbus replies say of the device's owner: nothing, where only the registers of measurements were asked for."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.modbus.rtu import REQUEST_CHARACTERS, crc16
from drivers.ports.transcript import Chunk

READS = (3, 4)


def asked_values(chunks: Sequence[Chunk]) -> list[Chunk]:
    """As they are: our drivers ask for weight, status, unit, division, pressure and temperature, never who it is.

    Raises ValueError where somebody else asked, or nobody: a register may hold a serial number.
    """
    requests = [chunk.data for chunk in chunks if chunk.direction == ">"]
    if not requests:
        raise ValueError("it was only listened to: any register may be a serial number, and its checksum hides no less")
    for request in requests:
        if len(request) != REQUEST_CHARACTERS or crc16(request) != 0 or request[1] not in READS:
            raise ValueError(f"the request {request.hex(' ')} is none of the rig's drivers")
    return list(chunks)
