"""An MCAP file, as Foxglove, PlotJuggler and robots have it: one topic per stream, JSON with a schema that has units.

A gap is a field that is not there: JSON has no NaN, and a schema whose type is "number or null" is one that Foxglove
refuses (its parseJsonSchema takes one type).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from mcap.writer import Writer

from rig.exporting.content import STEP_COLUMNS, TIME, Column, Content

LEVELS = {"info": 2, "warning": 3, "error": 4, "trip": 5}
"""Of foxglove.Log: INFO, WARNING, ERROR, FATAL."""
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
ENCODER = json.JSONEncoder(allow_nan=False)
"""Made once: `json.dumps` with an option makes one for each message."""
CONFIGURATION = ("bench_toml", "campaign_toml")


def write(content: Content, out: Path) -> None:
    """`out`, a new file: /streams/<stream>, /steps and /events, the header and both configuration files attached."""
    start = _start_ns(str(content.header.get("created", "")))
    with out.open("xb") as file:
        writer = Writer(file)
        writer.start(profile="", library=str(content.header["written_by"]))
        _attach(writer, content, start)
        for stream in content.streams:
            topic = _topic(writer, f"/streams/{stream.name}", stream.columns, stream.facts)
            for piece in stream.rows.pieces():
                for row in zip(*(column.tolist() for column in piece), strict=True):
                    _say(writer, topic, start, row[0], dict(_fields(stream.columns, row)))
        topic = _topic(writer, "/steps", STEP_COLUMNS, {})
        for step in content.steps:
            _say(writer, topic, start, step[3], dict(_fields(STEP_COLUMNS, step)))
        topic = _events(writer)
        for event in content.events:
            _say(writer, topic, start, event[0], _log(start, event))
        writer.finish()


def _start_ns(created: str) -> int:
    """Nanoseconds since 1970 of t = 0; 0 where the recording does not say when it was made."""
    try:
        made = datetime.fromisoformat(created)
    except ValueError:
        return 0
    known = made if made.tzinfo else made.replace(tzinfo=UTC)
    return max((known - EPOCH) // timedelta(microseconds=1) * 1000, 0)


def _stamp(start: int, time: float) -> int:
    return max(start + round(time * 1e9), 0)


def _attach(writer: Writer, content: Content, start: int) -> None:
    words = {name: value for name, value in content.header.items() if name not in (*CONFIGURATION, "streams")}
    writer.add_metadata("recording", {name: v if isinstance(v, str) else json.dumps(v) for name, v in words.items()})
    texts = {f"{name.removesuffix('_toml')}.toml": content.header.get(name) for name in CONFIGURATION}
    texts["header.json"] = json.dumps(content.header, ensure_ascii=False)
    for name, text in texts.items():
        if text:
            kind = "application/json" if name.endswith("json") else "application/toml"
            writer.add_attachment(start, start, name, kind, str(text).encode())


def _topic(writer: Writer, name: str, columns: Sequence[Column], facts: Any) -> int:
    """Number of a new topic whose schema says what each field is and in which unit."""
    properties = {column.name: _property(column) for column in columns}
    return _channel(writer, name, name.strip("/").replace("/", "."), properties, facts)


def _property(column: Column) -> dict[str, Any]:
    """A whole number is a number too: Foxglove takes an integer for one that has no sign."""
    if column.kind == "text":
        return {"type": "string"}
    return {"type": "number", **({"unit": column.unit} if column.unit else {}), **column.facts}


def _events(writer: Writer) -> int:
    """Events as `foxglove.Log`, which log panels show, our own time beside its own."""
    time = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
    log = {"timestamp": time, "level": {"type": "integer"}, "message": {"type": "string"}, "name": {"type": "string"}}
    return _channel(writer, "/events", "foxglove.Log", log | {TIME.name: _property(TIME)}, {})


def _channel(writer: Writer, topic: str, title: str, properties: dict[str, Any], facts: Any) -> int:
    schema = {"title": title, "type": "object", "properties": properties}
    described = writer.register_schema(title, "jsonschema", json.dumps(schema).encode())
    number: int = writer.register_channel(topic, "json", described, dict(facts))
    return number


def _fields(columns: Sequence[Column], row: Sequence[Any]) -> Iterator[tuple[str, Any]]:
    for column, value in zip(columns, row, strict=True):
        if column.kind == "text" or math.isfinite(value):
            yield column.name, value


def _log(start: int, event: tuple[float, str, str]) -> dict[str, Any]:
    time, level, text = event
    sec, nsec = divmod(_stamp(start, time), 10**9)
    stamp = {"sec": sec, "nsec": nsec}
    return {"timestamp": stamp, "level": LEVELS.get(level, 0), "message": text, "name": level, "time": time}


def _say(writer: Writer, topic: int, start: int, time: float, message: dict[str, Any]) -> None:
    stamp = _stamp(start, time)
    writer.add_message(topic, stamp, ENCODER.encode(message).encode(), stamp)
