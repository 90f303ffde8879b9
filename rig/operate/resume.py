"""rig resume: go on with a campaign that was cut, at the first step that is not measured.

campaign.jsonl says which files the campaign has; what is measured they say themselves. A file that was cut stays as it
is: the rest of its run goes into a further one, which begins with a tare.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import click

from rig.campaign.config import CampaignConfig
from rig.errors import ConfigError, LinkError, RecordingError, RigError
from rig.link.live_runs import live_runs, lock_bench
from rig.operate.front_ends import Console, progress_bar
from rig.operate.last_page import no_report_option
from rig.operate.measured import Measured, measured, recording_of
from rig.operate.run import follow, require_mountable, start_controller, then_next
from rig.recording.ledger import FILE_NAME, Fact, Ledger, file_facts, finished_runs, read
from rig.screen_options import look_of, screen_options


@dataclass(frozen=True, slots=True)
class Remainder:
    """What is left of a campaign."""

    finished: tuple[str, ...]
    thrusters: tuple[str, ...]
    """Still to be measured, in the order of the campaign."""
    begun: Mapping[str, Measured] = field(default_factory=dict)
    """Of thrusters, finished or not, of which a run that was cut has measured something."""


@click.command("resume")
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--headless", is_flag=True, help="A progress bar instead of the console.")
@screen_options
@no_report_option
def resume_command(folder: Path, headless: bool, colors: str, bell: bool, report: bool) -> int:
    """Go on with the campaign in FOLDER at the first step that is not measured."""
    folder = folder.resolve()
    if any(Path(run.folder) == folder for run in live_runs()):
        raise LinkError(f"the run in {folder} is still going on; look at it with `rig console {folder}`")
    from rig.operate.check import check_campaign  # a second of scipy that `rig --help` does not need

    facts = read(folder)
    config = check_campaign(Path(_begun(facts, folder)["campaign_file"])).campaign
    require_unchanged(facts, config)
    if not headless and not sys.stdout.isatty():
        raise RigError("rig resume opens the console, which needs a terminal; use --headless where there is none")
    with lock_bench(config.bench.path):  # nobody else measures on it or resumes while the files are looked through
        rest = remainder(facts, folder, config)
        require_mountable(config, rest.thrusters, headless=headless)
        keep(rest, folder)
    click.echo(told(rest, config))
    look = look_of(colors, bell)
    console = Console(look)
    front = progress_bar(start=True, look=look) if headless else console.front()
    run, _process = start_controller(config.path, folder, rest.thrusters)
    return then_next(follow(run, front, report=report), console, report=report)


def remainder(facts: Sequence[Fact], folder: Path, config: CampaignConfig) -> Remainder:
    """What is left to do. Raises RecordingError when that is nothing, and for files that are not as the ledger says."""
    completed, begun = finished_runs(facts), dict[str, Measured]()
    finished = []
    for thruster in _thrusters(facts, folder, config):
        if thruster in completed:
            for run in _runs(facts, thruster):
                recording_of(run, facts, folder)
        else:
            begun[thruster] = measured(facts, folder, thruster, config.plan)
        if thruster in completed or not config.plan.after(begun[thruster].steps):
            finished.append(thruster)
    rest = tuple(thruster for thruster in _begun(facts, folder)["thrusters"] if thruster not in finished)
    if not rest:
        raise RecordingError(f"{folder}: nothing to resume, every step of every thruster is measured")
    return Remainder(tuple(finished), rest, {name: found for name, found in begun.items() if found.steps})


def keep(rest: Remainder, folder: Path) -> None:
    """Tell the ledger what was found measured: the controller goes on behind it, and so does who reads it later."""
    ledger = Ledger.open(folder, at_once=True)
    for thruster, found in rest.begun.items():
        ledger.write(
            "kept", thruster=thruster, recordings=list(found.recordings), continues=found.continues,
            steps=sorted(found.steps),
        )  # fmt: skip
    ledger.close()
    if ledger.error:
        raise RecordingError(f"what was found measured can't be kept: {ledger.error}")


def told(rest: Remainder, config: CampaignConfig) -> str:
    """One line for the operator."""
    to_do = []
    for thruster in rest.thrusters:
        steps = [step for step in config.plan.after(rest.begun.get(thruster, Measured()).steps) if step.index >= 0]
        cut = thruster in rest.begun
        to_do.append(f"{thruster} from step {steps[0].number} ({steps[0].doing}) on" if cut else thruster)
    return f"finished: {', '.join(rest.finished) or 'none'}; to do: {', '.join(to_do)}"


def _runs(facts: Sequence[Fact], thruster: str) -> list[Fact]:
    return [fact for fact in facts if fact["fact"] == "run_start" and fact["thruster"] == thruster]


def _thrusters(facts: Sequence[Fact], folder: Path, config: CampaignConfig) -> list[str]:
    """Those that the campaign was begun with. Raises RecordingError for one that is none of its own."""
    thrusters: list[str] = _begun(facts, folder)["thrusters"]
    named = [*thrusters, *(fact["thruster"] for fact in facts if "thruster" in fact)]
    strange = next((name for name in named if name not in config.thrusters), None)
    if strange is not None:
        raise RecordingError(
            f"{folder / FILE_NAME} names the thruster {strange[:60]!r}, which is not in {config.path}; it has "
            f"{', '.join(config.thrusters)}; the ledger was edited: put the original back, or begin anew"
        )
    return thrusters


def require_unchanged(facts: Sequence[Fact], campaign: CampaignConfig) -> None:
    """Both files must be what they were: else two halves of one campaign could not be compared. Raises ConfigError."""
    begun, now = _begun(facts, campaign.path), file_facts(campaign)
    for name, path in (("campaign", campaign.path), ("bench", campaign.bench.path)):
        if begun[f"{name}_sha256"] == now[f"{name}_sha256"]:
            continue
        difference = "\n".join(
            difflib.unified_diff(
                begun[f"{name}_toml"].splitlines(),
                now[f"{name}_toml"].splitlines(),
                "as begun",
                "now",
                lineterm="",
                n=1,
            )
        )
        raise ConfigError(
            f"{path} has changed since the campaign was begun; put it back, or begin a new campaign:\n{difference}"
        )


def _begun(facts: Sequence[Fact], where: Path) -> Fact:
    begun = next((fact for fact in facts if fact["fact"] == "start"), None)
    if begun is None:
        raise RecordingError(f"{where}: the campaign was never started, so there is nothing to resume; use `rig run`")
    return begun
