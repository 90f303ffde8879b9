"""The order in which recordings become a diagnosis, and where it goes back. docs/method.md explains each stage."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from identification.mismatch.answer import stage as answer
from identification.mismatch.answer.explained.trace import Trace
from identification.mismatch.answer.periodic_findings import told_lines
from identification.mismatch.compare.earlier_recordings import Later, put_to_earlier
from identification.mismatch.compare.saved_model_baseline import lasting, starting
from identification.mismatch.compare.undecided_rows import decided
from identification.mismatch.faults import stage as faults
from identification.mismatch.faults import wiring
from identification.mismatch.locate import stage as locate
from identification.mismatch.next_experiment import stage as next_experiment
from identification.mismatch.observer import UNWATCHED, Observer
from identification.mismatch.periodic import stage as periodic
from identification.mismatch.periodic.stage import untouched
from identification.mismatch.prepare import stage as prepare
from identification.mismatch.prepare.preparing import Refusal
from identification.mismatch.select.begun_otherwise import begun_otherwise
from identification.mismatch.select.early_force import early_of
from identification.mismatch.select.forward_selection import Given, Selected, search
from identification.mismatch.select.ringing import ringing
from identification.mismatch.select.search_again import search_again
from identification.mismatch.select.sharpened import sharpened
from identification.mismatch.select.stage import exchange_rivals
from identification.mismatch.select.wrong_side import on_their_side
from identification.mismatch.unnamed import stage as unnamed
from identification.mismatch.validate.judged import HeldBack, judged
from identification.mismatch.validate.second_search import without_what_is_refused

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Diagnosis
    from identification.mismatch.faults.stage import Sound
    from identification.mismatch.next_experiment.sweeps import Limits
    from identification.mismatch.prepare.stage import Prepared
    from identification.recording import Recording
    from identification.twin import Twin


INTERRUPTED = "Interrupted"
NO_LINES = "which periodic disturbances there are"
NO_SHAPE = "which shape what is left has"


class Draws(NamedTuple):
    """Random numbers of each stage that draws any: one that draws more leaves the others theirs."""

    select: np.random.Generator
    select_again: np.random.Generator
    exchange: np.random.Generator
    locate: np.random.Generator
    unnamed: np.random.Generator
    answer: np.random.Generator
    calm: np.random.Generator
    beside: np.random.Generator
    apart: np.random.Generator
    rings: np.random.Generator
    sharp: np.random.Generator
    early: np.random.Generator

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
    watch: Observer = UNWATCHED,
    before: Sequence[Recording] = (),
) -> Diagnosis | Refusal:
    """Everything that `rig diagnose` says, for recordings of one thruster. A Refusal says what is wrong with them.

    `baseline`: a twin in the place of C V|V|; its terms keep their values, findings are what lies beyond them.
    `limits`: of the next experiment; None: what was recorded may be run again, for BUDGET s.
    `without`: ids of effects taken out of the catalogue (what does the tool say of a physics that it does not know?).
    `watch`: is told how far it is, and may end the search; then a note says what was not asked.
    `before`: the recordings behind `baseline`; with them is told whether what is found is new.
    """
    if any(r.kind == "vehicle" for r in recordings):
        from identification.mismatch.vehicle.diagnose import diagnose_vehicle  # as much again to start, for a few

        return diagnose_vehicle(recordings, holdout, seed, without=without)
    found = traced(recordings, holdout, seed, baseline, limits, without, watch, before)
    return found if isinstance(found, Refusal) else found.diagnosis


def traced(
    recordings: Sequence[Recording],
    holdout: Sequence[Recording] = (),
    seed: int = 0,
    baseline: Twin | None = None,
    limits: Limits | None = None,
    without: Collection[str] = (),
    watch: Observer = UNWATCHED,
    before: Sequence[Recording] = (),
) -> Trace | Refusal:
    """The same of a thruster, with what each stage handed on."""
    whole, baseline = baseline, None if baseline is None else lasting(baseline, recordings)
    draws, given = Draws.of(seed), None if baseline is None else starting(baseline)
    watch.stage("reading the runs")
    wired = wiring.run(recordings, holdout)
    begun = _begun(wired, baseline, given, draws, without, watch)
    if isinstance(begun, Refusal):
        return begun
    prepared, sound, first = begun
    found = first
    original = sound.histories
    cleaned = untouched(original) if found.undone else periodic.run(first.after.fit, first.data, original)
    if cleaned.changed:  # back: a line hides small terms, and is taken for some; a peak of the noise makes it louder
        watch.stage("looking again, without lines")
        found = search_again(first, cleaned.histories, draws.select_again, given, cleaned.bands, without, watch)
    found = sharpened(ringing(found, draws.rings, watch), draws.sharp, watch)
    watch.stage("asking for rivals")
    selected = exchange_rivals(found, draws.exchange, watch)  # goes back where the exchange made another model
    selected = begun_otherwise(selected, draws.apart, watch)
    selected = locate.calmed(selected, draws.calm)  # back to the baseline: noise after steps looks like many effects
    watch.stage("judging by what was not fitted")
    held_back = HeldBack(prepared.held_out, sound.unseen)
    chosen = without_what_is_refused(judged(selected, held_back, draws.locate), held_back, draws.beside, watch)
    selected, located, data = chosen.selected, chosen.located, chosen.selected.data
    now = located.estimate
    completed = unnamed.run(selected, located, chosen.validated, chosen.unseen, draws.unnamed)
    news = told_lines(cleaned.lines, baseline)
    experiment = None if selected.undone else next_experiment.run(now, data, completed.earned, news, limits)
    later = Later(recordings, data, completed.after)
    asked = [] if selected.undone else [*(n.term for n in completed.earned), *completed.nameless]
    novel, unasked = put_to_earlier(whole, before, later, asked)
    undone = (*selected.undone, *((NO_LINES,) if first.undone else ()))
    notes = (*interrupted(undone), *sound.notes, *chosen.unpredicted, *unasked)
    left_then = whole is not None and any(term.flexible is not None for term in whole.terms)
    case = answer.Case(prepared.recordings, sound, chosen.unseen, cleaned.lines, baseline, notes, left_then)
    diagnosis = answer.run(case, answer.Found(selected, located, completed, experiment, novel), draws.answer)
    return Trace(prepared, sound, first, cleaned, chosen, completed, diagnosis)


class Begun(NamedTuple):
    """Runs as they were given, with what of them may be believed, and a first model of them."""

    prepared: Prepared
    sound: Sound
    first: Selected


def _begun(
    wired: wiring.Wired,
    baseline: Twin | None,
    given: Given | None,
    draws: Draws,
    without: Collection[str],
    watch: Observer,
) -> Begun | Refusal:
    """The first search; where that has the force before its command, gone on with on intervals that suit it."""
    read = _read(wired, baseline, given)
    if isinstance(read, Refusal):
        return read
    watch.stage("looking for effects")
    first = search(read[1].histories, draws.select, given=given, without=without, watch=watch)
    early = 0.0 if first.undone else early_of(first)
    if not early:
        return Begun(*read, first)
    watch.stage("looking again, for a force that comes before its command")
    read = _read(wired, baseline, given, early)
    if isinstance(read, Refusal):
        return read
    return Begun(*read, search_again(first, read[1].histories, draws.early, given, without=without, watch=watch))


def _read(
    wired: wiring.Wired, baseline: Twin | None, given: Given | None, early: float = 0.0
) -> tuple[Prepared, Sound] | Refusal:
    """On intervals that are short before steps too, where the force comes `early` s before its command."""
    prepared = prepare.run(wired.recordings, wired.holdout, baseline, early)
    if isinstance(prepared, Refusal):
        return prepared
    sound = faults.run(prepared, wired.faults, None if baseline is None else baseline.slip_rate)
    if isinstance(sound, Refusal):
        return sound
    clear = sound.histories if baseline is None else decided(sound.histories, baseline)
    return prepared, replace(sound, histories=on_their_side(clear, given))


def interrupted(undone: Sequence[str]) -> tuple[str, ...]:
    """What is said of a search that was: what was not asked."""
    if not undone:
        return ()
    return (f"{INTERRUPTED} before it was asked {'; '.join((*undone, NO_SHAPE))}. Begin again for a whole answer.",)
