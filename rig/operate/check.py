"""rig check: everything that can be known wrong about a campaign before anything is opened, and what it will take."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from drivers.protocols import Channel, Instrument, MotorController, OneWay
from rig.campaign.bench import build
from rig.campaign.config import BenchConfig, CampaignConfig
from rig.campaign.disarmed import Disarmed, disarmed, require_armed
from rig.campaign.dwell import FixedDwell
from rig.campaign.loading import load_campaign
from rig.campaign.plan import Duration, Step
from rig.campaign.shapes import Levels
from rig.dry_run.earlier import known_power
from rig.dry_run.outlook import Outlook, energies_of
from rig.dry_run.power import PowerCurve
from rig.errors import ConfigError, PlanError
from rig.safety.watchdog_proof import PROOFS_OF_A_RUN
from rig.sequence.sequencer import settings_for
from rig.sequence.steady import LEAST_SAMPLES
from rig.visible_text import console

SAME = 1e-4
"""Relative: a set-point so near to the level of the plan is the level."""


@dataclass(frozen=True, slots=True)
class CheckReport:
    """A campaign that may run, and what it will take. Durations in s."""

    campaign: CampaignConfig
    steps: tuple[Step, ...]
    run: Duration
    """The first thruster, both proofs of the watchdog included; every later one has one of them."""
    total: Duration
    """All thrusters; `worst` adds the longest mounting."""
    peak_voltage: float
    """V"""
    peak_thrust: float | None
    """N, expected_C V^2; None: the campaign gives no expected_C and the peak thrust was not checked."""
    overridden: tuple[Disarmed, ...] = ()
    """Protections that the files take away, with their reasons."""
    told: Mapping[float, float] = field(default_factory=dict)
    """V held by the plan -> V that the motor controller can be told, where they differ."""


def check_campaign(path: Path) -> CheckReport:
    """Load and check a campaign; opens nothing. Raises ConfigError or PlanError: one sentence with file and key."""
    campaign = load_campaign(path)
    report = check_loaded(campaign)
    require_ports(campaign.bench)
    return report


def check_loaded(campaign: CampaignConfig) -> CheckReport:
    """All of `check_campaign` but whether the ports are there. Raises ConfigError or PlanError."""
    bench = build(campaign.bench)
    overridden = disarmed(campaign, (stream for _, stream in bench.streams()))
    require_armed(overridden)
    _require_watchdog(campaign.bench, bench.motor)
    _require_voltages(campaign, bench.motor)
    force = bench.instruments[campaign.bench.force]
    thrust = _require_thrust(campaign, force)
    _require_samples(campaign, force)
    proof = settings_for(campaign, "").proof
    once = Duration(proof.expected, proof.worst) if proof else Duration(0.0, 0.0)
    plan, runs = campaign.plan.duration(), len(campaign.thrusters)
    later = Duration(plan.expected + once.expected, plan.worst + once.worst + campaign.bench.coast_time)
    again = PROOFS_OF_A_RUN - 1
    run = Duration(later.expected + again * once.expected, later.worst + again * once.worst)
    total = Duration(
        run.expected + (runs - 1) * later.expected,
        run.worst + (runs - 1) * later.worst + runs * campaign.bench.mount.timeout,
    )
    steps = tuple(campaign.plan)
    told = {step.voltage: bench.told(step.voltage) for step in steps if step.phase == "hold"}
    coarse = {asked: volts for asked, volts in told.items() if abs(volts - asked) > SAME * abs(asked)}
    return CheckReport(campaign, steps, run, total, campaign.plan.peak(), thrust, overridden, coarse)


def _ports(bench: BenchConfig) -> Iterator[tuple[str, str]]:
    """(key, port) of everything that is to be opened."""
    for name, bus in bench.can.items():
        yield f"can.{name}.channel", bus.channel
    for name, device in bench.devices.items():
        port = getattr(device.options, "port", "")
        yield f"devices.{name}.port", port


def require_ports(bench: BenchConfig) -> None:
    """A port that is a path must exist; a URL or a plain name (COM3, can0) is left to the opening. None serves two."""
    taken: dict[str, str] = {}
    for key, port in _ports(bench):
        path = "/" in port and "://" not in port
        if path and not os.path.exists(port):  # noqa: PTH110 - Path.exists raises for a name that is too long
            raise ConfigError(
                f"{bench.path}: {key} is {port}, but there is no such port: connect it or correct the key"
            )
        place = str(Path(port).resolve()) if path else port
        other = taken.setdefault(place, key)
        if port and other != key:
            raise ConfigError(f"{bench.path}: {key} is {port}, which {other} has: each device needs a port of its own")


def _require_watchdog(bench: BenchConfig, motor: MotorController) -> None:
    timeout, key = motor.watchdog.timeout_s, f"devices.{bench.motor}"
    if timeout is None:
        raise ConfigError(f"{bench.path}: {key} has no command timeout of its own, or none that is known: refused")
    if timeout > bench.watchdog_limit:
        raise ConfigError(
            f"{bench.path}: {key} stops {timeout:g} s after the last command, but bench.watchdog_limit allows "
            f"{bench.watchdog_limit:g} s: shorten the device's timeout"
        )
    if 2 / bench.loop_rate > timeout:  # one command may be late without the motor being let go
        raise ConfigError(
            f"{bench.path}: bench.loop_rate is {bench.loop_rate:g} Hz, but {key} stops {timeout:g} s after the last "
            f"command: at least {2 / timeout:g} Hz are needed"
        )


def _require_voltages(campaign: CampaignConfig, motor: MotorController) -> None:
    bench, plan = campaign.bench, campaign.plan
    try:
        plan.require_within(motor.max_voltage, bench.slew, f"the motor controller {bench.motor!r}")
        plan.require_within(bench.max_voltage, bench.slew, "the bench (bench.max_voltage, bench.slew)")
    except PlanError as error:
        raise PlanError(f"{campaign.path}: [plan]: {error}") from None
    if isinstance(motor, OneWay):
        _require_one_way(campaign, motor.min_voltage)
    if campaign.prove_watchdog and bench.proof_voltage > motor.max_voltage:
        raise ConfigError(
            f"{bench.path}: bench.proof_voltage is {bench.proof_voltage:g} V, but the motor controller {bench.motor!r} "
            f"gives at most {motor.max_voltage:g} V"
        )


def _require_one_way(campaign: CampaignConfig, least: float) -> None:
    """A motor controller that gives nothing below `least` V has nothing to do in a plan that goes there."""
    lowest = min(step.voltage - abs(step.amplitude) for step in campaign.plan)
    if lowest < least:
        raise PlanError(
            f"{campaign.path}: [plan]: the plan goes down to {lowest:g} V, but the motor controller"
            f" {campaign.bench.motor!r} gives nothing below {least:g} V: choose levels on one side"
        )


def _thrust_channel(force: Instrument) -> tuple[str, Channel, float]:
    """(`<stream>.<channel>`, channel, rows/s) of the first thrust channel; the loader has made sure there is one."""
    found = ((s, c) for s in force.streams for c in s.channels if c.quantity == "thrust")
    stream, channel = next(found)
    return f"{stream.name}.{channel.name}", channel, 1 / stream.period_s


def _require_thrust(campaign: CampaignConfig, force: Instrument) -> float | None:
    """Expected peak thrust in N, inside the cell's range and its limits on each side that the plan goes to."""
    if campaign.expected_C is None:
        return None
    name, channel, _ = _thrust_channel(force)
    bounds = [("the load cell's range", channel.range_min, channel.range_max)]
    bounds += [(f'limits."{name}"', limit.min, limit.max) for limit in campaign.bench.limits if limit.channel == name]
    highest = max(step.voltage + abs(step.amplitude) for step in campaign.plan)
    lowest = min(step.voltage - abs(step.amplitude) for step in campaign.plan)
    for volts in (highest, lowest):
        thrust = campaign.expected_C * volts * abs(volts)
        for whose, low, high in bounds:
            bound = high if volts > 0 else low
            if volts and bound is not None and abs(bound) < abs(thrust):
                raise PlanError(
                    f"{campaign.path}: [plan]: {volts:g} V is expected to give {thrust:.4g} N (expected_C V|V|), but "
                    f"{whose} ends at {bound:g} N: lower the plan's levels"
                )
    return campaign.expected_C * campaign.plan.peak() ** 2


