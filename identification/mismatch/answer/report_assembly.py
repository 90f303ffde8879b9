"""A fit and what was found, in the words and figures of the answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch.diagnosis import (
    QUANTILE,
    Curves,
    Finding,
    Mismatch,
    RivalFinding,
    Value,
    Where,
)
from identification.mismatch.estimate.confidence_intervals import Interval
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import Fit, raw
from identification.mismatch.faults.channel_faults import Fault
from identification.mismatch.locate.residual_structure_test import ALARM, CovariateTest, locate, residual_structure
from identification.mismatch.model.model import Data, Weights
from identification.mismatch.name.naming import Named
from identification.mismatch.prepare.preparing import DRIVERS
from identification.mismatch.select.forward_selection import STATIC, Selected
from identification.mismatch.select.rivals import Rival
from identification.physics.term import Term

MOST_PLACES = 3
CLEAR = 1e-3
"""p-value of a place below which it is told beside the clearest one."""
LEAST_P = 1e-300


def fault_finding(fault: Fault) -> Finding:
    values = {k: Value(v.value, v.std, v.unit) for k, v in fault.parameters.items()}
    p = max(fault.p_value, LEAST_P)
    return Finding("channel_fault", fault.kind, fault.statement, values, p, -2 * float(np.log(p)), 1.0, ())


Intervals = Mapping[Term, tuple[Interval, ...]]


def values_of(fitted: Fit, data: Data, known: Intervals | None = None) -> dict[str, Value]:
    """C, tares and all parameters of the terms with their standard errors, or their intervals where they are known."""
    std = fitted.std
    unit = data.scale.driver_unit
    out = {"C": Value(fitted.theta.C, float(std[0]), f"N/{unit}^2" if unit == "V" else "N s^2/rev^2")}
    at = 1
    for term, values in zip(fitted.model.terms, fitted.theta.terms, strict=True):
        told = _term_values(term, values, std[at : at + len(values)].tolist(), data, (known or {}).get(term))
        out |= {f"{term.id}.{name}": value for name, value in told.items()}
        at += len(values)
    for history, tare in zip(data.histories, fitted.theta.tares, strict=True):
        key = "tare" if len(data.histories) == 1 else f"tare[{history.recording_id}]"
        out[key] = Value(tare, float(std[at]), "N")
        at += 1
    return out


def _term_values(
    term: Term,
    theta: Sequence[float],
    std: Sequence[float],
    data: Data,
    known: Sequence[Interval] | None = None,
) -> dict[str, Value]:
    told = term.parameters(data.scale)
    if known is None:
        return {p.name: Value(v, s, p.unit) for p, v, s in zip(told, theta, std, strict=True)}
    return {p.name: _within(v, p.unit, i) for p, v, i in zip(told, theta, known, strict=True)}


def _within(value: float, unit: str, interval: Interval) -> Value:
    far = max(interval.high - value, value - interval.low)
    return Value(value, far / QUANTILE, unit, (interval.low, interval.high))


def finding_of(named: Named, data: Data, known: Intervals) -> Finding:
    return Finding(
        named.term.id,
        named.term.form,
        named.term.statement(named.theta, data.scale),
        _term_values(named.term, named.theta, named.std, data, known.get(named.term)),
        named.p_value,
        named.bic_gain,
        named.probability,
        tuple(_rival(r, data) for r in named.rivals),
    )


def _rival(rival: Rival, data: Data) -> RivalFinding:
    fitted, at = rival.fit, 1
    for term, values in zip(fitted.model.terms, fitted.theta.terms, strict=True):
        if term == rival.term:
            std = fitted.std[at : at + len(values)]
            known = _term_values(term, values, [float(s) for s in std], data)
            return RivalFinding(term.id, term.form, known, rival.bic_loss, term.statement(values, data.scale))
        at += len(values)
    raise ValueError(f"{rival.term.id} is not in its own fit")


def where_of(
    judged: CovariateTest, fitted: Fit, data: Data, weights: Weights
) -> tuple[Where, float, tuple[tuple[float, float, float], ...]]:
    place = locate(judged, fitted, data, weights)
    return Where(place.quantity, place.low, place.high, place.unit), place.share, place.table


def says(where: Where, share: float, what: str) -> str:
    unit = "" if where.unit == "1" else f" {where.unit}"
    place = f"{where.quantity} {where.low:.3g} to {where.high:.3g}{unit}"
    return f"{100 * share:.0f} % of the residual lies at {place}: {what}."


def places_of(found: Selected, after: Estimate, rng: np.random.Generator, *, pulsing: bool) -> tuple[Mismatch, ...]:
    """Where the baseline fails: covariates of what was found first, the clearest first among them.

    Its C and tares are those of the model `after`: with its own it shares out the mismatch over all there is.
    `pulsing`: pulses that come back were found.
    """
    before, data = found.before.fit, found.data
    seen = residual_structure(before, data, found.before.weights, rng, pulsing=pulsing)
    if seen.p_value >= ALARM and not after.fit.model.terms:
        return ()
    same = replace(before.theta, C=after.fit.theta.C, tares=after.fit.theta.tares, shift=after.fit.theta.shift)
    bare = replace(before, theta=same)
    clear = [g for i, g in enumerate(seen.groups) if i == 0 or g.p_value <= CLEAR]
    own = {q for term in after.fit.model.terms for c in term.covariates for q in (DRIVERS if c in STATIC else (c,))}
    places = [
        _mismatch(g, bare, data, after.weights) for g in sorted(clear, key=lambda g: g.covariate.quantity not in own)
    ]
    told = [place for place, whole in places if not whole] or [place for place, _ in places]
    return tuple(told[:MOST_PLACES])


def _mismatch(judged: CovariateTest, bare: Fit, data: Data, weights: Weights) -> tuple[Mismatch, bool]:
    """Of one covariate, and whether it is all of that covariate, which says nothing."""
    where, share, table = where_of(judged, bare, data, weights)
    told = Mismatch("thrust", where, share, judged.p_value, says(where, share, judged.covariate.what))
    return told, where.low <= table[0][0] and where.high >= table[-1][0]


def curves_of(before: Estimate, after: Estimate, data: Data) -> tuple[Curves, ...]:
    old, _ = raw(before.fit.model, before.fit.theta, data, with_rate=False)
    new, _ = raw(after.fit.model, after.fit.theta, data, with_rate=False)
    return tuple(
        Curves(h.recording_id, h.sampled[r], h.driver[r], y, a, b)
        for h, r, y, a, b in zip(data.histories, data.rows, data.thrust, old, new, strict=True)
    )
