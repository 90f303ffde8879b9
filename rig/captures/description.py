"""What stands beside a capture: which kind of device it is of and how that was set, so that it can be played again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import tomlkit

from drivers import KINDS
from rig.errors import ConfigError
from rig.toml_tables import decode, read_toml, table_at, values

PLACE = {"port": "replay", "bus": "replay", "capture": ""}
"""Keys of options that are of the bench and not of the device -> what stands for them in a replay."""


@dataclass(frozen=True, slots=True)
class Description:
    """`<capture>.toml`"""

    kind: str
    """A key of `drivers.KINDS`; empty: nobody said, and it cannot be played through a driver."""
    device: str = "device"
    """Its name, which begins those of its streams."""
    listened: bool = False
    """Nothing was sent, so that the opening of the driver is not in it."""
    anonymised: bool = False
    bitrate: int = 0
    """Of a CAN bus; 0: a serial port."""
    options: Any = None
    """Of the kind's own class; None: not known."""


def path_of(capture: Path) -> Path:
    return capture.with_suffix(".toml")


def write(capture: Path, found: Description) -> None:
    """Raises ConfigError."""
    about = {field.name: getattr(found, field.name) for field in fields(found) if field.name != "options"}
    document = tomlkit.document()
    document.add(tomlkit.comment(f"What {capture.name} is of: rig replay plays it through the driver of this kind."))
    document.add("capture", tomlkit.item(about))
    if found.options is not None:
        document.add("options", tomlkit.item(_told(found.options)))
    try:
        path_of(capture).write_text(tomlkit.dumps(document), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path_of(capture)} can't be written: {error.strerror}") from error


def _told(options: Any) -> Mapping[str, Any]:
    told = {field.name: getattr(options, field.name) for field in fields(options) if field.name not in PLACE}
    known = {name: value for name, value in told.items() if value is not None}
    return {name: list(value) if isinstance(value, tuple) else value for name, value in known.items()}


def read(capture: Path) -> Description:
    """Raises ConfigError naming file and key."""
    path = path_of(capture)
    _, content = read_toml(path, "description of a capture (`rig capture` writes it beside the bytes)")
    scalars = values(Description, table_at(path, content, "capture"), path, "capture", elsewhere=("options",))
    found = Description(**scalars)
    if found.kind not in KINDS:
        raise ConfigError(f"{path}: capture.kind is {found.kind!r}, but must be one of {', '.join(sorted(KINDS))}")
    if "options" not in content:
        raise ConfigError(
            f"{path}: [options] is missing: the keys of the device's table in a bench file, without port and capture"
        )
    kind = KINDS[found.kind].options
    place = {name: value for name, value in PLACE.items() if name in {field.name for field in fields(kind)}}
    options = decode(kind, {**table_at(path, content, "options"), **place}, path, "options")
    return Description(**{**scalars, "options": options})
