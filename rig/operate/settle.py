"""`rig settle FILE...`: run the next experiment and diagnose again until one answer stands or the time is spent."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rig.campaign.loading import load_campaign
from rig.design.ask import seconds
from rig.diagnose.command import read, recordings_in, tell
from rig.diagnose.outputs import PATH, Wanted, seed_option, wanted_of
from rig.errors import ConfigError, RigError
from rig.operate.flow_setting import by_command, by_hand
from rig.operate.run import campaign_folder
from rig.operate.sequential_experiment import SequentialExperiment, bench_alone
from rig.result_path import RESULT, RESULT_FILE

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Diagnosis
    from identification.mismatch.next_experiment.sequential_experiment import Course, End


def _experiment(
    files: Sequence[Path], campaign: Path | None, bench: Path | None, output: Path | None, budget: str, seed: int
) -> SequentialExperiment:
    """Everything known wrong is said here, before anything is computed or opened."""
    if (campaign is None) == (bench is None):
        raise ConfigError("give either --campaign FILE (bench, pacing and tare) or --bench FILE (the rest by default)")
    time_left = seconds(budget, "--budget")
    paths = recordings_in(files, "rig settle")
    given = None if campaign is None else load_campaign(campaign)
    if given is None and output is None:
        raise ConfigError("--bench needs --output, the folder for the recordings: there is no campaign that names one")
    thruster = _thruster(paths[0])
    if given is not None and thruster not in given.thrusters:
        raise ConfigError(
            f"{given.path}: the recordings are of thruster {thruster}, but the campaign has "
            f"{', '.join(given.thrusters)}; give the campaign they were made with"
        )
    where = output if output is not None or given is None else given.output
    assert where is not None
    folder = campaign_folder(where, f"settle {thruster}")
    if given is None:
        assert bench is not None
        given = bench_alone(bench, thruster, folder)
    return SequentialExperiment(given, folder, paths, time_left, seed)


def _thruster(path: Path) -> str:
    """Of a recording whose command the rig can give again. Raises ConfigError."""
    from rig.hdf5 import load

    recording = load(path)
    if not any(recording.all_of(quantity) for quantity in ("command_voltage", "motor_voltage")):
        raise ConfigError(
            f"{path}: the recording holds no voltage, so the rig cannot run what a diagnosis asks for; expected a "
            "recording with command_voltage"
        )
    return recording.thruster


def _leave(experiment: SequentialExperiment, found: Diagnosis, course: Course, end: End, wanted: Wanted) -> None:
    """JSON, page and text. Raises RigError where one cannot be written."""
    from identification.mismatch.answer.as_json import diagnosis_json
    from identification.mismatch.next_experiment.sequential_experiment import course_json

    answer = json.dumps({**diagnosis_json(found), "settling": course_json(course, end)}, indent=1, allow_nan=False)
    try:
        if wanted.alone:
            click.echo(answer)
        elif wanted.json_path is not None:
            wanted.json_path.write_text(answer + "\n", encoding="utf-8")
        with contextlib.redirect_stdout(sys.stderr) if wanted.alone else contextlib.nullcontext():
            recordings = read(experiment.files) if wanted.report is not None else ()
            tell(found, Wanted(report=wanted.report), recordings, experiment.files)
    except OSError as error:
        raise RigError(
            f"the answer can't be written: {error}; rig diagnose makes it again of the recordings"
        ) from error


@click.command("settle")
@click.argument("files", nargs=-1, required=True, type=PATH)
@click.option("--campaign", type=PATH, help="Campaign of the recordings: bench, pacing and tare of what is run.")
@click.option("--bench", type=PATH, help="Bench alone, where there is no campaign; needs --output.")
@click.option(
    "--budget",
    default="20min",
    show_default=True,
    metavar="TIME",
    help="Time for everything, such as 600, 10min or 1h.",
)
@click.option(
    "--output", type=PATH, help="Record into a folder of its own in this one (default: `output` of the campaign)."
)
@click.option(
    "--json", "json_path", type=RESULT, help="Write the last diagnosis and the way to it; - is standard output."
)
@click.option("--report", type=RESULT_FILE, help="Write a page with figures here (HTML).")
@click.option("--flow", "flow", metavar="COMMAND", help="Command that sets the water's speed; {speed} is m/s.")
@seed_option
def settle_command(
    files: tuple[Path, ...],
    campaign: Path | None,
    bench: Path | None,
    budget: str,
    output: Path | None,
    json_path: Path | None,
    report: Path | None,
    flow: str | None,
    seed: int,
) -> int:
    """Diagnose recordings of one thruster; while two answers are equally good, run what separates them.

    THE PROPELLER TURNS when a sweep is run, with the guards of `rig run --headless`. Exit status 0 for an honest
    verdict, 1 when a run was aborted, 2 for input that cannot be used.
    """
    wanted = wanted_of(json_path, report, None, None, None, None)
    set_flow = by_command(flow) if flow is not None else by_hand if sys.stdin.isatty() else None
    experiment = _experiment(files, campaign, bench, output, budget, seed)
    experiment.set_flow = set_flow
    experiment.say = lambda text: click.echo(text, err=wanted.alone)
    found, course, end = experiment.run()
    experiment.say(f"{end.reason.replace('_', ' ')}: {end.says}")
    experiment.say(f"plans and recordings: {experiment.folder}")
    _leave(experiment, found, course, end, wanted)
    return 1 if end.reason == "aborted" else 0
