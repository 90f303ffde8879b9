"""A design as text for a person and as JSON for a program."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.experiment_design.thrust_design import LEVEL, POWER, noticed
from rig.campaign.plan import Plan, Step
from rig.design.baselines import Judged, means_of
from rig.design.optimal_levels import Ask
from rig.design.plan import Chosen


@dataclass(frozen=True, eq=False)
class Designed:
    """The design and what it is measured against."""

    ask: Ask
    chosen: Chosen
    plan: Plan
    judged: Judged
    plain: tuple[Judged, ...]
    unchecked: Chosen | None
    """The same without check levels; None when there are none anyhow, or without them no run is possible."""
    proof: float
    """s of the watchdog proof."""
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Row:
    """One level of the table."""

    voltage: float
    holds: int
    seconds: float
    """s of one hold, mean."""
    check: bool
    notices: float
    """N, see `thrust_design.noticed`."""


def table(found: Designed) -> tuple[Row, ...]:
    """Levels, ascending."""
    chosen = found.chosen
    levels = np.unique(chosen.levels)
    means, _ = means_of(found.plan)
    seen = noticed(found.judged.promise, levels, means.voltage)
    return tuple(
        Row(float(v), int(at.sum()), float(chosen.dwells[at].mean()), bool(np.isin(v, chosen.checks)), float(n))
        for v, n in zip(levels, seen, strict=True)
        for at in [chosen.levels == v]
    )


def budget(steps: tuple[Step, ...], proof: float) -> dict[str, float]:
    """Time by use in s; the sum is the time of the run."""
    held = [step for step in steps if step.phase == "hold"]
    by = {phase: sum(s.expected for s in steps if s.phase == phase) for phase in ("ramp", "rest", "tare")}
    settling = sum(s.settle for s in held)
    measuring = sum(s.expected for s in held) - settling
    return {"measuring": measuring, "settling": settling, "ramps": by["ramp"]} | {
        "rests": by["rest"],
        "tares": by["tare"],
        "watchdog proof": proof,
    }


def lack_of_fit_dof(found: Designed) -> int:
    """Distinct levels, rest among them, less the parameters: what is left to say that the model is wrong."""
    return len(np.unique(np.append(found.chosen.levels, 0.0))) - len(found.judged.promise.names)


def design_json(found: Designed) -> dict[str, Any]:
    """`thruster-rig-design` version 1. Numbers are finite or null."""
    judged, ask = found.judged, found.ask
    steps = tuple(found.plan)
    sequence = [{"voltage": s.voltage, "duration": s.duration} for s in found.chosen.steps]
    return {
        "format": "thruster-rig-design",
        "version": 1,
        "criterion": ask.criterion,
        "parameters": {
            name: {"std": float(std), "unit": unit, "per_newton_of_drift": float(drift)}
            for name, std, unit, drift in zip(
                judged.promise.names, judged.promise.std, ask.terms.units, judged.exposure.per_drift, strict=True
            )
        },
        "covariance": judged.promise.cov.tolist(),
        "levels": [
            {
                "voltage": r.voltage,
                "holds": r.holds,
                "seconds": r.seconds,
                "check": r.check,
                "notices": _number(r.notices),
            }
            for r in table(found)
        ],
        "sequence": sequence,
        "budget": budget(steps, found.proof),
        "total": judged.total + found.proof,
        "mean_heat": judged.heat,
        "variance_added": {"drift": judged.exposure.drift, "heating": judged.exposure.heating},
        "noise": {
            "white": ask.noise.white,
            "proportional": ask.noise.proportional,
            "floor": ask.noise.floor,
        },
        "lack_of_fit_dof": lack_of_fit_dof(found),
        "efficiency_without_check_levels": _ratio(found.unchecked.value, judged.value) if found.unchecked else None,
        "plain": [
            {
                "name": plain.name,
                "std": plain.promise.std.tolist(),
                "efficiency": _ratio(judged.value, plain.value),
                "mean_heat": plain.heat,
                "variance_added": {"drift": plain.exposure.drift, "heating": plain.exposure.heating},
                "total": plain.total + found.proof,
            }
            for plain in found.plain
        ],
        "remarks": list(found.remarks),
    }


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _ratio(better: float, worse: float) -> float:
    return float(better / worse)


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d}"


def design_text(found: Designed) -> str:
    """Levels, standard errors, time, heat, order, comparison; plain text in 110 columns."""
    return "\n".join(_lines(found))


def _lines(found: Designed) -> Iterator[str]:
    ask, judged = found.ask, found.judged
    whole = judged.total + found.proof
    names = " + ".join(ask.terms.names)
    yield (
        f"{ask.criterion}-optimal for {names}: {found.chosen.levels.size} holds, one run of {_clock(whole)} "
        f"(asked for: {_clock(ask.total + found.proof)})"
    )
    yield ""
    yield f"  {'level V':>8}{'holds':>7}{'s each':>8}{'s in all':>10}  for"
    for row in table(found):
        why = f"lack of fit: notices {row.notices:.2g} N" if row.check else "the parameters"
        yield f"  {row.voltage:8.2f}{row.holds:7d}{row.seconds:8.2f}{row.holds * row.seconds:10.1f}  {why}"
    yield ""
    yield from _errors(found)
    yield ""
    parts = budget(tuple(found.plan), found.proof)
    yield "time      " + ", ".join(f"{name} {seconds:.0f} s" for name, seconds in parts.items() if seconds)
    yield (
        f"heat      mean {100 * judged.heat:.0f} % of the copper loss at {ask.V_max:g} V, "
        f"as {judged.heat**0.25 * ask.V_max:.1f} V without end"
    )
    yield from _order(found)
    yield from _checks(found)
    yield from _comparison(found)
    yield from (f"  - {text}" for text in found.remarks)


def _errors(found: Designed) -> Iterator[str]:
    promise = found.judged.promise
    size = found.ask.terms.size(found.ask.V_max)
    yield f"  {'':<10}{'std error':>12}  {'unit':<7}  relative (calibration of the cell comes on top)"
    for name, std, unit, scale in zip(promise.names, promise.std, found.ask.terms.units, size, strict=True):
        share = f"{100 * std / scale:.2g} %" if np.isfinite(scale) else "-"
        yield f"  {name:<10}{std:>12.3g}  {unit:<7}  {share}"


def _slow(found: Judged) -> str:
    return f"drift {_percent(found.exposure.drift)}, heating {_percent(found.exposure.heating)}"


def _percent(share: float) -> str:
    if share > 1:
        return f"{share:.2g} times that of the noise"
    return f"{100 * share:.2g} %" if share >= 1e-5 else "0 %"


def _order(found: Designed) -> Iterator[str]:
    slow, own = found.ask.setting.slow, found.judged
    line = ", ".join(f"{name} {x:.2g}" for name, x in zip(own.promise.names, own.exposure.per_drift, strict=True))
    yield (
        f"order     a drift of {slow.drift:.2g} N over the run and {100 * slow.heating:.0f} % less thrust of a hot "
        f"motor add to the variance: {_slow(own)}"
    )
    yield f"          a straight drift of 1 N over the run moves {line}"


def _checks(found: Designed) -> Iterator[str]:
    dof = lack_of_fit_dof(found)
    if not found.chosen.checks.size:
        yield (
            "check     no check levels: "
            + ("nothing can say" if dof <= 0 else f"only {dof} degree(s) of freedom say")
            + " whether the model is right"
        )
        return
    share = (
        "" if found.unchecked is None else f" for {_cost(found.unchecked.value, found.judged.value)} of the efficiency"
    )
    yield (
        f"check     {found.chosen.checks.size} levels for lack of fit{share}: {dof} degrees of freedom; noticed: with "
        f"probability {POWER:g} at the {100 * LEVEL:g} % level"
    )


def _cost(best: float, value: float) -> str:
    return f"{max(0.0, 100 * (1 - best / value)):.2g} %"


def _comparison(found: Designed) -> Iterator[str]:
    for plain in found.plain:
        std = ", ".join(_pair(name, x) for name, x in zip(plain.promise.names, plain.promise.std, strict=True))
        share = 100 * found.judged.value / plain.value
        yield (
            f"plain     {plain.name} of {_clock(plain.total + found.proof)}: {share:.0f} % as efficient "
            f"({std}; {_slow(plain)}; heat {100 * plain.heat:.0f} %)"
        )


def _pair(name: str, std: float) -> str:
    return f"{name} {std:.2g}"
