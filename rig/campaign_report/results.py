"""The first sections of a campaign's page: how it ended, and all thrusters with C ± U and what is said of them."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from math import isfinite

from identification.thruster.thrust import ThrustFit
from identification.thruster.thrust_report import digits, misfit
from rig.campaign_report.answers import Told
from rig.campaign_report.budget import COVERAGE, Budget, budgets
from rig.campaign_report.folder import Campaign, Run
from rig.fit.report.comparisons import alike_sentences
from rig.report import regression_figures
from rig.report.page import Part, Picture, Remark, Section, Table, Tone, columns, sentences
from rig.report.regression_figures import Interval
from rig.report.style import prose, unit_text

TONES: dict[str, Tone] = {"completed": "good", "aborted": "doubt", "tripped": "bad", "cut": "bad"}
NOTHING = "–"
FITS, DOUBTFUL, WRONG, OPEN = "fits", "doubtful", "does NOT fit", "not judged"
"""What is said of a model: at 5 % and at 0.1 % of the chi-square test; without one nothing can be."""


def lead(campaign: Campaign, told: Sequence[Told]) -> str:
    """What a reader in a hurry takes away."""
    done = len(campaign.thrusters) - len(campaign.missing)
    cause = f", {campaign.cause}" if campaign.cause else ""
    lacking = f", not {', '.join(campaign.missing)}" if campaign.missing else ""
    text = f"{ended(campaign)}{cause}: {done} of {len(campaign.thrusters)} thrusters measured to the end{lacking}"
    fits = [each.answer.fit for each in told if each.answer is not None]
    wrong = [fit.thruster for fit in fits if misfit(fit)]
    doubtful = [fit.thruster for fit in fits if verdict(fit) == DOUBTFUL]
    if wrong:
        text += f"; the model does NOT fit {', '.join(wrong)}: see there before its numbers are used"
    if doubtful:
        text += f"; whether it fits {', '.join(doubtful)} is doubtful"
    if wronged := dict.fromkeys(run.thruster for run in campaign.runs if run.wrong):
        text += f"; a recording of {', '.join(wronged)} is damaged or was changed"
    if not fits:
        return f"{text}; no thruster has a fit."
    return f"{text}. {_span(told)}"


def _span(told: Sequence[Told]) -> str:
    """The first coefficient of all thrusters, in a sentence."""
    known = [found[0] for each in told if (found := of(each))]
    if not known:
        return "No uncertainty can be stated."
    name, unit = prose(known[0].name), unit_text(known[0].unit)
    if len(known) == 1:
        return f"{name} = {with_expanded(known[0])} {unit} (k = {COVERAGE:g})."
    low, high = min(known, key=lambda b: b.value), max(known, key=lambda b: b.value)
    return f"{name} lies between {with_expanded(low)} and {with_expanded(high)} {unit} (k = {COVERAGE:g})."


def of(told: Told) -> tuple[Budget, ...]:
    """The budgets of a thruster's coefficients; none without a fit."""
    return () if told.answer is None else budgets(told.answer.fit, told.recordings)


def ended(campaign: Campaign) -> str:
    """How it ended, as the beginning of a sentence."""
    if campaign.wrong:
        return "Read without its ledger"
    words = {"completed": "Completed", "aborted": "ABORTED", "tripped": "TRIPPED", "cut": "CUT"}
    return words.get(campaign.outcome, campaign.outcome.upper())


def course_section(campaign: Campaign) -> Section:
    """How it ended, which thrusters lack, what is wrong with files, and every run."""
    head = ("thruster", "recording", "recorded", "ended", "why")
    rows = tuple((run.thruster, run.path.name, _when(run), run.outcome, run.cause) for run in campaign.runs)
    table = Table("Runs in the order in which they were begun", head, rows, columns(head, *head))
    return Section("How it went", (*sentences(_course(campaign)), table))


def _when(run: Run) -> str:
    """As people write it; the recordings of the rig are stamped in UTC."""
    created = run.recording.created if run.recording is not None else ""
    return created[:19].replace("T", " ") + " UTC" if created.endswith("+00:00") else created or NOTHING


def _course(campaign: Campaign) -> Iterator[Remark]:
    if campaign.wrong:
        yield Remark(campaign.wrong, "bad")
    cause = f": {campaign.cause}" if campaign.cause else ""
    yield Remark(f"{ended(campaign)}{cause}.", TONES.get(campaign.outcome, "doubt"))
    if campaign.missing:
        goes_on = "" if campaign.wrong else f"; `rig resume {campaign.folder.name}` goes on with it"
        yield Remark(f"Not measured to the end: {', '.join(campaign.missing)}{goes_on}.", "bad")
    if campaign.resumed:
        times = "once" if campaign.resumed == 1 else f"{campaign.resumed} times"
        yield Remark(f"The campaign was gone on with {times} after it had been cut.")
    for run in campaign.runs:
        if run.wrong:
            left_out = "" if run.used else "; nothing of it is in the figures below"
            yield Remark(f"{run.thruster}: {run.wrong}{left_out}.", "bad")


