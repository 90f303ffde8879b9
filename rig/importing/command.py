"""`rig import`: tables and logs of other programs become recordings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import click

from rig.errors import ConfigError
from rig.fleet.options import Fleet, fleet_of, fleet_options, refuse_beside
from rig.importing.map_options import LEVELS, Levels, assignments_of, plan_of, refuse_without_map
from rig.importing.mapping import read_map, shipped
from rig.importing.one_file import Beside, Summary, import_file, import_plain, read_source
from rig.importing.thruster_name import thruster_of
from rig.importing.timing.two_clocks import ESTIMATED, offset_asked


def _list_maps(context: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
    if wanted and not context.resilient_parsing:
        for name in shipped():
            click.echo(f"{name:28} {read_map(name).about}")
        context.exit()


HELP = """Make a recording of another program's table or log, as MAP says what its columns are.

With --jobs of many of them, each by itself: every file has a row of a table too; a file may then be a URL.
"""


@click.command("import", help=HELP)
@click.argument("files", metavar="FILES...", nargs=-1, required=True, type=click.Path())
@click.option(
    "--map",
    "map_name",
    help="Name of a shipped map (--list) or path of a MAP.toml; none for JSON in the words of the recording format.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="The recording to write (default: FILE with .h5); with --jobs the folder for all.",
)
@click.option(
    "--set",
    "assignments",
    multiple=True,
    metavar="NAME=NUMBER",
    help="Override a parameter of the map; may be repeated.",
)
@click.option("--thruster", help="Its id (default: the map's, else what FILE's name tells).")
@click.option("--kind", type=click.Choice(["tunnel", "bollard", "vehicle"]), help="Override the map's kind.")
@click.option("--where", default="", metavar="FILTER", help="Only these rows, as \"mode == 'run' and c3 > 0\".")
@click.option(
    "--levels",
    type=click.Choice(LEVELS),
    help="Each row is a level, its time its start, middle or end; no: each row is a sample of a log.",
)
@click.option(
    "--with", "beside", type=click.Path(path_type=Path), metavar="FILE", help="A second file, with a clock of its own."
)
@click.option("--with-map", help="Map of the second file (default: that of the first).")
@click.option("--with-where", metavar="FILTER", help="Only these of its rows (default: --where; '': all).")
@click.option("--with-levels", type=click.Choice(LEVELS), help="What its rows are (default: --levels).")
@click.option(
    "--offset",
    default=ESTIMATED,
    show_default=True,
    metavar="S|clock|auto",
    help="From the first row of FILE to that of the second, s; clock: by their stamps; auto: estimated.",
)
@click.option("--notes", default="", help="Text that is kept in the recording.")
@click.option(
    "--list", is_flag=True, is_eager=True, expose_value=False, callback=_list_maps, help="List the shipped maps."
)
@fleet_options
def import_command(
    *,
    files: tuple[str, ...],
    map_name: str | None,
    output: Path | None,
    assignments: tuple[str, ...],
    thruster: str | None,
    kind: Literal["tunnel", "bollard", "vehicle"] | None,
    where: str,
    levels: Levels | None,
    beside: Path | None,
    with_map: str | None,
    with_where: str | None,
    with_levels: Levels | None,
    offset: str,
    notes: str,
    **asked: Any,
) -> None:
    """RigError is for the caller (rig.cli) to print."""
    fleet = fleet_of(**asked)
    if fleet is not None:
        refuse_beside(("--with", beside), ("--with-map", with_map), ("--with-where", with_where))
        refuse_beside(("--with-levels", with_levels), ("--offset", offset != ESTIMATED))
        chosen = {"levels": levels, "where": where, "thruster": thruster, "kind": kind, "notes": notes}
        raise SystemExit(_many(files, map_name, output, assignments, chosen, fleet))
    if len(files) > 1:
        raise ConfigError(f"{len(files)} files were given: --jobs N imports each by itself, N at a time")
    file = Path(files[0])
    out = output or file.with_suffix(".h5")
    if map_name is None:
        given: dict[str, object] = {
            "--set": assignments,
            "--thruster": thruster,
            "--kind": kind,
            "--where": where,
            "--levels": levels,
        }
        given |= {"--with": beside, "--with-map": with_map, "--with-where": with_where, "--with-levels": with_levels}
        refuse_without_map(file, given)
        _tell_plain(import_plain(file, out, notes))
        return
    plan = plan_of(map_name, levels, where)
    read_source(file, plan.file)  # what it is comes before whose it is
    whose, known_by = thruster_of(thruster, plan, file)
    plan = replace(plan, thruster=whose, kind=kind or plan.kind)
    second = None
    if beside is not None:
        its_rows = with_levels or levels, where if with_where is None else with_where
        second = Beside(beside, plan_of(with_map or map_name, *its_rows), offset_asked(offset))
    _tell(import_file(file, plan, out, assignments_of(assignments), notes, second), whose, known_by)


def _many(
    files: tuple[str, ...],
    map_name: str | None,
    output: Path | None,
    assignments: tuple[str, ...],
    chosen: dict[str, Any],
    fleet: Fleet,
) -> int:
    from rig.importing.many import import_all
    from rig.importing.row import question_of

    if map_name is None:
        raise ConfigError("--jobs: give --map too, which says what the columns of all these files are")
    question = question_of(map_name, output, parameters=assignments_of(assignments), **chosen)
    return import_all(question, plan_of(map_name, None, "").file, files, fleet)


def _tell_plain(summary: Summary) -> None:
    for sentence in summary.sentences:
        click.echo(sentence)
    click.echo(f"{summary.path}: {summary.rows} rows")


def _tell(summary: Summary, whose: str, known_by: str) -> None:
    for sentence in summary.sentences:
        click.echo(sentence)
    other = "; --thruster NAME for another" if known_by == "the file's name" else ""
    click.echo(f"thruster {whose} (by {known_by}{other})")
    click.echo(f"{summary.path}: {summary.rows} rows, {summary.bad} left out")
