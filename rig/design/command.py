"""`rig design`: the best levels, order and dwells for the time there is; or the best sine for an inertia test."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import click

from rig.campaign.dwell import FixedDwell
from rig.campaign.loading import load_campaign
from rig.campaign.plan import Plan
from rig.campaign.plan_file import Template, write_campaign
from rig.campaign.shapes import Levels
from rig.design.ask import Options, prepare
from rig.design.baselines import judge, plain_plans
from rig.design.inertia import InertiaOptions, design_inertia, inertia_json, inertia_text, write_inertia
from rig.design.optimal_levels import Ask
from rig.design.plan import Chosen, choose, without_checks
from rig.design.text import Designed, design_json, design_text
from rig.errors import ConfigError, PlanError
from rig.result_path import RESULT


def plan_of(chosen: Chosen, template: Template) -> Plan:
    """The plan that `rig run` makes of the file."""
    dwell = FixedDwell(float(chosen.dwells.max()), template.settle)
    shape = Levels(tuple(chosen.levels.tolist()), tuple(chosen.dwells.tolist()))
    return Plan(shape, dwell, template.slew, 1, template.zero_every, template.rest, tare=template.tare)


def design(ask: Ask, template: Template, proof: float = 0.0, remarks: tuple[str, ...] = ()) -> Designed:
    """Choose, judge the plan as it will run, compare. Raises PlanError when the limits leave no run."""
    chosen = choose(ask)
    plan = plan_of(chosen, template)
    judged = judge("designed", plan, ask)
    assert judged is not None  # choose has refused what cannot tell the parameters
    unchecked = without_checks(ask) if chosen.checks.size else None
    return Designed(ask, chosen, plan, judged, plain_plans(ask, template.tare), unchecked, proof, remarks)


def design_files(options: Options, output: Path | None = None) -> Designed:
    """From files to a design, written to `output` if given. Raises ConfigError, PlanError or RecordingError."""
    prepared = prepare(options)
    found = design(prepared.ask, prepared.template, prepared.proof, prepared.remarks)
    if output is not None:
        _spare(output, options.campaign)
        comment = ("Written by `rig design`.", design_text(found))
        write_campaign(found.chosen.steps, prepared.template, output, comment)
    return found


def _spare(output: Path, campaign: Path | None) -> None:
    if campaign is not None and output.resolve() == campaign.resolve():
        raise ConfigError(f"{output}: this is the campaign the design starts from; choose another name for -o")


def _inertia(options: InertiaOptions, campaign: Path | None, output: Path | None) -> tuple[str, dict[str, Any]]:
    if output is not None and campaign is None:
        raise ConfigError("-o needs a campaign to take bench and thrusters from: rig design CAMPAIGN --inertia ...")
    loaded = load_campaign(campaign) if campaign is not None else None
    found = design_inertia(options, loaded)
    if output is not None and loaded is not None:
        _spare(output, campaign)
        write_inertia(found, loaded, output)
    return inertia_text(found), inertia_json(found)


def _given(cls: type[Any], options: Mapping[str, Any]) -> Any:
    """An instance from what was given on the command line; the rest keeps the dataclass's defaults."""
    own = {field.name for field in fields(cls)}
    return cls(**{key: value for key, value in options.items() if key in own and value is not None})


def _refuse_stray(inertia: bool, options: Mapping[str, Any]) -> None:
    """An option of the other kind of design would be ignored: say so instead."""
    other = {field.name for field in fields(Options if inertia else InertiaOptions)}
    own = {field.name for field in fields(InertiaOptions if inertia else Options)}
    stray = sorted(key for key in other - own - {"campaign"} if options.get(key) not in (None, (), False))
    if stray:
        which = "does not go with --inertia" if inertia else "goes with --inertia only"
        raise PlanError(f"--{stray[0].replace('_', '-')} {which}")


