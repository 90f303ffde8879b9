"""One thruster's section of a campaign's page: verdict, budget, figures, tare drift, diagnosis, what happened."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from identification.estimation.tails import student_quantile
from identification.mismatch.compare.reported_runs import runs_of
from identification.thruster.thrust_report import digits, sentence, verdicts
from rig.campaign_report.answers import Told
from rig.campaign_report.budget import COVERAGE, Budget, budgets
from rig.campaign_report.pictures import tare_picture, tares
from rig.campaign_report.results import verdict, with_expanded
from rig.diagnose.recording_names import told_by_name
from rig.diagnose.report.page import short, what_section, where_section
from rig.diagnose.report.words import words
from rig.fit.report.page import tone
from rig.fit.report.pictures import measured_and_fitted, residuals_by_level, residuals_in_order
from rig.report.page import Remark, Section, Table, columns, sentences
from rig.report.style import prose, unit_text

MOST_EVENTS = 40
"""Warnings, trips and errors that are listed; the recording has all."""


def thruster_section(told: Told, folder: str) -> Section:
    """Everything about one thruster; `folder`: name of the campaign's, for what can be typed."""
    if told.answer is None:
        parts = (*sentences([Remark(f"No fit, for {told.why_no_fit}.", "bad")]), *_events(told))
        return Section(told.thruster, parts)
    fit = told.answer.fit
    said = (*verdicts(fit, told.answer.alternatives), *told.answer.notes)
    known = budgets(fit, told.recordings)
    parts = (
        *sentences(Remark(prose(text), tone(text)) for text in said),
        *(budget_table(each) for each in known),
        *sentences(_beside_budget(known)),
        measured_and_fitted(fit),
        residuals_by_level(fit),
        residuals_in_order(fit),
        *tare_picture(fit),
        *sentences(_drift(told)),
        diagnosis_section(told, folder),
        *_events(told),
    )
    return Section(told.thruster, parts, prose(f"{verdict(fit).capitalize()}. {sentence(fit)}"))


def budget_table(budget: Budget) -> Table:
    """Contributions, combined and expanded, in the unit of the coefficient and in % of the variance."""
    unit = unit_text(budget.unit)
    head = ("source", "type", f"standard uncertainty / ({unit})", "% of the variance", "known from")
    rows = [
        (part.source, part.kind, f"{part.u:.3g}", f"{budget.share(part):.1f}", part.basis)
        for part in budget.contributions
    ]
    rows.append(("combined, u", "", f"{budget.u:.3g}", "100.0", _freedom(budget)))
    rows.append((f"expanded, U = {COVERAGE:g} u", "", f"{budget.expanded:.3g}", "", f"{with_expanded(budget)} {unit}"))
    caption = f"Uncertainty budget of {prose(budget.name)}"
    return Table(caption, head, tuple(rows), columns(head, "source", "type", "known from"))


def _freedom(budget: Budget) -> str:
    """Effective degrees of freedom, and the k that 95 % would take with them."""
    if not budget.dof < 1e4:
        return "effective degrees of freedom above 10 000"
    factor = float(student_quantile(0.975, budget.dof))
    return f"{budget.dof:.0f} effective degrees of freedom: 95 % take k = {factor:.2f}"


def _beside_budget(known: tuple[Budget, ...]) -> Iterator[Remark]:
    if not known:
        yield Remark("No uncertainty can be stated: the scatter of the coefficient is not determined.", "bad")
    for text in dict.fromkeys(text for each in known for text in each.open):
        yield Remark(prose(text), "doubt")


def _drift(told: Told) -> Iterator[Remark]:
    """From the first tare of a recording to its last."""
    assert told.answer is not None
    for each in tares(told.answer.fit):
        change, std = each.drift
        first, last = (digits(float(x), std) for x in (each.value[0], each.value[-1]))
        text = (
            f"The tare goes from {first} to {last} N between {each.time[0]:.0f} and {each.time[-1]:.0f} s: "
            f"a change of {digits(change, std)} ± {digits(COVERAGE * std, std)} N (k = {COVERAGE:g})"
        )
        beyond = abs(change) > COVERAGE * std
        yield Remark(f"{text}{', which is more than its error' if beyond else ', within its error'}.".replace("-", "−"),
                     "doubt" if beyond else "good")  # fmt: skip


def diagnosis_section(told: Told, folder: str) -> Section:
    """What physics the model leaves out, in short; the whole of it is a page of its own."""
    files = " ".join(f"{folder}/{path.name}" for path in told.paths)
    whole = f"`rig diagnose {files} --report diagnosis.html`"
    if told.diagnosis is None:
        why = told.why_no_diagnosis or "it was left out"
        return Section("Diagnosis", sentences([Remark(f"Not made: {why}.", "doubt"), f"To make it: {whole}"]))
    names = {recording.recording_id: path.name for recording, path in zip(told.recordings, told.paths, strict=True)}
    d = told_by_name(told.diagnosis, names)
    runs = runs_of(d, [replace(r, recording_id=names[r.recording_id]) for r in told.recordings])
    where = where_section(d, runs).parts if d.mismatch else ()
    found = [part for section in what_section(d, runs) for part in section.parts]
    parts = (*sentences(short(d)), *where, *found, *sentences([*map(words, d.notes), f"All of it: {whole}"]))
    return Section("Diagnosis", parts, words(f"{d.headline}. {d.statement}"))


def _events(told: Told) -> tuple[Section, ...]:
    """What the journal of each recording has above plain information."""
    head = ("recording", "time / s", "level", "what happened")
    rows = [
        (run.path.name, f"{event.time:.1f}".replace("-", "−"), event.level, event.text)
        for run in told.runs
        if run.recording is not None
        for event in run.recording.events
        if event.level != "info"
    ]
    if not rows:
        return ()
    table = Table(
        f"{len(rows)} warnings, trips and errors", head, tuple(rows[:MOST_EVENTS]), columns(head, head[0], *head[2:])
    )
    return (Section("What happened", (table,)),)
