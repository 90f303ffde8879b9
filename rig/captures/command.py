"""`rig capture SOURCE [DEVICE] -o FILE`: raw bytes with their times, to send in, to replay, to test with."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import click

from drivers import KINDS
from drivers.ports.lines import bits_per_character
from drivers.ports.transcript import read_transcript
from drivers.recognition.serial_line import Rate
from rig.campaign.loading import load_bench
from rig.captures import description
from rig.captures.capturing import Bound, Taken, by_driver, from_bus, from_port, without_names, write
from rig.captures.description import Description
from rig.control.clocks import MonotonicClock
from rig.devices.command import BUS, bus_of
from rig.errors import ConfigError, RigError

LONGEST = 3600.0
"""s"""


@click.command("capture")
@click.argument("source")
@click.argument("device", required=False)
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="The new file of bytes.")
@click.option("--seconds", type=click.FloatRange(0.1, LONGEST), default=10.0, show_default=True, help="So long.")
@click.option(
    "--most-bytes", type=click.IntRange(1000), default=20_000_000, show_default=True, help="Largest size of the file."
)
@click.option("--anonymise", is_flag=True, help="Replace serial numbers, or refuse where that can't be done.")
@click.option("--baud", type=click.IntRange(1), help="Of a port that is only listened to.")
@click.option("--framing", default="8N1", show_default=True, help="The same: data bits, parity, stop bits.")
@click.option("--kind", default="", help="The same: of which kind the device is, where you know it.")
def capture_command(
    source: str,
    device: str | None,
    output: Path,
    seconds: float,
    most_bytes: int,
    anonymise: bool,
    baud: int | None,
    framing: str,
    kind: str,
) -> None:
    """Write what passes on a wire, with its times, to a file that `rig replay` plays.

    SOURCE is a bench file, and DEVICE one of its devices, which is opened as a run opens it (no motor is driven); or a
    PORT with --baud, or a bus such as slcan:/dev/ttyACM0@500000, which are only listened to.
    """
    _require_new(output)
    if kind and kind not in KINDS:
        raise ConfigError(f"--kind {kind!r} is no kind of device; known are {', '.join(KINDS)}")
    part = output.with_name(output.name + ".part")
    _require_new(part)
    try:
        taken, found = _take(source, device, part, Bound(seconds, most_bytes), _rate(baud, framing), kind)
        if anonymise:
            write(part, without_names(part, found.kind))
        part.rename(output)
    except OSError as error:
        raise ConfigError(f"{output} can't be written: {error.strerror}") from error
    finally:
        part.unlink(missing_ok=True)
    description.write(output, replace(found, anonymised=anonymise))
    _tell(output, taken, anonymised=anonymise)


def _require_new(path: Path) -> None:
    for each in (path, description.path_of(path)):
        if each.exists():
            raise ConfigError(f"{each} exists and is not overwritten: give --output another name")
    if path.suffix == ".toml":
        raise ConfigError(f"{path}: the description of the capture has this ending; name it {path.with_suffix('.txt')}")


def _rate(baud: int | None, framing: str) -> Rate | None:
    try:
        bits_per_character(framing)
    except ValueError as error:
        raise ConfigError(f"--framing: {error}") from None
    return None if baud is None else Rate(baud, framing)


def _take(
    source: str, device: str | None, part: Path, bound: Bound, rate: Rate | None, kind: str
) -> tuple[Taken, Description]:
    clock = MonotonicClock()
    if source.endswith(".toml"):
        bench = load_bench(Path(source))
        if device is None:
            raise ConfigError(f"{source}: which device? It has {', '.join(bench.devices)}")
        taken = by_driver(bench, device, part, bound, clock)
        config = bench.devices[device]
        bitrate = bench.can[config.options.bus].bitrate if KINDS[config.kind].link == "can" else 0
        return taken, Description(config.kind, device, bitrate=bitrate, options=config.options)
    if device is not None:
        raise ConfigError(f"{device!r} is a device of what? {source} is no bench file (.toml)")
    if re.fullmatch(BUS, source):
        bus = bus_of(source)
        return from_bus(bus, part, bound, clock), Description(kind, listened=True, bitrate=bus.bitrate)
    if rate is None:
        raise ConfigError(f"{source} is a port that is listened to: give --baud (rig devices {source} finds it)")
    return from_port(source, rate, part, bound, clock), Description(kind, listened=True)


def _tell(output: Path, taken: Taken, *, anonymised: bool) -> None:
    try:
        chunks = list(read_transcript(output))
    except (ValueError, OSError) as error:
        raise RigError(str(error)) from error
    came = sum(len(chunk.data) for chunk in chunks if chunk.direction == "<")
    sent = sum(len(chunk.data) for chunk in chunks if chunk.direction == ">")
    span = (chunks[-1].t_ns - chunks[0].t_ns) * 1e-9 if chunks else 0.0
    click.echo(f"{output}: {came} bytes came and {sent} were sent in {span:.1f} s")
    if taken.identity:
        whose = "" if anonymised else f" of {taken.identity}"
        click.echo(f"{len(taken.rows)} rows{whose}; {taken.bad} lines or frames were not understood")
    if taken.full:
        click.echo("it ended because the file is as large as it may be (--most-bytes)")
    if not came:
        click.echo("nothing came: a device that is polled is captured by its driver (rig capture BENCH DEVICE)")
