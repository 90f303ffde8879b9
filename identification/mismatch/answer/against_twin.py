"""The fitted model as a twin, and the answer against an earlier one: given terms, a changed thrust constant, and which
findings are new: what the twin's own recordings have too is none, what they could not show is said.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from identification.estimation.tails import normal_sf
from identification.flexible_terms.flexible import Flexible
from identification.mismatch import policy
from identification.mismatch.answer.draft import Draft
from identification.mismatch.answer.report_assembly import constant_of
from identification.mismatch.compare.earlier_recordings import Novelty
from identification.mismatch.compare.saved_model_baseline import terms_of
from identification.mismatch.diagnosis import Finding
from identification.mismatch.estimate.estimate import Estimate, fit_without, forces
from identification.mismatch.estimate.fit_covariance import covariance
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.estimate.rate_levels import rate_by_levels
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import acting
from identification.mismatch.name.naming import Named
from identification.mismatch.unexplained import Remainder
from identification.mismatch.value import QUANTILE, Value
from identification.physics.term import Term
from identification.recording import Recording
from identification.twin import Alternative, Source, Twin, TwinNoise, names_of

SAYS = {
    "changed": "That{amount} is new: the recordings behind {origin} speak against it.",
    "not shown before": "Whether that{amount} is new cannot be told: the recordings behind {origin} could not have "
    "shown it.",
}
LEFT_THEN = "Whether that is new cannot be told: the recordings behind {} left something without a name as well."
"""A shape that was drawn through one rest need not suit another, be both of one physics."""
NOW_KNOWN = (
    "That is no change: its levels left open where in between it lies, and those of these recordings are others."
)
NEAR_REST = 0.05
"""Of the largest thrust: below, a factor of the thrust says little."""
PART_OF_IT = "Part of what was found, or is left, may be in it."
NOT_NEW = "Not new, for it suits the recordings behind {} as well (chi-square of both {:+.3g} if it was there then): {}"


def with_twin(
    draft: Draft,
    estimate: Estimate,
    data: Data,
    recordings: Sequence[Recording],
    before: Twin | None,
    named: Sequence[Named] = (),
    *,
    beside: bool = False,
) -> Draft:
    """The draft with its twin; against an earlier twin the terms given are in the model, and a change is told.

    `named`: the terms of the model with their other forms; `beside`: whether something was found that is not new, or
    is left without a name.
    """
    twin = twin_of(estimate, data, recordings, before)
    ends, others = draft.model["C"].ends, _alternatives(estimate, data, named)
    draft = replace(draft, twin=replace(twin, constant_interval=ends, alternatives=others))
    if before is None:
        return draft
    known = before.origin
    model, was = estimate.fit.model, given_values(before)
    anew = {(t.id, t.form) for t in model.terms if model.given_for(t) is not None}
    effects = {effect for effect, _ in anew}
    told = [_relative(f, before, (f.effect, f.form) in anew, was) for f in draft.findings]
    closer = [f for f in told if (f.effect, f.form) in anew and _is_closer(f, before, was)]
    findings = tuple(f for f in told if f not in closer)
    draft = replace(draft, notes=(*draft.notes, *(f"{f.statement} {NOW_KNOWN}" for f in closer)))
    changed = changed_constant(before, estimate, data, known, draft.model["C"])
    if changed is not None and (findings or beside) and _referred(changed, before, estimate, data):
        draft = replace(draft, notes=(*draft.notes, f"{changed.statement} {PART_OF_IT}"))
    elif changed is not None:
        findings = (*findings, changed)
    of_twin = ", ".join(dict.fromkeys(t.effect for t in before.terms))
    return replace(
        draft,
        findings=findings,
        baseline_model=f"{known} ({draft.baseline_model}{' with ' + of_twin if of_twin else ''})",
        baseline={**draft.baseline, **was},
        model_terms=(*(t.effect for t in before.terms), *(e for e in draft.model_terms if e not in effects)),
        model={**was, **_renamed(draft.model, was, effects)},
    )


def _relative(finding: Finding, before: Twin, anew: bool, was: Mapping[str, Value]) -> Finding:
    """What is found of an effect that the baseline has already is a change of it, or comes on top of it."""
    if all(term.effect != finding.effect for term in before.terms):
        return finding
    if not anew:
        return replace(finding, statement=f"On top of what {before.origin} has: {finding.statement}")
    then = _had(before, finding, was)
    values = ", ".join(_then(name, value) for name, value in then.items())
    return replace(
        finding, statement=f"{finding.statement} {_sentence(before.origin)} has it with {values}.", before=then
    )


def _is_closer(finding: Finding, before: Twin, was: Mapping[str, Value]) -> bool:
    """Whether it is a threshold that lies where the twin's levels had left it open: those of this run are others."""
    known = next(t for t in before.terms if (t.effect, t.form) == (finding.effect, finding.form))
    then = _had(before, finding, was)
    return all(
        p.jumps and abs(finding.parameters[p.name].value - then[p.name].value) <= QUANTILE * then[p.name].std
        for p in known.term.parameters(known.scale)
    )