def results_section(told: Sequence[Told]) -> Section:
    """All thrusters: C ± U, what else the fit found, and the verdict."""
    head = ("thruster", f"coefficient ± U (k = {COVERAGE:g})", "U / %", "tare / N", "points", "RMSE / N", "χ²/dof",
            "verdict", "diagnosis")  # fmt: skip
    rows = tuple(row for each in told for row in _rows(each))
    words = columns(head, *head[:2], "verdict", "diagnosis")
    table = Table(
        f"Thrust coefficients with their expanded uncertainty U = {COVERAGE:g} u (about 95 %)", head, rows, words
    )
    wrong = sentences(remark for each in told for remark in _warnings(each))
    answers = [each.answer for each in told if each.answer is not None]
    beside: tuple[Part, ...] = (*alike_sentences(answers), *_side_by_side(told)) if len(answers) > 1 else ()
    return Section("Results", (table, *wrong, *beside), _models(told))


def _models(told: Sequence[Told]) -> str:
    forms = dict.fromkeys(each.answer.fit.model for each in told if each.answer is not None)
    return f"Thrust = {'; '.join(forms)} + tare, one tare for each recording." if forms else "No thruster has a fit."


def _rows(told: Told) -> Iterator[tuple[str, ...]]:
    cut = " (its search was cut short)" if told.cut_short else ""
    head = f"{told.diagnosis.headline}{cut}" if told.diagnosis is not None else "not made"
    if told.answer is None:
        yield (told.thruster, *(NOTHING,) * 6, "no fit", NOTHING)
        return
    fit = told.answer.fit
    tares = list(fit.tare.values())
    tare = digits(tares[0].value, tares[0].std) if len(tares) == 1 else f"{len(tares)} of them"
    judged = NOTHING if fit.chi2_per_dof is None else f"{fit.chi2_per_dof:.2f}"
    end = (
        tare,
        str(fit.estimate.rows.y.size),
        f"{fit.rmse:.3g}",
        judged,
        "; ".join([verdict(fit), *_reserves(told)]),
        head,
    )
    known = {each.name: each for each in of(told)}
    for name, p in fit.parameters.items():
        value = with_expanded(known[name]) if name in known else digits(p.value, p.std)
        percent = f"{100 * known[name].expanded / abs(p.value):.2g}" if name in known and p.value else NOTHING
        yield (told.thruster, f"{prose(name)} = {value} {unit_text(p.unit)}", percent, *end)


def _reserves(told: Told) -> Iterator[str]:
    """What is to be known of the recordings before their numbers are used."""
    if not any(run.outcome == "completed" for run in told.runs):
        yield f"its run was {told.runs[-1].outcome}"
    if any(run.wrong for run in told.runs):
        yield "a recording is damaged or was changed"


def with_expanded(budget: Budget) -> str:
    """`0.41201 ± 0.00043`: the value with its expanded uncertainty, to the second digit of u."""
    return f"{digits(budget.value, budget.u)} ± {digits(budget.expanded, budget.u)}"


def verdict(fit: ThrustFit) -> str:
    """In two words, whether the model fits its points."""
    if misfit(fit):
        return WRONG
    judged = fit.estimate.underfit
    if judged is None or judged.dof <= 0:
        return OPEN
    return DOUBTFUL if judged.underfitted else FITS


def _warnings(told: Told) -> Iterator[Remark]:
    """Beside the table that would be read alone."""
    if told.answer is None:
        yield Remark(f"{told.thruster}: no fit, for {told.why_no_fit}.", "bad")
        return
    if wrong := misfit(told.answer.fit):
        files = shlex.join(path.name for path in told.paths)
        yield Remark(
            prose(f"{told.thruster}: {wrong}; next: `rig diagnose {files}` (what the model leaves out)."), "bad"
        )


def _side_by_side(told: Sequence[Told]) -> tuple[Picture, ...]:
    found = [(each.thruster, b) for each in told for b in of(each)]
    if len(found) < 2:
        return ()
    alone = all(b.name == found[0][1].name for _, b in found)
    rows = [
        Interval(name if alone else f"{name} {prose(b.name)}", b.value, b.value - b.expanded, b.value + b.expanded)
        for name, b in found
        if isfinite(b.value)
    ]
    plot = regression_figures.forest(rows, f"coefficient / ({unit_text(found[0][1].unit)})")
    caption = (
        "Bars are ± U, k = 2; the load cell's calibration is in them, and common to all that were measured with it."
    )
    return (Picture("Thrusters side by side", plot, caption),)
