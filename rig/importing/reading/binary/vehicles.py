"""Logs of autopilots: PX4's ULog by pyulog, ArduPilot's dataflash and MAVLink's tlog by pymavlink. Times in s."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rig.importing.reading.binary.frames import Frame, Gathered, flat, numeric, with_its_suffix

MICROSECOND = 1e-6


def ulog(path: Path, wanted: Sequence[str]) -> list[Frame]:
    """A frame a topic; the second instance of one is `topic.1`. Time is its `timestamp`."""
    from pyulog import ULog

    topics = sorted({name.partition(".")[0] for name in wanted}) or None
    frames = []
    for topic in ULog(str(path), topics).data_list:
        found = {name: numeric(values) for name, values in topic.data.items()}
        columns = {name: values for name, values in found.items() if values is not None}
        name = topic.name if topic.multi_id == 0 else f"{topic.name}.{topic.multi_id}"
        frames.append(Frame(name, columns, columns["timestamp"] * MICROSECOND if "timestamp" in columns else None))
    return frames


def dataflash(path: Path, wanted: Sequence[str]) -> list[Frame]:
    """A frame a message, `BAT` or of the second instance `BAT[1]`. Time is its `TimeUS`."""
    from pymavlink.DFReader import DFReader_binary

    gathered = Gathered()
    log = DFReader_binary(str(path))
    try:
        types = sorted({name.partition("[")[0] for name in wanted}) or None
        while (message := log.recv_match(type=types)) is not None:
            fields = message.to_dict()
            if "TimeUS" in fields:
                name = _instance(str(message.get_type()), fields)
                gathered.add(name, fields["TimeUS"] * MICROSECOND, flat(_numbers(fields)))
    finally:
        log.close()
    return gathered.frames()


def _instance(kind: str, fields: dict[str, Any]) -> str:
    number = fields.get("Instance", fields.get("Inst", 0))
    return kind if "[" in kind or not isinstance(number, int) or number == 0 else f"{kind}[{number}]"


def tlog(path: Path, wanted: Sequence[str]) -> list[Frame]:
    """A frame a message. Time is that of its arrival, since 1970."""
    os.environ.setdefault("MAVLINK20", "1")  # pymavlink reads it as it is imported: version 2, which reads 1 as well
    from pymavlink import mavutil

    gathered = Gathered()
    with with_its_suffix(path, ".tlog") as named:
        log = mavutil.mavlink_connection(str(named))
        try:
            while (message := log.recv_match(type=list(wanted) or None)) is not None:
                if message.get_type() != "BAD_DATA":
                    gathered.add(message.get_type(), message._timestamp, flat(_numbers(message.to_dict())))
        finally:
            log.close()
    return gathered.frames()


def _numbers(fields: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in fields.items() if isinstance(value, int | float | list | np.ndarray)}
