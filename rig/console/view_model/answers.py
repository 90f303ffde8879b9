"""A diagnosis as the console shows it: texts and figures out of `thruster-rig-diagnosis`. Pure.

Its keys: docs/howto/diagnosis-json.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import floor, log10
from typing import Any, Final

from rig.visible_text import visible

MARKS: Final = {"adequate": "✓", "explained": "✓", "ambiguous": "?", "unexplained": "✗"}
FAILED_MARK: Final = "!"


@dataclass(frozen=True, slots=True)
class Effect:
    """A named effect."""

    name: str
    says: str
    values: tuple[str, ...]
    """Each parameter with its 95 % interval."""
    earned: str
    """Share and grade, and what of its shape it does not pass; empty: there is nothing to say."""
    rivals: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Sweep:
    """The next experiment."""

    why: str
    levels: tuple[float, ...]
    """V, in the order of the steps; rests are 0 V."""
    seconds: float
    """Of all steps; tares and the run's own rests come on top."""
    power: float | None
    flows: tuple[float, ...]
    """m/s; more than one: as many campaigns."""
    C: float | None
    """N/V^2, of the model found."""
    in_volts: bool = True

    @property
    def peak(self) -> float:
        """V, of either sign."""
        return max(abs(level) for level in self.levels)


@dataclass(frozen=True, slots=True)
class Answer:
    """What one diagnosis said, or why it said nothing (`fault`)."""

    files: tuple[str, ...]
    """Recordings that were diagnosed together, the newest last."""
    fault: str = ""
    thruster: str = ""
    verdict: str = ""
    headline: str = ""
    statement: str = ""
    where: tuple[str, ...] = ()
    what: tuple[Effect, ...] = ()
    error: str = ""
    left: str = ""
    notes: tuple[str, ...] = ()
    sweep: Sweep | None = None
    hopeless: str = ""
    """Why no sweep settles it; empty: there is one, or nothing to settle."""
    no_sweep: str = ""
    """Why the sweep can't be made a campaign; empty: it can."""
    campaign: str = ""
    """File of the campaign that the recordings were made with."""

    @property
    def mark(self) -> str:
        return FAILED_MARK if self.fault else MARKS.get(self.verdict, "?")

    @property
    def runs(self) -> bool:
        """Whether its sweep can be made a campaign."""
        return self.sweep is not None and self.sweep.in_volts and not self.no_sweep and bool(self.campaign)


def fault_of(files: tuple[str, ...], text: str) -> Answer:
    """A diagnosis that came to nothing."""
    return Answer(files, fault=visible(" ".join(text.split())) or "it said nothing")


def answer_of(files: tuple[str, ...], message: Mapping[str, Any]) -> Answer:
    """Of what the process that diagnosed has said; what is not as it should be is a fault too."""
    if "fault" in message:
        return fault_of(files, str(message["fault"]))
    try:
        return _answer(files, message)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        return fault_of(files, f"its answer is not as thruster-rig-diagnosis has it ({error!r:.80})")


def _answer(files: tuple[str, ...], message: Mapping[str, Any]) -> Answer:
    d = message["answer"]
    proposed = d["next_experiment"]
    sweep = _sweep(proposed, d["model"]["parameters"]) if proposed is not None and proposed["steps"] else None
    unit = str(d["response"]["unit"])
    return Answer(
        files,
        thruster=visible(str(d["thruster"])),
        verdict=str(d["verdict"]),
        headline=visible(str(d["headline"])),
        statement=visible(str(d["statement"])),
        where=tuple(visible(str(m["statement"])) for m in d["mismatch"]),
        what=tuple(_effect(f) for f in d["findings"]),
        error=_error(d["fit"]["heldout"], unit),
        left=_left(d["unexplained"]),
        notes=tuple(visible(str(note)) for note in d["notes"]),
        sweep=sweep,
        hopeless="" if proposed is None or proposed["steps"] else visible(str(proposed["why"])),
        no_sweep=visible(str(message["no_sweep"])),
        campaign=str(message["campaign"]),
    )


