"""Recordings in, diagnosis out: locate, name, refit, judge."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch.answer.periodic_findings import with_lines
from identification.mismatch.answer.proxies import proxies
from identification.mismatch.answer.report_assembly import (
    curves_of,
    fault_finding,
    finding_of,
    places_of,
    says,
    values_of,
    where_of,
)
from identification.mismatch.compare.saved_model_baseline import starting, unfit, with_twin
from identification.mismatch.diagnosis import (
    Diagnosis,
    Rmse,
    Unexplained,
    Verdict,
)
from identification.mismatch.estimate.confidence_intervals import Interval, intervals
from identification.mismatch.estimate.estimate import Estimate, refresh
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.faults.channel_faults import Fault, find_faults, repaired
from identification.mismatch.locate.residual_structure_test import ALARM, ResidualStructure, residual_structure
from identification.mismatch.locate.slow_change import beside_slow_change
from identification.mismatch.model.model import Data, Weights
from identification.mismatch.name.naming import Named, name, with_joint_checks
from identification.mismatch.next_experiment.proposal import propose
from identification.mismatch.next_experiment.sweeps import Limits
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.periodic.full_rate import look
from identification.mismatch.periodic.periodic_disturbances import Line
from identification.mismatch.prepare.channel_availability import held_by_all, predictable
from identification.mismatch.prepare.preparing import Refusal, history_of
from identification.mismatch.select.aliases import within_samples
from identification.mismatch.select.forward_selection import STATIC, Selected, prune, resumed, search
from identification.mismatch.select.rivals import EQUAL, SwapTest, swap_tests
from identification.mismatch.select.shape_error import SHAPE_ERROR, corrections
from identification.mismatch.unnamed.flexible import Extended, extend, foremost
from identification.mismatch.unnamed.flexible_shape import refitted_names, shared, with_flexible, with_held
from identification.mismatch.validate.cross_validation import by_folds
from identification.mismatch.validate.held_out import HeldOut, by_blocks, by_runs, rmse, whiteness
from identification.mismatch.validate.prediction import predicting, predicts, without_terms, worse_predicted
from identification.mismatch.validate.train_test_split import TrainTestSplit, train_test_split
from identification.physics.term import Term
from identification.recording import Recording
from identification.run_history.history import History
from identification.twin import Twin

COLOURED = 1e-25
"""p-value of whiteness below which no noise is blamed; 1/f noise alone was seen to reach 1e-21."""
UNCARRIED = 6.0
"""Sigmas of a direction of the last screening that no term made anything of: it is left, whatever its shape."""
ALONE = "without terms that have no name it predicts what was not fitted worse than the baseline"
DRIVER_NAMES = {"command_voltage": "V|V|", "motor_voltage": "V|V|", "rotation_rate": "n|n|"}


def diagnose(
    recordings: Sequence[Recording],
    holdout: Sequence[Recording] = (),
    seed: int = 0,
    baseline: Twin | None = None,
    limits: Limits | None = None,
    without: Collection[str] = (),
) -> Diagnosis | Refusal:
    """Everything that `rig diagnose` says, for recordings of one thruster. A Refusal says what is wrong with them.

    `baseline`: a twin in the place of C V|V|; its terms keep their values, findings are what lies beyond them.
    `limits`: of the next experiment; None: what was recorded may be run again, for BUDGET s.
    `without`: ids of effects taken out of the catalogue (what does the tool say of a physics that it does not know?).
    """
    if any(r.kind == "vehicle" for r in recordings):
        from identification.mismatch.vehicle.diagnose import diagnose_vehicle  # as much again to start, for a few

        return diagnose_vehicle(recordings, holdout, seed, without=without)
    histories = _histories(recordings)
    if isinstance(histories, Refusal):
        return histories
    others = _histories(holdout) if holdout else ()
    if isinstance(others, Refusal):
        return others
    wrong = unfit(recordings, holdout, histories, others, baseline)
    if wrong is not None:
        return wrong
    rng = np.random.default_rng(seed)
    faults, histories = _faulty(recordings, histories)
    of_others, others = _faulty(holdout, others)
    if isinstance(histories, Refusal):
        return histories
    if isinstance(others, Refusal):
        return others
    faults += of_others
    histories, notes = held_by_all(recordings, histories)
    given = None if baseline is None else starting(baseline)
    found = search(histories, rng, given=given, without=without)
    seen = look(found.after.fit, found.data, histories)
    lines: tuple[Line, ...] = ()
    if seen is not None:
        lines = seen.lines
        found = search(seen.histories, rng, given=given, bands=seen.bands, without=without)
    found, after, standing = _gone_on(found, rng)
    after, left = _left(found, after, rng)
    measured = replace(found.data, histories=histories)
    others, unpredicted = predictable(holdout, others, after)
    given_to_it = _Evidence(recordings, found.data, measured, others)
    answer, after = _answer(given_to_it, replace(found, after=after), left, rng, limits, standing)
    answer = with_twin(_with_channels(answer, faults), after, found.data, recordings, baseline)
    answer = with_lines(answer, lines, after, found.data, baseline, limits)
    told = (*notes, *unpredicted, *proxies(after.fit.model, answer.findings, recordings, histories))
    return replace(answer, notes=(*answer.notes, *told))


def _gone_on(found: Selected, rng: np.random.Generator) -> tuple[Selected, Estimate, dict[Term, SwapTest] | None]:
    """With rivals exchanged; and once more what lies beyond, where the exchange made another model of it."""
    if not found.after.fit.model.terms:
        return found, found.after, None
    after, standing = _settled(found)
    if frozenset(after.fit.model.terms) == frozenset(found.after.fit.model.terms):
        return found, after, standing
    again = resumed(found, after, rng)
    if again.after is after:
        return found, after, standing
    return again, *_settled(again)


def _left(found: Selected, after: Estimate, rng: np.random.Generator) -> tuple[Estimate, ResidualStructure]:
    """What no term carries, with the noise that shows it."""
    data = found.data
    left = _with_colour(residual_structure(after.fit, data, after.weights, rng), after, data)
    if left.p_value < ALARM or not left.groups:
        return after, left
    if after is found.after and found.last.largest > max(found.last.threshold, UNCARRIED):
        best = found.last.directions.terms[int(np.argmax(found.last.z))]
        return after, _foremost_over(replace(left, p_value=min(found.last.p_value, left.p_value)), best.covariates)
    beside = beside_slow_change(after, data)
    if beside is None:
        return after, left
    return beside, _foremost_over(residual_structure(beside.fit, data, beside.weights, rng), ("time",))


def _foremost_over(left: ResidualStructure, quantities: Collection[str]) -> ResidualStructure:
    """The same with these covariates first."""
    return replace(left, groups=tuple(sorted(left.groups, key=lambda g: g.covariate.quantity not in quantities)))


def _settled(found: Selected) -> tuple[Estimate, dict[Term, SwapTest] | None]:
    """With rivals exchanged, pruned as a search ends; as found where what was exchanged for a term is dropped again."""
    after, standing = swap_tests(found.after, found.data, found.terms)
    slower = within_samples(after, found.data)
    if slower is not after:
        return slower, None
    if after is found.after:
        return after, standing
    pruned = prune(after, found.data)
    if pruned is after:
        return after, standing
    exchanged = set(after.fit.model.terms) - set(found.after.fit.model.terms)
    return (pruned if exchanged <= set(pruned.fit.model.terms) else found.after), None


def _histories(recordings: Sequence[Recording]) -> tuple[History, ...] | Refusal:
    if not recordings:
        return Refusal("no recording was given")
    seen = {r.thruster for r in recordings}
    if len(seen) > 1:
        return Refusal(f"recordings of several thrusters ({', '.join(sorted(seen))}); diagnose one at a time")
    ids = [r.recording_id for r in recordings]
    if len(set(ids)) < len(ids):
        return Refusal("the same recording was given twice")
    out = []
    for recording in recordings:
        history = history_of(recording)
        if isinstance(history, Refusal):
            return history
        out.append(history)
    if len({h.driver_quantity for h in out}) > 1:
        return Refusal("the recordings are driven by different quantities; give those with one kind of command")
    return tuple(out)


@dataclass(frozen=True, eq=False, slots=True)
class _Evidence:
    """What an answer is judged by."""

    recordings: Sequence[Recording]
    data: Data
    """What was fitted: periodic disturbances that were found are taken out."""
    measured: Data
    """The same runs with these still in them."""
    others: Sequence[History]
    """Whole runs held out."""


def _answer(
    evidence: _Evidence,
    found: Selected,
    left: ResidualStructure,
    rng: np.random.Generator,
    limits: Limits | None,
    standing: dict[Term, SwapTest] | None,
) -> tuple[Diagnosis, Estimate]:
    """The answer, and the final model: with flexible terms where no physics carries what is left."""
    data, before, others = found.data, found.before, evidence.others
    structure = left.p_value < ALARM
    every_name = name(found.after, data, found.terms, standing)
    named = with_joint_checks(every_name, left if structure else None, measured=data.with_rate)
    split = train_test_split(found.after, data, others)
    named = _checked_on_held_out(named, split, same_run=not others)
    earned = [n for n in named if not n.failed_checks]
    unearned = [n for n in named if n.failed_checks]
    open_ended = (structure or bool(unearned)) and bool(left.groups)
    bare, place = _located(found.after, data, left, unearned, rng) if open_ended else (found.after, left)
    located = _foremost(place, unearned, data) if open_ended else ""
    free = extend(found.after, before, data, located, unearned, split, rng) if open_ended else None
    unnamed = [n.term for n in unearned]
    after = predicting(found.after, split, data, found.terms, unnamed, others) if free is None else free.estimate
    if earned and unearned and free is None and not predicts(after, before, data, others):
        after, unearned, earned = before, [*unearned, *(replace(n, failed_checks=(ALONE,)) for n in earned)], []
        bare, place = _located(found.after, data, left, unearned, rng)
    unexplained = _unexplained(place, bare, data, unearned, free, others) if open_ended else None
    earned, known = _with_values(earned, found.after, after, data, free)
    every = [np.ones(r.size, dtype=bool) for r in data.rows]
    held = _held_out(before, after, evidence, found.after.noise, free)
    n, p = after.fit.residual.size, int(after.fit.free.sum())
    answer = Diagnosis(
        recordings=tuple(r.recording_id for r in evidence.recordings),
        thruster=evidence.recordings[0].thruster,
        verdict=_verdict(earned, unexplained),
        baseline_model=f"C {DRIVER_NAMES[data.histories[0].driver_quantity]}",
        baseline=values_of(before.fit, data),
        mismatch=places_of(found, after, rng, pulsing=left.pulses is not None),
        findings=tuple(finding_of(n, data, known) for n in earned),
        unexplained=unexplained,
        model_terms=tuple(t.id for t in after.fit.model.terms),
        model=values_of(after.fit, data, known),
        train=Rmse(
            rmse(before.fit.model, before.fit.theta, evidence.measured, every),
            rmse(after.fit.model, after.fit.theta, data, every),
        ),
        heldout=with_held(held, free),
        chi2_per_dof=after.fit.chi2 / max(n - p, 1),
        whiteness_p=whiteness(after.fit, data),
        next_experiment=propose(found.after, data, earned, limits) if _equals(earned) else None,
        curves=curves_of(before, after, data),
    )
    return answer, after


def _checked_on_held_out(named: Sequence[Named], split: TrainTestSplit, *, same_run: bool) -> tuple[Named, ...]:
    """With a doubt where a model without the term predicts what was not fitted better."""
    worse = worse_predicted(split, [n.term for n in named if not n.failed_checks], same_run=same_run)
    doubt = "what was not fitted is predicted better without it"
    return tuple(replace(n, failed_checks=(*n.failed_checks, doubt)) if n.term in worse else n for n in named)


def _held_out(before: Estimate, after: Estimate, evidence: _Evidence, quiet: Noise, free: Extended | None) -> HeldOut:
    """On the runs held out; where none are on each run in turn; on blocks of time where one run is all there is, and
    where flexible terms were chosen on the rest of these."""
    if evidence.others:
        return by_runs(before, after, evidence.data, evidence.others, quiet)
    judge = by_folds if free is None else by_blocks
    return judge(before, after, evidence.data, evidence.measured, quiet)


def _with_values(
    earned: Sequence[Named], before: Estimate, after: Estimate, data: Data, free: Extended | None
) -> tuple[list[Named], dict[Term, tuple[Interval, ...]]]:
    """Names with their values and intervals in the final model, `after`; of those that share a covariate with a
    flexible term in the model without any."""
    alone = shared([n.term for n in earned], free) if free is not None else []
    named = refitted_names([n for n in earned if n.term not in alone], after)
    known = intervals(after.fit, data, after.weights, [n.term for n in named])
    if free is not None and alone:
        bare = refresh(*without_terms(before, free.dropped), data, None, None)  # what it leaves is noise to it
        named += refitted_names([n for n in earned if n.term in alone], bare)
        known |= intervals(bare.fit, data, bare.weights, alone)
    return sorted(named, key=lambda n: -n.chi2_gain), known


def _verdict(earned: Sequence[Named], unexplained: Unexplained | None) -> Verdict:
    if unexplained is not None:
        return "unexplained"
    if not earned:
        return "adequate"
    return "ambiguous" if _equals(earned) else "explained"


def _equals(earned: Sequence[Named]) -> bool:
    """Whether some answer has a rival that does as well."""
    return any(r.bic_loss < EQUAL for n in earned for r in n.rivals)


def _faulty(
    recordings: Sequence[Recording], histories: tuple[History, ...]
) -> tuple[tuple[Fault, ...], tuple[History, ...] | Refusal]:
    """Channel faults come first: what they make of the recordings, and the histories with grave ones put right."""
    faults = find_faults(recordings)
    if not any(f.grave and f.repairable for f in faults):
        return faults, histories
    mended = []
    for recording in recordings:
        right = recording
        for fault in faults:
            if fault.recording_id == recording.recording_id and fault.grave and fault.repairable:
                right = repaired(right, fault)
        mended.append(right)
    return faults, _histories(mended)


def _with_channels(answer: Diagnosis, faults: Sequence[Fault]) -> Diagnosis:
    """The answer with channel faults, first among its findings."""
    grave = [f for f in faults if f.grave and f.kind != "nan"]
    alone = {f.recording_id for f in grave} <= set(answer.recordings) and len(answer.recordings) == 1
    faulty = (f if alone else replace(f, statement=f"{f.recording_id}: {f.statement}") for f in grave)
    found = (*map(fault_finding, faulty), *answer.findings)
    notes = [f"{f.recording_id}: {f.statement}" for f in faults if f not in grave]
    notes += [f"for the model this was put right: {f.statement}" for f in grave if f.repairable]
    verdict = "explained" if answer.verdict == "adequate" and found else answer.verdict
    return replace(answer, verdict=verdict, findings=found, notes=(*answer.notes, *notes))


def _with_colour(left: ResidualStructure, after: Estimate, data: Data) -> ResidualStructure:
    """What is left counts as structure too when it is far from white, and more than the terms' shapes may leave."""
    colour = whiteness(after.fit, data)
    if not after.fit.model.terms or colour > COLOURED or left.p_value < ALARM:
        return left
    changes = corrections(after.fit, data, Weights(after.weights.thrust))
    spared = SHAPE_ERROR**2 * float(sum(change @ change for change in changes))
    excess = float(after.fit.residual[: data.size] @ after.fit.residual[: data.size]) - data.size
    return replace(left, p_value=colour) if excess > spared else left


