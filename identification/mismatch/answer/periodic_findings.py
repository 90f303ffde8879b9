"""Periodic disturbances in the answer: where they are, what they are, and how they stand to those of a twin."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.estimation.tails import normal_sf
from identification.mismatch.diagnosis import (
    Diagnosis,
    Finding,
    Mismatch,
    NextExperiment,
    PlanStep,
    RivalFinding,
    Value,
    Where,
)
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.model.model import Data
from identification.mismatch.next_experiment.proposal import largest_level
from identification.mismatch.next_experiment.sweeps import REST, Limits
from identification.mismatch.periodic.periodic_disturbances import Line
from identification.mismatch.select.rivals import EQUAL, NEAR
from identification.twin import Twin, TwinLine

EFFECT = "periodic_disturbance"
LEAST_P = 1e-300
SAME_PLACE = 4.0
"""Standard errors within which two frequencies, or two ratios, are one."""
SCALE = 0.01
"""Relative: how well one run's turns are those of another."""
GRID = 0.002
"""Relative: the mains are kept within it nearly always (ENTSO-E)."""
CHANGED = 3.3
"""Standard errors by which an amplitude must have changed to be a finding."""
SECOND_LEVEL = 0.7
"""Of the highest: a line that goes with the rotor is plainly elsewhere there."""
LONGEST, SHORTEST = 120.0, 10.0
"""s of one level of the sweep that tells a fixed line from one that goes with the rotor."""
ENOUGH = 20.0
"""Expected chi-square apart at which the probability of a right decision is about 0.95."""


def twin_line(line: Line) -> TwinLine:
    return TwinLine(
        line.amplitude,
        line.amplitude_std,
        line.frequency,
        line.frequency_std,
        line.ratio,
        line.ratio_std or 0.0,
        line.unit,
        line.phase,
        line.phase_std or 0.0,
    )


def line_values(line: TwinLine) -> dict[str, Value]:
    out = {
        "amplitude": Value(line.amplitude, line.amplitude_std, "N"),
        "frequency": Value(line.frequency, line.frequency_std, "Hz"),
    }
    if line.ratio is not None:
        name, unit = ("periods_per_turn", "1") if line.turns == "rev" else ("periods_per_volt_second", "1/(V s)")
        out[name] = Value(line.ratio, line.ratio_std, unit)
    if line.phase is not None:
        out["phase"] = Value(line.phase, line.phase_std, "rad")
    return out


def line_finding(line: Line) -> Finding:
    p = max(line.p_value, LEAST_P)
    rivals = tuple(_rivals(line))
    probability = 1.0 / (1.0 + sum(float(np.exp(-0.5 * max(r.bic_loss, 0.0))) for r in rivals))
    return Finding(EFFECT, line.kind, line.statement, line_values(twin_line(line)), p, line.gain, probability, rivals)


def _rivals(line: Line) -> Iterable[RivalFinding]:
    """The other kind has as many parameters, so BIC is worse by what chi-square is."""
    if line.rival is not None and (loss := line.gain - line.rival.gain) < NEAR:
        yield RivalFinding(EFFECT, line.rival.kind, line_values(twin_line(line.rival)), loss, line.rival.statement)


def line_place(line: Line, residual: float) -> Mismatch:
    """`residual`: rms of what the baseline leaves, N per sample."""
    low, high = line.band
    share = min(line.power / residual**2, 1.0) if residual > 0 else 1.0
    what = "a line that goes with the rotor" if line.kind == "rotation" else "a line of one frequency"
    what = what if line.rival is None else "a line, at one speed of the rotor"
    text = f"{100 * share:.2g} % of the residual lies at frequency {low:.4g} to {high:.4g} Hz: {what}."
    return Mismatch("thrust", Where("frequency", low, high, "Hz"), share, max(line.p_value, LEAST_P), text)


def with_lines(
    answer: Diagnosis, lines: Sequence[Line], estimate: Estimate, data: Data, before: Twin | None, limits: Limits | None
) -> Diagnosis:
    """The answer with periodic disturbances: a place, a finding, parameters of the model, a part of the twin.

    One that the twin `before` has is a finding only where it changed; one that is there no more is noted.
    """
    known = () if before is None else before.lines
    same = {i: j for i, line in enumerate(lines) if (j := _known_as(line, known)) is not None}
    told = [line for i, line in enumerate(lines) if i not in same or _changed(line, known[same[i]])]
    gone = {j: line for j, line in enumerate(known) if j not in same.values()}
    others = iter(range(len(known), len(known) + len(lines)))
    found = {same[i] if i in same else next(others): twin_line(line) for i, line in enumerate(lines)}
    origin = "" if before is None else before.origin
    answer = replace(
        answer,
        baseline={**answer.baseline, **_named(dict(enumerate(known)))},
        mismatch=(*answer.mismatch, *(line_place(line, answer.train.before) for line in told)),
        findings=(*answer.findings, *(_beside_known(line, known, origin) for line in told)),
        model_terms=(*answer.model_terms, *(EFFECT for _ in lines)),
        model={**answer.model, **_named(found)},
        notes=(
            *answer.notes,
            *(f"{origin} has a line at {g.frequency:.4g} Hz, not found here." for g in gone.values()),
        ),
        twin=None if answer.twin is None else replace(answer.twin, lines=(*found.values(), *gone.values())),
    )
    return _decided(answer, told, estimate, data, limits) if told else answer