def _had(before: Twin, finding: Finding, was: Mapping[str, Value]) -> dict[str, Value]:
    """The twin's own values of that effect in that form: where it has another form too, one of them is `effect#2`."""
    at, out = 1, dict[str, Value]()
    for term in before.terms:
        known = term.term.parameters(term.scale)
        if (term.effect, term.form) == (finding.effect, finding.form):
            out = {p.name: was[name] for p, name in zip(known, before.names[at : at + len(known)], strict=True)}
        at += len(known)
    return out


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def _then(name: str, then: Value) -> str:
    unit = "" if then.unit in ("", "1") else f" {then.unit}"
    return f"{then.told or name.replace('_', ' ')} {then.value:.4g}{unit}"


def _renamed(found: Mapping[str, Value], was: Mapping[str, Value], anew: Collection[str]) -> dict[str, Value]:
    out = {}
    for name, value in found.items():
        effect, dot, parameter = name.partition(".")
        out[f"{effect}#2{dot}{parameter}" if name in was and effect not in anew else name] = value
    return out


def given_values(twin: Twin) -> dict[str, Value]:
    """The twin's terms as they are given."""
    std = np.sqrt(np.diag(np.array(twin.covariance)))
    units = [p.unit for t in twin.terms for p in t.term.parameters(t.scale)]
    numbers = [v for t in twin.terms for v in t.values]
    return {
        name: Value(value, float(s), unit)
        for name, value, s, unit in zip(twin.names[1:], numbers, std[1:], units, strict=True)
    }


def _referred(changed: Finding, before: Twin, estimate: Estimate, data: Data) -> bool:
    """Whether C moved by little more than by what it refers to: of thrust that grows as |V|^2.03 it is another at every
    level, and the twin's is that of one of them."""
    now, was = changed.parameters["C"].value, changed.parameters["before"].value
    known = {term.effect for term in before.terms}
    new = [t for t in estimate.fit.model.terms if t.traits.refers and t.id not in known]
    least, most = _gains(estimate.fit, new, data) if new else (1.0, 1.0)
    little = policy.answer.CONSTANT_MOVED
    return least - little < was / now < most + little


def _gains(fitted: Fit, terms: Sequence[Term], data: Data) -> tuple[float, float]:
    """Least and most factor of the thrust that these terms of the model make, where it is not near rest."""
    whole = np.concatenate(forces(fitted.model, fitted.theta, data))
    less = np.concatenate(forces(*fitted.less(*terms), data))
    turning = np.abs(less) > NEAR_REST * float(np.max(np.abs(less)))
    gain = whole[turning] / less[turning]
    return float(np.min(gain, initial=1.0)), float(np.max(gain, initial=1.0))


def _own_constant(twin: Twin, estimate: Estimate, data: Data) -> tuple[float, float]:
    """C and its standard error, of the voltage of which the twin's is: where only the later model follows the measured
    rate, of the one that the rotor makes that rate of."""
    coupled = any(each.term.traits.follows_rate for each in twin.terms)
    return (estimate.fit.theta.C, float(estimate.fit.std[0])) if coupled else constant_of(estimate.fit, data)


