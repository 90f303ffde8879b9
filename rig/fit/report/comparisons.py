"""What stands beside a thrust fit: its rivals, the rotor, the other thrusters, an earlier fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.thruster import dynamics_report
from identification.thruster.dynamics import UNITS, DynamicsFit
from identification.thruster.model_choice import Candidate, statement
from identification.thruster.thrust_data import Unusable
from identification.thruster.thrust_report import digits
from rig.fit.answer import Answer
from rig.fit.comparison import Changed, alike
from rig.fit.text import alike_text, changed_text
from rig.report import regression_figures
from rig.report.page import Picture, Remark, Section, Sentences, Table, columns, sentences
from rig.report.regression_figures import Curve, Group, Interval
from rig.report.style import prose, unit_text


def value_and_interval(value: float, std: float, low: float, high: float) -> tuple[str, str]:
    """Two cells of a table; what is not known is a dash.

    >>> value_and_interval(0.40123, 0.0012, 0.39883, 0.40363), value_and_interval(1.0, np.nan, np.nan, np.nan)
    (('0.4012 ± 0.0012', '0.3988 to 0.4036'), ('1', '–'))
    """
    if not np.isfinite(value):
        return "–", "–"
    if not np.isfinite(std):
        return digits(value, std), "–"
    return f"{digits(value, std)} ± {digits(std, std)}", f"{digits(low, std)} to {digits(high, std)}"


def models_section(candidates: Sequence[Candidate]) -> tuple[Section, ...]:
    """All models that the data allow, with what each residual says; nothing for a single one."""
    if len(candidates) < 2:
        return ()
    head = ("model", "parameters", "RMSE / N", "χ²/dof", "p of χ²", "p of whiteness", "BIC over the best", "to drop")
    rows = []
    for c in candidates:
        numbers = (c.chi2_per_dof, c.underfit_p, c.whiteness_p, c.bic)
        known = ["–" if x is None or not np.isfinite(x) else f"{x:.2g}" for x in numbers]
        rows.append((c.model, str(c.parameters), f"{c.rmse:.4g}", *known, prose(", ".join(c.insignificant))))
    told = Table("Models fitted to the same data", head, tuple(rows), columns(head, "model", "to drop"))
    return (Section("Models side by side", (told,), prose(statement(candidates))),)


def rotor_section(found: DynamicsFit | Unusable | None) -> tuple[Section, ...]:
    """The rotor's own motion; nothing where it was not recorded or could not be told."""
    if found is None or isinstance(found, Unusable):
        return ()
    head = ("parameter", "value ± std", "95 % interval", "unit", "verdict")
    rows = []
    for name in found.estimate.names:
        std, verdict = found.estimate.std_of(name), found.significance[name]
        cells = value_and_interval(found.estimate[name], std, *found.interval(name))
        rows.append((name, *cells, unit_text(UNITS[name]), "significant" if verdict.significant else "not significant"))
    beta, std = found.beta
    rows.append(
        ("beta", *value_and_interval(beta, std, beta - 1.96 * std, beta + 1.96 * std), unit_text(UNITS["beta"]), "")
    )
    first, *levels = dynamics_report.levels_table(found)
    parts: tuple[Table | Sentences | Picture, ...] = (
        Table(f"Parameters of {found.model}", head, tuple(rows), columns(head, "parameter", "unit", "verdict")),
        Sentences(tuple(Remark(prose(text)) for text in dynamics_report.verdicts(found))),
        *_settled(found),
        Table("Levels that were held", first, tuple(levels), frozenset(), folded=True),
    )
    return (Section("Rotor", parts, prose(dynamics_report.sentence(found))),)


def _settled(found: DynamicsFit) -> tuple[Picture, ...]:
    seen = [level for level in found.levels if np.isfinite(level.rate)]
    if not seen:
        return ()
    V = np.array([level.voltage for level in seen])
    line = np.linspace(min(V.min(), 0.0), max(V.max(), 0.0), 2)
    k, std = found.estimate["k"], found.estimate.std_of("k")
    half = 1.96 * std * np.abs(line)
    curve = Curve("k V", line, k * line, k * line - half, k * line + half)
    points = Group("settled holds", V, np.array([level.rate for level in seen]))
    plot = regression_figures.fit_band([points], curve, "command voltage / V", "rotation rate / (rev/s)")
    return (Picture("Settled rate over voltage", plot, "A straight line through zero is what C = C_t k² rests on."),)


def alike_sentences(answers: Sequence[Answer]) -> tuple[Sentences, ...]:
    """Are the thrusters the same, by a test; nothing where they cannot be compared."""
    found = alike(answers)
    return () if found is None else sentences(_lines(alike_text(found)))


def change_sections(found: Sequence[Changed]) -> tuple[Section, ...]:
    """Has a thruster changed since each earlier fit."""
    out = []
    for one in found:
        title, *said = _lines(changed_text(one))
        rows = [
            Interval(
                f"{c.difference.second} {prose(c.difference.coefficient)}",
                *(100 * x for x in (c.difference.relative, c.difference.relative_low, c.difference.relative_high)),
            )
            for c in one.changes
        ]
        drawn = [Picture("Change since then", regression_figures.forest(rows, "change / %", 0.0))] if rows else []
        out.append(Section(f"Compared with {title.removeprefix('against ').rstrip(':')}", (*sentences(said), *drawn)))
    return tuple(out)


def _lines(text: str) -> list[str]:
    return [prose(line.strip().removeprefix("- ")) for line in text.splitlines()]
