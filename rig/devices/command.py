"""`rig devices [PORT ...] [--can BUS]`: what is on this port or bus."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import click

from drivers import KINDS
from drivers.ports.machine_ports import machine_ports
from drivers.recognition.serial_line import Rate, SerialProbe
from rig.devices.bench_file import write
from rig.devices.looking import LISTEN, can_probes, look_at_bus, look_at_port, rates_of, serial_probes, without_probe
from rig.devices.seen import Bus, BusSeen, PortSeen
from rig.devices.text import told
from rig.errors import ConfigError

BUS = re.compile(r"(?P<interface>\w+):(?P<channel>.+)@(?P<bitrate>\d{4,7})")


def bus_of(text: str) -> Bus:
    """`slcan:/dev/ttyACM0@500000`. Raises ConfigError."""
    found = BUS.fullmatch(text)
    if found is None:
        raise ConfigError(
            f"--can {text!r} must be INTERFACE:CHANNEL@BITRATE, such as slcan:/dev/ttyACM0@500000 or"
            " socketcan:can0@500000; the bit rate is not searched for, because a wrong one disturbs the bus"
        )
    return Bus(found["interface"], found["channel"], int(found["bitrate"]))


@click.command("devices")
@click.argument("ports", nargs=-1, metavar="[PORT]...")
@click.option("--can", "buses", multiple=True, metavar="BUS", help="A bus: slcan:/dev/ttyACM0@500000. May be repeated.")
@click.option(
    "--kind", "expected", default="", help="The kind that should be there: asked first, and told if it isn't."
)
@click.option("--baud", "bauds", type=int, multiple=True, help="Only this baud rate. May be repeated.")
@click.option("--framing", default="8N1", show_default=True, help="With --baud: data bits, parity, stop bits.")
@click.option(
    "--address", "addresses", type=click.IntRange(1, 247), multiple=True, help="Modbus address asked (default: 1)."
)
@click.option(
    "--seconds",
    type=click.FloatRange(0.1, 60.0),
    default=LISTEN,
    show_default=True,
    help="Listen so long before anything is asked.",
)
@click.option("--listen", is_flag=True, help="Only listen: nothing is sent.")
@click.option("--write", "bench", type=click.Path(path_type=Path), help="Write a bench file to start from.")
@click.option("-v", "--verbose", is_flag=True, help="Say what is tried while it is.")
def devices_command(
    ports: tuple[str, ...],
    buses: tuple[str, ...],
    expected: str,
    bauds: tuple[int, ...],
    framing: str,
    addresses: tuple[int, ...],
    seconds: float,
    listen: bool,
    bench: Path | None,
    verbose: bool,
) -> int:
    """Who is on each PORT and BUS: identity, settings, rate, watchdog. Without any, the ports of this machine.

    Listens first, then asks questions that move and set nothing. Unknown devices may take them otherwise: keep away
    from the propeller, or use --listen.

    Exit status 0 all were recognised, 1 not all.
    """
    if expected and expected not in KINDS:
        raise ConfigError(f"--kind {expected!r} is no kind of device; known are {', '.join(KINDS)}")
    asked = [bus_of(each) for each in buses]
    rates = _rates(bauds, framing)
    if not ports and not asked:
        _list_ports()
        return 0
    said = _say if verbose else _say_nothing
    seen: list[PortSeen | BusSeen] = []
    for port in ports:
        click.echo(f"looking at {port} ...", err=True)
        look = partial(look_at_port, port, rates, addresses or (1,), said)
        seen.append(look(expected=expected, ask=not listen, seconds=seconds))
        _show(seen[-1], expected, bool(rates))
    for bus in asked:
        click.echo(f"looking at {bus} ...", err=True)
        seen.append(_look_at_bus(bus, partial(look_at_bus, say=said, expected=expected, ask=not listen), seconds))
        _show(seen[-1], expected, False)
    if bench is not None:
        count = write(bench, seen)
        click.echo(f"{bench}: {count} device(s); fill in its lines that begin with #!, then rig check a campaign")
    if not all(each.found for each in seen) and without_probe():
        click.echo(f"kinds that cannot be recognised yet: {', '.join(without_probe())}")
    return 0 if all(each.found for each in seen) else 1


def _look_at_bus(bus: Bus, look: Callable[..., BusSeen], seconds: float) -> BusSeen:
    try:
        return look(bus, seconds=seconds)
    except ValueError as error:
        raise ConfigError(f"--can {bus}: {error}") from None


def _rates(bauds: tuple[int, ...], framing: str) -> tuple[Rate, ...]:
    from drivers.ports.lines import bits_per_character

    try:
        bits_per_character(framing)
    except ValueError as error:
        raise ConfigError(f"--framing: {error}") from None
    if wrong := [baud for baud in bauds if baud <= 0]:
        raise ConfigError(f"--baud must be above 0, not {wrong[0]}")
    return tuple(Rate(baud, framing) for baud in bauds)


def _say(line: str) -> None:
    click.echo(f"  ... {line}", err=True)


def _say_nothing(_line: str) -> None:
    """Nobody wants to know."""


def _show(seen: PortSeen | BusSeen, expected: str, only: bool) -> None:
    for line in told(seen, expected, only):
        click.echo(line)


def _list_ports() -> None:
    found = machine_ports()
    for port in found:
        click.echo(f"{port.path}  {port.description}".rstrip())
    if not found:
        click.echo("this machine has no serial port that it knows: connect an adapter")
    click.echo("none was opened. Who is on one: rig devices PORT; on a bus: rig devices --can slcan:PORT@500000")
    click.echo("\nlistened for and asked, in this order:")
    for name, probe in serial_probes():
        click.echo(f"  {name:<14} {probe.asks}; {', '.join(map(str, probe.rates))}")
    for name, can in can_probes():
        click.echo(f"  {name:<14} {can.asks}")
    for name, kind in KINDS.items():
        if isinstance(kind.probe, SerialProbe) and kind.probe.named_only:
            click.echo(f"  {name:<14} {kind.probe.asks}")
    click.echo(f"rates, in this order: {', '.join(map(str, rates_of(serial_probes())))}")
    if without_probe():
        click.echo(f"cannot be recognised yet: {', '.join(without_probe())}")