def _require_samples(campaign: CampaignConfig, force: Instrument) -> None:
    """The shortest hold and the tare must give enough samples to know the error of their mean."""
    rate = _thrust_channel(force)[2]
    windows = [("tare.duration", campaign.tare.duration)]
    holds = [step.min_duration - step.settle for step in campaign.plan if step.phase == "hold"]
    if holds:
        dwell, shape = campaign.plan.dwell, campaign.plan.shape
        own = isinstance(shape, Levels) and shape.durations
        key = "durations" if own else "dwell.duration" if isinstance(dwell, FixedDwell) else "dwell.min"
        windows.append((f"plan.{key} less settle", min(holds)))
    for key, seconds in windows:
        if seconds * rate < LEAST_SAMPLES:
            raise PlanError(
                f"{campaign.path}: {key} is {seconds:g} s, in which {campaign.bench.force!r} gives "
                f"{seconds * rate:.0f} samples at {rate:g}/s, but {LEAST_SAMPLES} are needed: make it longer"
            )


def outlook_of(report: CheckReport, powers: Mapping[str, PowerCurve | str]) -> Outlook:
    """The report's numbers with the energy by what is known of each thruster's power."""
    energies = energies_of(report.steps, powers)
    return Outlook(
        report.steps, report.run, report.total, report.peak_voltage, report.peak_thrust, energies, report.told
    )


