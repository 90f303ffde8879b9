"""A fit and what was found, in the words and figures of the answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any

import numpy as np

from identification.flexible_terms.flexible import Flexible
from identification.mismatch.diagnosis import Curves, Finding, RivalFinding
from identification.mismatch.estimate.confidence_intervals import Interval
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import Fit, raw
from identification.mismatch.estimate.rate_levels import rate_by_levels
from identification.mismatch.model.data import Data
from identification.mismatch.name.named_term import NamedTerm
from identification.mismatch.select.rounds import T
from identification.mismatch.select.stepwise import F, RivalTerm
from identification.mismatch.value import QUANTILE, Value, of_shape
from identification.physics.term import THERMOMETER, Term

Intervals = Mapping[Term, tuple[Interval, ...]]


def values_of(fitted: Fit, data: Data, known: Intervals | None = None) -> dict[str, Value]:
    """C, tares and all parameters of the terms with their standard errors, or their intervals where they are known.

    A tare could be anything within the reach of its run's readings.
    """
    std = fitted.std
    unit = data.scale.driver_unit
    out = {"C": Value(*constant_of(fitted, data), f"N/{unit}^2" if unit == "V" else "N s^2/rev^2")}
    at = fitted.layout
    for term, values in fitted.values.items():
        told = values_told(term, values, std[at.of(term)].tolist(), data.scale, (known or {}).get(term))
        told = of_shape(told) if isinstance(term, Flexible) else told
        out |= {f"{term.id}.{name}": value for name, value in told.items()}
    for run, (history, tare) in enumerate(zip(data.histories, fitted.theta.tares, strict=True)):
        reach = float(np.max(np.abs(data.thrust[run]), initial=0.0))
        key = "tare" if len(data.histories) == 1 else f"tare[{history.recording_id}]"
        out[key] = Value(tare, float(std[at.tare(run)]), "N", limits=(-reach, reach))
    return out


def constant_of(fitted: Fit, data: Data) -> tuple[float, float]:
    """C and its standard error, of the driver that the rotor makes a rate of, and of the motor as cold as it began.

    Where thrust follows the measured rate n in a share s, the model's own C is of the driver (1 - s) x + s n / k_0, k_0
    what the rate is per driver as it was recorded; with n = k x that is x (1 + s (k / k_0 - 1)).
    """
    C, std = _of_driver(fitted, data)
    return C, float(np.hypot(std, _by_cold(fitted, data)))


def _by_cold(fitted: Fit, data: Data) -> float:
    """How uncertain C is because the temperature is that it refers to: by what it would follow of the prediction."""
    error = data.scale.cold_error
    if not error or not any(THERMOMETER in term.needs for term in fitted.model.terms):
        return 0.0
    warmer = replace(data, scale=replace(data.scale, cold=data.scale.cold + error))
    (now, _), (then, _) = (raw(fitted.model, fitted.theta, each, with_rate=False) for each in (data, warmer))
    forces = [f - tare for f, tare in zip(now, fitted.theta.tares, strict=True)]
    moved = sum(float(f @ (g - h)) for f, g, h in zip(forces, then, now, strict=True))
    return abs(fitted.theta.C * moved) / sum(float(f @ f) for f in forces)


def _of_driver(fitted: Fit, data: Data) -> tuple[float, float]:
    """The same at the temperature that the thermometer began with."""
    C, at = fitted.theta.C, fitted.layout
    followed = [term for term in fitted.model.terms if term.traits.follows_rate]
    known = [h.rate_per_driver for h in data.histories if h.rate is not None]
    if not followed or not data.with_rate or not known:
        return C, float(fitted.std[at.C])
    (term, *_) = followed
    place = at.parameter(term, term.traits.follows_rate, data.scale)
    by_levels = rate_by_levels(fitted, data)
    k = fitted.theta.k if by_levels is None else by_levels[0]
    share, more = float(fitted.theta.vector[place]), k / known[0] - 1
    driven = 1 + share * more
    slopes = np.zeros(at.size)
    slopes[at.C], slopes[place] = driven**2, 2 * C * driven * more
    by_k = 2 * C * driven * share / known[0]
    slopes[at.k] = by_k if by_levels is None else 0.0
    beside = 0.0 if by_levels is None else by_k * by_levels[1]
    return C * driven**2, float(np.hypot(np.sqrt(slopes @ np.nan_to_num(fitted.cov) @ slopes), beside))


def values_told(
    term: T, theta: Sequence[float], std: Sequence[float], scale: Any, known: Sequence[Interval] | None = None
) -> dict[str, Value]:
    """Parameters of a term by name, from values and standard errors (p,), or from 95 % intervals where `known`."""
    told = term.parameters(scale)
    if known is None:
        triples = zip(told, theta, std, strict=True)
        return {p.name: Value(v, s, p.unit, limits=_limits(p), told=p.told) for p, v, s in triples}
    return {p.name: _within(v, p, i) for p, v, i in zip(told, theta, known, strict=True)}


def _within(value: float, known: Any, interval: Interval) -> Value:
    far = max(interval.high - value, value - interval.low)
    return Value(value, far / QUANTILE, known.unit, (interval.low, interval.high), _limits(known), known.told)


def _limits(known: Any) -> tuple[float, float] | None:
    """Of a parameter, a thruster's or a vehicle's; None where it may be any."""
    return (known.low, known.high) if isfinite(known.low) and isfinite(known.high) else None


def finding_of(named: NamedTerm[T, F], scale: Any, known: Mapping[T, tuple[Interval, ...]]) -> Finding:
    """Of any term, a thruster's or a vehicle's; `scale`: what its parameters refer to; `known`: intervals, if any."""
    values = values_told(named.term, named.theta, named.std, scale, known.get(named.term))
    lost = " and ".join(value.told or name.replace("_", " ") for name, value in values.items() if not value.determined)
    return Finding(
        named.term.id,
        named.term.form,
        named.term.statement(named.theta, scale) + (_undetermined(lost) if lost else ""),
        values,
        named.p_value,
        named.bic_gain,
        named.probability,
        tuple(_rival(r, scale) for r in named.rivals),
        None if named.attained is None else named.attained.share,
        None if named.attained is None else (named.attained.without, named.attained.with_it),
        named.failed_checks,
        named.searched,
        named.asked_effects,
    )


def _undetermined(lost: str) -> str:
    return f" The data do not determine its {lost}: what is told here is one value of many that do as well."


def _rival(rival: RivalTerm[T, F], scale: Any) -> RivalFinding:
    term, values = rival.term, rival.fit.values[rival.term]
    std = rival.fit.std[rival.fit.layout.of(term)].tolist()
    known = values_told(term, values, std, scale)
    return RivalFinding(term.id, term.form, known, rival.bic_loss, term.statement(values, scale))


def curves_of(before: Estimate, after: Estimate, data: Data) -> tuple[Curves, ...]:
    """Measured thrust of each run beside the thrust of two models, as a report draws it."""
    old, _ = raw(before.fit.model, before.fit.theta, data, with_rate=False)
    new, _ = raw(after.fit.model, after.fit.theta, data, with_rate=False)
    return tuple(
        Curves(h.recording_id, h.sampled[r], h.driver[r], y, a, b)
        for h, r, y, a, b in zip(data.histories, data.rows, data.thrust, old, new, strict=True)
    )
