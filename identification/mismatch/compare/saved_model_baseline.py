"""A twin as the baseline of a diagnosis, and a diagnosis as a twin."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isfinite

import numpy as np

from identification.estimation.tails import normal_sf
from identification.flexible_terms.flexible import Flexible
from identification.mismatch.diagnosis import Diagnosis, Finding, Value
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.model import Data, Given, Model, PriorPredictionFactor, Theta, acting
from identification.mismatch.prepare.preparing import FEW_SAMPLES, Refusal
from identification.recording import Floats, Recording
from identification.run_history.history import CHANGED, History
from identification.twin import Source, Twin, TwinNoise, TwinTerm, names_of

ALARM = 0.01
"""False-alarm rate of a changed thrust constant."""
LEAST_SAMPLES = 50
"""Of one recording with a course of time; a table of levels may have fewer."""
ONE_LEVEL = 1e-6
"""Share of the largest driver: levels nearer than this are one."""
ONE_CONSTANT = 0.02
"""Relative: where another effect was found, C may move by this much with what that effect refers to (a highest bus
voltage, say), and is no finding of its own."""
PROBE = 0.1
"""Standard deviations by which a parameter is moved for the slope of the prediction."""


def given(twin: Twin) -> tuple[Given, ...]:
    return tuple(Given(t.term, t.values, t.scale) for t in twin.terms)


def starting(twin: Twin) -> Callable[[Data, Theta], tuple[Data, Theta, Model]]:
    """For search(): the twin's terms at their values, C of the twin to begin with, and how uncertain they are."""

    def begin(data: Data, theta: Theta) -> tuple[Data, Theta, Model]:
        model = Model((), given(twin))
        theta = replace(theta, C=twin.C)
        return replace(data, prior_factor=_both(data.prior_factor, prior_factor(twin, data, theta))), theta, model

    return begin


def _both(one: PriorPredictionFactor | None, other: PriorPredictionFactor | None) -> PriorPredictionFactor | None:
    if one is None or other is None:
        return one or other
    thrust = tuple(np.column_stack(pair) for pair in zip(one.thrust, other.thrust, strict=True))
    rate = tuple(np.column_stack(pair) for pair in zip(one.rate, other.rate, strict=False))
    return PriorPredictionFactor(thrust, rate)


def prior_factor(twin: Twin, data: Data, theta: Theta) -> PriorPredictionFactor | None:
    """Change of the prediction by one standard deviation along each principal axis of the terms' covariance.

    C is fitted anew in each diagnosis, so its own uncertainty is not in it.
    """
    covariance = np.array(twin.covariance)[1:, 1:]
    if not covariance.size:
        return None
    std = np.sqrt(np.diag(covariance))
    moving = std > 0
    values, axes = np.linalg.eigh(covariance[np.ix_(moving, moving)] / np.outer(std[moving], std[moving]))
    root = np.zeros((std.size, values.size))
    root[moving] = std[moving, None] * axes * np.sqrt(np.maximum(values, 0.0))
    base, base_rate = raw(Model((), given(twin)), theta, data, with_rate=data.with_rate)
    thrust: list[list[Floats]] = [[] for _ in data.histories]
    rate: list[list[Floats]] = [[] for _ in data.histories]
    for axis in root.T:
        moved = Model((), given(_moved(twin, PROBE * axis)))
        new, new_rate = raw(moved, theta, data, with_rate=data.with_rate)
        for out, a, b in zip(thrust, new, base, strict=True):
            out.append((a - b) / PROBE)
        for out, a, b in zip(rate, new_rate, base_rate, strict=False):
            out.append((a - b) / PROBE)
    if not root.shape[1]:
        return None
    return PriorPredictionFactor(
        tuple(np.column_stack(c) for c in thrust), tuple(np.column_stack(c) for c in rate if c)
    )