def _located(
    after: Estimate, data: Data, left: ResidualStructure, unearned: Sequence[Named], rng: np.random.Generator
) -> tuple[Estimate, ResidualStructure]:
    """What is left without the terms whose names were not earned: they are no physics, and would hide its place."""
    if not unearned:
        return after, left
    bare = replace(after, fit=fit(*without_terms(after, [n.term for n in unearned]), data, after.weights))
    seen = residual_structure(bare.fit, data, after.weights, rng)
    return (bare, seen) if seen.p_value < ALARM else (after, left)


def _foremost(left: ResidualStructure, unearned: Sequence[Named], data: Data) -> str:
    """The covariate over which it is left most clearly; a static curve is one over what drives."""
    if left.p_value >= ALARM:  # nothing beyond noise is left: the doubt itself is the place
        driver = data.histories[0].driver_quantity
        own = {driver if c in STATIC else c for n in unearned for c in n.term.covariates}
        return next((g for g in left.groups if g.covariate.quantity in own), left.groups[0]).covariate.quantity
    return left.groups[0].covariate.quantity


def _unexplained(
    left: ResidualStructure,
    after: Estimate,
    data: Data,
    unearned: Sequence[Named],
    free: Extended | None,
    others: Sequence[History],
) -> Unexplained:
    quantity = free.terms[0].quantity if free is not None else _foremost(left, unearned, data)
    if free is None and left.p_value < ALARM:
        clear = [g.covariate.quantity for g in left.groups if g.p_value < ALARM]
        quantity = foremost(after, data, clear or [quantity], left.pulses)
    judged = next((g for g in left.groups if g.covariate.quantity == quantity), left.groups[0])
    where, share, table = where_of(judged, after.fit, data, after.weights)
    resembles = tuple(f"{n.term.id}: {'; '.join(n.failed_checks)}" for n in unearned)
    text = f"Something is left that no term of the catalogue carries: {says(where, share, judged.covariate.what)}"
    if unearned:
        text += f" It resembles {', '.join(n.term.id for n in unearned)}, but {unearned[0].failed_checks[0]}."
    return with_flexible(Unexplained(where, judged.share, left.p_value, table, text, resembles), free, data, others)
