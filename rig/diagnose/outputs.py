"""What is written beside the text of a diagnosis, and what of it can be refused before anything is computed."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from rig.campaign.config import CampaignConfig
from rig.diagnose.next_plan import asked, limits_of, require_thruster
from rig.errors import ConfigError, RecordingError
from rig.list_option import ListOption
from rig.result_path import RESULT, RESULT_FILE, require_different

if TYPE_CHECKING:
    from identification.mismatch.next_experiment.sweeps import Limits
    from identification.recording import Recording

C = TypeVar("C", bound=Callable[..., object])

PATH = click.Path(path_type=Path)
_OPTIONS = (
    click.option("--json", "json_path", type=RESULT, help="Write the diagnosis here; - is standard output."),
    click.option("--report", type=RESULT_FILE, help="Write a page with figures here (HTML)."),
    click.option("--save-twin", type=RESULT_FILE, help="Write the fitted model here, as a twin (JSON)."),
    click.option("--plan", type=RESULT_FILE, help="Write the next experiment here, as a campaign; needs --campaign."),
    click.option("--campaign", type=PATH, help="Campaign of the recordings: bench and pacing of the next experiment."),
    click.option("--budget", type=float, metavar="S", help="Longest next experiment.  [default: 300]"),
)


holdout_option = click.option(
    "--holdout",
    cls=ListOption,
    type=PATH,
    multiple=True,
    metavar="FILE...",
    help="Recordings that are not fitted, only predicted: every file up to the next option (may be repeated).",
)


seed_option = click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Of the surrogates that the false-alarm rate is judged by.",
)


def answer_options(command: C) -> C:
    """The options of a diagnosis that say what is written, and for which bench."""
    return reduce(lambda made, option: option(made), reversed(_OPTIONS), command)


@dataclass(frozen=True, slots=True)
class Wanted:
    """Files to be written, and the bench that the next experiment is for."""

    json_path: Path | None = None
    """`-` is standard output."""
    report: Path | None = None
    save_twin: Path | None = None
    plan: Path | None = None
    campaign: CampaignConfig | None = None
    limits: Limits | None = None
    """Of the next experiment; None: what was recorded may be run again."""

    @property
    def alone(self) -> bool:
        """Whether standard output is for the JSON alone."""
        return str(self.json_path) == "-"

    def refuse(self, recordings: Sequence[Recording]) -> None:
        """Raises RecordingError for what recordings of a vehicle do not have, ConfigError for another's campaign."""
        if not any(recording.kind == "vehicle" for recording in recordings):
            if self.plan is not None and self.campaign is not None and recordings:
                require_thruster(self.campaign, recordings[0].thruster)
            return
        if self.save_twin is not None:
            raise RecordingError("--save-twin keeps the model of a thruster; these are recordings of a vehicle")
        if self.plan is not None:
            raise RecordingError("--plan writes a campaign of the bench; these are recordings of a vehicle")


def wanted_of(
    json_path: Path | None,
    report: Path | None,
    save_twin: Path | None,
    plan: Path | None,
    campaign: Path | None,
    budget: float | None,
) -> Wanted:
    """Raises ConfigError or PlanError for what can be seen to fail before anything is read or computed."""
    outputs = (("--json", json_path), ("--save-twin", save_twin), ("--plan", plan))
    require_different(("--campaign", campaign), *outputs, ("--report", report))
    for name, path in outputs:
        if path is not None and str(path) != "-":
            require_writable(name, path)
    bench = asked(plan, campaign)
    limits = None if bench is None and budget is None else limits_of(bench, budget)
    return Wanted(json_path, report, save_twin, plan, bench, limits)


def require_writable(option: str, path: Path) -> None:
    """Raises ConfigError where a file of this name cannot be written."""
    if path.is_dir():
        raise ConfigError(f"{option} {path}: this is a folder; expected the name of a file to write")
    if not path.parent.is_dir():
        raise ConfigError(f"{option} {path}: there is no folder {path.parent}; make it, or choose another place")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise ConfigError(f"{option} {path}: it cannot be written; choose another place")
