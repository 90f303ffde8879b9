"""The order in which recordings become a diagnosis, and where it goes back. docs/method.md explains each stage."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from identification.mismatch.answer import stage as answer
from identification.mismatch.answer.periodic_findings import told_lines
from identification.mismatch.answer.trace import Trace
from identification.mismatch.compare.saved_model_baseline import lasting, starting
from identification.mismatch.faults import stage as faults
from identification.mismatch.faults import wiring
from identification.mismatch.locate import stage as locate
from identification.mismatch.name import stage as name
from identification.mismatch.next_experiment import stage as next_experiment
from identification.mismatch.periodic import stage as periodic
from identification.mismatch.prepare import stage as prepare
from identification.mismatch.prepare.channel_availability import predictable
from identification.mismatch.prepare.preparing import Refusal
from identification.mismatch.select.forward_selection import search
from identification.mismatch.select.stage import exchange_rivals
from identification.mismatch.unnamed import stage as unnamed
from identification.mismatch.validate import stage as validate

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Diagnosis
    from identification.mismatch.next_experiment.sweeps import Limits
    from identification.recording import Recording
    from identification.twin import Twin


class Draws(NamedTuple):
    """Random numbers of each stage that draws any: one that draws more leaves the others theirs."""

    select: np.random.Generator
    select_again: np.random.Generator
    exchange: np.random.Generator
    locate: np.random.Generator
    unnamed: np.random.Generator
    answer: np.random.Generator

    @classmethod
    def of(cls, seed: int) -> Draws:
        return cls(*map(np.random.default_rng, np.random.SeedSequence(seed).spawn(len(cls._fields))))


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
    found = traced(recordings, holdout, seed, baseline, limits, without)
    return found if isinstance(found, Refusal) else found.diagnosis


def traced(
    recordings: Sequence[Recording],
    holdout: Sequence[Recording] = (),
    seed: int = 0,
    baseline: Twin | None = None,
    limits: Limits | None = None,
    without: Collection[str] = (),
) -> Trace | Refusal:
    """The same of a thruster, with what each stage handed on."""
    baseline = None if baseline is None else lasting(baseline, recordings)
    draws, given = Draws.of(seed), None if baseline is None else starting(baseline)
    wired = wiring.run(recordings, holdout)
    prepared = prepare.run(wired.recordings, wired.holdout, baseline)
    if isinstance(prepared, Refusal):
        return prepared
    sound = faults.run(prepared, wired.faults)
    if isinstance(sound, Refusal):
        return sound
    first = found = search(sound.histories, draws.select, given=given, without=without)
    cleaned = periodic.run(first.after.fit, first.data, sound.histories)
    if cleaned.changed:  # back: a line hides small terms, and is taken for some; a peak of the noise makes it louder
        found = search(cleaned.histories, draws.select_again, given=given, bands=cleaned.bands, without=without)
    selected = exchange_rivals(found, draws.exchange)  # goes back by itself where the exchange made another model
    located = locate.run(selected, draws.locate)
    now, data = located.estimate, selected.data
    unseen, unpredicted = predictable(prepared.held_out, sound.unseen, now)
    named = name.run(selected, located)
    validated = validate.run(now, named, data, unseen)
    completed = unnamed.run(selected, located, validated, unseen, draws.unnamed)
    news = told_lines(cleaned.lines, baseline)
    experiment = next_experiment.run(now, data, completed.earned, news, limits)
    case = answer.Case(prepared.recordings, sound, unseen, cleaned.lines, baseline, (*sound.notes, *unpredicted))
    diagnosis = answer.run(case, selected, located, completed, experiment, draws.answer)
    return Trace(prepared, sound, first, cleaned, selected, located, named, validated, completed, diagnosis)
