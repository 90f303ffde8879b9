"""Entries of recordings: one for the file, and one for the calibration of each of its thrust channels."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import tee
from pathlib import Path
from typing import Any, Final

from rig.catalogue.entry import UNREAD, UNREADABLE, Entry, finite, seconds_of
from rig.errors import RecordingError, UnreadError

BENCH: Final = re.compile(
    r"^\[bench\]\s*$(?:(?!^\s*\[).*\n?)*?^\s*name\s*=\s*(?:\"([^\"\n]*)\"|'([^'\n]*)')", re.MULTILINE
)
"""The name of a bench in its file. A TOML parser takes 2 ms for each file of ten thousand."""
SHORT_ID: Final = 12
"""Digits of a hash that stand for the whole: two in ten million agree by chance with p = 0.2 (2^48 of them)."""


def read_recordings(folder: Path, batches: Iterable[Sequence[str]]) -> Iterator[list[tuple[str, list[Entry]]]]:
    """Of each batch of paths (path, entries) of each, whatever it holds."""
    from rig.hdf5 import headers_in_batches  # numpy and h5py: only where there is a recording to read

    ours, theirs = tee(batches)
    found = headers_in_batches([folder / path for path in paths] for paths in theirs)
    for paths, of_them in zip(ours, found, strict=True):
        yield [(path, _said(folder, path, header)) for path, header in zip(paths, of_them, strict=True)]


def _said(folder: Path, path: str, header: Any) -> list[Entry]:
    if not isinstance(header, RecordingError):
        return list(_entries(path, header))
    reason = str(header).removeprefix(str(folder / path)).lstrip(": ")
    facts = {UNREAD: isinstance(header, UnreadError)}
    return [Entry("recordings", path, outcome=UNREADABLE, reason=reason, facts=facts)]


def _entries(path: str, header: Any) -> Iterator[Entry]:
    texts, whole = header.texts, header.complete
    channels = [(stream.name, channel) for stream in header.streams for channel in stream.channels]
    quantities = dict.fromkeys(channel.quantity for _, channel in channels if channel.quantity)
    entry = Entry(
        "recordings",
        path,
        id=texts["recording_id"],
        thruster=texts["thruster"],
        kind=texts["kind"] or "tunnel",
        campaign=texts["campaign"],
        stated=seconds_of(texts["created"]),
        duration=header.duration,
        outcome=header.outcome or ("completed" if whole else ""),
        operator=texts["operator"],
        bench=bench_name(texts["bench_toml"]) or texts["facility"],
        said=f"{len(channels)} channels: {', '.join(quantities)}",
        reason=header.cause or ("" if whole else "not closed in order, or still being written"),
        facts={
            "attempt": finite(_number(texts["attempt"])),
            "continues": texts["continues"],
            "channels": [[stream, each.name, each.quantity, each.unit] for stream, each in channels],
        },
    )
    yield entry
    for stream, each in channels:
        if each.calibration:
            yield _calibration(entry, stream, each.name, each.calibration)


def _calibration(of: Entry, stream: str, channel: str, written: str) -> Entry:
    text, gain, said = calibration(stream, channel, written)
    return Entry(
        "calibrations",
        of.path,
        id=short_id(text),
        thruster=of.thruster,
        kind=of.kind,
        campaign=of.campaign,
        stated=of.stated,
        operator=of.operator,
        bench=of.bench,
        said=said,
        facts={"calibration": text, "gain_std": gain},
        recordings=(of.id,),
    )


@lru_cache(maxsize=256)
def calibration(stream: str, channel: str, written: str) -> tuple[str, float | None, str]:
    """The text that fits know it by, its relative standard uncertainty, and both in words."""
    from identification.recording import calibration_text

    try:
        found = json.loads(written)
    except (ValueError, RecursionError):
        found = {"text": written}
    facts = found if isinstance(found, dict) else {"value": found}
    gain = finite(facts.get("gain_std"))
    said = f"{stream}/{channel}" + (", gain_std not stated" if gain is None else f", gain_std {100 * gain:.2g} %")
    return calibration_text(stream, channel, facts), gain, said


@lru_cache(maxsize=256)
def bench_name(toml: str) -> str:
    r"""Of the text of a bench file; empty where it has none.

    >>> bench_name('# ours\n[bench]\nmotor = "m"\nname = "tunnel 2"\n[can.x]\nname = "no"\n')
    'tunnel 2'
    """
    found = BENCH.search(toml)
    return (found[1] or found[2] or "") if found else ""


def short_id(content: str | bytes) -> str:
    """The beginning of its SHA-256."""
    data = content.encode("utf-8", "replace") if isinstance(content, str) else content
    return hashlib.sha256(data).hexdigest()[:SHORT_ID]


def _number(text: str) -> object:
    return int(text) if text.isascii() and text.isdigit() and len(text) < 10 else None
