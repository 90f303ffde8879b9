"""Logs of robots: MCAP by mcap (JSON) or rosbags (ROS 2), ROS 1 bags by rosbags. Times are those of the log, in s."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from rig.errors import RecordingError
from rig.importing.reading.binary.frames import Frame, Gathered, flat, with_its_suffix

JSON = "json"


def mcap(path: Path, wanted: Sequence[str]) -> list[Frame]:
    """A frame a topic."""
    from mcap.reader import make_reader

    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        if summary is None:
            raise RecordingError("this MCAP log has no summary at its end, so it was cut off: `mcap recover` mends it")
        encodings = {c.message_encoding for c in summary.channels.values() if not wanted or c.topic in wanted}
        if encodings - {JSON}:
            return _by_rosbags(path, wanted, ".mcap")
        gathered = Gathered()
        for _, channel, message in reader.iter_messages(topics=list(wanted) or None):
            gathered.add(channel.topic, message.log_time * 1e-9, flat(json.loads(message.data)))
    return gathered.frames()


def bag(path: Path, wanted: Sequence[str]) -> list[Frame]:
    """A frame a topic."""
    return _by_rosbags(path, wanted, ".bag")


def _by_rosbags(path: Path, wanted: Sequence[str], suffix: str) -> list[Frame]:
    """It knows a kind by the file's suffix."""
    if find_spec("rosbags") is None:
        raise RecordingError("messages of ROS 2 need the package rosbags: pip install 'thruster-rig[ros]'")
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    gathered = Gathered()
    with (
        with_its_suffix(path, suffix) as log,
        AnyReader([log], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader,
    ):
        there = [c for c in reader.connections if not wanted or c.topic in wanted]
        for connection, stamp, raw in reader.messages(connections=there) if there else ():
            message = reader.deserialize(raw, connection.msgtype)
            gathered.add(connection.topic, stamp * 1e-9, flat(message))
    return gathered.frames()
