"""`rig fit` in words: per thruster, for all thrusters together, and against an earlier fit. Plain text, 100 columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, islice

import numpy as np

from identification.thruster import dynamics_report
from identification.thruster.comparison import POWER, Change, Difference
from identification.thruster.dynamics import UNITS
from identification.thruster.model_choice import Candidate, statement
from identification.thruster.thrust import ThrustFit
from identification.thruster.thrust_data import Unusable
from identification.thruster.thrust_report import Row, digits, misfit, sentence, table, verdicts
from rig.fit.answer import Answer
from rig.fit.columns import laid_out
from rig.fit.comparison import Alike, Changed

FORM = "<9 >11 >9 >11 >11 <14 >9 >9 <0"
SIDE = "<24 >4 >10 >10 >10 >10 >10 <0"
ALL = "<10 <10 >11 >10 <24 >5 >9 >9"
ROTOR = ">9 >12 >12 <0"
MOST_PAIRS = 10
"""Pairs that differ, listed; the rest is in the JSON."""


def rarity(p: float) -> str:
    """A p value as text.

    >>> rarity(0.0312), rarity(0.0)
    ('p = 0.031', 'p < 1e-12')
    """
    return "p < 1e-12" if p < 1e-12 else f"p = {p:.2g}"


def _small(value: float | None, pattern: str = "{:.3g}") -> str:
    return "-" if value is None or not np.isfinite(value) else pattern.format(value)


def answer_text(answer: Answer) -> str:
    """Sentence, table, models side by side, verdicts, rotor."""
    lines = [sentence(answer.fit), *_misfit(answer), ""]
    lines += _parameters((answer.fit, *answer.alternatives))
    lines.append("  error: std in % of the value, without the calibration; (white): if samples were independent")
    lines.append("  (eq. 4.11 of G. Indiveri's PhD thesis, University of Genova 1998)")
    lines += ["", *_models(answer.candidates), *_without(answer), ""]
    lines += [f"  - {text}" for text in (*verdicts(answer.fit, answer.alternatives), *answer.notes)]
    if answer.candidates:
        lines.append(f"  - {statement(answer.candidates)}")
    lines += _rotor(answer)
    return "\n".join(lines)


def _parameters(fits: Sequence[ThrustFit]) -> Iterator[str]:
    """One table of all models, the name of each above its parameters."""
    heads = ("", "value", "std", "95 % from", "to", "unit", "error", "(white)", "")
    parts = [[_parameter(row) for row in table(fit)] for fit in fits]
    lines = iter(laid_out([heads, *chain.from_iterable(parts)], FORM))
    yield next(lines)
    for fit, part in zip(fits, parts, strict=True):
        yield f" {fit.model}: RMSE {fit.rmse:.4g} N"
        yield from islice(lines, len(part))


def _parameter(row: Row) -> tuple[str, ...]:
    numbers = [digits(x, row.std) for x in (row.value, row.std, row.low, row.high)]
    known = [text if text != "not determined" else "-" for text in numbers]
    errors = [_small(x, "{:.2g} %") for x in (row.percent, row.percent_uncorrected)]
    return row.name, *known, row.unit, *errors, row.verdict


def _misfit(answer: Answer) -> Iterator[str]:
    """Beside the constant that it is about, with what to type next."""
    wrong = misfit(answer.fit)
    if wrong:
        yield f"  {wrong}; next: rig diagnose FILE (what the model leaves out)"


def _models(candidates: Sequence[Candidate]) -> Iterator[str]:
    if not candidates:
        return
    rows: list[tuple[str, ...]] = [("models side by side", "p", "RMSE / N", "chi2/dof", "its p", "white p", "BIC", "")]
    for c in candidates:
        numbers = [_small(x, "{:.2g}") for x in (c.chi2_per_dof, c.underfit_p, c.whiteness_p)]
        bic = _small(c.bic, "{:+.1f}")
        drop = f"drop {', '.join(c.insignificant)}" if c.insignificant else ""
        rows.append((c.model, str(c.parameters), f"{c.rmse:.4g}", *numbers, bic, drop))
    yield from laid_out(rows, SIDE)


def _without(answer: Answer) -> Iterator[str]:
    for found in answer.remainders:
        left = f"chi2/dof {found.chi2_per_dof:.3g}" if found.chi2_per_dof is not None else "not judged"
        others = ", ".join(f"{name} {digits(v, s)}" for name, v, s in found.others if not name.startswith("tare"))
        rest = f"; left: {others}" if others else ""
        yield f"  without {found.dropped}: RMSE {found.rmse:.4g} N, {left}{rest}"


def _rotor(answer: Answer) -> list[str]:
    found = answer.dynamics
    if found is None:
        return []
    if isinstance(found, Unusable):
        return [f"  - rotor: {found.reason}"]
    beta, std = found.beta
    rows: list[tuple[str, ...]] = []
    for name, plain in zip(found.estimate.names, found.uncorrected.tolist(), strict=True):
        value, error, verdict = found.estimate[name], found.estimate.std_of(name), found.significance[name]
        known = [digits(x, error) for x in (value, error, *found.interval(name))]
        errors = [f"{verdict.percent:.2g} %", _small(100 * plain / abs(value) if value else None, "{:.2g} %")]
        word = "significant" if verdict.significant else "not significant"
        rows.append((name, *known, UNITS[name], *errors, word))
    rows.append(("beta", digits(beta, std), digits(std, std), "", "", UNITS["beta"], "", "", ""))
    levels = laid_out(dynamics_report.levels_table(found), ROTOR)
    lines = ["", f"  {dynamics_report.sentence(found)}", *laid_out(rows, FORM), *levels]
    return [*lines, *(f"  - {text}" for text in dynamics_report.verdicts(found))]


def set_text(answers: Sequence[Answer]) -> str:
    """One table of all thrusters."""
    rows: list[tuple[str, ...]] = [("thruster", "", "value", "std", "95 % interval", "n", "RMSE / N", "chi2/dof")]
    for answer in answers:
        fit = answer.fit
        tail = (str(fit.estimate.rows.y.size), f"{fit.rmse:.3g}", _small(fit.chi2_per_dof, "{:.2f}"))
        for name, p in fit.parameters.items():
            low, high, value, std = (digits(x, p.std) for x in (p.low, p.high, p.value, p.std))
            known = (value, std, f"{low} .. {high}") if np.isfinite(p.std) else (value, "-", "-")
            rows.append((fit.thruster or "?", name, *known, *tail))
    names = dict.fromkeys(f"{a.fit.model}, {next(iter(a.fit.parameters.values())).unit}" for a in answers)
    return "\n".join([f"thrust = {'; '.join(names)}; one tare per recording", *laid_out(rows, ALL)])


def _gain(shared: bool) -> str:
    if shared:
        return "same cell, same calibration: its gain error cancels"
    return "cells or calibrations differ, or are not stated: each gain error counts in full"


def alike_text(found: Alike) -> str:
    """Are the thrusters the same, and which differ."""
    test = found.test
    law = f"F = {test.F:.3g} with {test.dof:.0f} and {test.dof_error:.3g} dof, {rarity(test.p_value)}"
    lines = [
        f"thrusters differ: {law}" if test.differ else f"thrusters do not differ: {law}",
        f"  - {_gain(found.shared)}",
    ]
    if found.odd and found.rest is not None:
        others = f"the others agree ({rarity(found.rest.p_value)})"
        lines.append(f"  - {', '.join(found.odd)} differ{'s' if len(found.odd) == 1 else ''} from the rest; {others}")
    elif test.differ and found.rest is None and len(found.groups) > 2:
        lines.append("  - no majority is alike: each thruster needs its own coefficients")
    apart = sorted((d for d in found.pairs if d.differ), key=lambda d: -abs(d.value) / max(d.std, 1e-300))
    lines.append(f"  - {len(apart)} of {len(found.pairs)} pairs differ (5 % for all pairs together, Holm)")
    lines += [f"      {d.second} against {d.first}: {_effect(d)}" for d in apart[:MOST_PAIRS]]
    if found.repeat is not None:
        lines.append(f"  - {found.repeat.statement}")
    else:
        lines.append("  - one recording of each: what taking it off and on again would change is not in these figures")
    return "\n".join(lines)


def _effect(d: Difference) -> str:
    low, high = 100 * d.relative_low, 100 * d.relative_high
    std = 100 * d.std / abs(d.value / d.relative) if d.relative else float("nan")
    percent = [digits(x, std) for x in (100 * d.relative, low, high)]
    return f"{d.coefficient} {percent[0]} % (95 %: {percent[1]} to {percent[2]} %), {rarity(d.p_value)}"


def changed_text(found: Changed) -> str:
    """Has a thruster changed since the earlier fit."""
    lines = [f"against {found.source}:"]
    for change, shared in zip(found.changes, found.shared, strict=True):
        lines.append(f"  {_change(change)}")
        if change is found.changes[-1] or len(set(found.shared)) > 1:
            lines.append(f"    {_gain(shared)}")
    if len(found.changes) > 1:
        lines.append(f"  p values are Holm's for all {len(found.changes)} coefficients together")
    return "\n".join([*lines, *(f"  - {note}" for note in found.notes)])


def _change(change: Change) -> str:
    d = change.difference
    word = "has changed" if change.changed else "has not changed measurably"
    first = abs(d.value / d.relative) if d.relative else float("nan")
    least = f"{100 * change.smallest / first:.2g} %" if np.isfinite(first) else f"{change.smallest:.2g}"
    return (
        f"{d.second or 'thruster'} {word}: {_effect(d).rpartition(',')[0]}, {rarity(change.adjusted_p)}; "
        f"a change of {least} would have been seen in {100 * POWER:.0f} % of cases"
    )
