"""What every stage of a diagnosis handed on, in figures: a trace in, a section of lines for each stage out.

Nothing is computed here that decides; each figure stands in the trace. docs/method.md says what they mean.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from textwrap import wrap

import numpy as np

from identification.mismatch import policy
from identification.mismatch.answer.explained.explain_search import (
    baseline_lines,
    label,
    p_text,
    round_lines,
    searches,
    values_text,
)
from identification.mismatch.answer.explained.trace import Trace
from identification.mismatch.diagnosis import Adequate, Ambiguous, Diagnosis, Explained, Unexplained
from identification.mismatch.name.naming import Named
from identification.mismatch.select.forward_selection import Rival, Selected
from identification.mismatch.unnamed.stage import Completed
from identification.physics.term import Term
from identification.recording import Recording
from identification.run_history.history import History

WIDTH = 96
"""Columns of a line: with the indent that the command gives it, a terminal's 100 hold it."""
MOST_PLACES = 10
"""Covariates that are shown, those of the smallest p-value."""
MOST_RUNS = 6
"""Recordings that are shown one by one."""


@dataclass(frozen=True, slots=True)
class Section:
    """One stage."""

    title: str
    lines: tuple[str, ...]
    """Of at most WIDTH columns."""


def explained(trace: Trace) -> tuple[Section, ...]:
    """Every stage in the order in which it ran; a search that was begun again stands twice."""
    found = [
        _section("prepare: from samples to intervals", _prepare(trace)),
        _section("faults: channels that lie", _faults(trace)),
        _section("select: the baseline and its noise", baseline_lines(trace.first.before, trace.first.data)),
        *_search("select: the search", trace.first),
        _section("periodic: lines and noise peaks at every sample", _periodic(trace)),
    ]
    if trace.cleaned.changed:
        again = baseline_lines(trace.selected.before, trace.selected.data)
        found += [
            _section("select again: the baseline, without lines and with noise peaks", again),
            *_search("select again: the search", trace.selected),
        ]
    found += [
        _section("select: each term against its rivals", _rivals(trace)),
        _section("locate: what the model leaves, over each covariate", _located(trace)),
        _section("name: whether each name is earned", _named(trace)),
        _section("validate: what was not fitted", _validated(trace)),
        _section("unnamed: a free shape for what has no name", _unnamed(trace.completed)),
        _section("next experiment: what would settle it", _next(trace.diagnosis)),
        _section("answer: the verdict", _answer(trace)),
    ]
    return tuple(found)


def _section(title: str, lines: Iterable[str]) -> Section:
    return Section(title, tuple(part for line in lines for part in _within(line)))


def _within(line: str) -> list[str]:
    """The line, or as many as it takes, those that follow farther in."""
    if len(line) <= WIDTH:
        return [line]
    indent = " " * (len(line) - len(line.lstrip()))
    return wrap(line.strip(), WIDTH, initial_indent=indent, subsequent_indent=f"{indent}  ")


def _prepare(trace: Trace) -> Iterator[str]:
    pairs = [*zip(trace.prepared.recordings, trace.sound.histories, trace.prepared.moved, strict=True)]
    for recording, history, moved in pairs[:MOST_RUNS]:
        yield from _run(recording, history)
        yield from (f"  {told}" for told in moved)
    if len(pairs) > MOST_RUNS:
        yield f"... and {len(pairs) - MOST_RUNS} more recordings"
    for recording in trace.prepared.held_out:
        yield f"held out: {recording.recording_id}"
    s = trace.first.data.scale
    size = f"driver {s.driver:.4g} {s.driver_unit}, C driver^2 {s.thrust:.4g} N"
    yield f"sizes: {size}, scatter of a sample {s.noise:.3g} N"
    most = trace.first.data.most_shift
    yield f"clocks of force and driver may disagree by {1000 * most:.3g} ms" if most else "no shift of clocks is fitted"
    for note in trace.sound.notes:
        yield f"note: {note}"


