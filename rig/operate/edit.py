"""rig edit: a campaign file in a form, with its dry run beside it. Opens no device, starts no run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from rig.campaign.config import CampaignConfig
from rig.campaign.loading import campaign_of
from rig.dry_run.earlier import known_power
from rig.dry_run.outlook import Assessment
from rig.dry_run.power import PowerCurve
from rig.editing.draft import Draft
from rig.editing.saving import opened
from rig.errors import ConfigError, PlanError, RigError
from rig.operate.check import check_loaded, outlook_of, require_ports
from rig.screen_options import look_of, screen_options


def assessor(path: Path) -> Callable[[str], Assessment]:
    """What `rig check` would say of `path` with another text in it. Recordings are looked at once for each thruster."""
    known: dict[tuple[Path, str], PowerCurve | str] = {}

    def powers(campaign: CampaignConfig) -> dict[str, PowerCurve | str]:
        for name in campaign.thrusters:
            if (campaign.output, name) not in known:
                known[campaign.output, name] = known_power(campaign.output, name)
        return {name: known[campaign.output, name] for name in campaign.thrusters}

    def assess(text: str) -> Assessment:
        try:
            campaign = campaign_of(path, text)
        except RigError as error:
            return Assessment(problem=_said(path, error))
        steps = tuple(campaign.plan)
        try:
            report = check_loaded(campaign)
        except (ConfigError, PlanError) as error:
            return Assessment(steps, problem=_said(path, error))
        rows = outlook_of(report, powers(campaign)).rows()
        notes = (*(f"OVERRIDE {each.told}" for each in report.overridden), *_ports(campaign))
        return Assessment(steps, rows, notes=notes)

    return assess


def _said(path: Path, error: RigError) -> str:
    """Without the name of the file, which stands above the form."""
    return str(error).removeprefix(f"{path}: ")


def _ports(campaign: CampaignConfig) -> tuple[str, ...]:
    """A bench that is not connected is no fault of the campaign that is written for it."""
    try:
        require_ports(campaign.bench)
    except ConfigError as error:
        return (str(error),)
    return ()


@click.command("edit")
@click.argument("campaign", type=click.Path(path_type=Path))
@screen_options
def edit_command(campaign: Path, colors: str, bell: bool) -> int:
    """Edit CAMPAIGN in a form, with its dry run beside it: duration, peaks, thrust, energy. Opens no device."""
    from rig.console.editor.app import EditorApp

    look = look_of(colors, bell)
    draft = Draft(opened(campaign))
    EditorApp(draft, assessor(campaign), colors=look.colors).run()
    return 0
