"""Frames and lines into every decoder of `drivers`, and frames of the sockets: a record or an error that is meant."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rig.errors import LinkError
from rig.link.framing import HEADER, decode, encode
from rig.link.front_end_messages import Request
from rig.link.recorder_messages import Ack, EventRow, Rows

from . import of_can, of_serial
from .mutation import Tally, mutant

Decode = Callable[[bytes], Any]
MESSAGES = tuple(
    encode(message)
    for message in (
        Request("note", "x" * 40),
        Ack((1, 2), 0.5, 10**9),
        EventRow(1.0, "info", "ü"),
        Rows(0, np.arange(4), np.ones((4, 2))),
    )
)
MAY_BE_INFINITE = ("Keller registers", "frames of the sockets")
"""What reads these judges the number itself."""


def _link(data: bytes) -> Any:
    try:
        return decode(data[4] if len(data) > 4 else 0, data[HEADER.size :])
    except LinkError as error:
        return error


def decoders() -> dict[str, tuple[tuple[bytes, ...], Decode]]:
    """Name -> seeds and the decoder."""
    return of_serial.decoders() | of_can.decoders() | {"frames of the sockets": (MESSAGES, _link)}


def infinite(record: Any) -> bool:
    """Whether a number in a record is infinite: no instrument measures that."""
    if isinstance(record, float):
        return math.isinf(record)
    return isinstance(record, list | tuple) and any(infinite(item) for item in record)


def run(count: int, seed: int, folder: Path) -> list[Tally]:
    """`count` mutants into each decoder."""
    return [
        _fuzz(name, count, np.random.default_rng([seed, i]), folder, *one)
        for i, (name, one) in enumerate(decoders().items())
    ]


def _fuzz(
    name: str, count: int, rng: np.random.Generator, folder: Path, seeds: tuple[bytes, ...], feed: Decode
) -> Tally:
    tally = Tally(name, folder)
    for number in range(count):
        data = mutant(rng, seeds)
        begun = time.process_time()
        try:
            record = feed(data)
        except Exception as error:  # noqa: BLE001 - whatever it is, it is what is looked for
            tally.fail(f"{name.replace(' ', '_')}-{number}", repr(error), data)
            continue
        if name not in MAY_BE_INFINITE and infinite(record):
            tally.fail(f"{name.replace(' ', '_')}-{number}", f"an infinite number: {str(record)[:80]}", data)
        else:
            tally.add("decoded or refused", time.process_time() - begun)
    return tally
