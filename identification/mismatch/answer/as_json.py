"""The answer as one JSON object, `thruster-rig-diagnosis` version 1; its keys: docs/howto/diagnosis-json.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite

from identification.mismatch.diagnosis import Diagnosis, Finding, NextExperiment
from identification.mismatch.unexplained import FlexibleShape, FormulaFound, Remainder
from identification.mismatch.value import Value, Where


def diagnosis_json(d: Diagnosis) -> dict[str, object]:
    """`thruster-rig-diagnosis` version 1, see docs/howto/diagnose.md."""
    return {
        "format": "thruster-rig-diagnosis",
        "version": 1,
        "recordings": list(d.recordings),
        "thruster": d.thruster,
        "response": {"quantity": d.response, "unit": d.unit, "force_unit": d.force_unit},
        "verdict": d.verdict,
        "headline": d.headline,
        "statement": d.statement,
        "baseline": {"model": d.baseline_model, "parameters": _values(d.baseline)},
        "mismatch": [
            {
                "channel": m.channel,
                "where": _where(m.where),
                "share": _number(m.share),
                "p_value": _number(m.p_value),
                "statement": m.statement,
            }
            for m in d.mismatch
        ],
        "findings": [_finding(f) for f in d.findings],
        "unexplained": None if d.unexplained is None else _unexplained(d.unexplained),
        "model": {
            "terms": list(d.model_terms),
            "parameters": _values(d.model),
            "calibration_std": _number(d.gain_std) if d.gain_std else None,
            "equations": [{"effect": e.effect or None, "line": e.line} for e in d.equations],
        },
        "fit": {
            "train": {"rmse_before": _number(d.train.before), "rmse_after": _number(d.train.after)},
            "heldout": {
                "rmse_before": _number(d.heldout.before),
                "rmse_after": _number(d.heldout.after),
                "noise": _number(d.heldout.noise),
                "what": d.heldout.what,
                "growth_p": _number(d.heldout.growth_p),
                "whitened_fall": _number(d.heldout.whitened_fall),
            },
            "chi2_per_dof": _number(d.chi2_per_dof),
            "whiteness_p": _number(d.whiteness_p),
            "named_share": None if d.named_share is None else _number(d.named_share),
        },
        "next_experiment": None if d.next_experiment is None else _next_experiment(d.next_experiment),
        "notes": list(d.notes),
    }


def _number(x: float) -> float | None:
    return float(x) if isfinite(x) else None


def _values(values: Mapping[str, Value]) -> dict[str, object]:
    out: dict[str, object] = {}
    for name, v in values.items():
        low, high = v.interval
        told = {"value": _number(v.value), "std": _number(v.std), "low": _number(low), "high": _number(high)}
        out[name] = {**told, "unit": v.unit, "determined": v.determined}
    return out


def _next_experiment(e: NextExperiment) -> dict[str, object]:
    steps = [{e.quantity: s.command_voltage, "duration": s.duration, "flow_speed": s.flow_speed} for s in e.steps]
    return {"why": e.why, "steps": steps, "expected_power": _number(e.expected_power)}


def _where(w: Where) -> dict[str, object]:
    return {"quantity": w.quantity, "from": _number(w.low), "to": _number(w.high), "unit": w.unit}


def _finding(f: Finding) -> dict[str, object]:
    return {
        "effect": f.effect,
        "form": f.form,
        "statement": f.statement,
        "parameters": _values(f.parameters),
        "p_value": _number(f.p_value),
        "searched": f.searched,
        "bic_gain": _number(f.bic_gain),
        "probability": _number(f.probability),
        "asked": f.asked,
        "share": None if f.share is None else _number(f.share),
        "grade": f.grade,
        "in_measurement": f.in_measurement,
        "heldout": None
        if f.heldout is None
        else {"rmse_without": _number(f.heldout[0]), "rmse_with": _number(f.heldout[1])},
        "doubts": list(f.doubts),
        "channels": list(f.channels),
        "recording": f.recording or None,
        "since": f.since or None,
        "before": _values(f.before),
        "rivals": [r.effect for r in f.rivals],
        "rival_details": [
            {
                "effect": r.effect,
                "form": r.form,
                "parameters": _values(r.parameters),
                "bic_loss": _number(r.bic_loss),
                "statement": r.statement,
            }
            for r in f.rivals
        ],
    }


def _unexplained(u: Remainder) -> dict[str, object]:
    return {
        "where": _where(u.where),
        "share": _number(u.share),
        "p_value": _number(u.p_value),
        "shape": [
            {"at": _number(a), "residual": _number(b), "std": _number(c), "determined": bool(known)}
            for (a, b, c), known in zip(u.shape, u.told, strict=True)
        ],
        "statement": u.statement,
        "resembles": list(u.resembles),
        "equals": list(u.equals),
        "flexible": _flexible(u.flexible, u.replaces, u.heldout_without),
        "formula": None if u.formula is None else _formula(u.formula),
        "unpredictive": u.unpredictive,
    }


def _flexible(
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
        "coefficients": _plain_values(f.coefficients),
        "table": [
            {
                "at": _number(at),
                "times": s.times,
                "value": _number(value),
                "measured": _number(measured),
                "measured_std": _number(std),
                "value_unit": s.unit,
                "determined": bool(known),
            }
            for s in f.splines
            for (at, value, measured, std), known in zip(s.table, s.told, strict=True)
        ],
        "statement": f.statement,
    }


def _formula(f: FormulaFound) -> dict[str, object]:
    return {
        "text": f.text,
        "symbols": f.symbols,
        "coefficients": _plain_values(f.coefficients),
        "bic_gain": _number(f.bic_gain),
        "heldout": {"rmse_before": _number(f.heldout_before), "rmse_after": _number(f.heldout_after)},
        "halves_p": _number(f.halves_p),
        "equals": list(f.equals),
    }


def _plain_values(values: Mapping[str, Value]) -> dict[str, object]:
    return {
        k: {"value": _number(v.value), "std": _number(v.std), "unit": v.unit, "determined": v.determined}
        for k, v in values.items()
    }
