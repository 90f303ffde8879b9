"""`rig diagnose FILE...`: what the model leaves out of these recordings, located, named, refitted and judged."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.diagnose.behind_twin import behind, missing
from rig.diagnose.next_plan import write_next
from rig.diagnose.outputs import PATH, Wanted, answer_options, holdout_option, seed_option, wanted_of
from rig.diagnose.progress import observed
from rig.diagnose.recording_names import file_names, told_by_name, with_names
from rig.diagnose.vehicle import VehicleFiles, diagnose_vehicle_files, is_vehicle, refuse_for_tunnel
from rig.errors import RecordingError, RigError
from rig.fleet.options import Fleet, fleet_of, fleet_options, refuse_beside
from rig.list_option import ListCommand
from rig.recording.recover import rather_recovered

if TYPE_CHECKING:  # numpy and scipy come up when a diagnosis is made, not for `rig diagnose --help`
    from identification.mismatch.answer.explained.trace import Trace
    from identification.mismatch.diagnosis import Diagnosis
    from identification.mismatch.next_experiment.sweeps import Limits
    from identification.mismatch.observer import Observer
    from identification.recording import Recording
    from identification.twin import Twin
    from rig.campaign.config import CampaignConfig

NO_VEHICLE = VehicleFiles()
NOTHING = Wanted()
WHAT = "expected one or more recordings (*.h5) of one thruster"


def recordings_in(paths: Iterable[Path], who: str = "rig diagnose", *, told: bool = True) -> list[Path]:
    """The files meant by files and folders, of a damaged one and its copy the copy. Raises RecordingError.

    `told`: which copies are taken is said on stderr.
    """
    return rather_recovered(named(paths, who), told=told)


def named(paths: Iterable[Path], who: str = "rig diagnose") -> list[Path]:
    """The files meant by files and folders, a folder for its *.h5; none is looked into. Raises RecordingError."""
    found = list(chain.from_iterable(_in(Path(path)) for path in paths))
    if not found:
        raise RecordingError(f"{who}: no recording was given; {WHAT}")
    return found


def _in(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = sorted(path.glob("*.h5"))
    if not found:
        raise RecordingError(f"{path} is a folder without recordings; {WHAT}")
    return found


def read(paths: Iterable[Path]) -> list[Recording]:
    """Raises RecordingError with one sentence for the first that cannot be read."""
    from rig.hdf5 import load

    return [load(path) for path in paths]


def refuse_both(files: Iterable[Path], held: Iterable[Path]) -> None:
    """Raises RecordingError for a file that is fitted and held out."""
    fitted = {path.resolve() for path in files}
    for path in held:
        if path.resolve() in fitted:
            raise RecordingError(f"{path} is both to be diagnosed and held out; hold out another recording")


def diagnose_files(
    paths: Iterable[Path],
    holdout: Iterable[Path] = (),
    seed: int = 0,
    twin: Path | None = None,
    *,
    any_thruster: bool = False,
    limits: Limits | None = None,
    vehicle: VehicleFiles = NO_VEHICLE,
    wanted: Wanted = NOTHING,
    watched: Callable[[Trace], object] | None = None,
    observer: Observer | None = None,
    before: Sequence[Path] = (),
) -> Diagnosis:
    """The diagnosis of recordings of one thruster, against C V|V| or a twin; its own twin knows the files' hashes.

    Of recordings of a vehicle, against its drag and its thrusters' models; `vehicle` says what is known of it.
    `limits`: of the next experiment. `wanted`: what is to be written of the answer; what cannot be is refused before
    anything is computed. `before`: recordings behind the twin that are neither beside it nor beside the files.
    `watched` is given what each stage of a thruster's diagnosis handed on, `observer` is told how far it is and may end
    its search.
    Raises RecordingError or ConfigError for what cannot be used, TwinError for such a twin.
    """
    from rig.twin.reading import read_twin
    from rig.twin.writing import stamped

    given, kept_back = named(paths), named(holdout) if holdout else []
    refuse_both(given, kept_back)
    files, held = rather_recovered(given), rather_recovered(kept_back)
    baseline = None if twin is None else read_twin(twin)
    if before and baseline is None:
        raise RecordingError("--before is of the recordings behind a twin, and there is no --twin; give one")
    recordings = read(files)
    wanted.refuse(recordings)
    if is_vehicle(recordings):
        _refuse_for_vehicle(files, twin, limits, explained=watched is not None)
        kept = dict(zip(held, read(held), strict=True))
        return diagnose_vehicle_files(dict(zip(files, recordings, strict=True)), kept, seed, vehicle)
    refuse_for_tunnel(vehicle)
    if baseline is not None and any_thruster:
        baseline = replace(baseline, thruster=recordings[0].thruster)
    folders = [path.parent for path in (twin, *files) if path is not None]
    earlier = [] if baseline is None else behind(baseline, folders, before)
    trace = traced(recordings, read(held), seed, baseline, limits, observer, earlier)
    if watched is not None:
        watched(trace)
    found = trace.diagnosis
    if baseline is not None and not earlier and found.findings:
        found = replace(found, notes=(*found.notes, missing(baseline)))
    by_id = {r.recording_id: path for r, path in zip(recordings, files, strict=True)}
    return found if found.twin is None else replace(found, twin=stamped(found.twin, by_id))


def _refuse_for_vehicle(files: Sequence[Path], twin: Path | None, limits: Limits | None, *, explained: bool) -> None:
    if explained:
        raise RecordingError(
            f"--explain shows the stages of a thruster's diagnosis and is not there yet for a vehicle, and {files[0]} "
            "is of a vehicle; leave --explain out"
        )
    if twin is not None:
        raise RecordingError(f"--twin is of a thruster, and {files[0]} is a recording of a vehicle")
    if limits is not None:
        raise RecordingError(
            f"--campaign and --budget are of an experiment on the bench, and {files[0]} is a recording of a vehicle"
        )


def traced(
    recordings: Sequence[Recording],
    holdout: Sequence[Recording] = (),
    seed: int = 0,
    baseline: Twin | None = None,
    limits: Limits | None = None,
    observer: Observer | None = None,
    before: Sequence[Recording] = (),
) -> Trace:
    """As identification has it for a thruster, a refusal raised as RecordingError."""
    from identification.mismatch.observer import UNWATCHED
    from identification.mismatch.pipeline import traced as trace_of
    from identification.mismatch.prepare.preparing import Refusal

    found = trace_of(recordings, holdout, seed, baseline, limits, watch=observer or UNWATCHED, before=before)
    if isinstance(found, Refusal):
        raise RecordingError(found.reason)
    return found


def tell(found: Diagnosis, wanted: Wanted, recordings: Sequence[Recording] = (), files: Sequence[Path] = ()) -> None:
    """Twin, page, JSON and plan where they are wanted; text for a person unless the JSON goes to standard output.

    `recordings`: those diagnosed; with them the page draws each effect by itself. `files`: those of all recordings,
    whose names text and page have in the place of ids. Raises OSError, ConfigError.
    """
    from identification.mismatch.answer.as_json import diagnosis_json
    from rig.diagnose.text import diagnosis_text

    if wanted.save_twin is not None and found.twin is not None:
        from rig.twin.writing import write_twin

        write_twin(found.twin, wanted.save_twin)
    if wanted.report is not None:
        page = "rig.diagnose.report.page" if found.response == "thrust" else "rig.diagnose.report.vehicle"
        import_module(page).write(found, wanted.report, recordings, _names(files))  # matplotlib: only for a page
    if wanted.json_path is not None:
        text = json.dumps(diagnosis_json(found), indent=1, allow_nan=False)
        if wanted.alone:
            click.echo(text)
        else:
            wanted.json_path.write_text(text + "\n", encoding="utf-8")
    if not wanted.alone:
        click.echo(diagnosis_text(told_by_name(found, _names(files))))
    if wanted.plan is not None and wanted.campaign is not None:
        _plan(found, wanted.campaign, wanted.plan, err=wanted.alone)


def _names(files: Iterable[Path]) -> dict[str, str]:
    """Of the recordings in these files and folders."""
    return file_names(chain.from_iterable(map(_in, files)))


def explain(trace: Trace, wanted: Wanted, files: Sequence[Path] = ()) -> None:
    """How it came to the answer, after it; on standard error where standard output is for the JSON alone."""
    from identification.mismatch.answer.explained.explain import explained
    from rig.diagnose.explanation import explanation_text

    text = with_names(explanation_text(explained(trace)), _names(files))
    click.echo(("" if wanted.alone else "\n") + text, err=wanted.alone)


def _plan(found: Diagnosis, campaign: CampaignConfig, plan: Path, *, err: bool) -> None:
    """The next experiment as a campaign, or why there is none."""
    if found.next_experiment is None:
        click.echo(f"no next experiment is needed, for no finding has a rival; {plan} was not written", err=True)
    elif not found.next_experiment.steps:
        click.echo(f"no sweep settles it: {found.next_experiment.why}; {plan} was not written", err=True)
    for file in write_next(found, campaign, plan):
        click.echo(f"next experiment written to {file}; next: rig check {file}", err=err)


def _refuse_of_one(options: Sequence[tuple[str, object]], of_vehicle: bool, outputs: Mapping[str, object]) -> None:
    """Raises ConfigError for what is asked of one diagnosis, where every file has its own."""
    refuse_beside(*options, ("what is known of a vehicle", of_vehicle))
    refuse_beside(*((f"--{name.replace('_path', '').replace('_', '-')}", path) for name, path in outputs.items()))


def _rows(names: Sequence[str], seed: int, twin: Path | None, fleet: Fleet, *, any_thruster: bool) -> int:
    from rig.diagnose.fleet.row import COLUMNS, question_of
    from rig.fleet.asking import ask_all
    from rig.fleet.files import meant

    question = question_of(seed, twin, any_thruster=any_thruster)
    return ask_all(question, COLUMNS, meant(names), fleet)


@click.command("diagnose", cls=ListCommand)
@click.argument("names", metavar="FILES...", nargs=-1, required=True, type=click.Path())
@click.option("--twin", type=PATH, help="Diagnose against this twin (--save-twin) instead of C V|V|.")
@click.option("--any-thruster", is_flag=True, help="The twin may be of another thruster.")
@click.option(
    "--before",
    multiple=True,
    type=PATH,
    metavar="FILE",
    help="A recording behind the twin, where it is not beside it: tells whether what is found is new.",
)
@holdout_option
@answer_options
@click.option("--thrusters", multiple=True, type=PATH, help="Vehicle: what `rig fit --json` wrote of its thrusters.")
@click.option("--installation", type=PATH, help="Vehicle: which thruster sits where (TOML), as for `rig vehicle`.")
@click.option(
    "--mass", type=float, metavar="KG", help="Vehicle: its inertia on that axis, in the installation's place."
)
@click.option("--mass-std", type=float, default=0.0, metavar="KG", help="Standard deviation of --mass.  [default: 0]")
@click.option("--axis", type=click.Choice(["surge", "sway", "heave", "yaw"]), help="Vehicle: only trials of this axis.")
@seed_option
@click.option("--explain", "wants_stages", is_flag=True, help="Also print what each stage handed on, in figures.")
@fleet_options
def diagnose_command(
    names: tuple[str, ...],
    twin: Path | None,
    any_thruster: bool,
    before: tuple[Path, ...],
    holdout: tuple[Path, ...],
    thrusters: tuple[Path, ...],
    installation: Path | None,
    mass: float | None,
    mass_std: float,
    axis: str | None,
    seed: int,
    wants_stages: bool,
    jobs: int | None,
    scheduler: str | None,
    store: Path | None,
    limit: float | None,
    **outputs: Any,
) -> None:
    """Find the physics that C V|V| leaves out of recordings of one thruster; a folder stands for its *.h5.

    Of recordings of a vehicle: what its drag and the models of its thrusters leave out.

    Ctrl+C ends the search with what it has, and the answer says what was not asked; a second time ends at once.

    With --jobs every file is diagnosed by itself, and has a row of a table; a file may then be a URL.

    Exit status 0 for every honest verdict, 2 for input that cannot be used (one sentence why), 130 if ended at once.
    """
    try:
        fleet = fleet_of(jobs, scheduler, store, limit)
        if fleet is not None:
            of_one = (("--holdout", holdout), ("--before", before), ("--explain", wants_stages))
            _refuse_of_one(of_one, any((thrusters, installation, mass, axis)), outputs)
            raise SystemExit(_rows(names, seed, twin, fleet, any_thruster=any_thruster))
        files = tuple(map(Path, names))
        wanted = wanted_of(**outputs)
        vehicle = VehicleFiles(thrusters, installation, mass, mass_std, axis or "")
        traces: list[Trace] = []
        with observed(shown=not wanted.alone) as observer:
            found = diagnose_files(
                files,
                holdout,
                seed,
                twin,
                any_thruster=any_thruster,
                limits=wanted.limits,
                vehicle=vehicle,
                wanted=wanted,
                watched=traces.append if wants_stages else None,
                observer=observer,
                before=before,
            )
        shown = read(recordings_in(files, told=False)) if wanted.report is not None else ()
        tell(found, wanted, shown, (*files, *holdout))
        for trace in traces:
            explain(trace, wanted, (*files, *holdout))
    except (RigError, OSError) as error:
        click.echo(f"rig diagnose: {error}", err=True)
        raise SystemExit(2) from error
