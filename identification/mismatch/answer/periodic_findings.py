"""Periodic disturbances in the answer: where they are, what they are, and how they stand to those of a twin."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.answer.draft import Draft
from identification.mismatch.diagnosis import Finding, Mismatch, RivalFinding
from identification.mismatch.name.named_term import probability_beside
from identification.mismatch.periodic.periodic_disturbances import EFFECT, Line
from identification.mismatch.value import Value, Where
from identification.twin import Twin, TwinLine

LEAST_P = 1e-300
"""Smallest p-value that is written: 0 has no logarithm for those who draw it."""


def twin_line(line: Line) -> TwinLine:
    """A line that was found, as a twin keeps it."""
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
        *((float(line.law.growth), line.top) if line.law.growth else ()),
    )


def line_values(line: TwinLine) -> dict[str, Value]:
    """The parameters of a line by name: amplitude in N, frequency in Hz, and where it has them periods per turn,
    growth, the speed at which it has that amplitude, and phase in rad.
    """
    out = {
        "amplitude": Value(line.amplitude, line.amplitude_std, "N"),
        "frequency": Value(line.frequency, line.frequency_std, "Hz"),
    }
    if line.ratio is not None:
        name, unit = ("periods_per_turn", "1") if line.turns == "rev" else ("periods_per_volt_second", "1/(V s)")
        out[name] = Value(line.ratio, line.ratio_std, unit)
    if line.growth:
        out["growth"] = Value(line.growth, 0.0, "1")
        out["at_speed"] = Value(line.at_speed, 0.0, "rev/s" if line.turns == "rev" else "V")
    if line.phase is not None:
        out["phase"] = Value(line.phase, line.phase_std, "rad")
    return out


def line_finding(line: Line) -> Finding:
    """A line that was found as a finding, its rivals those that fit the same spectrum."""
    p = max(line.p_value, LEAST_P)
    rivals = tuple(_rivals(line))
    probability = probability_beside([r.bic_loss for r in rivals])
    values, asked = line_values(twin_line(line)), 1 + len(rivals)
    return Finding(
        *(EFFECT, line.kind, line.statement, values, p, line.gain, probability, rivals),
        searched=line.searched,
        asked=asked,
        in_measurement=line.kind != "rotation",
    )


def _rivals(line: Line) -> Iterable[RivalFinding]:
    """The other kind has as many parameters, so BIC is worse by what chi-square is."""
    if line.rival is not None and (loss := line.gain - line.rival.gain) < policy.select.RIVAL_STATED_BIC:
        yield RivalFinding(EFFECT, line.rival.kind, line_values(twin_line(line.rival)), loss, line.rival.statement)


def line_place(line: Line, residual: float) -> Mismatch:
    """`residual`: rms of what the baseline leaves, N per sample."""
    low, high = line.band
    share = min(line.power / residual**2, 1.0) if residual > 0 else 1.0
    what = "a line that goes with the rotor" if line.kind == "rotation" else "a line of one frequency"
    what = what if line.rival is None else "a line, at one speed of the rotor"
    text = f"{100 * share:.2g} % of the residual lies at frequency {low:.4g} to {high:.4g} Hz: {what}."
    return Mismatch("thrust", Where("frequency", low, high, "Hz"), share, max(line.p_value, LEAST_P), text)


def told_lines(lines: Sequence[Line], before: Twin | None) -> tuple[Line, ...]:
    """Those that are news: one that the twin `before` has is only where it changed."""
    known = () if before is None else before.lines
    named = (line for line in lines if not seen_once(line, before))
    return tuple(line for line in named if (j := _known_as(line, known)) is None or _changed(line, known[j]))


def seen_once(line: Line, before: Twin | None) -> bool:
    """Whether it is in one run, or one part of the only run, alone; one that a twin has has come again."""
    return not line.again and _known_as(line, () if before is None else before.lines) is None


def _once(line: Line, recordings: Sequence[str]) -> str:
    """What is said of a line that has no name."""
    seen = line.seen
    if seen is None:
        raise ValueError("only a line of which it was asked whether it comes again was seen once")
    there = f"from {seen.clearest.start:.4g} to {seen.clearest.end:.4g} s"
    if len(recordings) > 1:
        there = f"in {recordings[seen.clearest.run]}"
    one, more = ("run", "runs") if len(recordings) > 1 else ("quarter of the run", "quarters of the run")
    others = one if seen.others == 1 else f"{seen.others} {more}"
    also = f", not in the other {others}" if seen.others else ""
    return (
        f"A line seen once, and no finding: {line.amplitude:.3g} N at {line.frequency:.4g} Hz (p = {line.p_value:.2g}) "
        f"stands out {there}{also}. It was taken out of the thrust; record again, and look whether it comes again."
    )


def with_lines(
    draft: Draft, lines: Sequence[Line], residual: float, before: Twin | None, recordings: Sequence[str] = ()
) -> Draft:
    """The draft with periodic disturbances: a place, a finding, parameters of the model, a part of the twin.

    `residual`: rms of what the baseline leaves, N per sample; `recordings`: ids of the runs, as lines count them. A
    line of the twin that is gone is noted, and one that was seen once.
    """
    once = tuple(_once(line, recordings) for line in lines if seen_once(line, before))
    lines = tuple(line for line in lines if not seen_once(line, before))
    known = () if before is None else before.lines
    same = {i: j for i, line in enumerate(lines) if (j := _known_as(line, known)) is not None}
    told = told_lines(lines, before)
    gone = {j: line for j, line in enumerate(known) if j not in same.values()}
    others = iter(range(len(known), len(known) + len(lines)))
    found = {same[i] if i in same else next(others): twin_line(line) for i, line in enumerate(lines)}
    origin = "" if before is None else before.origin
    missing = (f"{origin} has a line at {g.frequency:.4g} Hz, not found here." for g in gone.values())
    return replace(
        draft,
        baseline={**draft.baseline, **_named(dict(enumerate(known)))},
        mismatch=(*draft.mismatch, *(line_place(line, residual) for line in told)),
        findings=(*draft.findings, *(_beside_known(line, known, origin) for line in told)),
        model_terms=(*draft.model_terms, *(EFFECT for _ in lines)),
        model={**draft.model, **_named(found)},
        notes=(*draft.notes, *missing, *once),
        twin=None if draft.twin is None else replace(draft.twin, lines=(*found.values(), *gone.values())),
    )


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
            near = max(policy.answer.LINE_KNOWN_SIGMA * std, resolution, policy.periodic.MAINS_WANDER * other.frequency)
            if abs(line.frequency - other.frequency) < near:
                return j
        elif line.ratio is not None and other.ratio is not None and line.unit == other.turns:
            std = float(np.hypot(line.ratio_std or 0.0, other.ratio_std))
            if abs(line.ratio - other.ratio) < max(
                policy.answer.LINE_KNOWN_SIGMA * std, policy.answer.LINE_KNOWN_RATIO * other.ratio
            ):
                return j
    return None


def _changed(line: Line, known: TwinLine) -> bool:
    std = float(np.hypot(line.amplitude_std, known.amplitude_std))
    return abs(line.amplitude - known.amplitude) > policy.answer.LINE_CHANGED_SIGMA * std


def _beside_known(line: Line, known: Sequence[TwinLine], origin: str) -> Finding:
    found, j = line_finding(line), _known_as(line, known)
    if j is None:
        return found
    return replace(found, statement=f"{found.statement[:-1]}, where {origin} has {known[j].amplitude:.3g} N.")