def _moved(twin: Twin, by: Floats) -> Twin:
    """The twin with its terms' parameters moved, within their bounds."""
    at, terms = 0, []
    for term in twin.terms:
        known = term.term.parameters(term.scale)
        moved = {
            p.name: float(np.clip(value + step, p.low, p.high))
            for p, value, step in zip(known, term.values, by[at : at + len(known)], strict=True)
        }
        terms.append(replace(term, parameters=moved))
        at += len(known)
    return replace(twin, terms=tuple(terms))


def twin_of(estimate: Estimate, data: Data, recordings: Sequence[Recording], before: Twin | None) -> Twin:
    """The fitted model as a twin; files' hashes and the time are added by who knows them."""
    fitted = estimate.fit
    terms = tuple(
        TwinTerm(
            term.id,
            term.form,
            {p.name: value for p, value in zip(term.parameters(sizes), values, strict=True)},
            sizes,
            term if isinstance(term, Flexible) else None,
        )
        for term, values, sizes in acting(fitted.model, fitted.theta, data.scale)
    )
    return Twin(
        thruster=recordings[0].thruster,
        driver_quantity=data.histories[0].driver_quantity,
        C=fitted.theta.C,
        terms=terms,
        names=names_of(terms),
        covariance=_covariance(estimate, data, before),
        noise=TwinNoise(
            estimate.noise.white,
            estimate.noise.proportional,
            estimate.noise.scales,
            estimate.noise.slow,
            estimate.noise.bands,
            estimate.noise.band,
        ),
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
        rate_per_driver=fitted.theta.k if data.with_rate else None,
    )


def _interval(recordings: Sequence[Recording]) -> float:
    gaps = [np.median(np.diff(r.first_of("thrust").time)) for r in recordings]  # type: ignore[union-attr]  # a diagnosis has thrust
    return float(min(gaps))


def _covariance(estimate: Estimate, data: Data, before: Twin | None) -> tuple[tuple[float, ...], ...]:
    """Of C and every term's parameters: fitted ones from the fit, given ones as the twin had them."""
    fitted = estimate.fit
    full = np.nan_to_num(fitted.cov)
    place: dict[int, list[int]] = {}
    at = 1
    for term, values in zip(fitted.model.terms, fitted.theta.terms, strict=True):
        place[id(term)] = list(range(at, at + len(values)))
        at += len(values)
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


def unfit(
    recordings: Sequence[Recording],
    holdout: Sequence[Recording],
    histories: Sequence[History],
    others: Sequence[History],
    twin: Twin | None,
) -> Refusal | None:
    """Why these cannot be diagnosed together, or against this twin."""
    thruster, driver = recordings[0].thruster, histories[0].driver_quantity
    other = next((r for r in holdout if r.thruster != thruster), None)
    if other is not None:
        return Refusal(
            f"{other.source or other.recording_id} is of thruster {other.thruster}, the recordings to be diagnosed are "
            f"of {thruster}; hold out a recording of {thruster}"
        )
    twice = next((r for r in holdout if any(r.recording_id == q.recording_id for q in recordings)), None)
    if twice is not None:
        return Refusal(
            f"{twice.source or twice.recording_id} is both to be diagnosed and held out; hold out another recording"
        )
    for recording, history in zip(holdout, others, strict=True):
        if history.driver_quantity != driver:
            return Refusal(
                f"{recording.source or recording.recording_id} is driven by {history.driver_quantity}, the recordings "
                f"to be diagnosed by {driver}; hold out a recording with {driver}"
            )
    for recording, history in zip(recordings, histories, strict=True):
        few = _too_little(recording.source or recording.recording_id, history)
        if few is not None:
            return few
    if twin is None:
        return None
    if twin.thruster != thruster:
        return Refusal(
            f"the twin is of thruster {twin.thruster}, the recording {recordings[0].source} is of {thruster}; give the "
            f"twin of {thruster}, or ask for --any-thruster"
        )
    if twin.driver_quantity != driver:
        return Refusal(
            f"the twin is driven by {twin.driver_quantity}, the recording by {driver}; both must be the same"
        )
    for term in twin.terms:
        for history in (*histories, *others):
            lacking = sorted(set(term.term.needs) - set(history.others))
            if lacking:
                return Refusal(
                    f"the twin's {term.effect} needs {', '.join(lacking)}, which {history.recording_id} does not hold; "
                    "diagnose it without the twin"
                )
    return None


