"""`rig diagnose FILE...`: what the model leaves out of these recordings, located, named, refitted and judged."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rig.diagnose_vehicle import VehicleFiles, diagnose_vehicle_files, is_vehicle, refuse_for_tunnel
from rig.errors import RecordingError, RigError
from rig.next_plan import asked, limits_of, write_next

if TYPE_CHECKING:  # numpy and scipy come up when a diagnosis is made, not for `rig diagnose --help`
    from identification.mismatch.diagnosis import Diagnosis
    from identification.mismatch.sweeps import Limits
    from identification.recording import Recording
    from identification.twin import Twin

NO_VEHICLE = VehicleFiles()
WHAT = "expected one or more recordings (*.h5) of one thruster"


def recordings_in(paths: Iterable[Path], who: str = "rig diagnose") -> list[Path]:
    """The files meant by files and folders; a folder stands for its *.h5. Raises RecordingError."""
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


def diagnose_files(
    paths: Iterable[Path],
    holdout: Iterable[Path] = (),
    seed: int = 0,
    twin: Path | None = None,
    *,
    any_thruster: bool = False,
    limits: Limits | None = None,
    vehicle: VehicleFiles = NO_VEHICLE,
) -> Diagnosis:
    """The diagnosis of recordings of one thruster, against C V|V| or a twin; its own twin knows the files' hashes.

    Of recordings of a vehicle, against its drag and its thrusters' models; `vehicle` says what is known of it.
    Raises RecordingError for what cannot be diagnosed, TwinError for a twin that cannot be read.
    """
    from rig.twin import read_twin, stamped

    files = recordings_in(paths)
    baseline = None if twin is None else read_twin(twin)
    recordings = read(files)
    if is_vehicle(recordings):
        if baseline is not None:
            raise RecordingError(f"--twin is of a thruster, and {files[0]} is a recording of a vehicle")
        held = list(holdout)
        kept = dict(zip(held, read(held), strict=True))
        return diagnose_vehicle_files(dict(zip(files, recordings, strict=True)), kept, seed, vehicle)
    refuse_for_tunnel(vehicle)
    if baseline is not None and any_thruster:
        baseline = replace(baseline, thruster=recordings[0].thruster)
    found = diagnosed(recordings, read(holdout), seed, baseline, limits)
    by_id = {r.recording_id: path for r, path in zip(recordings, files, strict=True)}
    return found if found.twin is None else replace(found, twin=stamped(found.twin, by_id))


def diagnosed(
    recordings: Sequence[Recording],
    holdout: Sequence[Recording] = (),
    seed: int = 0,
    baseline: Twin | None = None,
    limits: Limits | None = None,
) -> Diagnosis:
    """As identification has it, a refusal raised as RecordingError."""
    from identification.mismatch.diagnosing import diagnose
    from identification.mismatch.preparing import Refusal

    found = diagnose(recordings, holdout, seed, baseline, limits)
    if isinstance(found, Refusal):
        raise RecordingError(found.reason)
    return found


def tell(
    found: Diagnosis, json_path: Path | None, report: Path | None, save_twin: Path | None, files: Iterable[Path] = ()
) -> None:
    """Twin, page and JSON where they are wanted; text for a person unless the JSON goes to standard output.

    `files`: the recordings diagnosed; with them the page draws each effect by itself.
    """
    from identification.mismatch.diagnosis import diagnosis_json
    from rig.diagnose_text import diagnosis_text

    if save_twin is not None and found.response != "thrust":
        raise RecordingError("--save-twin keeps the model of a thruster; these are recordings of a vehicle")
    if save_twin is not None and found.twin is not None:
        from rig.twin import write_twin

        write_twin(found.twin, save_twin)
    if report is not None:
        page = "rig.report.diagnosis" if found.response == "thrust" else "rig.report.diagnosis_vehicle"
        import_module(page).write(found, report, read(files))  # matplotlib: only for a page
    if json_path is not None:
        text = json.dumps(diagnosis_json(found), indent=1, allow_nan=False)
        if str(json_path) == "-":
            click.echo(text)
            return
        json_path.write_text(text + "\n", encoding="utf-8")
    click.echo(diagnosis_text(found))


PATH = click.Path(path_type=Path)


@click.command("diagnose")
@click.argument("files", nargs=-1, required=True, type=PATH)
@click.option("--twin", type=PATH, help="Diagnose against this twin instead of C V|V|.")
@click.option("--any-thruster", is_flag=True, help="The twin may be of another thruster.")
@click.option(
    "--holdout", type=PATH, multiple=True, help="Recording that is not fitted, only predicted (may be repeated)."
)
@click.option("--json", "json_path", type=PATH, help="Write the diagnosis here; - is standard output.")
@click.option(
    "--report", type=click.Path(dir_okay=False, path_type=Path), help="Write a page with figures here (HTML)."
)
@click.option(
    "--save-twin",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the fitted model here, as a twin (JSON).",
)
@click.option("--thrusters", multiple=True, type=PATH, help="Vehicle: what `rig fit --json` wrote of its thrusters.")
@click.option("--installation", type=PATH, help="Vehicle: which thruster sits where (TOML), as for `rig vehicle`.")
@click.option(
    "--mass", type=float, metavar="KG", help="Vehicle: its inertia on that axis, in the installation's place."
)
@click.option("--mass-std", type=float, default=0.0, metavar="KG", help="Standard deviation of --mass.  [default: 0]")
@click.option("--axis", type=click.Choice(["surge", "sway", "heave", "yaw"]), help="Vehicle: only trials of this axis.")
@click.option("--plan", type=PATH, help="Write the next experiment here, as a campaign; needs --campaign.")
@click.option("--campaign", type=PATH, help="Campaign of the recordings: bench and pacing of the next experiment.")
@click.option("--budget", type=float, metavar="S", help="Longest next experiment.  [default: 300]")
@click.option("--seed", default=0, show_default=True, help="Of the surrogates that the false-alarm rate is judged by.")
def diagnose_command(
    files: tuple[Path, ...],
    twin: Path | None,
    any_thruster: bool,
    holdout: tuple[Path, ...],
    json_path: Path | None,
    report: Path | None,
    save_twin: Path | None,
    thrusters: tuple[Path, ...],
    installation: Path | None,
    mass: float | None,
    mass_std: float,
    axis: str | None,
    plan: Path | None,
    campaign: Path | None,
    budget: float | None,
    seed: int,
) -> None:
    """Find the physics that C V|V| leaves out of recordings of one thruster; a folder stands for its *.h5.

    Of recordings of a vehicle: what its drag and the models of its thrusters leave out.

    Exit status 0 for every honest verdict, 2 for input that cannot be used (one sentence why).
    """
    try:
        held = recordings_in(holdout) if holdout else []
        bench = asked(plan, campaign)
        limits = limits_of(bench, budget)
        vehicle = VehicleFiles(thrusters, installation, mass, mass_std, axis or "")
        found = diagnose_files(files, held, seed, twin, any_thruster=any_thruster, limits=limits, vehicle=vehicle)
        if plan is not None and found.response != "thrust":
            raise RecordingError("--plan writes a campaign of the bench; these are recordings of a vehicle")
        tell(found, json_path, report, save_twin, recordings_in(files))
        if plan is not None and bench is not None:
            for file in write_next(found, bench, plan):
                click.echo(f"next experiment written to {file}; next: rig check {file}", err=str(json_path) == "-")
    except (RigError, OSError) as error:
        click.echo(f"rig diagnose: {error}", err=True)
        raise SystemExit(2) from error