@click.command("design")
@click.argument("campaign", required=False, type=click.Path(path_type=Path))
@click.option("--bench", type=click.Path(path_type=Path), help="Bench file, when there is no campaign yet.")
@click.option("--time", metavar="TIME", help="Of one run: 600, 10min, 1h. Needed, but with --inertia.")
@click.option("-o", "--output", type=RESULT, help="Write the campaign here.")
@click.option("--json", "json_path", type=RESULT, help="Write the design here; - is standard output.")
@click.option("--noise", metavar="FIT.json|N", help="Fit of an earlier run, or N: error of a mean over one second.")
@click.option("--model", type=click.Choice(["C", "C+/C-"]), help="One coefficient (default), or one each direction.")
@click.option("--linear", is_flag=True, default=None, help="A linear term k V in the model.")
@click.option("--dead-band", type=float, metavar="V", help="A dead band in the model: its expected half width.")
@click.option("--criterion", type=click.Choice(["A", "D"]), help="A (default): coefficients; D: all, tare too.")
@click.option("--check-levels", type=int, help="Levels for lack of fit only.  [default: 4]")
@click.option("--max-voltage", type=float, metavar="V", help="Default: the campaign's highest, or the bench's.")
@click.option(
    "--max-thrust", type=float, metavar="N", help="Largest expected thrust, beside the limits of cell and bench."
)
@click.option("--levels", metavar="V,V,...", help="Only these voltages may be held.")
@click.option(
    "--heat", type=float, metavar="SHARE", help="Largest mean copper heat, as a share of that at the highest voltage."
)
@click.option("--continuous", type=float, metavar="V", help="The same, as the voltage that may be held for ever.")
@click.option("--max-dwell", type=float, metavar="S", help="Longest hold.  [default: 8]")
@click.option("--settle", type=float, metavar="S", help="Start of a hold that is no measurement.")
@click.option("--zero-every", type=int, help="Holds between zero returns.")
@click.option("--slew", type=float, metavar="V/S", help="Of the ramps (default: the campaign's, or the bench's).")
@click.option("--drift", type=float, metavar="N", help="Drift of the zero over a run, against which the order is made.")
@click.option("--thermal-time", type=float, metavar="S", help="Time constant of the motor's heat.  [default: 60]")
@click.option("--expected-C", "expected_C", type=float, metavar="N/V^2", help="Default: the fit's, the campaign's.")
@click.option("--thruster", multiple=True, help="Of the new campaign; may be repeated.")
@click.option("--seed", type=int, help="Random seed of the search for the order.")
@click.option("--inertia", is_flag=True, help="Design the sine of an inertia test instead.")
@click.option("--mass", type=float, metavar="KG", help="Inertia: expected, with added mass.")
@click.option("--k", type=float, metavar="N.s/m", help="Inertia: linear drag.")
@click.option("--k-q", "k_q", type=float, metavar="N.s2/m2", help="Inertia: quadratic drag.")
@click.option("--k-std", type=float, help="Inertia: standard error of --k.")
@click.option("--k-q-std", "k_q_std", type=float, help="Inertia: standard error of --k-q.")
@click.option("--f0", type=float, metavar="N", help="Inertia: constant force.")
@click.option("--max-force", type=float, metavar="N", help="Inertia: largest force.")
@click.option("--max-travel", type=float, metavar="M", help="Inertia: largest way.")
@click.option("--max-speed", type=float, metavar="M/S", help="Inertia: highest speed.")
@click.option("--rate", type=float, metavar="HZ", help="Inertia: positions a second.")
@click.option("--sigma", type=float, metavar="M", help="Inertia: noise of a position.")
@click.option("--per-volt", type=float, metavar="N/V^2", help="Inertia: of all thrusters that push, for a plan.")
def design_command(
    campaign: Path | None, output: Path | None, json_path: Path | None, inertia: bool, **options: Any
) -> None:
    """Find the levels, order and dwells that tell a thruster's parameters best in the time there is.

    CAMPAIGN gives bench, thrusters, limits and pacing; -o writes a campaign that `rig check` and `rig run` take.
    """
    _refuse_stray(inertia, options)
    if inertia:
        text, content = _inertia(_given(InertiaOptions, options), campaign, output)
    else:
        found = design_files(_given(Options, {**options, "campaign": campaign}), output)
        text, content = design_text(found), design_json(found)
    as_json = json.dumps(content, indent=1, allow_nan=False)
    if json_path is not None and str(json_path) != "-":
        _write_json(json_path, as_json)
    click.echo(as_json if json_path is not None and str(json_path) == "-" else text)
    if output is not None and str(json_path) != "-":
        click.echo(f"written to {output}; next: rig check {output}")


def _write_json(path: Path, text: str) -> None:
    try:
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: the design can't be written: {error.strerror}; choose another place") from None
