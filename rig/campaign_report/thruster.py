"""One thruster's section of a campaign's page: verdict, budget, figures, tare drift, diagnosis, what happened."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from dataclasses import replace
from math import floor, log10

from identification.estimation.tails import student_quantile
from identification.mismatch.compare.reported_runs import runs_of
from identification.thruster.thrust_report import digits, verdicts
from rig.campaign_report.answers import Told
from rig.campaign_report.budget import COVERAGE, Budget
from rig.campaign_report.pictures import tare_picture, tares
from rig.campaign_report.results import DOUBTFUL, FITS, OPEN, WRONG, of, verdict, with_expanded
from rig.diagnose.recording_names import told_by_name
from rig.diagnose.report.page import short, what_section, where_section
from rig.diagnose.report.words import words
from rig.fit.report.page import tone
from rig.fit.report.pictures import measured_and_fitted, residuals_by_level, residuals_in_order
from rig.report.page import Part, Remark, Section, Table, columns, sentences
from rig.report.style import prose, unit_text

MOST_EVENTS = 40
"""Warnings, trips and errors that are listed; the recording has all."""

CUT_SHORT = (
    "The search had no more time and ended with what it had: this is not its last word. The command below has no "
    "limit; `rig report --diagnosis-time` sets that of this page."
)


def thruster_section(told: Told, folder: str) -> Section:
    """Everything about one thruster; `folder`: name of the campaign's, for what can be typed."""
    if told.answer is None:
        none = sentences([Remark(f"No fit, for {told.why_no_fit}.", "bad")])
        return Section(told.thruster, (*none, *_events(told)))
    fit = told.answer.fit
    said = (*verdicts(fit, told.answer.alternatives), *told.answer.notes)
    known = of(told)
    parts: tuple[Part, ...] = (
        *sentences(Remark(prose(text), tone(text)) for text in said),
        measured_and_fitted(fit),
        residuals_by_level(fit),
        *(budget_table(each) for each in known),
        *sentences(_beside_budget(known)),
        residuals_in_order(fit),
        *tare_picture(fit),
        *sentences(_drift(told)),
        diagnosis_section(told, folder),
        *_events(told),
    )
    return Section(told.thruster, parts, _found(told, known))


def _found(told: Told, known: tuple[Budget, ...]) -> str:
    """The model with its coefficients, and whether it fits, in a sentence."""
    assert told.answer is not None
    fit = told.answer.fit
    values = [f"{prose(b.name)} = {with_expanded(b)} {unit_text(b.unit)} (k = {COVERAGE:g})" for b in known]
    judged = {FITS: "The model fits its points", DOUBTFUL: "Whether the model fits its points is doubtful"}
    judged |= {WRONG: "The model does NOT fit its points", OPEN: "Whether the model fits its points is not judged"}
    over = f"RMSE {fit.rmse:.3g} N over {fit.estimate.rows.y.size} {fit.rmse_of}"
    return f"{judged[verdict(fit)]}: thrust = {', '.join([f'{fit.model} + tare', *values])}; {over}."


def budget_table(budget: Budget) -> Table:
    """Contributions, combined and expanded, in the unit of the coefficient and in % of the variance."""
    unit = unit_text(budget.unit)
    places = max(2 - floor(log10(budget.u)), 0) if budget.u > 0 else 6
    head = ("source", f"u / ({unit})", "u / % of the value", "share of the variance / %", "known from")

    def row(source: str, u: float, share: str, basis: str) -> tuple[str, ...]:
        relative = f"{100 * u / abs(budget.value):.3f}" if budget.value else ""
        return (source, f"{u:.{places}f}", relative, share, basis)

    rows = [
        row(f"{part.source} (type {part.kind})", part.u, f"{budget.share(part):.1f}", part.basis)
        for part in budget.contributions
    ]
    rows.append(row("combined", budget.u, "100.0", _freedom(budget)))
    rows.append(row(f"expanded, U = {COVERAGE:g} u", budget.expanded, "", f"{with_expanded(budget)} {unit}"))
    caption = f"Uncertainty budget of {prose(budget.name)}: standard uncertainties u, combined and expanded"
    return Table(caption, head, tuple(rows), columns(head, "source", "known from"))


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
    files = shlex.join(f"{folder}/{path.name}" for path in told.paths)
    whole = f"`rig diagnose {files} --report diagnosis.html`"
    if told.diagnosis is None:
        why = told.why_no_diagnosis or "it was left out"
        return Section("Diagnosis", sentences([Remark(f"Not made: {why}.", "doubt"), f"To make it: {whole}"]))
    names = {recording.recording_id: path.name for recording, path in zip(told.recordings, told.paths, strict=True)}
    d = told_by_name(told.diagnosis, names)
    runs = runs_of(d, [replace(r, recording_id=names[r.recording_id]) for r in told.recordings])
    cut = [Remark(CUT_SHORT, "doubt")] if told.cut_short else []
    if not d.mismatch:
        return Section(
            "Diagnosis", sentences([*cut, *short(d), *map(words, d.notes), f"All of it: {whole}"]), words(d.statement)
        )
    found = [part for section in what_section(d, runs) for part in section.parts]
    parts = (*sentences([*cut, *short(d)]), *where_section(d, runs).parts, *found)
    last = sentences([*map(words, d.notes), f"All of it: {whole}"])
    return Section("Diagnosis", (*parts, *last), words(f"{d.headline[:1].upper()}{d.headline[1:]}. {d.statement}"))


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
