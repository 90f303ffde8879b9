"""`thruster-rig-fit` version 1: the JSON of a fit. Keys are only ever added; numbers are finite or null."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from identification.estimation.verdicts import Significance, significance
from identification.recording import Floats
from identification.thruster.comparison import Difference
from identification.thruster.dynamics import UNITS, DynamicsFit
from identification.thruster.model_choice import Candidate, Remainder, statement
from identification.thruster.thrust import Parameter, ThrustFit
from identification.thruster.thrust_data import Unusable
from identification.thruster.thrust_report import verdicts
from rig.fit.answer import FIT_FORMAT, FIT_VERSION, Answer
from rig.fit.comparison import Alike, Changed, alike, coefficients


def number(value: float | None) -> float | None:
    """A number as JSON has it: null where it is not known or not finite."""
    return float(value) if value is not None and np.isfinite(value) else None


def matrix(array: Floats) -> list[list[float | None]]:
    """A matrix (n, m) as rows, what is not finite as null."""
    return [[number(value) for value in row] for row in array.tolist()]


def parameter_json(p: Parameter) -> dict[str, Any]:
    """A parameter with the parts of its standard error and its 95 % interval, all in `unit`."""
    return {
        "value": number(p.value),
        "std": number(p.std),
        "unit": p.unit,
        "std_statistical": number(p.std_statistical),
        "std_calibration": number(p.std_calibration),
        "std_internal": number(p.std_internal),
        "dof": number(p.dof),
        "interval_95": [number(p.low), number(p.high)],
        "std_uncorrected": number(p.std_uncorrected),
    }


def points_json(fit: ThrustFit) -> list[dict[str, Any]]:
    """Every steady point that a fit of points was made of: V, N, and the window in s."""
    out = []
    for run in fit.runs:
        for point in run.points.points if run.points is not None and fit.rmse_of == "points" else ():
            e = point.thrust
            numbers = {
                "voltage": point.voltage,
                "thrust": e.mean,
                "std_error": e.std_error,
                "n_effective": e.n_effective,
            }
            window = {"t_start": e.t_start, "t_end": e.t_end, "drift": e.drift, "drift_std": e.drift_std}
            known = {key: number(value) for key, value in (numbers | window).items()}
            out.append({"recording": run.recording_id, "n": e.n, "steady": point.steady, "phase": point.phase, **known})
    return out


def significance_json(found: Significance, plain: Significance | None = None) -> dict[str, Any]:
    """Eq. 4.11 with errors corrected for correlation, and `_uncorrected` as if samples were independent."""
    out = {
        "percent": number(found.percent),
        "threshold_percent": number(found.threshold),
        "significant": found.significant,
        "p": number(found.p_value),
    }
    if plain is not None:
        out |= {"percent_uncorrected": number(plain.percent), "significant_uncorrected": plain.significant}
    return out


def _significances(fit: ThrustFit) -> dict[str, Any]:
    dof = float(fit.estimate.fit.dof)
    return {
        name: significance_json(found, significance(found.value, fit.parameters[name].std_uncorrected, dof))
        for name, found in fit.significance.items()
    }


def fit_json(fit: ThrustFit) -> dict[str, Any]:
    """The stable keys first, then what more is known."""
    judged, solved = fit.estimate.underfit, fit.estimate.fit
    return {
        "thruster": fit.thruster,
        "recordings": list(fit.recordings),
        "model": fit.model,
        "parameters": {name: parameter_json(p) for name, p in fit.parameters.items()},
        "tare": {name: parameter_json(p) for name, p in fit.tare.items()},
        "rmse": number(fit.rmse),
        "chi2_per_dof": number(fit.chi2_per_dof),
        "rmse_of": fit.rmse_of,
        "n": int(fit.estimate.rows.y.size),
        "dof": solved.dof,
        "chi2_p": number(None if judged is None else judged.p_value),
        "underfit": None if judged is None else judged.underfitted,
        "birge_ratio": number(fit.estimate.birge_ratio),
        "excess_std": number(fit.estimate.excess_std),
        "sigma": number(fit.sigma),
        "whiteness_p": number(None if fit.whiteness is None else fit.whiteness.p_value),
        "difference_p": number(None if fit.difference is None else fit.difference.p_value),
        "singular_values": [number(s) for s in solved.singular_values],
        "condition": number(solved.condition),
        "voltage": fit.voltage_quantity,
        "unsteady_points": fit.unsteady,
        "skipped_samples": fit.skipped,
        "covariance": {
            "names": list(fit.names),
            "matrix": matrix(fit.cov),
            "statistical": matrix(fit.cov_statistical),
        },
        "significance": _significances(fit),
    }


def _candidate(found: Candidate) -> dict[str, Any]:
    return {
        "model": found.model,
        "parameters": found.parameters,
        "rmse": number(found.rmse),
        "chi2_per_dof": number(found.chi2_per_dof),
        "chi2_p": number(found.underfit_p),
        "whiteness_p": number(found.whiteness_p),
        "bic": number(found.bic),
        "insignificant": list(found.insignificant),
    }


def _remainder(found: Remainder) -> dict[str, Any]:
    return {
        "rmse": number(found.rmse),
        "chi2_per_dof": number(found.chi2_per_dof),
        "chi2_p": number(found.underfit_p),
        "parameters": {name: {"value": number(value), "std": number(std)} for name, value, std in found.others},
    }


def dynamics_json(found: DynamicsFit | Unusable) -> dict[str, Any]:
    """Of the rotor; `reason` alone where there is none."""
    if isinstance(found, Unusable):
        return {"reason": found.reason}
    names, beta = found.estimate.names, found.beta
    parameters = {
        name: {
            "value": number(found.estimate[name]),
            "std": number(found.estimate.std_of(name)),
            "unit": UNITS[name],
            "std_uncorrected": number(plain),
            "dof": number(found.dof[name]),
            "interval_95": [number(x) for x in found.interval(name)],
            "significance": significance_json(found.significance[name]),
        }
        for name, plain in zip(names, found.uncorrected.tolist(), strict=True)
    }
    return {
        "model": found.model,
        "parameters": parameters,
        "beta": {"value": number(beta[0]), "std": number(beta[1]), "unit": UNITS["beta"]},
        "covariance": {"names": list(names), "matrix": matrix(found.estimate.cov)},
        "rmse": number(found.rmse),
        "rmse_without_gamma": number(found.rmse_without_gamma),
        "whiteness_p": number(None if found.whiteness is None else found.whiteness.p_value),
        "levels": [
            {
                "voltage": number(level.voltage),
                "rate": number(level.rate),
                "model_rate": number(level.model_rate),
                "time_constant": number(level.time_constant),
                "std": number(level.std),
            }
            for level in found.levels
        ],
        "offset": None if found.offset is None else number(found.offset.value),
        "offset_p": None if found.offset is None else number(found.offset.p_value),
    }


def difference_json(d: Difference) -> dict[str, Any]:
    """One coefficient of one side against the other."""
    return {
        "first": d.first,
        "second": d.second,
        "coefficient": d.coefficient,
        "difference": number(d.value),
        "std": number(d.std),
        "interval_95": [number(d.low), number(d.high)],
        "relative": number(d.relative),
        "relative_interval_95": [number(d.relative_low), number(d.relative_high)],
        "p": number(d.p_value),
    }


def alike_json(found: Alike) -> dict[str, Any]:
    """Are the thrusters of this fit the same?"""
    repeat = found.repeat
    return {
        "thrusters": [group.name for group in found.groups],
        "coefficients": list(found.groups[0].coefficients),
        "shared_calibration": found.shared,
        "F": number(found.test.F),
        "dof": number(found.test.dof),
        "dof_error": number(found.test.dof_error),
        "p": number(found.test.p_value),
        "differ": found.test.differ,
        "common": [number(x) for x in found.test.common],
        "different_thrusters": list(found.odd),
        "rest_p": None if found.rest is None else number(found.rest.p_value),
        "pairs": [difference_json(d) for d in found.pairs],
        "repeatability": None
        if repeat is None
        else {"relative_std": number(repeat.std), "dof": number(repeat.dof), "p": number(repeat.p_value)},
    }


def changed_json(found: Changed) -> dict[str, Any]:
    """Against an earlier fit."""
    both = zip(found.changes, found.shared, strict=True)
    return {
        "earlier": found.source,
        "changes": [
            {
                "thruster": c.difference.second,
                **{k: v for k, v in difference_json(c.difference).items() if k not in {"first", "second"}},
                "p_adjusted": number(c.adjusted_p),
                "changed": c.changed,
                "smallest_seen": number(c.smallest),
                "shared_calibration": shared,
            }
            for c, shared in both
        ],
        "notes": list(found.notes),
    }


def _entry(answer: Answer) -> dict[str, Any]:
    entry = fit_json(answer.fit)
    cells = {run.calibration for run in answer.fit.runs}
    entry["points"] = points_json(answer.fit)
    entry["verdicts"] = [*verdicts(answer.fit, answer.alternatives), *answer.notes]
    entry["alternatives"] = [fit_json(other) for other in answer.alternatives]
    entry["calibration"] = cells.pop() if len(cells) == 1 else ""
    entry["models"] = [_candidate(found) for found in answer.candidates]
    entry["models_say"] = statement(answer.candidates) if answer.candidates else None
    entry["without"] = {found.dropped: _remainder(found) for found in answer.remainders}
    entry["dynamics"] = None if answer.dynamics is None else dynamics_json(answer.dynamics)
    return entry


def answer_json(answers: Sequence[Answer], changes: Iterable[Changed] = ()) -> dict[str, Any]:
    """One entry per thruster with the model asked for, others under `alternatives`; then all thrusters together."""
    names, found, cov = coefficients(answers)
    same = alike(answers)
    return {
        "format": FIT_FORMAT,
        "version": FIT_VERSION,
        "fits": [_entry(answer) for answer in answers],
        "coefficients": {
            "names": list(names),
            "values": [number(p.value) for p in found],
            "units": [p.unit for p in found],
            "covariance": matrix(cov),
        },
        "comparison": None if same is None else alike_json(same),
        "changes": [changed_json(one) for one in changes],
    }
