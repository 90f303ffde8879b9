"""What is modelled without being explained: flexible terms and formulas, as data and as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

from identification.recording import Floats

if TYPE_CHECKING:  # the diagnosis holds what is here
    from identification.mismatch.diagnosis import Value


@dataclass(frozen=True, eq=False)
class Spline:
    """What a flexible term multiplies by, over its covariate."""

    times: str
    """`force` (1), `gain` (thrust), `even` (|thrust|), `step` (change of thrust), `rate` (|drive|) or `drive`."""
    what: str
    """The same as a clause."""
    unit: str
    at: Floats
    value: Floats
    std: Floats
    """The curve, (n,) each."""
    table: tuple[tuple[float, float, float, float], ...]
    """(covariate, value of the spline, value measured there, its standard error) bin by bin."""


@dataclass(frozen=True, eq=False)
class FlexibleShape:
    """A flexible term of the final model: a spline over a covariate, no physics."""

    covariate: str
    unit: str
    knots: tuple[float, ...]
    degree: int
    memory: float
    """s, of load_history; otherwise 0."""
    period: float
    """s after which a spline over time begins anew; 0: never."""
    coefficients: Mapping[str, Value]
    splines: tuple[Spline, ...]
    statement: str


@dataclass(frozen=True, eq=False)
class FormulaFound:
    """A formula that agrees with held-out data and in both halves; a formula, not a physics."""

    text: str
    """`residual = ...`"""
    symbols: str
    """What its symbols stand for: `T_w: water_temperature`."""
    coefficients: Mapping[str, Value]
    bic_gain: float
    heldout_before: float
    heldout_after: float
    """RMSE per sample on what was not fitted, without and with the formula alone, N."""
    halves_p: float
    """p-value of the same coefficients in both halves."""
    equals: tuple[str, ...] = ()
    """Other formulas that do about as well."""


def flexible_json(
    flexible: Sequence[FlexibleShape], replaces: Sequence[str], without: float | None
) -> dict[str, object] | None:
    """The first flexible term, further ones under `more`. `without`: held-out RMSE without them, N."""
    if not flexible:
        return None
    first, *more = map(_flexible_shape, flexible)
    return {
        **first,
        "more": more,
        "replaces": list(replaces),
        "heldout_rmse_without": None if without is None else _number(without),
    }


def _flexible_shape(f: FlexibleShape) -> dict[str, object]:
    return {
        "covariate": f.covariate,
        "unit": f.unit,
        "knots": list(f.knots),
        "degree": f.degree,
        "memory": f.memory,
        "period": f.period,
        "coefficients": _values(f.coefficients),
        "table": [
            {
                "at": _number(at),
                "times": s.times,
                "value": _number(value),
                "measured": _number(measured),
                "measured_std": _number(std),
                "value_unit": s.unit,
            }
            for s in f.splines
            for at, value, measured, std in s.table
        ],
        "statement": f.statement,
    }


def formula_json(f: FormulaFound) -> dict[str, object]:
    return {
        "text": f.text,
        "symbols": f.symbols,
        "coefficients": _values(f.coefficients),
        "bic_gain": _number(f.bic_gain),
        "heldout": {"rmse_before": _number(f.heldout_before), "rmse_after": _number(f.heldout_after)},
        "halves_p": _number(f.halves_p),
        "equals": list(f.equals),
    }


def _number(x: float) -> float | None:
    return float(x) if isfinite(x) else None


def _values(values: Mapping[str, Value]) -> dict[str, object]:
    return {k: {"value": _number(v.value), "std": _number(v.std), "unit": v.unit} for k, v in values.items()}