def _too_little(name: str, history: History) -> Refusal | None:
    """What a line through two points would describe without a residual is not diagnosed."""
    samples, driven = int(history.count.sum()), history.driver[history.rows]
    levels = 1 + int(np.count_nonzero(np.abs(np.diff(driven)) > CHANGED * history.size))
    if samples < LEAST_SAMPLES and samples > FEW_SAMPLES * levels:
        return Refusal(
            f"{name} has {samples} thrust samples, at least {LEAST_SAMPLES} are needed to tell physics from noise; "
            "record for longer"
        )
    if float(np.ptp(driven)) <= ONE_LEVEL * history.size:
        return Refusal(
            f"{name} has thrust at one level of {history.driver_quantity} only ({driven[0]:.4g}); at least two levels "
            "are needed"
        )
    return None


def with_twin(
    answer: Diagnosis, estimate: Estimate, data: Data, recordings: Sequence[Recording], before: Twin | None
) -> Diagnosis:
    """The diagnosis with its twin; against an earlier twin the terms given are in the model, and a change is told."""
    answer = replace(answer, twin=twin_of(estimate, data, recordings, before))
    if before is None:
        return answer
    known = before.origin
    C = answer.model["C"]
    findings = tuple(_relative(f, before, known) for f in answer.findings)
    changed = changed_constant(before, estimate, known, C.unit)
    if changed is not None and findings and abs(C.value / before.C - 1) < ONE_CONSTANT:
        answer = replace(answer, notes=(*answer.notes, f"{changed.statement} Part of what was found may be in it."))
    elif changed is not None:
        findings = (*findings, changed)
    was = given_values(before)
    named = ", ".join(dict.fromkeys(t.effect for t in before.terms))
    return replace(
        answer,
        verdict="explained" if answer.verdict == "adequate" and findings else answer.verdict,
        findings=findings,
        baseline_model=f"{known} ({answer.baseline_model}{' with ' + named if named else ''})",
        baseline={**answer.baseline, **was},
        model_terms=(*(t.effect for t in before.terms), *answer.model_terms),
        model={**was, **_renamed(answer.model, was)},
    )


def _relative(finding: Finding, before: Twin, known: str) -> Finding:
    """What is found of an effect that the baseline has already comes on top of it."""
    if all(term.effect != finding.effect for term in before.terms):
        return finding
    return replace(finding, statement=f"On top of what {known} has: {finding.statement}")


def _renamed(found: Mapping[str, Value], was: Mapping[str, Value]) -> dict[str, Value]:
    out = {}
    for name, value in found.items():
        effect, dot, parameter = name.partition(".")
        out[f"{effect}#2{dot}{parameter}" if name in was else name] = value
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


def changed_constant(twin: Twin, estimate: Estimate, known: str, unit: str) -> Finding | None:
    """The thrust constant is no longer the twin's, at ALARM."""
    value, std = estimate.fit.theta.C, float(estimate.fit.std[0])
    was, was_std = twin.C, float(np.sqrt(twin.covariance[0][0]))
    both = float(np.hypot(std, was_std))
    if not isfinite(both) or both <= 0:
        return None
    z = (value - was) / both
    p = max(2 * float(normal_sf(abs(z))), 1e-300)
    if p >= ALARM:
        return None
    share = 100 * (value - was) / abs(was)
    says = f"Thrust constant: {value:.4g} {unit} where {known} has {was:.4g} ({share:+.2g} %, {abs(z):.0f} sigma)."
    logn = float(np.log(max(estimate.fit.residual.size, 2)))
    parameters = {"C": Value(value, std, unit), "before": Value(was, was_std, unit)}
    return Finding("thrust_constant", "", says, parameters, p, z**2 - logn, 1.0, ())