def known_powers(campaign: CampaignConfig) -> dict[str, PowerCurve | str]:
    """Of each thruster, from the campaign's folder of recordings."""
    return {name: known_power(campaign.output, name) for name in campaign.thrusters}


def print_report(report: CheckReport, screen: Console, powers: Mapping[str, PowerCurve | str] | None = None) -> None:
    """Steps, durations, holds, peaks, energy by the `powers` that are known."""
    campaign = report.campaign
    table = Table("step", "phase", "from V", "to V", "expected s", "at most s", title=f"{campaign.name}: one run")
    for step in report.steps:
        to = f"{step.voltage:.2f}" + (f" ± {step.amplitude:g} at {step.frequency:g} Hz" if step.amplitude else "")
        start = step.from_voltage if step.phase == "ramp" else step.voltage
        times = (f"{step.expected:.1f}", f"{step.max_duration:.1f}")
        table.add_row(str(step.number), step.doing, f"{start:.2f}", to, *times)
    screen.print(table)
    screen.print(f"bench          {campaign.bench.name}")
    screen.print(f"thrusters      {', '.join(campaign.thrusters)}")
    if campaign.flow_speed is not None:
        screen.print(f"flow speed     {campaign.flow_speed:g} m/s, to be set by hand; the preflight compares")
    for what, told in outlook_of(report, powers or {}).rows():
        screen.print(f"{what:<14} {told}")
    for each in report.overridden:
        screen.print(f"OVERRIDE       {each.told}")
    screen.print("The campaign may run. Nothing was opened.")


@click.command("check")
@click.argument("campaign", type=click.Path(path_type=Path))
def check_command(campaign: Path) -> int:
    """Check CAMPAIGN and its bench without opening a port: steps, durations, peaks, energy, and every limit."""
    report = check_campaign(campaign)
    print_report(report, console(), known_powers(report.campaign))
    return 0
