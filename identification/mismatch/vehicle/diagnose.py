"""Recordings of a vehicle in, diagnosis out: locate, name, refit, judge."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.answer.report_assembly import finding_of
from identification.mismatch.answer.verdict import decided
from identification.mismatch.diagnosis import Diagnosis, HeldOutRmse, Mismatch, NextExperiment, Rmse
from identification.mismatch.name.named_term import Check, restated
from identification.mismatch.prepare.preparing import Refusal
from identification.mismatch.select.stepwise import pruned
from identification.mismatch.unexplained import Remainder
from identification.mismatch.vehicle.answering import (
    baseline_words,
    curves_of,
    place_of_findings,
    places_of,
    state_whiteness,
    ties,
    unexplained_of,
    values_of,
)
from identification.mismatch.vehicle.experiment import propose
from identification.mismatch.vehicle.free_force import Left, free_force_of, judge_left, with_free_force
from identification.mismatch.vehicle.judging import better_predicting, held_out, only, residuals, rms
from identification.mismatch.vehicle.naming import Named, name
from identification.mismatch.vehicle.runs import Prepared, prepare
from identification.mismatch.vehicle.screening import applicable
from identification.mismatch.vehicle.search import State, Vehicle, search
from identification.mismatch.vehicle.setup import VehicleSetup, axis_of, straight_ahead
from identification.recording import Recording

NO_SETUP = VehicleSetup()


def diagnose_vehicle(
    recordings: Sequence[Recording],
    holdout: Sequence[Recording] = (),
    seed: int = 0,
    setup: VehicleSetup = NO_SETUP,
    without: Collection[str] = (),
) -> Diagnosis | Refusal:
    """What m v' = -k2 |v| v + thrusters leaves out of recordings of one axis of one vehicle.

    `setup`: the thrusters as mounted with their models, the mass, ballasts; `without`: effect ids out of the catalogue.
    """
    wrong = _unfit(recordings, holdout)
    if wrong is not None:
        return wrong
    everything = [*recordings, *holdout]
    installation = setup.installation or straight_ahead(everything)
    if isinstance(installation, Refusal):
        return installation
    axis = axis_of(everything, installation, setup)
    if isinstance(axis, Refusal):
        return axis
    whole = prepare(everything, installation, axis, setup)
    if isinstance(whole, Refusal):
        return whole
    data = only(whole, whole.runs[: len(recordings)])
    unseen = only(whole, whole.runs[len(recordings) :]) if holdout else None
    candidates, not_told = applicable(data, tuple(without))
    found = _judged(Vehicle(data, candidates), unseen, np.random.default_rng(seed))
    return _diagnosed(recordings, data, found, not_told)


def _unfit(recordings: Sequence[Recording], holdout: Sequence[Recording]) -> Refusal | None:
    if not recordings:
        return Refusal("no recording was given")
    everything = [*recordings, *holdout]
    other = next((r for r in everything if r.kind != "vehicle"), None)
    if other is not None:
        who = other.source or other.recording_id
        return Refusal(f"{who} is a {other.kind} recording, the others are of a vehicle; diagnose them apart")
    vehicles = {r.thruster for r in everything}
    if len(vehicles) > 1:
        return Refusal(f"recordings of several vehicles ({', '.join(sorted(vehicles))}); diagnose one at a time")
    if len({r.recording_id for r in everything}) < len(everything):
        return Refusal("the same recording was given twice")
    return None


@dataclass(frozen=True, eq=False)
class _Judged:
    """What a search came to, and how it does on what was not fitted."""

    before: State
    last: State
    held: HeldOutRmse
    places: tuple[Mismatch, ...]
    earned: tuple[Named, ...]
    unexplained: Remainder | None
    experiment: NextExperiment | None


def _judged(vehicle: Vehicle, unseen: Prepared | None, rng: np.random.Generator) -> _Judged:
    """Locate, name, refit with a free force for what is left, and keep of it what predicts."""
    data = vehicle.data
    before, found = search(vehicle, rng)
    after, named = name(found, vehicle)
    left = judge_left(after.fit, after.white, data, rng)
    held, last = held_out(before, after, data, unseen), after
    if left.p_value < policy.locate.RESIDUAL_FALSE_ALARM:
        free = pruned(vehicle, with_free_force(after, data, left.structures[0]))
        held, last = better_predicting(before, (held, after), free, data, unseen)
    standing = [_beside(n, last, left) for n in named]
    unearned = [n for n in standing if n.failed_checks]
    unnamed = [n.term for n in unearned if n.term in last.terms]
    if unnamed:
        held, last = better_predicting(before, (held, last), vehicle.less(last, unnamed), data, unseen)
    earned = tuple(_beside(n, last, left) for n in standing if not n.failed_checks)
    doubtful = [n for n in unearned if not n.only_unpaid]
    unexplained = unexplained_of(_as_fitted(left, last), doubtful, data)
    experiment = propose(after, earned, data) if unexplained is None else None
    return _Judged(before, last, held, _places(before, after, data, left, rng), earned, unexplained, experiment)


def _diagnosed(recordings: Sequence[Recording], data: Prepared, found: _Judged, unseen: Sequence[str]) -> Diagnosis:
    """The answer in the words and units of this vehicle; `unseen`: sentences about effects that cannot be told."""
    before, last = found.before, found.last
    findings = tuple(finding_of(n, data.scale, {}) for n in restated(found.earned, last.fit))
    n, p = last.fit.residual.size, int(np.sum(last.fit.free))
    unit = _unit(data)
    return Diagnosis(
        recordings=tuple(r.recording_id for r in recordings),
        thruster=recordings[0].thruster,
        answer=decided(findings, found.unexplained, found.experiment, found.held, found.places, unit),
        baseline_model=baseline_words(data),
        baseline=values_of(before.fit, data),
        mismatch=found.places,
        model_terms=tuple(term.id for term in last.terms),
        model=values_of(last.fit, data),
        train=Rmse(rms(residuals(before.fit, data)), rms(residuals(last.fit, data))),
        heldout=found.held,
        chi2_per_dof=last.fit.chi2 / max(n - p, 1),
        whiteness_p=state_whiteness(last),
        notes=(*ties(data, last.fit, unseen), *_noise_note(last, data)),
        curves=curves_of(before.fit, last.fit, data),
        response=_channel(data),
        unit=unit,
        force_unit=data.scale.force_unit,
    )


def _beside(n: Named, last: State, left: Left) -> Named:
    """A name beside the free force: where the term stands now, or what took its place."""
    if n.term in last.terms:
        return n
    instead = f"a free force over {left.structures[0].covariate.quantity} takes its place"
    return n.asked(Check("repair", "stands beside a free force", instead))


def _as_fitted(left: Left, last: State) -> Left:
    """The clearest structure with the free force as it was fitted, everything else free beside it."""
    term = free_force_of(last.fit.layout)
    if term is None:
        return left
    at = last.fit.layout.of(term)
    force, std = last.fit.theta[at], last.fit.std[at]
    if term.reference is not None:
        force, std = np.insert(force, term.reference, 0.0), np.insert(std, term.reference, np.inf)
    if not np.all(std > 0):  # a steady force of another term and this one's mean are one
        return left
    return replace(left, structures=(replace(left.structures[0], force=force, std=std), *left.structures[1:]))


def _unit(data: Prepared) -> str:
    return data.scale.speed_unit if data.runs[0].quantity == "speed" else data.scale.length_unit


def _channel(data: Prepared) -> str:
    if data.runs[0].quantity == "speed":
        return "speed"
    return {"heave": "depth", "yaw": "heading"}.get(data.scale.axis, "position")


def _places(before: State, after: State, data: Prepared, left: Left, rng: np.random.Generator) -> tuple[Mismatch, ...]:
    """Where the baseline fails; nothing when nothing was found and nothing is left."""
    channel = _channel(data)
    if not after.terms:
        return places_of(left, data, channel)
    seen = judge_left(before.fit, before.white, data, rng)
    return places_of(seen, data, channel) or place_of_findings(seen, before, after, data, channel)


def _noise_note(after: State, data: Prepared) -> tuple[str, ...]:
    """Slow noise is where a disturbance (waves, wind, a hand on the cable) goes that no term carries."""
    out = []
    if state_whiteness(after) < policy.vehicle.VEHICLE_NOT_WHITE_P:
        out.append(
            "what remains is not white: white and slow noise do not describe this sensor (a filter, steps of its own); "
            "standard errors may be too small"
        )
    slow = float(np.sqrt(sum(after.noise.slow)))
    white = float(np.sqrt(after.noise.white))
    if slow < policy.vehicle.SLOW_DISTURBANCE * white:
        return tuple(out)
    unit = _unit(data)
    out.append(
        f"what remains is {slow:.3g} {unit} of slow disturbance beside {white:.3g} {unit} of white noise: errors and "
        "p-values allow for it, and what is weaker than it cannot be seen"
    )
    return tuple(out)
