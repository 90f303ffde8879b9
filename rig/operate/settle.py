"""`rig settle FILE...`: run the next experiment and diagnose again until one answer stands or the time is spent."""

from __future__ import annotations

import contextlib
import json
import math
import shlex
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rig.campaign.config import CampaignConfig
from rig.campaign.loading import load_bench, load_campaign
from rig.campaign.plan import TareConfig
from rig.campaign.plan_file import Level, Template, write_campaign
from rig.design.ask import seconds
from rig.diagnose.command import diagnose_files, read, recordings_in, tell
from rig.diagnose.next_plan import limits_of, write_next
from rig.diagnose.outputs import Wanted, seed_option, wanted_of
from rig.errors import ConfigError, RigError
from rig.operate.run import campaign_folder, progress_bar, require_runnable, run_campaign
from rig.result_path import RESULT, RESULT_FILE

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Diagnosis
    from identification.mismatch.next_experiment.sequential_experiment import Course, End

OPENING = 20.0
"""s of a run beside its plan: ports, preflight, mounting, closing, table; seen on a loaded two-core machine."""
FLOW_PATIENCE = 300.0
"""s that a command may take to bring the water to its speed."""

SetFlow = Callable[[float], None]
"""Brings the water to a speed in m/s. Raises RigError."""


@dataclass
class Settling:
    """The bench as the loop sees it: it diagnoses what there is, and runs what it is told."""

    campaign: CampaignConfig
    folder: Path
    files: list[Path]
    budget: float
    """s"""
    seed: int = 0
    set_flow: SetFlow | None = None
    """None: nobody sets the flow, so still water is all that is proposed."""
    say: Callable[[str], None] = click.echo
    begun: float = field(default_factory=time.monotonic)
    thinking: float = 0.0
    """s of the longest diagnosis so far."""
    flow: float = 0.0
    """m/s, as it was set last; it is still when this begins."""
    setting: float = 0.0
    """s that the flow took at most so far."""

    def settle(self) -> tuple[Diagnosis, Course, End]:
        """Until one answer stands, the water still again.

        Raises RigError for input that cannot be used, before anything moves; after that what goes wrong is an end.
        """
        from identification.mismatch.next_experiment.sequential_experiment import Course, End, belief, opening_line

        found = self._diagnosed(0.0)
        course = Course(self.budget, belief(found), self._spent())
        self.say(opening_line(course))
        try:
            while True:
                try:
                    found, course, end = self._round(found, course)
                except (RigError, OSError, click.Abort, KeyboardInterrupt) as error:
                    why = str(error) or "broken off by the operator"
                    return found, course, End("aborted", f"{course.now.says}; the run was aborted: {why}")
                if end is not None:
                    return found, course, end
        finally:
            self._still()

    def _round(self, found: Diagnosis, course: Course) -> tuple[Diagnosis, Course, End | None]:
        """One experiment and its diagnosis, or why there is none."""
        from identification.mismatch.next_experiment.sequential_experiment import End, next_step, round_line

        plans = self._written(found, len(course.rounds) + 1)
        step = next_step(course, self._needs(plans))
        if isinstance(step, End):
            return found, course, step
        began = time.monotonic()
        self.files += self._run(plans)
        on_bench = time.monotonic() - began
        found = self._diagnosed(self._spent())
        course = course.after(on_bench, self._spent(), found)
        self.say(round_line(course))
        return found, course, None

    def _spent(self) -> float:
        return time.monotonic() - self.begun

    def _diagnosed(self, spent: float) -> Diagnosis:
        from identification.mismatch.next_experiment.sequential_experiment import allowance

        began = time.monotonic()
        room = allowance(self.budget - spent, fixed_cost(self.campaign) + self.thinking)
        limits = limits_of(self.campaign, room, () if self.set_flow is None else None)
        found = diagnose_files(self.files, seed=self.seed, limits=limits)
        self.thinking = max(self.thinking, time.monotonic() - began)
        return found

    def _written(self, found: Diagnosis, number: int) -> tuple[Path, ...]:
        """The plans of the next experiment: one for each flow speed, none when there is no experiment."""
        return write_next(found, self.campaign, self.folder / f"round-{number}.toml", attended=True)

    def _needs(self, plans: Sequence[Path]) -> float:
        """S until the plans are run and diagnosed."""
        return sum(_expected(load_campaign(plan)) + self.setting for plan in plans) + self.thinking

    def _run(self, plans: Sequence[Path]) -> list[Path]:
        """The recordings of the plans, each run as `rig run --headless` runs it. Raises RigError when one is aborted.

        What the run prints goes to standard error: standard output is the answer's.
        """
        made: list[Path] = []
        for plan in plans:
            config = require_runnable(plan, (), headless=True)
            self._flow_at(config.flow_speed or 0.0)
            folder = self.folder / plan.stem
            folder.mkdir()
            with contextlib.redirect_stdout(sys.stderr):
                status = run_campaign(plan, folder, (), progress_bar(start=True))
            if status:
                raise RigError(f"{folder} holds what was recorded and why it ended")
            made += sorted(folder.glob("*.h5"))
        return made

    def _flow_at(self, speed: float) -> None:
        """Raises RigError when the water cannot be brought to `speed` m/s."""
        if self.set_flow is None or speed == self.flow:
            return
        began = time.monotonic()
        self.flow = math.nan  # until it is known again
        self.set_flow(speed)
        self.flow = speed
        self.setting = max(self.setting, time.monotonic() - began)

    def _still(self) -> None:
        """Whatever happened; a flow that goes on is said."""
        try:
            self._flow_at(0.0)
        except (RigError, click.Abort, KeyboardInterrupt) as error:
            self.say(f"THE WATER MAY STILL FLOW: it could not be brought to rest: {str(error) or 'broken off'}")