def _run(recording: Recording, h: History) -> Iterator[str]:
    dt = 1000 * h.dt
    yield (
        f"{recording.recording_id}: {h.edges[-1] - h.edges[0]:.4g} s, {h.sample_time.size} samples of thrust"
        f" ({1 / h.spacing:.4g}/s)"
    )
    kind = "a table of levels" if h.static else f"{h.driver.size} intervals of {dt.min():.3g} to {dt.max():.3g} ms"
    yield f"  {kind}, {h.rows.size} of them with thrust"
    beside = ", ".join(sorted(h.others)) or "nothing else"
    yield f"  driven by {h.driver_quantity}, {h.driver.min():.4g} to {h.driver.max():.4g}; beside it: {beside}"


def _faults(trace: Trace) -> Iterator[str]:
    if not trace.sound.faults:
        yield "none"
    for fault in trace.sound.faults:
        done = "put right for the model" if fault.grave and fault.repairable else "left as it is"
        done = fault.done or done
        yield f"{fault.kind}: {fault.statement} ({p_text(fault.p_value)}; {done})"


def _search(title: str, selected: Selected) -> Iterator[Section]:
    """One section for each round: a screen each."""
    for i, one in enumerate(searches(selected)[0], 1):
        yield _section(f"{title}, round {i}", round_lines(one))


def _periodic(trace: Trace) -> Iterator[str]:
    for line in trace.cleaned.lines:
        once = "" if line.again else ", seen once: it has no name"
        yield (
            f"{line.kind}: {line.frequency:.4g} +- {line.frequency_std:.2g} Hz, {line.amplitude:.3g} +- "
            f"{line.amplitude_std:.2g} N, chi-square {line.gain:.4g}, {p_text(line.p_value)}: taken out{once}"
        )
    for f, quality in trace.cleaned.bands:
        yield f"broad peak of the noise at {f:.4g} Hz, quality {quality:.3g}: told to the noise model"
    if trace.cleaned.changed:
        yield "the way goes back: the model is selected again, from what of it still earns its place"
    else:
        yield f"no line (family-wise threshold p < {policy.periodic.LINE_FALSE_ALARM:g}), no peak; the model stands"


def _rivals(trace: Trace) -> Iterator[str]:
    selected = trace.selected
    search, resumed = searches(selected)
    begun = next((r.after for r in reversed(search) if r.after is not None), search[0].model)
    if resumed:
        yield f"exchanged: {_terms(begun)} -> {_terms(resumed[0].model)}; the way goes back: the search is resumed"
        for one in resumed:
            yield from round_lines(one)
        begun = next((r.after for r in reversed(resumed) if r.after is not None), resumed[0].model)
    terms = selected.after.fit.model.terms
    if set(begun) != set(terms):
        yield f"exchanged: {_terms(begun)} -> {_terms(terms)}"
    elif terms:
        yield "none was exchanged" if not resumed else "no further exchange"
    if not terms:
        yield "no term, no rival"
    elif selected.standing is None:
        yield "how each term stands was worked out anew when it was named"
    for term, (less, rivals) in (selected.standing or {}).items():
        lost = less.chi2 - selected.after.fit.chi2
        yield f"{label(term)}: without it chi-square {lost:+.4g}; in its place, BIC worse by"
        told = ", ".join(_rival(r) for r in rivals) or "(no rival was like enough to be fitted)"
        yield f"    {told}"


def _rival(rival: Rival) -> str:
    """A fit that cannot come near is ended early: what it says is the most that the rival may be worse."""
    far = rival.bic_loss > policy.select.RIVAL_STATED_BIC
    return f"{label(rival.term)} {'at most ' if far else ''}{rival.bic_loss:.4g}"


def _terms(terms: Iterable[Term]) -> str:
    return " + ".join(map(label, terms)) or "no term"


def _located(trace: Trace) -> Iterator[str]:
    left = trace.located.left
    yield f"{'covariate':<22}{'chi-square':>12}{'dof':>7}{'p':>12}"
    for g in left.groups[:MOST_PLACES]:
        yield f"{g.covariate.quantity:<22}{g.statistic:>12.4g}{g.dof:>7}{g.p_value:>12.2g}"
    alarm = policy.locate.RESIDUAL_FALSE_ALARM
    verdict = "structure is left" if trace.located.structured else "nothing is left that noise does not leave"
    yield f"family-wise {p_text(left.p_value)} (threshold {alarm:g}): {verdict}"
    if left.pulses is not None:
        yield f"pulses that come back: {left.pulses.statement} ({p_text(left.pulses.p_value)})"
    if trace.located.estimate is not trace.selected.after:
        yield "a slow change hid in the noise: it was estimated anew beside one, and is quieter now"


