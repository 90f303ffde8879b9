"""`rig design --inertia`: amplitude and frequency of the sine that tells the inertia of a vehicle best (4.2.1)."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, pi, sqrt
from pathlib import Path
from typing import Any

from identification.experiment_design.experiment import Impossible
from identification.experiment_design.inertia_sine import Limits, SineTest, Vehicle, best_sine
from rig.campaign.config import CampaignConfig
from rig.campaign.plan_file import Template, template_of, write_sine
from rig.campaign.shapes import require, require_above_zero, require_not_negative
from rig.design.ask import seconds
from rig.errors import PlanError


@dataclass(frozen=True)
class InertiaOptions:
    """Of the command line, SI; None: not given."""

    time: str = ""
    mass: float | None = None
    k: float | None = None
    k_q: float = 0.0
    k_std: float = 0.0
    k_q_std: float = 0.0
    f0: float = 0.0
    max_force: float | None = None
    max_travel: float = inf
    max_speed: float = inf
    rate: float | None = None
    sigma: float | None = None
    per_volt: float | None = None
    """N/V^2 of all thrusters that push together: the voltage is the sine, not the force."""


@dataclass(frozen=True, slots=True)
class InertiaDesign:
    """The sine, and how long."""

    sine: SineTest
    m: float
    """kg, as expected."""
    cycles: int
    """Whole ones within the time."""
    voltage: float | None
    """V, amplitude when the voltage is the sine."""

    @property
    def frequency(self) -> float:
        """Hz"""
        return self.sine.omega / (2 * pi)


def design_inertia(options: InertiaOptions, campaign: CampaignConfig | None = None) -> InertiaDesign:
    """Raises PlanError. With a campaign its bench limits voltage and slew."""
    duration = seconds(options.time or "180")
    vehicle = _vehicle(options)
    for key, value, unit in (("--max-travel", options.max_travel, "m"), ("--max-speed", options.max_speed, "m/s")):
        require(value > 0, f"{key} must be a number above 0 {unit}, but is {value:g}")
    force = _needed("--max-force", options.max_force, "N")
    if options.per_volt is not None:
        require_above_zero("--per-volt", options.per_volt, "N/V^2")
        force = min(force, options.per_volt * campaign.bench.max_voltage**2) if campaign else force
    rate, sigma = _needed("--rate", options.rate, "Hz"), _needed("--sigma", options.sigma, "m")
    require(duration * rate >= 5, f"{duration:g} s at {rate:g} Hz are fewer than 5 positions: raise --time or --rate")
    fastest = min(5.0, pi * rate / 2)  # four samples a cycle, at least
    slowest = min(2 * pi / duration, fastest / 2)  # one cycle, at least
    limits = Limits(
        duration, rate, sigma, force, options.max_travel, options.max_speed, (slowest, fastest),
        options.per_volt is not None,
    )  # fmt: skip
    found = best_sine(vehicle, limits)
    if isinstance(found, Impossible):
        raise PlanError(f"no inertia test can be designed: {found.statement}")
    volts = None if options.per_volt is None else sqrt(found.amplitude / options.per_volt)
    return InertiaDesign(found, vehicle.m, max(1, int(duration * found.omega / (2 * pi) + 1e-9)), volts)


def _needed(key: str, value: float | None, unit: str) -> float:
    if value is None:
        raise PlanError(f"{key} is missing: an inertia test needs --mass, --k, --max-force, --rate and --sigma")
    require_above_zero(key, value, unit)
    return value


def _vehicle(options: InertiaOptions) -> Vehicle:
    m = _needed("--mass", options.mass, "kg")
    if options.k is None:
        raise PlanError("--k is missing: an inertia test needs --mass, --k, --max-force, --rate and --sigma")
    for key, value, unit in (
        ("--k", options.k, "N s/m"),
        ("--k-q", options.k_q, "N s^2/m^2"),
        ("--k-std", options.k_std, "N s/m"),
        ("--k-q-std", options.k_q_std, "N s^2/m^2"),
    ):
        require_not_negative(key, value, unit)
    require(isfinite(options.f0), f"--f0 must be a finite number of N, but is {options.f0:g}")
    return Vehicle(m, options.k, options.k_q, options.k_std, options.k_q_std, options.f0)


def inertia_json(found: InertiaDesign) -> dict[str, Any]:
    """`thruster-rig-design-inertia` version 1."""
    sine = found.sine
    return {
        "format": "thruster-rig-design-inertia",
        "version": 1,
        "amplitude": sine.amplitude,
        "frequency": found.frequency,
        "omega": sine.omega,
        "cycles": found.cycles,
        "voltage": found.voltage,
        "m_std": sine.m_std,
        "m_relative": sine.m_std / found.m,
        "travel": sine.travel,
        "speed": sine.speed,
    }


def inertia_text(found: InertiaDesign) -> str:
    """Five lines."""
    sine = found.sine
    volts = "" if found.voltage is None else f", which is a sine of {found.voltage:.3g} V"
    period = 1 / found.frequency
    return "\n".join(
        [
            f"amplitude   {sine.amplitude:.3g} N{volts}",
            f"frequency   {found.frequency:.4g} Hz ({sine.omega:.4g} rad/s): {found.cycles} cycles of {period:.3g} s",
            f"travel      {sine.travel:.3g} m between the ends, up to {sine.speed:.3g} m/s",
            f"inertia     standard error {sine.m_std:.3g} kg, {100 * sine.m_std / found.m:.2g} % of {found.m:g} kg",
            "            (the Cramér-Rao bound; what the fit of a real trial reaches is not below it)",
        ]
    )


def write_inertia(found: InertiaDesign, campaign: CampaignConfig, path: Path) -> Path:
    """A campaign of kind `sine`. Raises PlanError when the amplitude in V is not known or too steep for the bench."""
    if found.voltage is None:
        raise PlanError("a plan commands volts: give --per-volt, N/V^2 of all thrusters that push together")
    template: Template = template_of(campaign)
    slew = 2 * pi * found.frequency * found.voltage
    require(
        slew <= campaign.bench.slew,
        f"a sine of {found.voltage:.3g} V at {found.frequency:.3g} Hz needs {slew:.3g} V/s, but the bench allows "
        f"{campaign.bench.slew:g} V/s: lower --max-force",
    )
    comment = ["Written by `rig design --inertia`.", inertia_text(found)]
    return write_sine(found.voltage, found.frequency, found.cycles, template, path, comment)