def _named(lines: Mapping[int, TwinLine]) -> dict[str, Value]:
    """`periodic_disturbance.amplitude`, and of a second one `periodic_disturbance#2.amplitude`."""
    out: dict[str, Value] = {}
    for number, line in sorted(lines.items()):
        label = EFFECT if number == 0 else f"{EFFECT}#{number + 1}"
        out |= {f"{label}.{name}": value for name, value in line_values(line).items()}
    return out


def _known_as(line: Line, known: Sequence[TwinLine]) -> int | None:
    """Which of a twin's lines this one is; its phase may be another in each run."""
    resolution = 0.5 * (line.band[1] - line.band[0])
    for j, other in enumerate(known):
        if line.ratio is None and other.ratio is None:
            std = float(np.hypot(line.frequency_std, other.frequency_std))
            near = max(SAME_PLACE * std, resolution, GRID * other.frequency)
            if abs(line.frequency - other.frequency) < near:
                return j
        elif line.ratio is not None and other.ratio is not None and line.unit == other.turns:
            std = float(np.hypot(line.ratio_std or 0.0, other.ratio_std))
            if abs(line.ratio - other.ratio) < max(SAME_PLACE * std, SCALE * other.ratio):
                return j
    return None


def _changed(line: Line, known: TwinLine) -> bool:
    std = float(np.hypot(line.amplitude_std, known.amplitude_std))
    return abs(line.amplitude - known.amplitude) > CHANGED * std


def _beside_known(line: Line, known: Sequence[TwinLine], origin: str) -> Finding:
    found, j = line_finding(line), _known_as(line, known)
    if j is None:
        return found
    return replace(found, statement=f"{found.statement[:-1]}, where {origin} has {known[j].amplitude:.3g} N.")


def _decided(
    answer: Diagnosis, told: Sequence[Line], estimate: Estimate, data: Data, limits: Limits | None
) -> Diagnosis:
    """With the verdict that the lines make, and the levels that tell one of a fixed frequency from one that turns."""
    open_ = [f for f in answer.findings if f.effect == EFFECT and any(r.bic_loss < EQUAL for r in f.rivals)]
    if not open_:
        return replace(answer, verdict="explained") if answer.verdict == "adequate" else answer
    line = next(line for line in told if line.rival is not None and line.gain - line.rival.gain < EQUAL)
    return replace(
        answer,
        verdict="ambiguous" if answer.verdict in ("adequate", "explained") else answer.verdict,
        next_experiment=answer.next_experiment or two_levels(line, estimate, data, limits or Limits()),
    )


def two_levels(line: Line, estimate: Estimate, data: Data, limits: Limits) -> NextExperiment:
    """Two levels of one direction: a line of a fixed frequency stays, one that goes with the rotor moves.

    At the second level only the true kind gains, in proportion to the time; chi-square apart is normal, its standard
    deviation twice the root of its mean.
    """
    volts = data.scale.driver_unit == "V"
    limits = limits if volts else replace(limits, max_voltage=None)  # of a bench, in V
    top = largest_level(data, estimate, limits)
    gain = line.gain / sum(float(h.edges[-1] - h.edges[0]) for h in data.histories)
    longest = max(0.5 * (limits.budget - 2 * REST), SHORTEST)
    seconds = float(np.clip(np.ceil(ENOUGH / max(gain, 1e-9)), SHORTEST, min(LONGEST, longest)))
    apart = gain * seconds
    power = float(normal_sf((EQUAL - apart) / (2 * np.sqrt(apart)))) if apart > 0 else 0.5
    steps = ((0.0, REST), (float(f"{top:.6g}"), seconds), (float(f"{SECOND_LEVEL * top:.3g}"), seconds), (0.0, REST))
    why = f"separates a line at {line.frequency:.4g} Hz from one that goes with the rotor: two levels of one direction"
    held = "command_voltage" if volts else "rotation_rate"
    return NextExperiment(why, tuple(PlanStep(level, s) for level, s in steps), power, held)
