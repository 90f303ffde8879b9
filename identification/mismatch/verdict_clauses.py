"""Findings as clauses of the verdict's sentence."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Finding, HeldOutRmse, NextExperiment

NOT_WHITE = (
    "intervals and p-values rest on the noise model, which does not describe all of it: they may be surer than they "
    "should"
)
MISSING = "Missing from the model:"
CHANGED = "Changed:"
IN_MEASUREMENT = "In the measurement, not in the thruster:"
NO_BETTER = 0.995
"""Of the error before: names that leave more take nothing off."""
MOST_REFUSED = 3
"""Names in a sentence: all of them are in the answer."""


def sureness(f: Finding) -> str:
    """How many alternatives were looked at before it was taken, and its odds among those fitted in its place."""
    says = f"the best of {f.searched} alternatives looked at" if f.searched is not None and f.searched > 1 else ""
    odds = (
        f"{_percent(f.probability)} of the odds among the {f.asked} effects of the catalogue that were fitted in this "
        "place; how likely physics outside the catalogue is, that does not say"
    )
    return ", ".join(part for part in (says, odds if f.asked > 1 else "") if part)


def _percent(share: float) -> str:
    """Whole, and never all or nothing.

    >>> _percent(0.7), _percent(1.0), _percent(1e-9)
    ('70 %', 'more than 99 %', 'less than 1 %')
    """
    if share >= 0.995:
        return "more than 99 %"
    return f"{100 * share:.0f} %" if share >= 0.005 else "less than 1 %"


def degree(f: Finding) -> str:
    """Its grade with its share; empty where that was not judged."""
    if f.share is None or f.heldout is None:
        return ""
    without, with_it = f.heldout
    return (
        f"{f.grade}: not fitted {without:.4g} without it, {with_it:.4g} with it, {100 * f.share:.0f} % of what any "
        "shape in its place could take off"
    )


def graded(f: Finding) -> str:
    """With how much it is of what could be taken off what was not fitted."""
    says = f"{'Partly' if f.grade == 'partly' else 'Mostly'} {f.statement[:1].lower()}{f.statement[1:]}"
    if f.share is None:
        return says
    return (
        f"{says} Of the error that a curve of any shape in its place would take off data that were not fitted, it "
        f"takes off {100 * f.share:.0f} %."
    )


def missing(told: Sequence[tuple[Finding, str]]) -> list[str]:
    """Findings as they are told: what the model lacks, what it has with other values, and apart from these what is of
    the stand, the cell and channels."""
    groups: dict[str, list[str]] = {MISSING: [], CHANGED: [], IN_MEASUREMENT: []}
    for f, text in told:
        groups[IN_MEASUREMENT if f.in_measurement else CHANGED if f.before else MISSING].append(text)
    return [part for head, texts in groups.items() if texts for part in (head, *texts)]


def beyond_noise(error: float, noise: float) -> float:
    """A model's own part of an rms error; noise and model error are independent.

    >>> beyond_noise(5.0, 4.0), beyond_noise(0.3, 0.4)
    (3.0, 0.0)
    """
    return sqrt(max(error**2 - noise**2, 0.0))


def with_names(findings: Sequence[Finding], held: HeldOutRmse, more: str) -> float | None:
    """RMSE on what was not fitted of the model with its names alone; `more`: what else is in it. None: not known."""
    if not more:
        return held.after
    return next((f.heldout[1] for f in findings if f.heldout is not None), None)


def named_share(findings: Sequence[Finding], held: HeldOutRmse, more: str) -> float | None:
    """Of the rms error beyond the noise that the baseline has on what was not fitted, how much is gone with the names,
    0 to 1; None where nothing is named, or there is no error beyond the noise.

    What is held out may be quieter than what was fitted: where the model falls below that noise, its error counts.
    """
    names = with_names(findings, held, more) if findings else None
    noise = min(held.noise, held.after)
    if names is None or not isfinite(held.noise) or not held.before > noise:
        return None
    return max(1 - beyond_noise(names, noise) / beyond_noise(held.before, noise), 0.0)


def in_part(share: float) -> str:
    """A headline where a part has names.

    >>> in_part(0.973)
    'unexplained in part: what has a name takes off 97 % of the error beyond the noise'
    """
    return f"unexplained in part: what has a name takes off {_percent(share)} of the error beyond the noise"


def errors(findings: Sequence[Finding], held: HeldOutRmse, unit: str, more: str = "") -> str:
    """The errors on what was not fitted in one chain that ends with that of the model which is told: of the baseline,
    with the names, and with `more` where the model has anything but names; empty where it does no better.
    """
    if held.hidden:
        return (
            f"Error on data that were not fitted: {held.before:.3g} {unit} before and {held.after:.3g} {unit} after, "
            "for slow noise is most of it; with that taken out the model predicts them better."
        )
    if held.after >= held.before:
        return ""
    names = with_names(findings, held, more)
    chain = [f"{held.before:.3g} {unit} before"]
    if findings and names is not None:
        chain.append(f"{names:.3g} {unit} with {_alone(len(findings), names, held.before, more)}")
    if more:
        chain.append(f"{held.after:.3g} {unit} with {more}")
    return f"Error on data that were not fitted: {', '.join(chain)}; {of_noise(held.after, held.noise, unit)}."


def _alone(many: int, names: float, before: float, more: str) -> str:
    """So many names, and that they are no better by themselves, if they are not.

    >>> _alone(2, 0.399, 0.362, "a free curve"), _alone(1, 0.399, 0.41, "")
    ('these alone, which predict no better than without', 'it')
    """
    who, predict = ("it", "predicts") if many == 1 else ("these", "predict")
    if not more or names < NO_BETTER * before:
        return who
    return f"{who} alone, which {predict} no better than without"


def of_noise(error: float, noise: float, unit: str) -> str:
    """An error on what was not fitted beside the noise of what was, as a clause.

    >>> of_noise(1.47, 0.31, "N"), of_noise(0.51, 0.72, "N")
    ('noise alone gives 0.31 N', '0.51 N is no more than the noise of the data that were fitted (0.72 N)')
    """
    if error <= noise:
        return f"{error:.3g} {unit} is no more than the noise of the data that were fitted ({noise:.3g} {unit})"
    return f"noise alone gives {noise:.3g} {unit}"


def beside(findings: Sequence[Finding], left: str, held: HeldOutRmse, unit: str, more: str) -> str:
    """What is known, those that are not the whole of it first, and then the sentence of what is left.

    `more`: what is in the model without a name.
    """
    if not findings:
        return f"{left} {errors(findings, held, unit, more)}".rstrip()
    most = [graded(f) for f in findings if f.doubts]
    sure = [(f, f.statement) for f in findings if not f.doubts]
    named = [*most, *missing(sure), errors(findings, held, unit, more)]
    return " ".join([*filter(None, named), f"Beside that {left[:1].lower()}{left[1:]}"])


def unsettled(f: Finding) -> str:
    """It, and by name the rivals that would do as well; by form, where they are the same effect."""
    names = [r.effect if r.effect != f.effect else f"{r.effect} ({r.form})" for r in f.rivals]
    others = " or ".join(name.replace("_", " ") for name in names)
    return (
        f"{f.statement} Instead of {f.effect.replace('_', ' ')} it may be {others}: these recordings cannot tell which."
    )


def to_settle(found: NextExperiment | None) -> str:
    """What would tell the rivals, in a sentence."""
    if found is None:
        return "Run the next experiment."
    why = found.why.split(";", maxsplit=1)[0].replace("_", " ")
    if not found.steps:
        return f"No sweep settles it: {why}."
    seconds = sum(step.duration for step in found.steps)
    return f"To settle it run the next experiment, {len(found.steps)} steps, {seconds:.0f} s in all: it {why}."


def refused(candidates: Sequence[tuple[str, str]]) -> str:
    """What was tried for it, each (name, first check that it failed); the first few."""
    told = [f"{name.replace('_', ' ')} ({why})" for name, why in candidates[:MOST_REFUSED]]
    more = len(candidates) - len(told)
    return f"Tried for it and refused: {'; '.join(told)}{f'; and {more} more' if more else ''}."
