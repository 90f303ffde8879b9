"""Which binary logs are read, by what library, and how a file of each begins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Final, NamedTuple

from rig.errors import ConfigError, RecordingError
from rig.importing.reading.binary.frames import Frame, table_of
from rig.importing.reading.table import Table
from rig.regular_file import beginning

Read = Callable[[Path, Sequence[str]], list[Frame]]
"""A file and the messages, topics, groups or variables that are wanted; none: all. What is not wanted is not kept."""
HEAD = 16
"""Bytes by which a kind is known."""


class Kind(NamedTuple):
    """One word of `[file] kind`."""

    what: str
    module: str
    function: str
    starts: tuple[bytes, ...]
    """Of a file; empty: it has no beginning of its own."""
    library: str
    extra: str
    """Where the library is declared; empty: it is there."""


KINDS: Final = {
    "parquet": Kind("Parquet table", "columnar", "parquet", (b"PAR1",), "pyarrow", "parquet"),
    "mat": Kind("MATLAB file", "mat", "mat", (b"MATLAB", b"\x89HDF\r\n\x1a\n"), "scipy", ""),
    "tdms": Kind("LabVIEW TDMS file", "columnar", "tdms", (b"TDSm",), "nptdms", "tdms"),
    "mdf": Kind("measurement file MDF/MF4", "columnar", "mdf", (b"MDF     ", b"UnFinMF "), "asammdf", "mdf"),
    "mcap": Kind("MCAP log", "robots", "mcap", (b"\x89MCAP0\r\n",), "mcap", "mcap"),
    "bag": Kind("ROS 1 bag", "robots", "bag", (b"#ROSBAG",), "rosbags", "ros"),
    "ulog": Kind("PX4 log (ULog)", "vehicles", "ulog", (b"ULog\x01\x12\x35",), "pyulog", "ulog"),
    "dataflash": Kind("ArduPilot dataflash log", "vehicles", "dataflash", (b"\xa3\x95",), "pymavlink", "ardupilot"),
    "tlog": Kind("MAVLink telemetry log (tlog)", "vehicles", "tlog", (), "pymavlink", "ardupilot"),
}


def kind_named(name: str) -> Kind:
    """Raises ConfigError for another word, and where its library is not installed."""
    kind = KINDS[name]
    if find_spec(kind.library) is None:
        raise ConfigError(
            f'[file] kind = "{name}" needs the Python package {kind.library}, which is not installed:'
            f" pip install 'thruster-rig[{kind.extra}]'"
        )
    return kind


def read_binary(path: Path, name: str, wanted: Sequence[str]) -> Table:
    """Raises RecordingError for a file of another kind, a damaged one, and one without what is wanted.

    The file is read as far as it is wanted: columns of tables when they are asked for.
    """
    kind = kind_named(name)
    head = beginning(path, kind.what, HEAD, RecordingError)
    if not head:
        raise RecordingError(f"this {kind.what} is empty: it has no bytes")
    if kind.starts and not head.startswith(kind.starts):
        raise RecordingError(
            f'the map says [file] kind = "{name}", but this is no {kind.what}: it begins with {head[:8].hex(" ")}'
        )
    read: Read = getattr(import_module(f"rig.importing.reading.binary.{kind.module}"), kind.function)
    try:
        frames = read(path, wanted)
    except RecordingError:
        raise
    except Exception as error:  # whatever a library of somebody else raises for bytes that it does not understand
        raise RecordingError(
            f"this {kind.what} can't be read, it may be cut off or damaged ({type(error).__name__}: {error})"
        ) from error
    _require(frames, wanted, kind)
    return table_of(_wanted(frames, wanted), kind.what)


def _wanted(frames: Sequence[Frame], wanted: Sequence[str]) -> list[Frame]:
    """Those that are wanted; all where none is named."""
    return [frame for frame in frames if not wanted or frame.name in wanted]


def _require(frames: Sequence[Frame], wanted: Sequence[str], kind: Kind) -> None:
    there = [frame.name for frame in frames]
    for name in wanted:
        if name not in there:
            raise RecordingError(f"this {kind.what} has no {name!r}; it has {_some(there)}")


def _some(names: Sequence[str]) -> str:
    most = 40
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more if names else "nothing"