def _named(trace: Trace) -> Iterator[str]:
    every = (*trace.completed.earned, *trace.completed.unearned)
    if not every:
        yield "the model has no term to name"
    for named in every:
        yield from _name(named, trace.selected)


def _name(named: Named, selected: Selected) -> Iterator[str]:
    says = "NOT earned" if named.failed_checks else "earned"
    yield f"{label(named.term)} {values_text(named.term, named.theta, selected.data, named.std)}: {says}"
    yield (
        f"  chi-square {named.chi2_gain:.4g}, BIC {named.bic_gain:.4g}, {p_text(named.p_value)} of the best of "
        f"{named.searched}, weight among {named.asked_effects} asked {named.probability:.3g}"
    )
    for check in named.checks:
        if check.failed:
            yield f"  FAILED  {check.failed}"
        else:
            told = f" ({check.told})" if check.told else ""
            yield f"  {'-' if check.silent else 'passed':<8}{check.asked}{told}"


def _validated(trace: Trace) -> Iterator[str]:
    scores = trace.validated.scores
    held = "runs held out" if trace.prepared.held_out else "every fourth block of time, kept back"
    yield f"judged on {held}"
    yield f"{'model':<34}{'RMSE / N':>10}{'chi-square':>12}"
    yield f"{'  all of its terms':<34}{scores.whole.rmse:>10.4g}{scores.whole.chi2:>12.5g}"
    for term, score in scores.less.items():
        yield f"{'  without ' + label(term):<34}{score.rmse:>10.4g}{score.chi2:>12.5g}"
    d = trace.diagnosis.heldout
    yield (f"told in the answer: {d.before:.4g} N before, {d.after:.4g} N after, noise {d.noise:.4g} N ({d.what})")


def _unnamed(completed: Completed) -> Iterator[str]:
    if not completed.open_ended:
        yield "not asked: nothing is left, and every term has its name"
        return
    free = completed.flexible
    if free is None:
        yield "no free shape predicts better what was not fitted"
        return
    for term in free.terms:
        knots = ", ".join(f"{k:.4g}" for k in term.knots)
        yield f"{label(term)}: degree {term.degree}, knots at {knots} {term.unit}"
    yield f"error on what was not fitted: {free.without:.4g} N without, {free.held:.4g} N with"
    if free.dropped:
        yield f"in the place of {_terms(free.dropped)}"


def _answer(trace: Trace) -> Iterator[str]:
    d = trace.diagnosis
    yield f"{d.verdict}: {_why(d)}"
    for named in trace.completed.earned:
        intervals = trace.completed.intervals.get(named.term, ())
        known = named.term.parameters(trace.selected.data.scale)
        for p, value, interval in zip(known, named.theta, intervals, strict=False):
            ends = f"95 % from {interval.low:.4g} to {interval.high:.4g}"
            yield f"  {named.term.id}.{p.name} {value:.4g} {p.unit}, {ends}"
    yield f"chi-square per degree of freedom {d.chi2_per_dof:.4g}, whiteness (Ljung-Box) {p_text(d.whiteness_p)}"
    yield f"RMSE per sample, fitted: {d.train.before:.4g} N before, {d.train.after:.4g} N after"


def _why(d: Diagnosis) -> str:
    equal = policy.select.RIVALS_EQUAL_BIC
    match d.answer:
        case Adequate():
            return "no term passed, no line, no fault, and nothing is left"
        case Explained(findings):
            return f"{len(findings)} finding(s), none with a rival within {equal:g} BIC, and nothing is left"
        case Ambiguous():
            return f"a finding has a rival within {equal:g} BIC"
        case Unexplained():
            if d.heldout.grown:
                return "the error on what was not fitted grew, by more than chance makes it"
            return "something is left, or a term of the model has no name"


def _next(d: Diagnosis) -> Iterator[str]:
    n = d.next_experiment
    if n is None:
        yield "none is needed"
        return
    if not n.steps:
        yield "no sweep settles it"
        yield n.why
        return
    seconds = float(np.sum([step.duration for step in n.steps]))
    yield f"{len(n.steps)} steps, {seconds:.4g} s, probability of a right decision {n.expected_power:.3g}"
    yield n.why
