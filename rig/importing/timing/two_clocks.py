"""Two files with two clocks into one recording: by an offset that is given, by their own stamps, or estimated.

Estimated from a quantity that both recorded, else from the command of one and the thrust of the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.run_history.clock_offset import ClockOffset, Relation, Signal, Undetermined, clock_offset
from rig.errors import ConfigError, RecordingError
from rig.importing.convert import Imported
from rig.importing.streams import COMMAND, StreamData
from rig.link.recorder_messages import StepRow

ESTIMATED = "auto"
OWN_STAMPS = "clock"


@dataclass(frozen=True, slots=True)
class Offset:
    """Seconds to add to the second file's times, and how they are known."""

    seconds: float
    said: str


@dataclass(frozen=True, slots=True)
class Pair:
    """Two channels that may tell the offset: `driver` explains `response`; which of them is the second file's."""

    name: str
    driver: Signal
    response: Signal
    relation: Relation
    driver_is_second: bool


def offset_asked(text: str) -> str | float:
    """`auto`, `clock` or seconds. Raises ConfigError.

    >>> offset_asked("-2.5"), offset_asked("clock")
    (-2.5, 'clock')
    """
    if text in (ESTIMATED, OWN_STAMPS):
        return text
    try:
        seconds = float(text)
    except ValueError:
        seconds = float("nan")
    if not np.isfinite(seconds):
        raise ConfigError(
            f"--offset {text}: expected auto, clock, or the seconds from the first row of FILE to that of --with"
        )
    return seconds


def offset_between(first: Imported, second: Imported, asked: str | float) -> Offset:
    """From the first file's time 0 to the second's. Raises RecordingError where it cannot be told."""
    if isinstance(asked, float):
        return Offset(asked, f"{asked:+.6g} s from the first row of the one to that of the other, as --offset says")
    if asked == OWN_STAMPS:
        return _by_stamps(first, second)
    return _estimated(first, second)


def _by_stamps(first: Imported, second: Imported) -> Offset:
    if first.clock_start is None or second.clock_start is None or bool(first.created) != bool(second.created):
        raise RecordingError(
            "--offset clock needs times of one clock in both files (a time column in each, both with a time zone or "
            "both without); give the seconds, --offset 12.5, or leave it out to have them estimated"
        )
    seconds = second.clock_start - first.clock_start
    return Offset(
        seconds, f"{seconds:+.6g} s by the time stamps of both files, taken to be of one clock (--offset clock)"
    )


def _estimated(first: Imported, second: Imported) -> Offset:
    failed: list[str] = []
    for pair in _pairs(first, second):
        found = clock_offset(pair.driver, pair.response, pair.relation)
        if isinstance(found, ClockOffset):
            return _said(pair, found)
        failed.append(f"{pair.name}: {found.reason}" if isinstance(found, Undetermined) else pair.name)
    why = "; ".join(failed) or "no quantity is in both, and no command in one with a thrust in the other"
    raise RecordingError(
        f"the offset of the two clocks cannot be told ({why}); give it, --offset 12.5 (s from the first row of FILE to "
        "the first of --with), or --offset clock where both have stamps of one clock"
    )


def _said(pair: Pair, found: ClockOffset) -> Offset:
    seconds = found.offset if pair.driver_is_second else -found.offset
    lag = ", with the thruster's own lag in it, which cannot be told from it" if pair.relation == "thrust" else ""
    return Offset(
        seconds,
        f"{seconds:+.4g} +- {found.std:.2g} s, estimated from {pair.name}: {100 * found.share:.1f} % of the variance "
        f"explained over {found.overlap:.4g} s in common{lag}",
    )


def _pairs(first: Imported, second: Imported) -> Iterator[Pair]:
    ours, theirs = _signals(first), _signals(second)
    for quantity in ours:
        if quantity in theirs:
            yield Pair(f"{quantity} in both", theirs[quantity], ours[quantity], "same", True)
    for one, other, is_second in ((theirs, ours, True), (ours, theirs, False)):
        if COMMAND in one and "thrust" in other and not (COMMAND in other and "thrust" in one):
            where = ("--with", "FILE") if is_second else ("FILE", "--with")
            name = f"the command of {where[0]} and the thrust of {where[1]}"
            yield Pair(name, one[COMMAND], other["thrust"], "thrust", is_second)


def _signals(imported: Imported) -> dict[str, Signal]:
    """The first channel of each quantity, without what is no number and without rows at the time of the row before."""
    found: dict[str, Signal] = {}
    for stream in imported.streams:
        for k, channel in enumerate(stream.spec.channels):
            if channel.quantity is None or channel.quantity in found:
                continue
            good = np.isfinite(stream.values[:, k]) & (np.diff(stream.time, prepend=-np.inf) > 0)
            found[channel.quantity] = Signal(
                stream.time[good], stream.values[good, k], held=channel.quantity == COMMAND
            )
    return found


def merged(first: Imported, second: Imported, offset: Offset, names: tuple[str, str]) -> Imported:
    """One recording, on the first file's clock; time 0 is the earlier of the two beginnings.

    Raises RecordingError where the files share no stretch of time.
    """
    (low, high), (begin, end) = _span(first), _span(second)
    if begin + offset.seconds >= high or end + offset.seconds <= low:
        raise RecordingError(
            f"{names[1]} begins {offset.said}: then the files share no stretch of time ({low:.6g} to {high:.6g} s and "
            f"{begin + offset.seconds:.6g} to {end + offset.seconds:.6g} s); is the offset another?"
        )
    earliest = min(0.0, offset.seconds)
    ours = [_moved(stream, -earliest) for stream in first.streams]
    taken = {stream.spec.name for stream in ours}
    theirs = [_moved(_renamed(stream, taken), offset.seconds - earliest) for stream in second.streams]
    steps = _shifted(first.steps, -earliest) or _shifted(second.steps, offset.seconds - earliest)
    line = f"clocks: {names[1]} begins {offset.said}"
    return Imported(
        streams=(*ours, *theirs),
        steps=steps,
        notes=(line, *_of(names[0], first.notes), *_of(names[1], second.notes), *_twice(first, second, names)),
        warnings=(*_of(names[0], first.warnings), *_of(names[1], second.warnings)),
        created=first.created if not earliest else "",
        rows=first.rows + second.rows,
        bad=first.bad + second.bad,
    )


def _span(imported: Imported) -> tuple[float, float]:
    """First and last time of any row, s."""
    times = [stream.time for stream in imported.streams if stream.time.size]
    return min(float(t[0]) for t in times), max(float(t[-1]) for t in times)


def _of(name: str, texts: Sequence[str]) -> Iterator[str]:
    return (f"{name}: {text}" for text in texts)


def _twice(first: Imported, second: Imported, names: tuple[str, str]) -> Iterator[str]:
    for quantity in _signals(first):
        if quantity in _signals(second):
            yield f"{quantity} is in both files; that of {names[0]} stands first and is used"


def _renamed(stream: StreamData, taken: set[str]) -> StreamData:
    name = stream.spec.name
    while name in taken:
        name += "_2"
    taken.add(name)
    return replace(stream, spec=replace(stream.spec, name=name))


def _moved(stream: StreamData, seconds: float) -> StreamData:
    return replace(stream, time=stream.time + seconds)


def _shifted(steps: tuple[StepRow, ...], seconds: float) -> tuple[StepRow, ...]:
    return tuple(replace(s, t_start=s.t_start + seconds, t_end=s.t_end + seconds) for s in steps)
