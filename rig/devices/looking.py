"""Look at a port or a bus: listen first, then ask, rate by rate, until somebody is recognised."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import zip_longest

from drivers import KINDS
from drivers.errors import LinkError
from drivers.ports.can_bus import CanBus
from drivers.recognition.can_traffic import CanProbe, Traffic
from drivers.recognition.found import Found
from drivers.recognition.serial_line import Line, Rate, SerialProbe
from rig.devices.seen import Bus, BusSeen, PortSeen, Tried

LISTEN = 1.5
"""s: an instrument that sends by itself does so once a second at least, and so do the heartbeats of CAN devices."""
AGAIN = 0.2
"""Of that, at a further rate while nothing has come at any."""
STRANGERS = 3
"""Frames that are shown."""

Say = Callable[[str], None]


def serial_probes(first: str = "") -> list[tuple[str, SerialProbe]]:
    """(kind, probe) in the order of asking, that of the kind `first` in front; some are asked only if they are that."""
    known = ((name, kind.probe) for name, kind in KINDS.items() if isinstance(kind.probe, SerialProbe))
    found = [(name, probe) for name, probe in known if name == first or not probe.named_only]
    return sorted(found, key=lambda pair: (pair[0] != first, pair[1].order))


def can_probes() -> list[tuple[str, CanProbe]]:
    return [(name, kind.probe) for name, kind in KINDS.items() if isinstance(kind.probe, CanProbe)]


def without_probe() -> list[str]:
    """Kinds that cannot be recognised yet."""
    return [name for name, kind in KINDS.items() if kind.probe is None]


def rates_of(probes: Iterable[tuple[str, SerialProbe]]) -> list[Rate]:
    """The factory's rate of every kind, then the second of each, and so on; none twice."""
    columns = zip_longest(*(probe.rates for _, probe in probes))
    return list(dict.fromkeys(rate for column in columns for rate in column if rate is not None))


def look_at_port(
    port: str,
    rates: tuple[Rate, ...],
    addresses: tuple[int, ...],
    say: Say,
    *,
    expected: str = "",
    ask: bool = True,
    seconds: float = LISTEN,
) -> PortSeen:
    """`rates`: only these, each with every kind; empty: those of the kinds. `ask` False: nothing is sent.

    `seconds`: how long a silence is listened to before anything is asked.
    """
    tried: list[Tried] = []
    probes = serial_probes(expected)
    order = list(rates) or rates_of(probes)
    try:
        with Line(port, order[0], addresses) as line:
            for rate in order:
                if tried and not _retuned(line, rate, say):
                    continue
                silent = bool(tried) and not any(each.heard for each in tried)
                line.listen(AGAIN * seconds if silent else seconds)
                if silent and line.heard:
                    line.listen(seconds)
                found, asked = _at_rate(line, probes if ask else [], probes, told=bool(rates))
                tried.append(Tried(rate, line.heard, line.answers, asked, tuple(line.withheld)))
                say(f"{port} at {rate}: {_told(tried[-1])}")
                if found is not None:
                    return PortSeen(port, tuple(tried), found, rate)
    except LinkError as error:
        return PortSeen(port, tuple(tried), error=str(error))
    return PortSeen(port, tuple(tried))


def _retuned(line: Line, rate: Rate, say: Say) -> bool:
    """Not every adapter has every rate: that one is left out. Raises LinkError where the port is lost."""
    try:
        line.retune(rate)
    except LinkError as error:
        if not line.alive:
            raise
        say(str(error))
        return False
    return True


def _told(tried: Tried) -> str:
    asked = f"asked for {', '.join(tried.asked)}" if tried.asked else "asked nothing"
    return f"{len(tried.heard)} bytes heard, {asked}, {len(tried.answers)} bytes answered"


def _at_rate(
    line: Line, asking: list[tuple[str, SerialProbe]], hearing: list[tuple[str, SerialProbe]], *, told: bool
) -> tuple[Found | None, tuple[str, ...]]:
    """Who is there, and the kinds that were asked. `told`: this is the operator's rate, at which all are asked."""
    for _, probe in hearing if line.heard else ():
        if (found := probe.hear(line)) is not None:
            return found, ()
    asked: list[str] = []
    for name, probe in asking:
        if probe.ask is None or not (told or line.rate in probe.rates):
            continue
        asked.append(name)
        if (found := probe.ask(line)) is not None:
            return found, tuple(asked)
    return None, tuple(asked)


def look_at_bus(bus: Bus, say: Say, *, expected: str = "", ask: bool = True, seconds: float = LISTEN) -> BusSeen:
    """Nothing is asked where a device of another kind, or of none that is known, was heard, unless it is `expected`."""
    can = CanBus(bus.interface, bus.channel, bus.bitrate)
    try:
        can.open()
        traffic = Traffic(can)
        traffic.listen(seconds)
        say(f"{bus}: {len(traffic.frames)} frames heard in {traffic.heard_for:.1f} s")
        found, asked = _on_bus(traffic, expected, ask)
        health = can.health()
        if health.error is not None:
            return BusSeen(bus, error=health.error)
        return BusSeen(bus, tuple(found), len(traffic.frames), _strangers(traffic), health.bad, asked)
    except LinkError as error:
        return BusSeen(bus, error=str(error))
    finally:
        can.close()


def _on_bus(traffic: Traffic, expected: str, ask: bool) -> tuple[list[Found], tuple[str, ...]]:
    probes = can_probes()
    found = [each for _, probe in probes for each in probe.hear(traffic)]
    asked: list[str] = []
    for name, probe in probes if ask else ():
        alone = all(probe.owns(frame) for _, frame in traffic.frames)
        if probe.ask is not None and (alone or name == expected):
            asked.append(name)
            traffic.named = name == expected
            found += probe.ask(traffic)
    return found, tuple(asked)


def _strangers(traffic: Traffic) -> tuple[str, ...]:
    return tuple(_first(_unknown(traffic), STRANGERS))


def _unknown(traffic: Traffic) -> Iterator[str]:
    seen: set[int] = set()
    for _, frame in traffic.frames:
        if frame.id not in seen and not any(probe.owns(frame) for _, probe in can_probes()):
            seen.add(frame.id)
            yield str(frame)


def _first(items: Iterator[str], count: int) -> Iterator[str]:
    return (item for _, item in zip(range(count), items, strict=False))
