"""rig resume: go on with a campaign whose run was cut, at the first thruster whose run did not end completed.

What is believed is campaign.jsonl. The cut run is repeated from its first tare into a file of its own.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from rig.campaign.config import CampaignConfig
from rig.errors import ConfigError, LinkError, RecordingError, RigError
from rig.link.live_runs import live_runs
from rig.operate.run import console_screen, follow, progress_bar, require_mountable, start_controller
from rig.recording.ledger import Fact, file_facts, finished_runs, read


@dataclass(frozen=True, slots=True)
class Remainder:
    """What is left of a campaign."""

    campaign: Path
    """Its file."""
    finished: tuple[str, ...]
    thrusters: tuple[str, ...]
    """Still to be measured, in the order of the campaign."""


@click.command("resume")
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--headless", is_flag=True, help="A progress bar instead of the console.")
def resume_command(folder: Path, headless: bool) -> int:
    """Go on with the campaign in FOLDER at the first thruster that is not finished."""
    folder = folder.resolve()
    if any(Path(run.folder) == folder for run in live_runs()):
        raise LinkError(f"the run in {folder} is still going on; look at it with `rig console {folder}`")
    from rig.operate.check import check_campaign  # a second of scipy that `rig --help` does not need

    facts = read(folder)
    rest = remainder(facts, folder)
    config = check_campaign(rest.campaign).campaign
    require_unchanged(facts, config)
    require_mountable(config, rest.thrusters, headless=headless)
    if not headless and not sys.stdout.isatty():
        raise RigError("rig resume opens the console, which needs a terminal; use --headless where there is none")
    click.echo(f"finished: {', '.join(rest.finished) or 'none'}; to do: {', '.join(rest.thrusters)}")
    front = progress_bar(start=True) if headless else console_screen()
    run, _process = start_controller(rest.campaign, folder, rest.thrusters)
    return follow(run, front)


def remainder(facts: Sequence[Fact], folder: Path) -> Remainder:
    """What the ledger leaves to do. Raises RecordingError when that is nothing."""
    begun = _begun(facts, folder)
    finished = finished_runs(facts)
    rest = tuple(thruster for thruster in begun["thrusters"] if thruster not in finished)
    if not rest:
        raise RecordingError(f"{folder}: nothing to resume, every thruster's run is completed")
    return Remainder(Path(begun["campaign_file"]), tuple(finished), rest)


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