def _expected(campaign: CampaignConfig) -> float:
    """S of one run of the plan, with its opening and the watchdog proof."""
    from rig.sequence.sequencer import settings_for

    proof = settings_for(campaign, "").proof
    return OPENING + campaign.plan.duration().expected + (proof.expected if proof else 0.0)


def fixed_cost(campaign: CampaignConfig) -> float:
    """S of a run beside its sweep: opening, watchdog proof, both tares and the rest before the last."""
    plan = campaign.plan
    return _expected(campaign) - plan.duration().expected + 2 * campaign.tare.duration + plan.rest


def bench_alone(bench: Path, thruster: str, folder: Path) -> CampaignConfig:
    """A campaign of the bench with the tare and the pacing that are the defaults. Raises ConfigError."""
    config = load_bench(bench)
    template = Template("settle", bench, (thruster,), folder, config.slew, TareConfig(), notes="rig settle --bench")
    (file,) = write_campaign([Level(0.0, 3.0)], template, folder / "bench-alone.toml", ("Bench and pacing only.",))
    return load_campaign(file)


def by_hand(speed: float) -> None:
    """An operator sets the flow."""
    click.prompt(f"set the flow to {speed:g} m/s, then press Enter", default="", show_default=False, err=True)


def by_command(command: str) -> SetFlow:
    """A command sets it; `{speed}` in it stands for m/s. Raises ConfigError for what no shell could split."""
    try:
        pattern = shlex.split(command)
    except ValueError as error:
        raise ConfigError(f"--flow {command}: {error}; expected a program and its arguments") from error
    if not pattern:
        raise ConfigError("--flow is empty; expected a program and its arguments")

    def set_flow(speed: float) -> None:
        words = [word.replace("{speed}", f"{speed:g}") for word in pattern]
        try:
            done = subprocess.run(
                words, capture_output=True, text=True, errors="replace", timeout=FLOW_PATIENCE, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise RigError(f"--flow: {words} could not set {speed:g} m/s: {error}") from error
        if done.returncode:
            said = (done.stderr or done.stdout).strip()[-500:]
            raise RigError(f"--flow: {words} ended with status {done.returncode}: {said}")

    return set_flow


def _settling(
    files: Sequence[Path], campaign: Path | None, bench: Path | None, output: Path | None, budget: str, seed: int
) -> Settling:
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
    return Settling(given, folder, paths, time_left, seed)


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


PATH = click.Path(path_type=Path)


def _leave(settling: Settling, found: Diagnosis, course: Course, end: End, wanted: Wanted) -> None:
    """JSON, page and text. Raises RigError where one cannot be written."""
    from identification.mismatch.diagnosis import diagnosis_json
    from identification.mismatch.next_experiment.sequential_experiment import course_json

    answer = json.dumps({**diagnosis_json(found), "settling": course_json(course, end)}, indent=1, allow_nan=False)
    try:
        if wanted.alone:
            click.echo(answer)
        elif wanted.json_path is not None:
            wanted.json_path.write_text(answer + "\n", encoding="utf-8")
        with contextlib.redirect_stdout(sys.stderr) if wanted.alone else contextlib.nullcontext():
            tell(found, Wanted(report=wanted.report), read(settling.files) if wanted.report is not None else ())
    except OSError as error:
        raise RigError(
            f"the answer can't be written: {error}; rig diagnose makes it again of the recordings"
        ) from error


@click.command("settle")
@click.argument("files", nargs=-1, required=True, type=PATH)
@click.option("--campaign", type=PATH, help="Campaign of the recordings: bench, pacing and tare of what is run.")
@click.option("--bench", type=PATH, help="Bench alone, where there is no campaign; needs --output.")
@click.option("--budget", default="20min", show_default=True, help="Time for everything, such as 600, 10min or 1h.")
@click.option("--output", type=PATH, help="Folder for what is recorded (default: the campaign's).")
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
    settling = _settling(files, campaign, bench, output, budget, seed)
    settling.set_flow = set_flow
    settling.say = lambda text: click.echo(text, err=wanted.alone)
    found, course, end = settling.settle()
    settling.say(f"{end.reason.replace('_', ' ')}: {end.says}")
    settling.say(f"plans and recordings: {settling.folder}")
    _leave(settling, found, course, end, wanted)
    return 1 if end.reason == "aborted" else 0
