"""The options of `rig design` and the files they name become an Ask; what is impossible is one sentence."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path

import numpy as np

from identification.experiment_design.experiment import Criterion
from identification.experiment_design.run_order import THERMAL_TIME, Course, Slow
from identification.experiment_design.thrust_design import Noise, Terms
from identification.recording import Floats
from rig.campaign.bench import build, thrust_bounds
from rig.campaign.config import BenchConfig
from rig.campaign.loading import load_bench, load_campaign
from rig.campaign.plan import TareConfig
from rig.campaign.plan_file import Template, template_of
from rig.campaign.shapes import require, require_above_zero, require_not_negative
from rig.design.noise import Known, read_noise
from rig.design.optimal_levels import DRIFT, Ask
from rig.errors import ConfigError, PlanError
from rig.safety.watchdog_proof import PROOFS_OF_A_RUN
from rig.sequence.steady import LEAST_SAMPLES
from rig.sequence.ticks import proof_settings

GRID = 20
"""Candidates from 0 V to the highest, on each side."""
SETTLE = 1.0
"""s, when only a bench is given: the rotor and the water near it come to their new speed."""
PARTS = {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0}


@dataclass(frozen=True)
class Options:
    """Of the command line, units as in its help; None: not given."""

    time: str = ""
    campaign: Path | None = None
    bench: Path | None = None
    thruster: tuple[str, ...] = ()
    noise: str | None = None
    model: str = "C"
    linear: bool = False
    dead_band: float | None = None
    criterion: Criterion = "A"
    check_levels: int = 4
    max_voltage: float | None = None
    max_thrust: float | None = None
    levels: str | None = None
    heat: float | None = None
    continuous: float | None = None
    max_dwell: float = 8.0
    settle: float | None = None
    zero_every: int | None = None
    slew: float | None = None
    drift: float | None = None
    thermal_time: float = THERMAL_TIME
    expected_C: float | None = None
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Prepared:
    """What is to be designed, and the file it will become."""

    ask: Ask
    template: Template
    proof: float
    """s that the watchdog proof takes before the first tare."""
    remarks: tuple[str, ...]


def seconds(text: str, option: str = "--time") -> float:
    """`600`, `600s`, `10min` or `1h` in s, as given to `option`. Raises PlanError.

    >>> seconds("10min"), seconds("90")
    (600.0, 90.0)
    """
    found = re.fullmatch(r"\s*([0-9.eE+-]+|nan|inf)\s*(s|min|h|)\s*", text)
    try:
        value = float(found[1]) * PARTS[found[2]] if found else None
    except ValueError:
        value = None
    if value is None:
        raise PlanError(f"{option} must be a time such as 600, 10min or 1h, but is {text!r}")
    require_above_zero(option, value, "s")
    return value


def prepare(options: Options) -> Prepared:
    """Raises ConfigError, PlanError or RecordingError."""
    if not options.time:
        raise PlanError("--time is missing: say how long one run may take, such as --time 10min")
    total = seconds(options.time)
    _require_numbers(options)
    bench, template, proof, top = _places(options)
    known = read_noise(options.noise, template.thrusters) if options.noise else Known(Noise(1.0), None)
    C = options.expected_C or known.C or template.expected_C
    if C is None and (options.dead_band is not None or options.max_thrust is not None or known.noise.proportional):
        raise PlanError("a thrust is needed to design this run: give --expected-C in N/V^2, or --noise a fit's JSON")
    template = replace(template, expected_C=C)
    require(proof < total, f"--time is {total:g} s, but the watchdog proof alone takes {proof:.1f} s")
    terms = Terms(abs(C or 1.0), options.model == "C+/C-", options.linear, options.dead_band)
    remarks = (*_remarks(options, C), *_of_waits(options))
    candidates, short = _candidates(options, bench, top, C)
    course = Course(template.slew, template.zero_every, template.rest, template.tare.duration, template.settle)
    highest = float(np.abs(candidates).max(initial=0.0))
    full = float(terms.thrust(np.array([highest]))[0])
    ask = Ask(
        terms,
        known.noise,
        candidates,
        total - proof,
        course,
        options.criterion,
        _heat(options, highest),
        options.max_dwell,
        LEAST_SAMPLES * _period(bench) * 1.25,  # the loop may take a few of them for the change of step
        options.check_levels,
        Slow(DRIFT * full if options.drift is None else options.drift, thermal_time=options.thermal_time),
        options.levels is not None,
        seed=options.seed,
    )
    return Prepared(ask, template, proof, (*remarks, *short))


def _require_numbers(options: Options) -> None:
    for key, value, unit in (
        ("--max-voltage", options.max_voltage, "V"),
        ("--max-thrust", options.max_thrust, "N"),
        ("--heat", options.heat, "(a share)"),
        ("--continuous", options.continuous, "V"),
        ("--max-dwell", options.max_dwell, "s"),
        ("--slew", options.slew, "V/s"),
        ("--thermal-time", options.thermal_time, "s"),
        ("--expected-C", options.expected_C, "N/V^2"),
    ):
        if value is not None:
            require_above_zero(key, value, unit)
    for key, value, unit in (
        ("--dead-band", options.dead_band, "V"),
        ("--settle", options.settle, "s"),
        ("--drift", options.drift, "N"),
        ("--check-levels", options.check_levels, ""),
        ("--zero-every", options.zero_every, "holds"),
    ):
        if value is not None:
            require_not_negative(key, float(value), unit)
    if options.heat is not None and options.continuous is not None:
        raise PlanError("--heat and --continuous both limit the mean heat: give one of them")


def _places(options: Options) -> tuple[BenchConfig, Template, float, float]:
    """Bench, template, s of the watchdog proof, and the highest voltage that files and device allow."""
    if (options.campaign is None) == (options.bench is None):
        raise ConfigError("give either a campaign to take bench, thrusters and pacing from, or --bench BENCH.toml")
    if options.campaign is not None:
        campaign = load_campaign(options.campaign)
        bench, template, top = campaign.bench, _paced(template_of(campaign)), campaign.plan.peak()
    else:
        assert options.bench is not None
        bench = load_bench(options.bench)
        names = options.thruster or ("T1",)
        template = Template("design", bench.path, names, Path("recordings"), bench.slew, TareConfig(), SETTLE)
        top = bench.max_voltage
    changed = {
        key: value
        for key, value in (
            ("thrusters", options.thruster or None),
            ("settle", options.settle),
            ("zero_every", options.zero_every),
            ("slew", options.slew),
        )
        if value is not None
    }
    template = replace(template, **changed, name=f"{template.name}, designed")  # type: ignore[arg-type]  # keys above
    allowed = min(bench.max_voltage, build(bench).motor.max_voltage)
    require(
        template.slew <= bench.slew,
        f"--slew is {template.slew:g} V/s, but {bench.path} allows at most {bench.slew:g} V/s",
    )
    wanted = options.max_voltage or min(top, allowed)
    require(wanted <= allowed, f"--max-voltage is {wanted:g} V, but {bench.path} allows at most {allowed:g} V")
    once = proof_settings(bench, template.slew).expected
    proof = PROOFS_OF_A_RUN * once if template.prove_watchdog else 0.0
    return bench, template, proof, wanted


def _paced(template: Template) -> Template:
    """With its waits for the water in the rests, whose time the design knows; its order of levels is its own."""
    return replace(template, rest=template.rest + template.settle_water, settle_water=0.0, settle_reversal=0.0)


def _period(bench: BenchConfig) -> float:
    """Sampling period of the thrust in s."""
    force = build(bench).instruments[bench.force]
    return next(s.period_s for s in force.streams for c in s.channels if c.quantity == "thrust")


def _candidates(options: Options, bench: BenchConfig, top: float, C: float | None) -> tuple[Floats, tuple[str, ...]]:
    """Voltages that may be held, ascending, and a remark when thrust limits them."""
    if options.levels is not None:
        V = _listed(options.levels)
        over = V[np.abs(V) > top]
        require(over.size == 0, f"--levels holds {over[0] if over.size else 0:g} V, but at most {top:g} V are allowed")
    else:
        V = np.linspace(-top, top, 2 * GRID + 1)
    if C is None:
        return V, ()
    low, high = thrust_bounds(bench)
    if options.max_thrust is not None:
        low, high = max(low, -options.max_thrust), min(high, options.max_thrust)
    thrust = C * V * np.abs(V)
    fits = (thrust >= low) & (thrust <= high)
    if bool(fits.all()):
        return V, ()
    if options.levels is None:  # the grid ends where the thrust does
        reach = [np.sqrt(max(0.0, bound) / abs(C)) for bound in ((-low, high) if C > 0 else (high, -low))]
        down, up = (min(top, float(np.floor(100 * r) / 100)) for r in reach)
        V = np.append(np.linspace(-down, 0.0, GRID + 1), np.linspace(0.0, up, GRID + 1)[1:])
        V = np.unique(V)
    else:
        V = V[fits]
    return V, (f"thrust between {low:g} and {high:g} N limits the levels, with C = {C:.4g} N/V^2",)


def _listed(text: str) -> Floats:
    try:
        V = np.unique(np.array([float(part) for part in text.replace(",", " ").split()]))
    except ValueError:
        raise PlanError(f"--levels must be voltages such as 5,10,-5,-10, but is {text!r}") from None
    require(V.size > 0 and bool(np.isfinite(V).all()), f"--levels must be finite numbers in V, but is {text!r}")
    return V


def _heat(options: Options, top: float) -> float:
    if options.heat is not None:
        return options.heat
    return inf if options.continuous is None or top == 0 else (options.continuous / top) ** 4


def _of_waits(options: Options) -> tuple[str, ...]:
    """What becomes of the waits of a campaign."""
    plan = load_campaign(options.campaign).plan if options.campaign is not None else None
    if plan is None or not (plan.settle_water or plan.settle_reversal):
        return ()
    return ("settle_water of the campaign is in each rest, none is before the first tare; settle_reversal is left out",)


def _remarks(options: Options, C: float | None) -> tuple[str, ...]:
    out = []
    if options.noise is None:
        out.append("no --noise was given: standard errors hold for a noise of 1 N in a mean over one second, and scale")
    if C is None:
        out.append("C is not known (--expected-C): limits of thrust were not looked at")
    if options.heat is None and options.continuous is None:
        out.append("the heat is not limited (--heat or --continuous): the highest levels take most of the time")
    return tuple(out)
