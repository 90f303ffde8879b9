"""What `rig vehicle` found, as text for a person and as JSON for a program."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from identification.estimation.maximum_likelihood import Gaussian
from identification.thruster.thrust_data import Unusable
from identification.thruster.thrust_report import digits
from identification.vehicle.campaign import AxisResult
from identification.vehicle.inertia import InertiaFit
from identification.vehicle.replay import Replay
from identification.vehicle.report import Row, rows
from identification.vehicle.steady_drag import DragFit
from rig.vehicle.answer import VehicleAnswer

RAN_AWAY = "runs away: the drag that was identified is negative there"
LEARNT = 0.5
"""Share of the earlier standard deviation below which these trials have told more than the calibration had."""
NAMES = 18
"""Least width of the column of names."""
FORM = "  {:<{width}}{:>12}{:>11}{:>12}{:>12}  {:<15}{}"


def answer_text(answer: VehicleAnswer) -> str:
    """Per axis a sentence, the table, the verdicts; then simulations, recordings held out and other estimators."""
    lines = [_head(answer)]
    for axis, result in answer.fit.axes.items():
        lines += ["", f"{axis.upper()}: {_axis_sentence(result)}"]
        estimate = result.estimate
        if estimate is not None:
            lines += _table((*rows(estimate, axis), *_learnt(answer, axis, estimate)))
        lines += [f"  - {text}" for text in _verdicts(result)]
        lines += list(_replay_lines(answer.replays.get(axis, ()), axis))
        lines += list(_rival_lines(answer, axis))
    lines += list(_held_out_lines(answer))
    unused = [f"{name} was not used: no thruster of the installation is driven in it" for name in answer.fit.unused]
    if answer.notes or unused:
        lines += ["", *(f"note: {text}" for text in (*answer.notes, *unused))]
    return "\n".join(lines)


def _learnt(answer: VehicleAnswer, axis: str, estimate: Gaussian) -> list[Row]:
    """Thruster coefficients that the trials tell better than what was known before them."""
    before = dict(zip(answer.installation.names, np.sqrt(np.diag(answer.installation.cov)), strict=True))
    return [row for row in rows(estimate, axis, calibration=True) if row.std < LEARNT * before[row.name]]


def _head(answer: VehicleAnswer) -> str:
    etas = ", ".join(answer.installation.etas) or "none"
    return (
        f"{answer.vehicle or 'vehicle'}: {len(answer.recordings)} recordings, "
        f"{len(answer.installation.thrusters)} thrusters, efficiencies asked for: {etas}"
    )


def _axis_sentence(result: AxisResult) -> str:
    drag, inertia = result.drag, result.inertia
    if isinstance(drag, Unusable):
        first = _without(drag.reason, result.axis)
    else:
        first = f"drag and efficiency from {len(drag.runs)} constant-velocity runs"
    if isinstance(inertia, Unusable):
        return f"{first}; {_without(inertia.reason, result.axis)}"
    return f"{first}; inertia from {len(result.moving)} trial{'s' * (len(result.moving) != 1)} by {inertia.method}"


def _without(text: str, axis: str) -> str:
    return text.removeprefix(f"{axis}: ")


def _table(found: Sequence[Row]) -> list[str]:
    """A head and a line per parameter."""
    width = max([NAMES, *(len(row.name) + 1 for row in found)])
    head = FORM.format("", "value", "std", "95 % from", "to", "unit", "", width=width)
    lines = [head]
    for row in found:
        numbers = [digits(x, row.std) if row.determined else "-" for x in (row.value, row.std, row.low, row.high)]
        lines.append(FORM.format(row.name, *numbers, row.unit, row.verdict, width=width))
    return [line.rstrip() for line in lines]


def _verdicts(result: AxisResult) -> list[str]:
    """Of both steps, each once."""
    found = [_without(text, result.axis) for text in result.contradictions]
    found += [
        _without(text, result.axis)
        for step in (result.drag, result.inertia)
        if not isinstance(step, Unusable)
        for text in step.verdicts
    ]
    return list(dict.fromkeys(found))


def unit_of_response(axis: str, quantity: str) -> str:
    """Of what was measured on an axis."""
    angle = axis == "yaw"
    if quantity == "speed":
        return "rad/s" if angle else "m/s"
    return "rad" if angle else "m"


def _replay_lines(found: tuple[Replay, ...], axis: str) -> Iterator[str]:
    if found:
        yield "  simulated with what was identified, against what was measured:"
    for one in found:
        check = one.validation
        unit = unit_of_response(axis, one.quantity)
        said = RAN_AWAY if one.ran_away else f"{check.rmse:>9.3g} {unit:<6} rms, fit {check.fit:6.2f} %"
        yield f"    {one.recording_id:<24}{said}"


def _rival_lines(answer: VehicleAnswer, axis: str) -> Iterator[str]:
    rivals = answer.comparators.get(axis, ())
    ours = answer.fit.axes[axis].inertia
    if not rivals:
        return
    yield "  inertia by other ways:"
    for one in (ours, *rivals):
        if isinstance(one, Unusable):
            yield f"    {_without(one.reason, axis)}"
        else:
            m, std = one.estimate["m"], one.estimate.std_of("m")
            yield f"    {one.method:<36}m = {digits(m, std)} ± {digits(std, std)}, simulated {rms_of(one):.3g} rms"


def rms_of(fit: InertiaFit) -> float:
    """Root mean square of the simulation error over its trials."""
    return float(np.sqrt(np.mean([one.rmse**2 for one in fit.validation])))


def _held_out_lines(answer: VehicleAnswer) -> Iterator[str]:
    found = answer.held_out
    if not found:
        return
    yield ""
    yield "HELD OUT (not fitted; simulated from the commands and how the recording began):"
    for one in found:
        unit = unit_of_response(one.axis, one.replay.quantity)
        line = f"  {one.name:<24}{one.axis:<7}{_off(one.replay, unit)}"
        if one.without is not None:
            line += f"; without efficiencies {_off(one.without, unit)}"
        yield f"{line}; {one.note}" if one.note else line
    for result in answer.without.axes.values() if answer.without is not None else ():
        yield from (f"  - without efficiencies, {text}" for text in result.contradictions)


def _off(one: Replay, unit: str) -> str:
    return RAN_AWAY if one.ran_away else f"{one.validation.rmse:.3g} {unit} rms"


def _number(value: float | None) -> float | None:
    return float(value) if value is not None and np.isfinite(value) else None


def _row_json(row: Row) -> dict[str, Any]:
    return {
        "value": _number(row.value) if row.determined else None,
        "std": _number(row.std),
        "unit": row.unit,
        "interval_95": [_number(row.low), _number(row.high)],
        "determined": row.determined,
        "verdict": row.verdict,
    }


def _parameters_json(estimate: Gaussian, axis: str, calibration: bool = False) -> dict[str, Any]:
    return {row.name: _row_json(row) for row in rows(estimate, axis, calibration)}


def _drag_json(drag: DragFit | Unusable) -> dict[str, Any]:
    if isinstance(drag, Unusable):
        return {"reason": drag.reason}
    runs = [
        {
            "recording": run.recording_id,
            "t_start": _number(run.t_start),
            "t_end": _number(run.t_end),
            "force": _number(float(run.force.nominal()[0])),
            "velocity": _number(run.velocity),
            "std": _number(run.std),
            "predicted": _number(float(predicted)),
            "straight": run.straight,
        }
        for run, predicted in zip(drag.runs, drag.predicted, strict=True)
    ]
    return {
        "parameters": _parameters_json(drag.estimate, drag.axis),
        "thrusters": _parameters_json(drag.estimate, drag.axis, calibration=True),
        "chi2": _number(drag.maximum.chi2),
        "dof": drag.maximum.dof,
        "chi2_p": _number(drag.underfit.p_value),
        "underfit": bool(drag.underfit.underfitted),
        "excess_std": _number(drag.excess_std),
        "runs": runs,
    }


def _inertia_json(fit: InertiaFit | Unusable, axis: str) -> dict[str, Any]:
    if isinstance(fit, Unusable):
        return {"reason": fit.reason}
    return {
        "method": fit.method,
        "parameters": _parameters_json(fit.estimate, axis),
        "thrusters": _parameters_json(fit.estimate, axis, calibration=True),
        "noise_std": [_number(std) for std in fit.noise_std],
        "whiteness_p": [None if w is None else _number(w.p_value) for w in fit.whiteness],
        "simulation_rms": _number(rms_of(fit)),
    }


def _replay_json(one: Replay | None, axis: str) -> dict[str, Any] | None:
    if one is None:
        return None
    check = one.validation
    unit = unit_of_response(axis, one.quantity)
    return {
        "recording": one.recording_id,
        "quantity": one.quantity,
        "unit": unit,
        "ran_away": one.ran_away,
        "rmse": None if one.ran_away else _number(check.rmse),
        "fit_percent": None if one.ran_away else _number(check.fit),
    }


def _axis_json(answer: VehicleAnswer, axis: str, result: AxisResult) -> dict[str, Any]:
    estimate = result.estimate
    names = () if estimate is None else estimate.names
    covariance = [] if estimate is None else [[_number(x) for x in row] for row in estimate.cov]
    return {
        "parameters": {} if estimate is None else _parameters_json(estimate, axis),
        "covariance": {"names": list(names), "matrix": covariance},
        "drag": _drag_json(result.drag),
        "inertia": _inertia_json(result.inertia, axis),
        "verdicts": _verdicts(result),
        "simulation": [_replay_json(one, axis) for one in answer.replays.get(axis, ())],
        "comparators": [_inertia_json(one, axis) for one in answer.comparators.get(axis, ())],
    }


def answer_json(answer: VehicleAnswer) -> dict[str, Any]:
    """`thruster-rig-vehicle` version 1. Numbers are finite or null."""
    places = {
        one.recording_id: (axis, step)
        for axis, group in answer.fit.trials.items()
        for step, recordings in (("steady", group.steady), ("moving", group.moving))
        for one in recordings
    }
    return {
        "format": "thruster-rig-vehicle",
        "version": 1,
        "vehicle": answer.vehicle,
        "recordings": [
            {
                "name": one.name,
                "file": one.path.name,
                "recording_id": one.uuid,
                "axis": places.get(one.name, (None, None))[0],
                "step": places.get(one.name, (None, None))[1],
            }
            for one in answer.recordings
        ],
        "thrusters": {t.name: {"arms": dict(t.arms)} for t in answer.installation.thrusters},
        "efficiencies": list(answer.installation.etas),
        "axes": {axis: _axis_json(answer, axis, result) for axis, result in answer.fit.axes.items()},
        "held_out": [
            {
                "axis": one.axis,
                "with_efficiency": _replay_json(one.replay, one.axis),
                "without_efficiency": _replay_json(one.without, one.axis),
                "note": one.note,
            }
            for one in answer.held_out
        ],
        "notes": list(answer.notes),
    }
