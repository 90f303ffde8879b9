"""A capture played and told: streams, rows, rates, what was not understood; or its rows, exact to the bit."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

from drivers.protocols import Sample, Stream
from rig.captures import description
from rig.captures.playing import Played, chunks_of, play


def replayed(capture: Path, speed: float) -> Played:
    """`speed`: times as fast as it was; 0: as fast as it goes. Raises RigError."""
    return play(chunks_of(capture), description.read(capture), _paced(speed))


def _paced(speed: float) -> Callable[[float], None]:
    if speed == 0.0:
        return lambda _: None
    begun: list[float] = []

    def pace(now: float) -> None:
        real = time.monotonic()
        begun.extend([] if begun else [now, real])
        time.sleep(max(0.0, (now - begun[0]) / speed - (real - begun[1])))

    return pace


def told(played: Played) -> Iterator[str]:
    """A line each."""
    yield played.identity
    for stream in played.streams:
        rows = [row for row in played.rows if row.stream == stream.name]
        yield f"  {stream.name}: {_rows(rows, stream)}"
    health = played.health
    if health.bad:
        yield f"  {health.bad} of {health.received} lines or frames were not understood, first: {health.first_bad[0]}"
    if health.error:
        yield f"  {health.error}"
    for difference in played.differences:
        yield f"  the driver asks otherwise than when this was captured: {difference}"


def _rows(rows: list[Sample], stream: Stream) -> str:
    if not rows:
        return "no row"
    span = (rows[-1].t_ns - rows[0].t_ns) * 1e-9
    rate = f", {(len(rows) - 1) / span:.4g}/s (nominal {1 / stream.period_s:.4g}/s)" if span > 0 else ""
    last = ", ".join(f"{c.name} {v:.6g} {c.unit}" for c, v in zip(stream.channels, rows[-1].values, strict=True))
    return f"{len(rows)} rows{rate}; the last: {last}"
