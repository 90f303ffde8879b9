"""The run that tells two explanations of a vehicle's motion apart best: a few plans, each foreseen by both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.diagnosis import NextExperiment, PlanStep
from identification.mismatch.next_experiment.discrimination import needed, power
from identification.mismatch.next_experiment.predicted_response import (
    PredictedResponse,
    inverse_information,
    known_from_bounds,
)
from identification.mismatch.noise.covariance import Noise, Rows, Whitener
from identification.mismatch.select.stepwise import RivalTerm
from identification.mismatch.vehicle.fitting import Fit
from identification.mismatch.vehicle.model import on_other_runs, predict
from identification.mismatch.vehicle.naming import Named
from identification.mismatch.vehicle.runs import Prepared, Run
from identification.mismatch.vehicle.search import State
from identification.physics.vehicle.term import VehicleTerm

BUDGET = 300.0
"""s of a proposed run, as of a thruster's sweep."""
MOORED = (
    "moor the vehicle to a force gauge and run these steps: the steady pull is the thrust as installed, which no free "
    "run tells from the mass"
)


def propose(state: State, named: Sequence[Named], data: Prepared) -> NextExperiment | None:
    """For the finding whose nearest rival is nearest."""
    pairs = [(n, r) for n in named for r in n.rivals if r.bic_loss < policy.select.RIVALS_EQUAL_BIC]
    if not pairs:
        return None
    finding, rival = min(pairs, key=lambda pair: pair[1].bic_loss)
    top = data.scale.volts
    found = [(decides(steps, state, rival, data), steps) for steps in plans(top)]
    best, steps = max(found, key=lambda one: one[0])
    why = f"separates {finding.term.id} from {rival.term.id}"
    if best < policy.vehicle.VEHICLE_SWEEP_POWER:
        why = f"{MOORED} ({finding.term.id} or {rival.term.id})"
        steps = tuple(PlanStep(sign * share * top, 20.0) for share in (0.4, 0.7, 1.0) for sign in (1, -1))
    return NextExperiment(why, steps, best)


def plans(top: float) -> tuple[tuple[PlanStep, ...], ...]:
    """Holds of both signs; fine levels round zero; quick reversals; one way and back."""

    def of(levels: Sequence[float], each: float) -> tuple[PlanStep, ...]:
        return tuple(PlanStep(share * top, each) for share in levels)

    return (
        of([s * level for level in (0.3, 0.5, 0.7, 0.85, 1.0) for s in (1, -1)], BUDGET / 10),
        of([s * level for level in (0.04, 0.08, 0.12, 0.16, 0.22, 0.3) for s in (1, -1)], BUDGET / 12),
        of([1.0, -1.0] * 15, BUDGET / 30),
        of([0.6, 0.0, 1.0, 0.0, 0.3, 0.0], BUDGET / 6),
        of([1.0, -1.0], BUDGET / 2),
    )


def decides(steps: Sequence[PlanStep], state: State, rival: RivalTerm[VehicleTerm, Fit], data: Prepared) -> float:
    """Probability that a run of these steps decides rightly between a model and its rival, the worse of both ways."""
    one, other = (foreseen(steps, fitted, state.noise, data) for fitted in (state.fit, rival.fit))
    more, rows, new = rival.fit.theta.size - state.fit.theta.size, state.fit.residual.size, one.value.size
    return min(
        power(one, other, needed(rival.bic_loss, more, rows, new)),
        power(other, one, needed(-rival.bic_loss, -more, rows, new)),
    )


def foreseen(steps: Sequence[PlanStep], fitted: Fit, noise: Noise, data: Prepared) -> PredictedResponse:
    """What a model says of a run of these steps, from rest, and what the data in hand and its own start leave open."""
    run, old = _planned(steps, data), fitted.layout
    there = replace(data, runs=(run,))
    layout, theta = on_other_runs(old, there, fitted.theta)
    theta[layout.starts :] = 0.0
    found = predict(layout, theta, there, 0, None, slopes=True)
    white = Whitener(noise, run.rows, np.zeros(run.time.size))
    known, free = known_from_bounds(*old.bounds()), fitted.free
    inside = np.zeros((old.size, old.size))
    inside[np.ix_(free, free)] = inverse_information(fitted.jacobian[:, free], known[free])
    cov = np.diag([0.0] * layout.starts + [data.scale.speed**2, data.scale.length**2])
    cov[: old.starts, : old.starts] = inside[: old.starts, : old.starts]
    return PredictedResponse(white.whiten(found.response), white.whiten(found.slopes), cov)


def _planned(steps: Sequence[PlanStep], data: Prepared) -> Run:
    """All thrusters that push, at these volts, measured as the first run was."""
    like = data.runs[0]
    moment = like.moment
    ends = np.cumsum([s.duration for s in steps])
    g = int(np.ceil(ends[-1] / moment.step))
    looks = moment.volts.shape[2]
    fine = (np.arange(g * looks) + 0.5) * moment.step / looks
    level = np.array([s.command_voltage for s in steps])[np.minimum(np.searchsorted(ends, fine), len(steps) - 1)]
    each = {
        t.name: (np.sign(arm) * level).reshape(g, looks)
        for t, arm in zip(like.installation.thrusters, like.arms, strict=True)
    }
    names = list(each)
    active = {
        name: np.array(
            [
                np.any([i.active(t, each) for i in like.installation.interactions if i.name == name], axis=0)
                for t in names
            ]
        )
        for name in moment.active
    }
    spacing = float(np.median(np.diff(like.time)))
    time = np.asarray(np.arange(int(ends[-1] / spacing) + 1) * spacing, dtype=np.float64)
    one = np.ones(time.size)
    heading = np.full(g, float(moment.heading[0]) if moment.heading.size else np.nan)
    new = replace(moment, volts=np.array([each[name] for name in names]), active=active, heading=heading)
    return replace(like, time=time, response=0 * time, rows=Rows(time, one, one, spacing * one), start=0.0, moment=new)
