"""A bench file to start from: what was found is filled in, what nobody could tell is left as a comment."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

from drivers.recognition.found import Found, Role
from rig.devices.seen import Bus, BusSeen, PortSeen
from rig.errors import ConfigError

HEAD = """# Made by `rig devices`. Lines that begin with #! are for you: fill them in and take the mark away.
# Keys: docs/howto/campaign.md
[bench]
name = "My bench"
{motor}
{force}
#! max_voltage =           # V, largest command that this bench allows
#! slew =                  # V/s, fastest change of the command
proof_voltage = 4.0        # V, at which the motor's watchdog is proved
"""


def write(path: Path, seen: Sequence[PortSeen | BusSeen]) -> int:
    """How many devices are in the new file. Raises ConfigError where it exists, or nobody was found."""
    tables = list(_tables(seen))
    if not tables:
        raise ConfigError(f"{path} is not written: no device was recognised")
    buses = [each.bus for each in seen if isinstance(each, BusSeen) and each.found]
    names = _named([found for found, _ in tables])
    text = HEAD.format(motor=_role("motor", names, tables), force=_role("force", names, tables))
    text += "".join(_bus(number, bus) for number, bus in enumerate(buses))
    text += "".join(_device(name, found, where) for name, (found, where) in zip(names, tables, strict=True))
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ConfigError(f"{path} exists and is not overwritten: give --write another name") from None
    except OSError as error:
        raise ConfigError(f"{path} can't be written: {error.strerror}") from error
    return len(tables)


def _tables(seen: Sequence[PortSeen | BusSeen]) -> Iterator[tuple[Found, dict[str, object]]]:
    """(device, keys of its wire)"""
    number = 0
    for each in seen:
        if isinstance(each, PortSeen) and each.found is not None and each.rate is not None:
            framing = {} if each.rate.framing == "8N1" else {"framing": each.rate.framing}
            wire: dict[str, object] = {"port": _path(each.port), "baud": each.rate.baud, **framing}
            yield each.found, wire
        elif isinstance(each, BusSeen) and each.found:
            for found in each.found:
                yield found, {"bus": f"bus{number}"}
            number += 1


def _named(found: Sequence[Found]) -> list[str]:
    """Names of the tables: what the device is to the bench, numbered where there are more."""
    names: list[str] = []
    for each in found:
        name = {"motor": "motor", "force": "load_cell", "": each.kind}[each.role]
        taken = sum(other.rstrip("0123456789") == name for other in names)
        names.append(f"{name}{taken + 1}" if taken else name)
    return names


def _role(role: Role, names: Sequence[str], tables: Sequence[tuple[Found, object]]) -> str:
    name = next((name for name, (found, _) in zip(names, tables, strict=True) if found.role == role), None)
    meaning = {"motor": "device that turns the propeller", "force": "device whose thrust is modelled"}[role]
    return f"#! {role} =                 # {meaning}: none was found" if name is None else f'{role} = "{name}"'


def _bus(number: int, bus: Bus) -> str:
    return (
        f"\n[can.bus{number}]\ninterface = {_value(bus.interface)}\nchannel = {_value(_path(bus.channel))}\n"
        f"bitrate = {bus.bitrate}\n"
    )


def _path(port: str) -> str:
    """A path from the root; the name of a network, COM3 and URLs as they are."""
    return str(Path(port).absolute()) if "/" in port and "://" not in port else port


def _device(name: str, found: Found, where: dict[str, object]) -> str:
    lines = [f"\n[devices.{name}]", *(f"# {line}" for line in _comments(found)), f'kind = "{found.kind}"']
    lines += [f"{key} = {_value(value)}" for key, value in (where | dict(found.keys)).items()]
    lines += [f"#! {key} =    # {meaning}" for key, meaning in found.untold.items()]
    return "\n".join(lines) + "\n"


def _comments(found: Found) -> Iterator[str]:
    yield found.identity
    yield from found.settings
    if found.watchdog:
        yield f"watchdog: {found.watchdog}"


def _value(value: object) -> str:
    """As TOML: its basic strings are those of JSON."""
    return json.dumps(value)
