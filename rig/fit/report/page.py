"""The report of `rig fit`: per thruster the sentence, the table, the figures that judge the fit, the points."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from identification.thruster.thrust import ThrustFit
from identification.thruster.thrust_report import digits, sentence, table, verdicts
from rig.fit.answer import Answer
from rig.fit.comparison import Changed
from rig.fit.report.comparisons import (
    alike_sentences,
    change_sections,
    models_section,
    rotor_section,
    value_and_interval,
)
from rig.fit.report.pictures import QUANTITY, pictures
from rig.report import provenance, regression_figures
from rig.report.page import Page, Picture, Remark, Section, Table, Tone, columns, sentences, write
from rig.report.regression_figures import Interval
from rig.report.style import prose, unit_text

SIGNS: tuple[tuple[str, Tone], ...] = (
    ("not underfitted", "good"),
    ("residual white", "good"),
    ("this fit means nothing", "bad"),
    ("the data cannot tell", "bad"),
    ("underfitted", "doubt"),
    ("points scatter", "doubt"),
    ("not white", "doubt"),
    ("poorly excited", "doubt"),
    ("fit not judged", "doubt"),
    ("calibration uncertainty", "doubt"),
    ("were not steady", "doubt"),
    ("the directions are not alike", "doubt"),
    ("had not reached a constant velocity", "doubt"),
    ("hardly told apart", "doubt"),
)
"""What a verdict says, and the sign it gets; the first that is found counts."""


def write_report(
    answers: Sequence[Answer], path: Path, files: Sequence[Path] = (), changes: Sequence[Changed] = ()
) -> None:
    """One page for all thrusters. `files`: the recordings, to be hashed. Raises RecordingError, OSError."""
    write(fit_page(answers, provenance.sources(files), changes), path)


def fit_page(
    answers: Sequence[Answer], found: Sequence[provenance.Source] = (), changes: Sequence[Changed] = ()
) -> Page:
    """The page of one or more answers."""
    names = [answer.fit.thruster or "thruster" for answer in answers]
    ids = [name for answer in answers for name in answer.fit.recordings]
    parts = [comparison(answers)] if len(answers) > 1 else []
    parts += [thruster_section(answer, alone=len(answers) == 1) for answer in answers]
    parts += change_sections(changes)
    many = f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]
    lead = prose(sentence(answers[0].fit)) if len(answers) == 1 else _spread(answers)
    return Page(f"Thrust fit of {many}", lead, (*parts, provenance.section(found, ids)), contents=len(answers) > 1)


def _spread(answers: Sequence[Answer]) -> str:
    """Of the first coefficient over thrusters."""
    first = [next(iter(answer.fit.parameters.values())) for answer in answers]
    name = next(iter(answers[0].fit.parameters))
    values = [p.value for p in first if np.isfinite(p.value)]
    if not values:
        return f"{len(answers)} thrusters were fitted with {answers[0].fit.model}; {name} was determined for none."
    unit = unit_text(first[0].unit)
    widest = 100 * (max(values) - min(values)) / abs(float(np.mean(values)))
    return (
        f"{len(answers)} thrusters were fitted with thrust = {answers[0].fit.model}: {name} lies between "
        f"{min(values):.4g} and {max(values):.4g} {unit}, {widest:.2g} % apart."
    )


def comparison(answers: Sequence[Answer]) -> Section:
    """All thrusters side by side."""
    head = ("thruster", "coefficient", "value ± std", "95 % interval", "unit", "points", "RMSE / N", "χ²/dof")
    rows, intervals = [], []
    for answer in answers:
        fit = answer.fit
        judged = "" if fit.chi2_per_dof is None else f"{fit.chi2_per_dof:.2f}"
        for name, p in fit.parameters.items():
            end = (unit_text(p.unit), str(fit.estimate.rows.y.size), f"{fit.rmse:.3g}", judged)
            thruster = fit.thruster or "?"
            rows.append((thruster, prose(name), *value_and_interval(p.value, p.std, p.low, p.high), *end))
            label = thruster if len(fit.parameters) == 1 else f"{thruster} {prose(name)}"
            intervals.append(Interval(label, p.value, p.low, p.high))
    first = next(iter(answers[0].fit.parameters.values()))
    plot = regression_figures.forest(intervals, f"coefficient of {answers[0].fit.model} / ({unit_text(first.unit)})")
    caption = "Bars are 95 % intervals, the load cell's calibration included: that part is common to all thrusters."
    told = Table("Coefficients of all thrusters", head, tuple(rows), columns(head, "thruster", "coefficient", "unit"))
    return Section("All thrusters", (told, *alike_sentences(answers), Picture("Thrusters side by side", plot, caption)))


def thruster_section(answer: Answer, *, alone: bool = False) -> Section:
    """Everything about one thruster; `alone` on a page whose head already says it."""
    fit = answer.fit
    said = (*verdicts(fit, answer.alternatives), *answer.notes)
    judgement = Section(
        "What to know before the numbers are used", sentences(Remark(prose(text), tone(text)) for text in said)
    )
    return Section(
        "The fit" if alone else fit.thruster or "Thruster",
        (
            parameter_table(fit),
            judgement,
            *pictures(fit),
            *models_section(answer.candidates),
            *other_models(answer.alternatives),
            *rotor_section(answer.dynamics),
            *points_table(fit),
        ),
        "" if alone else prose(sentence(fit)),
    )


def tone(verdict: str) -> Tone:
    """The sign of a verdict, by what it says.

    >>> tone("not underfitted (chi2/dof 0.9)"), tone("underfitted: residuals exceed"), tone("explained by rate")
    ('good', 'doubt', '')
    """
    return next((sign for words, sign in SIGNS if words in verdict), "")


def parameter_table(fit: ThrustFit) -> Table:
    """Of the model asked for alone: on a phone each row is a card, and the curve shall not stand behind twelve."""
    return _parameters("Parameters; std holds scatter and calibration", (fit,))


def other_models(alternatives: Sequence[ThrustFit]) -> tuple[Table, ...]:
    """Parameters of the models beside the one asked for, folded; nothing without such models."""
    return (_parameters("Parameters of the other models", alternatives, folded=True),) if alternatives else ()


def _parameters(caption: str, fits: Sequence[ThrustFit], *, folded: bool = False) -> Table:
    head = ("parameter", "model", "value ± std", "95 % interval", "unit", "relative error", "verdict", "RMSE / N")
    rows = []
    for fit in fits:
        for row in table(fit):
            found = value_and_interval(row.value, row.std, row.low, row.high)
            error = f"{row.percent:.2g} %" if np.isfinite(row.percent) else "–"
            rmse = f"{fit.rmse:.4g}" if row.name in fit.parameters else ""
            rows.append((prose(row.name), fit.model, *found, unit_text(row.unit), error, row.verdict, rmse))
    words = columns(head, "parameter", "model", "unit", "verdict")
    return Table(caption, head, tuple(rows), words, folded)


def points_table(fit: ThrustFit) -> tuple[Table, ...]:
    """One row per hold, folded; nothing for a fit on samples."""
    if fit.rmse_of != "points":
        return ()
    explained = QUANTITY[fit.voltage_quantity]
    head = (
        *("recording", "start / s", "end / s", explained, "thrust / N", "std error / N"),
        *("n", "n effective", "residual / N", "steady"),
    )
    rows = []
    left = iter(fit.estimate.fit.residual)
    for k, run in enumerate(fit.runs):
        for point in run.points.points if run.points is not None else ():
            e = point.thrust
            window = (str(k + 1), f"{e.t_start:.2f}", f"{e.t_end:.2f}", f"{point.voltage:.3f}")
            found = (digits(e.mean, e.std_error), digits(e.std_error, e.std_error), str(e.n), f"{e.n_effective:.0f}")
            rows.append((*window, *found, f"{next(left):+.3f}", "yes" if point.steady else "no"))
    return (Table(f"All {len(rows)} points", head, tuple(rows), columns(head, "steady"), folded=True),)
