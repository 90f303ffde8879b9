"""The stage: all that was found in, the diagnosis out: a draft, then the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.answer.against_twin import ToldNew, told_new, with_twin
from identification.mismatch.answer.averaged_constant import averaged
from identification.mismatch.answer.draft import Draft
from identification.mismatch.answer.equations import equations_of
from identification.mismatch.answer.fault_findings import with_channels
from identification.mismatch.answer.periodic_findings import seen_once, twin_line, with_lines
from identification.mismatch.answer.proxies import proxies
from identification.mismatch.answer.remainder import remainder_of
from identification.mismatch.answer.report_assembly import curves_of, finding_of, values_of
from identification.mismatch.answer.verdict import decided, refuted
from identification.mismatch.compare.earlier_recordings import Novelty
from identification.mismatch.diagnosis import Diagnosis, Equation, Finding, HeldOutRmse, NextExperiment, Rmse
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.faults.stage import Sound
from identification.mismatch.locate.places import places_of
from identification.mismatch.locate.stage import Located
from identification.mismatch.locate.unclaimed import unclaimed
from identification.mismatch.locate.unrest import told_by_unrest
from identification.mismatch.model.data import Data
from identification.mismatch.noise.whiteness import whiteness
from identification.mismatch.periodic.periodic_disturbances import Line
from identification.mismatch.select.forward_selection import Selected
from identification.mismatch.unnamed.flexible_shape import with_held
from identification.mismatch.unnamed.stage import Completed
from identification.mismatch.validate.each_run import run_differences
from identification.mismatch.validate.held_out import rmse
from identification.mismatch.validate.stage import score
from identification.physics.term import MEASURED, Term
from identification.recording import Recording
from identification.run_history.history import History
from identification.thruster.thrust_data import gain_std
from identification.twin import Twin

TAKEN_BACK = (
    "{} passed the search, but predicts what was not fitted worse than the baseline does, whose residual shows "
    "nothing: it was noise that was followed"
)
DRIVER_NAMES = {"command_voltage": "V|V|", "motor_voltage": "V|V|", "rotation_rate": "n|n|"}


@dataclass(frozen=True, eq=False, slots=True)
class Case:
    """What the answer is of."""

    recordings: tuple[Recording, ...]
    sound: Sound
    unseen: tuple[History, ...]
    """Of the runs held out, those that can be predicted."""
    lines: tuple[Line, ...]
    baseline: Twin | None
    notes: tuple[str, ...]
    """What was left aside, and what cannot be predicted."""
    left_then: bool = False
    """Whether the recordings behind the twin left something that had no name."""

    @property
    def ids(self) -> tuple[str, ...]:
        """Of the recordings."""
        return tuple(r.recording_id for r in self.recordings)


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """What the stages before found in it."""

    selected: Selected
    located: Located
    completed: Completed
    experiment: NextExperiment | None
    novelties: Mapping[Term, Novelty]
    """Of terms found beside a twin, whether its own recordings have them too; empty where nobody asked."""


@dataclass(frozen=True, eq=False, slots=True)
class Drafted:
    """All of an answer but its verdict, and what that is decided by."""

    draft: Draft
    after: Estimate
    new: ToldNew
    train: Rmse
    held: HeldOutRmse
    experiment: NextExperiment | None


def run(case: Case, found: Found, rng: np.random.Generator) -> Diagnosis:
    """The verdict is decided last, and once, from all findings: names, channel faults, a changed constant, lines.

    What predicts worse than the baseline, whose own residual shows nothing anywhere, was noise: it is taken back first.
    """
    drafted = _drafted(case, found, rng)
    if not _followed_noise(drafted):
        return _told(case, found, drafted)
    tried = " and ".join(dict.fromkeys(n.term.id for n in found.completed.earned))
    before = found.selected.before
    told = told_by_unrest(before, found.selected.data)
    bare = Completed(before, (), {}, (), None, False, before, found.located.left, told)
    again = _drafted(case, replace(found, completed=bare, experiment=None), rng)
    return _told(case, found, again, TAKEN_BACK.format(tried))


def _followed_noise(drafted: Drafted) -> bool:
    findings, mismatch = drafted.draft.findings, drafted.draft.mismatch
    if drafted.new.left is not None or not findings or refuted(findings, drafted.held) != findings:
        return False
    return all(place.p_value >= policy.locate.RESIDUAL_FALSE_ALARM for place in mismatch)


def _drafted(case: Case, found: Found, rng: np.random.Generator) -> Drafted:
    selected, located, completed = found.selected, found.located, found.completed
    data, before, after = selected.data, selected.before, completed.after
    measured = replace(data, histories=case.sound.histories)
    every = [np.ones(r.size, dtype=bool) for r in data.rows]
    train = Rmse(
        rmse(before.fit.model, before.fit.theta, measured, every), rmse(after.fit.model, after.fit.theta, data, every)
    )
    remainder, flexible = remainder_of(completed, data, case.unseen), completed.flexible
    new = told_new(
        _findings(completed, data),
        found.novelties,
        case.baseline,
        remainder,
        completed.nameless,
        left_then=case.left_then,
    )
    quiet = located.estimate.noise
    held = with_held(score(before, after, data, measured, case.unseen, quiet, flexible=flexible is not None), flexible)
    model = values_of(completed.stated.fit, data, completed.intervals)
    near = unclaimed(selected, located)
    model["C"], moved = averaged(model["C"], located.estimate.fit, data, completed.earned, near)
    draft = Draft(
        baseline_model=f"C {DRIVER_NAMES[data.histories[0].driver_quantity]}",
        baseline=values_of(before.fit, data),
        mismatch=places_of(selected, after, rng, pulsing=located.left.pulses is not None),
        findings=new.findings,
        model_terms=tuple(t.id for t in after.fit.model.terms),
        model=model,
        notes=moved,
    )
    ids = case.ids
    draft = with_channels(draft, case.sound.faults, ids)
    beside = bool(new.not_new) or completed.open_ended
    draft = with_twin(draft, completed.stated, data, case.recordings, case.baseline, completed.earned, beside=beside)
    draft = with_lines(draft, case.lines, train.before, case.baseline, ids)
    return Drafted(draft, after, new, train, held, found.experiment)


def _told(case: Case, found: Found, drafted: Drafted, *taken_back: str) -> Diagnosis:
    draft, after, new = drafted.draft, drafted.after, drafted.new
    data, fit = found.selected.data, drafted.after.fit
    stands_in = proxies(fit.model, draft.findings, case.recordings, case.sound.histories)
    return Diagnosis(
        recordings=case.ids,
        thruster=case.recordings[0].thruster,
        answer=decided(draft.findings, new.left, drafted.experiment, drafted.held, draft.mismatch),
        baseline_model=draft.baseline_model,
        baseline=draft.baseline,
        mismatch=draft.mismatch,
        model_terms=draft.model_terms,
        model=draft.model,
        train=drafted.train,
        heldout=drafted.held,
        chi2_per_dof=fit.chi2 / max(fit.residual.size - int(fit.free.sum()), 1),
        whiteness_p=whiteness(fit.residual, [r.size for r in data.rows]),
        notes=(*draft.notes, *new.notes, *case.notes, *stands_in, *taken_back),
        curves=curves_of(found.selected.before, after, data),
        twin=draft.twin,
        not_new=new.not_new,
        equations=_equations(found.completed.stated, data, case, draft),
        gain_std=max(gain_std(thrust) for r in case.recordings if (thrust := r.first_of("thrust")) is not None),
    )


def _equations(stated: Estimate, data: Data, case: Case, draft: Draft) -> tuple[Equation, ...]:
    """Of the model that is told, with the lines that came again."""
    assert draft.twin is not None
    lines = tuple(twin_line(line) for line in case.lines if not seen_once(line, case.baseline))
    tares = {h.recording_id: tare for h, tare in zip(data.histories, stated.fit.theta.tares, strict=True)}
    recorded = frozenset.intersection(*(frozenset(h.others) for h in data.histories))
    return equations_of(replace(draft.twin, lines=lines), tares, recorded)


def _findings(completed: Completed, data: Data) -> dict[Term, Finding]:
    """Each with what single runs say otherwise."""
    inside = [n.term for n in completed.earned if n.term in completed.after.fit.model.terms]
    apart = run_differences(completed.after, data, inside)
    out = {}
    for n in completed.earned:
        found = replace(finding_of(n, data.scale, completed.intervals), in_measurement=n.term.stage in MEASURED)
        said = apart.get(n.term)
        out[n.term] = found if said is None else replace(found, statement=f"{found.statement} {said.statement}")
    return out
