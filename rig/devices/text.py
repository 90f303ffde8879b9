"""What was seen, in sentences: who is there; or why nobody is, and what to do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from drivers import KINDS
from drivers.ports.lines import printable
from drivers.recognition.found import Found
from rig.devices.seen import BusSeen, PortSeen, Tried

REFUSAL = b"\a\r"
"""What a LAWICEL adapter says to words that it does not know (CANUSB manual 1.0D)."""
MOSTLY = 0.9
"""Share of printable characters from which bytes are taken for text."""


def told(seen: PortSeen | BusSeen, expected: str = "", only: bool = False) -> list[str]:
    """Lines about one port or bus. `only`: the operator named the rates that were tried."""
    if seen.error:
        return [seen.error]
    if isinstance(seen, BusSeen):
        return _bus(seen, expected)
    if seen.found is None:
        return [_nobody(seen, only), *dict.fromkeys(why for each in seen.tried for why in each.withheld)]
    lines = [f"{seen.port}, {seen.rate}: {seen.found.kind}", *_found(seen.found)]
    return [*lines, *_other(expected, [seen.found])]


def _found(found: Found) -> Iterator[str]:
    yield f"  identity   {found.identity}"
    for setting in found.settings:
        yield f"  setting    {setting}"
    if found.rate:
        yield f"  rate       {found.rate}"
    if found.watchdog:
        yield f"  watchdog   {found.watchdog}"
    for key, meaning in found.untold.items():
        yield f"  to be told {key}: {meaning}"


def _other(expected: str, found: Iterable[Found]) -> list[str]:
    kinds = [each.kind for each in found]
    if not expected or expected in kinds:
        return []
    if KINDS[expected].probe is None:
        return [f"whether it is of kind {expected} cannot be recognised yet: it is here by its answers as {kinds[0]}"]
    return [f"no {expected} answers here: it is a device of another kind, {', '.join(kinds)}; change kind or cable"]


def _nobody(seen: PortSeen, only: bool) -> str:
    rates = ", ".join(str(each.rate) for each in seen.tried)
    heard = [each for each in seen.tried if each.heard]
    answered = [each for each in seen.tried if each.answers]
    if not heard and not answered:
        return (
            f"{seen.port}: nothing is heard and nobody answers (tried {rates}). Is the device switched on, are TX and"
            " RX crossed, is it this port? At another baud rate: --baud; at another Modbus address: --address"
        )
    if heard:
        return f"{seen.port}: {_unknown_bytes(heard, only)} (tried {rates})"
    return f"{seen.port}: {_unknown_answers(answered, only)} (tried {rates})"


def _unknown_bytes(heard: list[Tried], only: bool) -> str:
    best = max(heard, key=lambda each: _readable(each.heard))
    if _readable(best.heard) >= MOSTLY:
        return (
            f"a device of another kind sends text at {best.rate}, such as {_sample(best.heard)!r}: where it has a"
            " number, kind line_stream reads it by a pattern (docs/howto/campaign.md)"
        )
    sample = f"something sends, but no known kind reads its bytes ({best.heard[:12].hex(' ')} at {best.rate})"
    if only:
        return f"{sample}: that is probably the wrong baud rate; leave --baud out and all are tried"
    return f"{sample}: the baud rate or framing is one that was not tried (--baud), or it is a device of another kind"


def _unknown_answers(answered: list[Tried], only: bool) -> str:
    if all(set(each.answers) <= set(REFUSAL) for each in answered):
        return "it answers as an slcan CAN adapter does: rig devices --can slcan:PORT@BITRATE looks at its bus"
    best = max(answered, key=lambda each: _readable(each.answers))
    shown = _sample(best.answers) if _readable(best.answers) >= MOSTLY else best.answers[:12].hex(" ")
    hint = "the wrong baud rate (leave --baud out), or " if only else "a baud rate that was not tried (--baud), or "
    return f"somebody answers at {best.rate} ({shown!r}), but as no known kind: {hint}a device of another kind"


def _readable(data: bytes) -> float:
    """Share of characters that are text."""
    return sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in data) / len(data) if data else 0.0


def _sample(data: bytes) -> str:
    lines = [line for line in data.replace(b"\r", b"\n").split(b"\n") if line]
    return printable(lines[min(1, len(lines) - 1)]) if lines else ""


def _bus(seen: BusSeen, expected: str) -> list[str]:
    lines: list[str] = []
    for found in seen.found:
        lines += [f"{seen.bus}: {found.kind}", *_found(found)]
    if seen.strangers:
        lines.append(
            f"{seen.bus}: frames of a device of another kind, such as {', '.join(seen.strangers)};"
            " what does not know them asks nothing on this bus (--kind names one that shall)"
        )
    if not lines and seen.bad:
        lines.append(
            f"{seen.bus}: {seen.bad} frames came that cannot be read: the bit rate is probably wrong; end this at once,"
            " a node at the wrong bit rate disturbs the others, and give @ the one that the devices are set to"
        )
    if not lines:
        asked = f"nor does anybody answer ({', '.join(seen.asked)} asked)" if seen.asked else "and nothing was asked"
        lines.append(
            f"{seen.bus}: no frame is heard, {asked}. Is the bus powered and terminated at both ends (60 ohm between"
            " CANH and CANL), and is this its bit rate? It is not searched for: a wrong one disturbs the others."
            " A CANopen device whose heartbeat is off, as delivered, says nothing by itself: --kind cia402 (or another)"
            " asks every node"
        )
    return [*lines, *(_other(expected, seen.found) if seen.found else [])]