def _effect(f: Mapping[str, Any]) -> Effect:
    form = f" ({f['form'].replace('_', ' ')})" if f["form"] else ""
    where = ", in the measurement, not in the thruster" if f["in_measurement"] else ""
    share = "" if f["share"] is None else f"{100 * f['share']:.0f} % of the error that any shape could take off"
    graded = f"explains {f['grade']} of it" if f["grade"] != "all" else ""
    return Effect(
        visible(f"{f['effect'].replace('_', ' ')}{form}{where}"),
        visible(str(f["statement"])),
        tuple(visible(f"{name.replace('_', ' ')} {value_text(v)}") for name, v in f["parameters"].items()),
        visible("; ".join(part for part in (share, graded, *map(str, f["doubts"])) if part)),
        tuple(
            visible(f"{r['effect'].replace('_', ' ')} (BIC worse by {r['bic_loss']:.1f})") for r in f["rival_details"]
        ),
    )


def value_text(value: Mapping[str, Any]) -> str:
    """A parameter with its 95 % interval.

    >>> value_text({"value": 0.2937, "std": 0.0061, "low": 0.2812, "high": 0.3061, "unit": "V", "determined": True})
    '0.2937 V (95 %: 0.2812 to 0.3061)'
    >>> value_text({"value": 5e9, "std": 6e9, "low": 1.0, "high": 400.0, "unit": "s", "determined": False})
    'not determined (1 to 400 s)'
    """
    low, high, std = value["low"], value["high"], value["std"]
    unit = "" if value["unit"] in ("", "1") else f" {value['unit']}"
    ends = low is not None and high is not None
    if not value["determined"] or value["value"] is None:
        return "not determined" + (f" ({low:.3g} to {high:.3g}{unit})" if ends else "")
    digits = min(max(1 - floor(log10(std)), 0), 9) if std else None

    def figure(x: float) -> str:
        return f"{x:.4g}" if digits is None else f"{x:.{digits}f}"

    return f"{figure(value['value'])}{unit}" + (f" (95 %: {figure(low)} to {figure(high)})" if std and ends else "")


def _error(heldout: Mapping[str, Any], unit: str) -> str:
    before, after, noise = heldout["rmse_before"], heldout["rmse_after"], heldout["noise"]
    if before is None or after is None:
        return ""
    of = f" (noise {noise:.3g} {unit})" if noise is not None else ""
    return f"{before:.3g} {unit} before, {after:.3g} {unit} after{of}; {visible(str(heldout['what']))}"


def _left(u: Mapping[str, Any] | None) -> str:
    if u is None:
        return ""
    resembles = f" It resembles {', '.join(map(str, u['resembles']))}." if u["resembles"] else ""
    return visible(f"{u['statement']}{resembles}")


def _sweep(e: Mapping[str, Any], parameters: Mapping[str, Any]) -> Sweep:
    steps = e["steps"]
    volts = "command_voltage" in steps[0]
    C = parameters.get("C", {}).get("value")
    return Sweep(
        visible(str(e["why"])),
        tuple(float(step["command_voltage" if volts else "rotation_rate"]) for step in steps),
        float(sum(step["duration"] for step in steps)),
        e["expected_power"],
        tuple(dict.fromkeys(float(step["flow_speed"]) for step in steps)),
        None if C is None else float(C),
        volts,
    )


def levels_text(sweep: Sweep, most: int = 8) -> str:
    """Its levels, both ways as one.

    >>> levels_text(Sweep("", (0.0, 5.4, -5.4, 16.2, 0.0), 15.0, 0.9, (0.0,), 0.4))
    '±5.4, 16.2 V'
    """
    both = {abs(v) for v in sweep.levels if -v in sweep.levels}
    told: list[str] = []
    for size in sorted({abs(v) for v in sweep.levels if v}):
        sign = "±" if size in both else "" if size in sweep.levels else "-"
        told.append(f"{sign}{size:.3g}")
    shown = told if len(told) <= most else [*told[: most - 1], "...", told[-1]]
    return f"{', '.join(shown)} {'V' if sweep.in_volts else 'rev/s'}"


def sweep_text(sweep: Sweep) -> str:
    """What it asks of the bench: steps, levels, duration, peak, and what it would decide by."""
    unit = "V" if sweep.in_volts else "rev/s"
    thrust = f", about {abs(sweep.C) * sweep.peak**2:.3g} N" if sweep.C is not None and sweep.in_volts else ""
    flow = f"; flow {', '.join(f'{v:g}' for v in sweep.flows)} m/s" if any(sweep.flows) else ""
    power = "" if sweep.power is None else f"; decides with a probability of {sweep.power:.2f}"
    return (
        f"{len(sweep.levels)} steps, {sweep.seconds:.0f} s and tares: {levels_text(sweep)}; "
        f"peak {sweep.peak:.3g} {unit}{thrust}{flow}{power}"
    )