def _constant_now(twin: Twin, estimate: Estimate, data: Data) -> tuple[float, float]:
    """As `_own_constant`. A free shape may be most of C V|V|: beside one it is the C nearer to the twin's, of the model
    with it and of the model without it, and the twin's own where they move to either side."""
    value, std = _own_constant(twin, estimate, data)
    plain = _without_free_shapes(estimate, data)
    if plain is estimate:
        return value, std
    other, _ = _own_constant(twin, plain, data)
    if (value - twin.C) * (other - twin.C) <= 0:
        return twin.C, std
    return min(value, other, key=lambda each: abs(each - twin.C)), std


def _without_free_shapes(estimate: Estimate, data: Data) -> Estimate:
    for term in [t for t in estimate.fit.model.terms if isinstance(t, Flexible)]:
        estimate = replace(estimate, fit=fit_without(estimate, term, data))
    return estimate


def _error_towards(told: Value, was: float) -> float:
    """The standard error of C as it is told, on the side of another: its interval holds what rivals, and what nothing
    claims, would make of it."""
    low, high = told.interval
    return (told.value - low if was < told.value else high - told.value) / QUANTILE


def _told_then(twin: Twin) -> Value:
    """C of the twin as its own recordings had it told."""
    return Value(twin.C, float(np.sqrt(twin.covariance[0][0])), "", ends=twin.constant_interval)


def changed_constant(twin: Twin, estimate: Estimate, data: Data, known: str, told: Value) -> Finding | None:
    """The thrust constant is no longer the twin's, at CHANGED_CONSTANT_FALSE_ALARM, and the change pays for itself.

    `told`: C as it is told of the model.
    """
    value, std = _constant_now(twin, estimate, data)
    was, was_std, unit = twin.C, _error_towards(_told_then(twin), value), told.unit
    std = float(np.maximum(std, _error_towards(told, was)))
    both = float(np.hypot(std, was_std))
    if not isfinite(both) or both <= 0:
        return None
    z = (value - was) / both
    p = max(2 * float(normal_sf(abs(z))), 1e-300)
    bic_gain = z**2 - float(np.log(max(estimate.fit.residual.size, 2)))
    if p >= policy.answer.CHANGED_CONSTANT_FALSE_ALARM or bic_gain <= 0:
        return None
    share = 100 * (value - was) / abs(was)
    says = f"Thrust constant: {value:.4g} {unit} where {known} has {was:.4g} ({share:+.2g} %, {abs(z):.0f} sigma)."
    parameters = {"C": Value(value, std, unit), "before": Value(was, was_std, unit)}
    then = {"C": parameters["before"]}
    return Finding("thrust_constant", "", says, parameters, p, bic_gain, 1.0, (), before=then)


def twin_of(estimate: Estimate, data: Data, recordings: Sequence[Recording], before: Twin | None) -> Twin:
    """The fitted model as a twin; files' hashes and the time are added by who knows them."""
    fitted, noise = estimate.fit, estimate.noise.everywhere(estimate.rows)
    terms = terms_of(fitted, data)
    return Twin(
        thruster=recordings[0].thruster,
        driver_quantity=data.histories[0].driver_quantity,
        C=fitted.theta.C,
        terms=terms,
        names=names_of(terms),
        covariance=_covariance(estimate, data, before),
        noise=TwinNoise(noise.white, noise.proportional, noise.scales, noise.slow, noise.bands, noise.band),
        sources=(
            *(() if before is None else before.sources),
            *(
                Source(r.recording_id, tare=tare)
                for r, tare in zip(recordings, fitted.theta.tares, strict=True)
                if before is None or all(s.recording_id != r.recording_id for s in before.sources)
            ),
        ),
        interval=_interval(recordings),
        highest_driver=max(data.scale.driver, 0.0 if before is None else before.highest_driver),
        rate_per_driver=_rate_per_driver(fitted, data),
        slip_rate_per_driver=next((h.rate_per_driver for h in data.histories if h.rate is not None), None),
    )


def _rate_per_driver(fitted: Fit, data: Data) -> float | None:
    if not data.with_rate:
        return None
    by_levels = rate_by_levels(fitted, data)
    return fitted.theta.k if by_levels is None else by_levels[0]


