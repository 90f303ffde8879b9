"""The next experiment of a diagnosis as a campaign file that `rig check` accepts and `rig run` takes."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from rig.campaign.config import CampaignConfig
from rig.campaign.plan_file import Level, Template, files_of, template_of, write_campaign
from rig.errors import ConfigError, PlanError

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Diagnosis, NextExperiment
    from identification.mismatch.next_experiment.sweeps import Limits

SUFFIX = ": next experiment"
"""Of the campaign's name, once."""


def asked(plan: Path | None, campaign: Path | None) -> CampaignConfig | None:
    """The campaign whose bench is used. Raises ConfigError for a plan without one, or in its place."""
    if plan is not None and campaign is None:
        raise ConfigError("--plan needs --campaign, the campaign file of the recordings: it names bench and pacing")
    if campaign is None:
        return None
    if plan is not None:
        _require_apart(plan, campaign)
    from rig.campaign.loading import load_campaign  # pydantic and every driver: not for a diagnosis without a plan

    return load_campaign(campaign)


def limits_of(
    campaign: CampaignConfig | None, budget: float | None = None, flow_speeds: tuple[float, ...] | None = None
) -> Limits:
    """What the bench allows: its voltage, its slew, the thrust that cell and guard stand; `flow_speeds`: see Limits."""
    from identification.mismatch.next_experiment.sweeps import BUDGET, Limits

    seconds = BUDGET if budget is None else budget
    if not seconds > 0:
        raise PlanError(f"--budget must be above 0 s, but is {seconds:g} s")
    if campaign is None:
        return Limits(budget=seconds)
    from rig.campaign.bench import thrust_bounds  # every driver: not for a diagnosis without a plan

    bench = campaign.bench
    low, high = thrust_bounds(bench)
    stands = min(abs(low), abs(high))
    return Limits(
        max_voltage=bench.max_voltage,
        budget=seconds,
        flow_speeds=flow_speeds,
        slew=campaign.plan.slew,
        max_thrust=stands if isfinite(stands) else None,
    )


def require_thruster(campaign: CampaignConfig, thruster: str) -> None:
    """Raises ConfigError for a campaign of other thrusters."""
    if thruster not in campaign.thrusters:
        raise ConfigError(
            f"{campaign.path}: the recordings are of thruster {thruster}, but the campaign has "
            f"{', '.join(campaign.thrusters)}; give the campaign they were made with"
        )


def _require_apart(plan: Path, campaign: Path) -> None:
    if plan.resolve() == campaign.resolve():
        raise ConfigError(f"{plan}: this is the campaign that the plan is made from; choose another name for --plan")


def next_template(
    proposed: NextExperiment, thruster: str, campaign: CampaignConfig, *, attended: bool = False
) -> Template:
    """The campaign's bench and pacing for one thruster; no zero returns but the last, for the steps hold rests.

    `attended`: the run stops when its front end is gone, whatever the campaign allows. Raises ConfigError.
    """
    require_thruster(campaign, thruster)
    shortest = min(step.duration for step in proposed.steps)
    template = template_of(campaign)
    return replace(
        template,
        name=f"{template.name.removesuffix(SUFFIX)}{SUFFIX}",
        thrusters=(thruster,),
        zero_every=0,
        settle=min(template.settle, 0.5 * shortest),
        settle_reversal=0.0,  # its power was foretold for levels that follow one another
        unattended=template.unattended and not attended,
    )


def write_next(found: Diagnosis, campaign: CampaignConfig, path: Path, *, attended: bool = False) -> tuple[Path, ...]:
    """Write the sweep, one file for each flow speed; none when nothing is to be told apart, or no sweep does. Raises
    ConfigError, also when the levels are no voltages."""
    if found.next_experiment is None or not found.next_experiment.steps:
        return ()
    return write_proposed(found.next_experiment, found.thruster, campaign, path, attended=attended)


def write_proposed(
    proposed: NextExperiment, thruster: str, campaign: CampaignConfig, path: Path, *, attended: bool = False
) -> tuple[Path, ...]:
    """The same of a sweep that is there. Raises ConfigError."""
    if proposed.quantity != "command_voltage":
        raise ConfigError(
            "--plan: the recordings have no command in V, so the levels of the next experiment are in "
            f"{proposed.unit}; a campaign is driven in V; nothing was written"
        )
    flows = {step.flow_speed for step in proposed.steps}
    levels = [
        Level(step.command_voltage, step.duration, step.flow_speed if len(flows) > 1 or step.flow_speed else None)
        for step in proposed.steps
    ]
    for file in files_of(levels, path):
        _require_apart(file, campaign.path)
    comment = (
        f"Written by `rig {'settle' if attended else 'diagnose'}`.",
        proposed.why,
        f"probability that it decides rightly, as expected: {proposed.expected_power:.2f}",
    )
    return write_campaign(levels, next_template(proposed, thruster, campaign, attended=attended), path, comment)
