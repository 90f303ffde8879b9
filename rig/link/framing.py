"""Messages between the processes as bytes.

A frame is `<u32 length of the payload> <u8 kind> <payload>`, little-endian. Every message but `Rows` is JSON of its
dataclass. `Rows` is binary: u16 stream, u32 n, int64 t_ns[n], float64 values[n * channels], row-major.
"""

from __future__ import annotations

import re
import struct
from typing import Any, Final

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError, with_config
from pydantic_core import to_json

from rig.errors import LinkError
from rig.link.front_end_messages import Request, Snapshot
from rig.link.recorder_messages import Ack, Close, Closed, EventRow, Failed, Open, Ready, Rows, StepRow
from rig.link.watch_messages import Judged, Mismatch, Watched
from rig.visible_text import HIDDEN, visible_texts

ToRecorder = Open | Rows | StepRow | EventRow | Close
Message = Snapshot | Request | ToRecorder | Ready | Ack | Closed | Failed | Watched | Mismatch | Judged

KINDS: Final[dict[int, type[Any]]] = {
    1: Snapshot,
    2: Request,
    16: Open,
    17: StepRow,
    18: EventRow,
    19: Close,
    24: Ready,
    25: Ack,
    26: Closed,
    27: Failed,
    32: Rows,
    40: Watched,
    48: Mismatch,
    49: Judged,
}
NUMBERS: Final = {message: number for number, message in KINDS.items()}
ADAPTERS: Final[dict[int, TypeAdapter[Any]]] = {
    number: TypeAdapter(message) for number, message in KINDS.items() if message is not Rows
}
SNAPSHOTS: Final = TypeAdapter(with_config(ConfigDict(ser_json_inf_nan="constants"))(Snapshot))
ESCAPED: Final = re.compile(rb"\\[ubfr]")
"""How JSON writes a control character: RFC 8259 section 7."""
HEADER: Final = struct.Struct("<IB")
ROWS_HEADER: Final = struct.Struct("<HI")
MAX_FRAME: Final = 64 * 2**20
"""Bytes; a longer frame means that the two sides are out of step."""


def encode(message: Message) -> bytes:
    """One message as a whole frame."""
    kind = NUMBERS[type(message)]
    match message:
        case Rows():
            payload = _encode_rows(message)
        case Snapshot():  # ten a second and long: a compiled serializer takes a third of the time of `to_json`
            payload = SNAPSHOTS.dump_json(message, warnings=False)
        case _:
            payload = to_json(message, inf_nan_mode="constants")
    if len(payload) > MAX_FRAME:
        raise LinkError(
            f"a {KINDS[kind].__name__} of {len(payload)} bytes exceeds the {MAX_FRAME} bytes of a frame; split it"
        )
    return HEADER.pack(len(payload), kind) + payload


def decode(kind: int, payload: bytes) -> Message:
    """The message in a frame. Raises LinkError that says what came."""
    if kind not in KINDS:
        raise LinkError(f"a frame of unknown kind {kind} with {len(payload)} bytes came; known are {sorted(KINDS)}")
    if KINDS[kind] is Rows:
        return _decode_rows(payload)
    try:
        message: Message = ADAPTERS[kind].validate_json(payload)
    except ValidationError as error:
        raise LinkError(
            f"a malformed {KINDS[kind].__name__} came: {payload[:80]!r} ({error.error_count()} errors)"
        ) from error
    return visible_texts(message) if kind == NUMBERS[Snapshot] and not _is_plain(payload) else message


def _is_plain(payload: bytes) -> bool:
    """JSON whose texts have nothing to be made visible, as nearly every one: a search is cheaper than to walk it."""
    return ESCAPED.search(payload) is None and HIDDEN.search(payload.decode()) is None


def _encode_rows(rows: Rows) -> bytes:
    t_ns = np.ascontiguousarray(rows.t_ns, dtype="<i8")
    values = np.ascontiguousarray(rows.values, dtype="<f8")
    if values.ndim != 2 or values.shape[0] != t_ns.size:
        raise ValueError(f"rows of stream {rows.stream}: {t_ns.size} times, but values of shape {values.shape}")
    return ROWS_HEADER.pack(rows.stream, t_ns.size) + t_ns.tobytes() + values.tobytes()


def _decode_rows(payload: bytes) -> Rows:
    if len(payload) < ROWS_HEADER.size:
        raise LinkError(f"a Rows frame of {len(payload)} bytes came; its header alone has {ROWS_HEADER.size}")
    stream, n = ROWS_HEADER.unpack_from(payload)
    body = len(payload) - ROWS_HEADER.size
    if n == 0 or body < 8 * n or body % (8 * n):
        raise LinkError(f"a Rows frame for stream {stream} came with {n} rows in {body} bytes, which do not divide")
    t_ns = np.frombuffer(payload, "<i8", n, ROWS_HEADER.size).astype(np.int64, copy=False)
    values = np.frombuffer(payload, "<f8", offset=ROWS_HEADER.size + 8 * n).astype(np.float64, copy=False)
    return Rows(stream, t_ns, values.reshape(n, -1))
