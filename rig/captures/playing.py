"""A capture through the driver of its device, in the time of its bytes: the rows that a run would have had."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from drivers import KINDS
from drivers.errors import DeviceError as DriverDeviceError
from drivers.errors import LinkError as DriverLinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.replayed_wire import ReplayedWire, as_slcan, is_frame
from drivers.ports.transcript import Chunk, read_transcript
from drivers.protocols import Instrument, LinkHealth, Sample, Stream
from rig.captures.capturing import TURN
from rig.captures.description import Description
from rig.errors import DeviceError, RecordingError

Pace = Callable[[float], None]
"""Told the time of the capture (s), again and again; may wait."""


@dataclass(frozen=True, slots=True)
class Played:
    """What a driver made of a capture."""

    identity: str
    streams: tuple[Stream, ...]
    rows: tuple[Sample, ...]
    health: LinkHealth
    differences: tuple[str, ...]
    """Where the driver asks otherwise now than it did then."""


def chunks_of(capture: Path) -> list[Chunk]:
    """Raises RecordingError for a file that is no capture, or an empty one."""
    try:
        chunks = list(read_transcript(capture))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise RecordingError(f"{capture} is no capture that can be read: {reason}") from error
    if not any(chunk.direction == "<" for chunk in chunks):
        raise RecordingError(f"{capture} holds nothing that came from a device")
    return chunks


def play(chunks: list[Chunk], found: Description, pace: Pace) -> Played:
    """Raises DeviceError where the driver does not open with these bytes."""
    kind = KINDS[found.kind]
    if kind.link == "can":
        wire = ReplayedWire(as_slcan(chunks), is_frame)
        bus = CanBus("slcan", "replay", found.bitrate, wire=wire)
        bus.open()
        device: Instrument = kind.build(found.device, found.options, bus)
        closing = [device.close, bus.close]
    else:
        wire = ReplayedWire(chunks)
        device = kind.build(found.device, found.options, wire)
        closing = [device.close]
    try:
        identity = device.open()
        rows = tuple(_rows(device, wire, pace))
        return Played(identity, device.streams, rows, device.health(), tuple(wire.differences))
    except (DriverDeviceError, DriverLinkError) as error:
        raise DeviceError(f"the driver of kind {found.kind} does not open on this capture: {error}") from error
    finally:
        for close in closing:
            close()


def _rows(device: Instrument, wire: ReplayedWire, pace: Pace) -> Iterable[Sample]:
    while not wire.over:
        yield from device.drain()
        wire.wait(TURN)
        pace(wire.now())
    yield from device.drain()


def exact(rows: Iterable[Sample]) -> str:
    """Rows as text that is the same only where they are the same to the bit."""
    return "".join(f"{row.stream} {row.t_ns} {' '.join(float(v).hex() for v in row.values)}\n" for row in rows)
