"""`rig export FILE --to WHAT`: a recording as tables that other programs read."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path

import click

from rig.errors import RecordingError
from rig.exporting.content import Content, content_of
from rig.exporting.targets import TARGETS, target_of
from rig.list_option import ListCommand, ListOption


@click.command("export", cls=ListCommand)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--to", "word", type=click.Choice(list(TARGETS)), required=True, help="What to write.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="A new file, for csv and parquet a new folder (default: beside FILE, by its name).",
)
@click.option("--streams", cls=ListOption, multiple=True, help="These streams only (default: all).")
def export_command(file: Path, word: str, output: Path | None, streams: tuple[str, ...]) -> None:
    """Write a recording as CSV, Parquet, MATLAB or MCAP: a table per stream, with units."""
    target = target_of(file, word)
    out = output or file.with_name(file.stem + target.ending)
    module, _, name = target.writer.partition(":")
    content = content_of(file, streams)
    written(content, out, getattr(import_module(module), name))
    for sentence in told(content):
        click.echo(sentence)
    click.echo(f"{out}: {len(content.steps)} steps, {len(content.events)} events")


def written(content: Content, out: Path, write: Callable[[Content, Path], None]) -> None:
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