def _alternatives(estimate: Estimate, data: Data, named: Sequence[Named]) -> tuple[Alternative, ...]:
    """Of the final model with one effect in another form; none where it is not the model that was named."""
    model = estimate.fit.model
    return tuple(
        Alternative(r.fit.theta.C, terms_of(r.fit, data), max(r.fit.chi2 - n.chi2_of_all, 0.0), n.chi2_gain)
        for n in named
        for r in n.forms
        if set(r.fit.model.terms) - {r.term} == set(model.terms) - {n.term}
    )


def _interval(recordings: Sequence[Recording]) -> float:
    gaps = [np.median(np.diff(r.first_of("thrust").time)) for r in recordings]  # type: ignore[union-attr]  # a diagnosis has thrust
    return float(min(gaps))


def _covariance(estimate: Estimate, data: Data, before: Twin | None) -> tuple[tuple[float, ...], ...]:
    """Of C and every term's parameters: fitted ones from the fit, given ones as the twin had them."""
    fitted = estimate.fit
    full = covariance(fitted, data, estimate.weights)
    every = list(range(fitted.layout.size))
    place = {id(term): every[fitted.layout.of(term)] for term in fitted.model.terms}
    old = np.zeros((1, 1)) if before is None else np.array(before.covariance)
    old_place, at = {}, 1
    for g in fitted.model.given:
        old_place[id(g.values)] = list(range(at, at + len(g.values)))
        at += len(g.values)
    fresh: list[int | None] = [0]
    kept: list[int | None] = [None]
    for term, values, _ in acting(fitted.model, fitted.theta, data.scale):
        was = old_place.get(id(values))
        fresh += place[id(term)] if was is None else [None] * len(was)
        kept += [None] * len(values) if was is None else was
    out = np.zeros((len(fresh), len(fresh)))
    for i in range(len(fresh)):
        for j in range(len(fresh)):
            a, b, c, d = fresh[i], fresh[j], kept[i], kept[j]
            if a is not None and b is not None:
                out[i, j] = full[a, b]
            elif c is not None and d is not None:
                out[i, j] = old[c, d]
    return tuple(tuple(map(float, row)) for row in out)


@dataclass(frozen=True, eq=False, slots=True)
class ToldNew:
    """What is told of the findings, and of what no name carries."""

    findings: tuple[Finding, ...]
    """Without those that are not new."""
    not_new: tuple[str, ...]
    """The statements of those."""
    notes: tuple[str, ...]
    left: Remainder | None = None
    """What no name carries; None where nothing is left, or was left then too."""


def told_new(
    findings: Mapping[Term, Finding],
    novelties: Mapping[Term, Novelty],
    twin: Twin | None,
    left: Remainder | None = None,
    nameless: Collection[Term] = (),
    *,
    left_then: bool = False,
) -> ToldNew:
    """Each with whether it is new, where that was asked; `nameless`: the terms that model what is `left`; `left_then`:
    whether the twin's own recordings left something that had no name."""
    new, not_new, notes = [], [], []
    origin = "the twin" if twin is None else twin.origin
    for term, finding in findings.items():
        novelty = novelties.get(term)
        if novelty is None:
            new.append(finding)
        elif novelty.since == "there before":
            not_new.append(finding.statement)
            notes.append(NOT_NEW.format(origin, novelty.loss, finding.statement))
        else:
            amount = " amount" if twin is not None and finding.effect in {t.effect for t in twin.terms} else ""
            statement = f"{finding.statement} {SAYS[novelty.since].format(amount=amount, origin=origin)}"
            new.append(replace(finding, statement=statement, since=novelty.since))
    whole = _together([novelties[term] for term in nameless if term in novelties], len(nameless))
    if left is not None and whole is not None and whole.since == "there before":
        not_new.append(left.statement)
        notes.append(NOT_NEW.format(origin, whole.loss, left.statement))
        left = None
    elif left is not None and left_then:
        left = replace(left, statement=f"{left.statement} {LEFT_THEN.format(origin)}")
    elif left is not None and whole is not None:
        left = replace(left, statement=f"{left.statement} {SAYS[whole.since].format(amount='', origin=origin)}")
    return ToldNew(tuple(new), tuple(not_new), tuple(notes), left)


def _together(asked: Sequence[Novelty], of: int) -> Novelty | None:
    """Of terms that are told as one: the newest; None where not all of them were asked."""
    return max(asked, key=lambda each: each.loss) if asked and len(asked) == of else None
