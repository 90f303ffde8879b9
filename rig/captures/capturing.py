"""Bytes of a device or a bus into a file, for so long and so many: asked by its driver, or only listened to."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from drivers import KINDS
from drivers.errors import DeviceError as DriverDeviceError
from drivers.errors import LinkError as DriverLinkError
from drivers.ports.anonymous import from_zero
from drivers.ports.can_bus import CanBus
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.transcript import Chunk, Transcript, read_transcript
from drivers.protocols import Sample
from drivers.recognition.serial_line import Rate
from rig.campaign.config import BenchConfig
from rig.control.clocks import Clock
from rig.devices.seen import Bus
from rig.errors import ConfigError, DeviceError, LinkError

TURN = 0.02
"""s between two looks, as in a run of 50 Hz."""


@dataclass(frozen=True, slots=True)
class Bound:
    """What ends a capture."""

    seconds: float
    most_bytes: int
    """Of the file."""


@dataclass(frozen=True, slots=True)
class Taken:
    """What a capture holds."""

    identity: str
    """Of the device, as its driver opened it; empty: it was only listened to."""
    rows: tuple[Sample, ...]
    """That the driver made of it."""
    bad: int
    full: bool
    """Whether the size ended it."""


def by_driver(bench: BenchConfig, name: str, file: Path, bound: Bound, clock: Clock) -> Taken:
    """The device of a bench file, opened as a run opens it. A motor controller is told 0 at most, never driven.

    Raises ConfigError, LinkError, DeviceError.
    """
    if name not in bench.devices:
        raise ConfigError(f"{bench.path} has no device {name!r}; it has {', '.join(bench.devices)}")
    device = bench.devices[name]
    kind = KINDS[device.kind]
    with _errors(), contextlib.ExitStack() as closing:
        if kind.link == "can":
            config = bench.can[device.options.bus]
            bus = CanBus(config.interface, config.channel, config.bitrate, str(file))
            closing.callback(bus.close)
            bus.open()
            instrument = kind.build(name, device.options, bus)
        else:
            instrument = kind.build(name, replace(device.options, capture=str(file)))
        closing.callback(instrument.close)
        identity = instrument.open()
        rows: list[Sample] = []

        def look() -> bool:
            rows.extend(instrument.drain())
            return instrument.health().alive

        full = _until(look, file, bound, clock)
        health = instrument.health()
        if not health.alive:
            raise LinkError(f"{name}: {health.error or 'its link is gone'}")
    return Taken(identity, tuple(rows), health.bad, full)


def from_port(port: str, rate: Rate, file: Path, bound: Bound, clock: Clock) -> Taken:
    """What comes at a port by itself. Raises LinkError."""
    line: SerialPort[bytes] = SerialPort(port, SerialSettings(port, rate.baud, rate.framing, str(file)), _nothing)
    with _errors():
        line.open()
        try:
            full = _until(lambda: line.alive, file, bound, clock)
            if line.error:
                raise LinkError(line.error)
        finally:
            line.close()
    return Taken("", (), 0, full)


def from_bus(bus: Bus, file: Path, bound: Bound, clock: Clock) -> Taken:
    """What is said on a bus. Raises LinkError, or ConfigError for an adapter that is none."""
    try:
        can = CanBus(bus.interface, bus.channel, bus.bitrate, str(file))
    except ValueError as error:
        raise ConfigError(f"{bus}: {error}") from None
    with _errors():
        can.open()
        try:
            full = _until(lambda: can.alive, file, bound, clock)
            health = can.health()
            if health.error:
                raise LinkError(health.error)
        finally:
            can.close()
    return Taken("", (), health.bad, full)


def without_names(file: Path, kind: str) -> list[Chunk]:
    """The chunks of a capture without what tells whose they are. Raises ConfigError where that cannot be done."""
    change = KINDS[kind].anonymise if kind in KINDS else None
    if change is None:
        whose = f"of a {kind}" if kind else "of a device of which nobody said the kind (--kind)"
        raise ConfigError(f"the capture {whose} can't be anonymised: nobody knows what its bytes say; nothing is kept")
    try:
        chunks = list(read_transcript(file))
        return from_zero(change(chunks)) if chunks else []
    except ValueError as error:
        raise ConfigError(f"the capture can't be anonymised: {error}; nothing is kept") from error


def write(file: Path, chunks: list[Chunk]) -> None:
    """A new transcript."""
    file.unlink(missing_ok=True)
    transcript = Transcript(file)
    for chunk in chunks:
        transcript.write(*chunk)
    transcript.close()
    if transcript.error:
        raise ConfigError(transcript.error)


def _until(look: Callable[[], bool], file: Path, bound: Bound, clock: Clock) -> bool:
    """Whether the file was full before its time was over."""
    begun = clock.now_ns()
    while clock.now_ns() - begun < bound.seconds * 1e9 and look():
        if file.stat().st_size >= bound.most_bytes:
            return True
        clock.sleep_until_ns(clock.now_ns() + round(TURN * 1e9))
    return False


def _nothing(_data: bytes) -> list[bytes]:
    return []


@contextlib.contextmanager
def _errors() -> Iterator[None]:
    try:
        yield
    except DriverLinkError as error:
        raise LinkError(str(error)) from error
    except DriverDeviceError as error:
        raise DeviceError(str(error)) from error
