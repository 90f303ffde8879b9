"""`rig export FILE --to WHAT`: a recording as tables that other programs read, a twin as its consumers read it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

import click

from rig.errors import ConfigError, RecordingError
from rig.exporting.content import Content, content_of
from rig.exporting.targets import TARGETS, TWIN, Target, target_of
from rig.list_option import ListCommand, ListOption
from rig.workers.called import called

What = TypeVar("What")
"""That is exported: a recording's content, or a twin with what was asked of it."""


@click.command("export", cls=ListCommand)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--to", "word", type=click.Choice(list(TARGETS)), required=True, help="What to write.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="A new file, for csv and parquet a new folder (default: beside FILE, by its name).",
)
@click.option("--streams", cls=ListOption, multiple=True, help="Of a recording these streams only (default: all).")
@click.option("--diameter", type=click.FloatRange(0.0, min_open=True), metavar="M", help="Of a twin's propeller.")
@click.option(
    "--pulse",
    type=(float, float, float),
    metavar="US US US",
    help="Of a twin's ESC: pulses at full astern, neutral, full ahead.  [default: 1100 1500 1900]",
)
def export_command(
    file: Path,
    word: str,
    output: Path | None,
    streams: tuple[str, ...],
    diameter: float | None,
    pulse: tuple[float, float, float] | None,
) -> None:
    """Write a recording as tables (csv, parquet, mat, mcap), or a twin as what simulators, autopilots and programs
    read (all other words)."""
    target = target_of(file, word)
    out = output or file.with_name(_stem(file) + target.ending)
    if target.of == TWIN:
        if streams:
            raise ConfigError("--streams: a twin has none; leave it out")
        sentences = _of_twin(file, target, out, diameter, pulse)
    else:
        if diameter is not None or pulse is not None:
            raise ConfigError("--diameter and --pulse belong to a twin; this is a recording: leave them out")
        sentences = _of_recording(file, target, out, streams)
    for sentence in sentences:
        click.echo(sentence)


def _stem(file: Path) -> str:
    """T1 of T1.h5 and of T1.twin.json."""
    return file.name.removesuffix(file.suffix).removesuffix(".twin")


def _of_recording(file: Path, target: Target, out: Path, streams: tuple[str, ...]) -> list[str]:
    content = content_of(file, streams)
    written(content, out, called(target.writer))
    return [*told(content), f"{out}: {len(content.steps)} steps, {len(content.events)} events"]


def _of_twin(
    file: Path, target: Target, out: Path, diameter: float | None, pulse: tuple[float, float, float] | None
) -> list[str]:
    from rig.exporting.twins.curve import curve_of  # scipy
    from rig.exporting.twins.written import PULSE, Asked, summary
    from rig.twin.reading import read_twin

    twin = read_twin(file)
    low, neutral, high = pulse or PULSE
    if not low < neutral < high:
        raise ConfigError(f"--pulse must be full astern < neutral < full ahead in us, got {low:g} {neutral:g} {high:g}")
    asked = Asked(twin, curve_of(twin), file.name, diameter, pulse=(low, neutral, high))
    written(asked, out, called(target.writer))
    return [f"{out}: {asked.curve.thruster}", *summary(asked, called(target.carried)(asked))]


def written(content: What, out: Path, write: Callable[[What, Path], None]) -> None:
    """`out`, a new file or folder, whole or not at all. Raises RecordingError."""
    if out.exists():
        raise RecordingError(f"{out} exists; an export is never written over anything: give another name")
    if not out.parent.is_dir():
        raise RecordingError(f"{out}: there is no folder {out.parent}; make it, or give another name")
    part = out.with_name(f".{out.name}.part")
    _remove(part)
    try:
        write(content, part)
        part.rename(out)
    except (OSError, UnicodeError) as error:  # UnicodeError: a name that a stranger's file has and UTF-8 has not
        raise RecordingError(f"{out} can't be written: {error}") from error
    finally:
        _remove(part)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def told(content: Content) -> Iterable[str]:
    """A line per stream: its columns with units, its rows, and the rows that could not be used."""
    for stream in content.streams:
        left_out = f", {n} left out: time not finite or running back" if (n := stream.rows.left_out) else ""
        titles = ", ".join(column.title for column in stream.columns)
        yield f"{stream.name}: {stream.rows.kept} rows of {titles}{left_out}"
    for _, level, text in content.events:
        if level == "warning" and text.startswith("not closed in order"):
            yield text
