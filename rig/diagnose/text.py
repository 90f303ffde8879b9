"""A diagnosis in words: verdict, where, what, how much better, what next. Plain text, 100 columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import floor, isfinite, log10
from textwrap import wrap

from identification.mismatch.diagnosis import Diagnosis, Finding
from identification.mismatch.unexplained import FlexibleShape, FormulaFound, Remainder
from identification.mismatch.value import Value, Where
from identification.mismatch.verdict_clauses import NOT_WHITE, degree, sureness
from rig.diagnose.by_calibration import by_calibration
from rig.diagnose.typed import TITLE, typed

WIDTH = 100
MOST_STEPS = 12
BAR = 24
"""Characters of the longest bar in the table of a shape."""


def diagnosis_text(d: Diagnosis) -> str:
    """Everything that a person needs to act."""
    lines = [*_para(f"{d.thruster or 'This thruster'}: {d.headline}. {d.statement}"), ""]
    lines += _where(d)
    lines += _findings(d)
    if d.unexplained is not None:
        lines += _unexplained(d.unexplained, d.force_unit)
    lines += _model(d)
    lines += _equations(d)
    lines += _fit(d)
    lines += _next(d)
    lines += [line for note in d.notes for line in _para(f"- {note}")]
    return "\n".join(lines).rstrip()


def with_error(value: Value) -> str:
    """Value and standard error to the error's second digit.

    >>> with_error(Value(0.41234, 0.00123, "N/V^2")), with_error(Value(3.0, float("nan"), "s"))
    ('0.4123 +- 0.0012 N/V^2', '3 s')
    >>> with_error(Value(24.0, 5844288569.0, "s", limits=(1.0, 400.0)))
    'not determined (between 1 and 400 s)'
    """
    unit = "" if value.unit in ("", "1") else f" {value.unit}"
    if not value.determined:
        low, high = value.interval
        return "not determined" + (f" (between {low:.3g} and {high:.3g}{unit})" if value.limits else "")
    if not (isfinite(value.std) and value.std > 0):
        return f"{value.value:.4g}{unit}"
    digits = max(1 - floor(log10(value.std)), 0)
    if digits > 9:
        return f"{value.value:.4g} +- {value.std:.2g}{unit}"
    return f"{value.value:.{digits}f} +- {value.std:.{digits}f}{unit}"


def rarity(p: float) -> str:
    """A p value as text.

    >>> rarity(0.0312), rarity(0.0)
    ('p = 0.031', 'p < 1e-12')
    """
    return "p < 1e-12" if p < 1e-12 else f"p = {p:.2g}"


def place(where: Where) -> str:
    """A stretch of a quantity in words.

    >>> place(Where("command_voltage", -1.0, 1.0, "V"))
    'command_voltage -1 to 1 V'
    """
    unit = "" if where.unit in ("", "1") else f" {where.unit}"
    return f"{where.quantity} {where.low:.3g} to {where.high:.3g}{unit}"


def _para(text: str, indent: str = "") -> list[str]:
    hang = indent + ("  " if text.startswith("- ") else "")
    return wrap(text, WIDTH, initial_indent=indent, subsequent_indent=hang)


def baseline_name(d: Diagnosis) -> str:
    """Without what a twin holds, which the statement has told."""
    return d.baseline_model.split(" (")[0]


def _values(values: Mapping[str, Value]) -> str:
    return ", ".join(f"{name} {with_error(value)}" for name, value in values.items())


def _where(d: Diagnosis) -> Iterator[str]:
    if not d.mismatch:
        return
    yield f"Where {baseline_name(d)} fails:"
    for m in d.mismatch:
        yield from _para(f"- {m.statement[:-1]} ({rarity(m.p_value)}).", "  ")
    yield ""


def _findings(d: Diagnosis) -> Iterator[str]:
    for finding in d.findings:
        yield from _finding(finding)
        yield ""


def _finding(f: Finding) -> Iterator[str]:
    form = f" ({f.form.replace('_', ' ')})" if f.form else ""
    yield f"{f.effect}{form}{', in the measurement, not in the thruster' if f.in_measurement else ''}"
    yield from _para(f.statement, "  ")
    if f.parameters:
        yield from _para(_values({v.told or name: v for name, v in f.parameters.items()}), "  ")
    if f.before:
        yield from _para(f"before: {_values({v.told or name: v for name, v in f.before.items()})}", "  ")
    evidence = (rarity(f.p_value), sureness(f), f"BIC better by {f.bic_gain:.4g}")
    yield from _para(", ".join(part for part in evidence if part), "  ")
    if f.grade != "all":
        yield from _para("; ".join((degree(f), *f.doubts)), "  ")
    for rival in f.rivals:
        yield from _para(f"- or {rival.effect} (BIC worse by {rival.bic_loss:.1f}): {rival.statement}", "  ")


def _unexplained(u: Remainder, force: str) -> Iterator[str]:
    of = "what the baseline leaves" if u.unpredictive else "what remains"
    yield f"Not explained: {100 * u.share:.0f} % of {of}, at {place(u.where)} ({rarity(u.p_value)})"
    yield from _shape(u, force)
    for text in u.resembles:
        yield from _para(f"- resembles {text}", "  ")
    for flexible in u.flexible:
        yield from _flexible(flexible)
    if u.replaces:
        yield from _para(f"It stands in the place of {', '.join(u.replaces)}, whose name was not earned.", "  ")
    if u.formula is not None:
        yield from _formula(u.formula)
    yield ""


def _flexible(f: FlexibleShape) -> Iterator[str]:
    """The spline in bins, beside what was measured there."""
    yield from _para(f.statement, "  ")
    unit = "" if f.unit in ("", "1") else f" / {f.unit}"
    for s in f.splines:
        label = s.times if s.unit in ("", "1") else f"{s.times} / {s.unit}"
        rows = zip(s.table, s.told, strict=True)
        size = max((abs(value) for (_, value, _, _), known in rows if known), default=0.0) or 1.0
        yield f"  {f.covariate + unit:>24}{label:>14}{'measured':>12}{'std':>10}"
        for (at, value, measured, std), known in zip(s.table, s.told, strict=True):
            if not known:
                yield f"  {at:>24.4g}{'not determined':>26}"
                continue
            yield f"  {at:>24.4g}{value:>14.3g}{measured:>12.3g}{std:>10.2g}  {_bar(value, size)}".rstrip()


def _formula(f: FormulaFound) -> Iterator[str]:
    yield from _para(f"formula (not a physics): {f.text} ({f.symbols})", "  ")
    yield from _para(
        f"{_values(f.coefficients)}; not fitted {f.heldout_before:.4g} -> {f.heldout_after:.4g} N; the same in both "
        f"halves with {rarity(f.halves_p)}",
        "  ",
    )
    if f.equals:
        yield from _para(f"about as well: {', '.join(f.equals)} (F: the thrust)", "  ")


def _shape(u: Remainder, force: str) -> Iterator[str]:
    """The residual over the covariate, bin by bin, as numbers and bars."""
    rows = [(a, b, c, known) for (a, b, c), known in zip(u.shape, u.told, strict=True) if isfinite(b)]
    size = max((abs(b) for _, b, _, known in rows if known), default=0.0)
    if not size:
        return
    unit = "" if u.where.unit in ("", "1") else f" / {u.where.unit}"
    yield f"  {u.where.quantity + unit:>24}{f'residual / {force}':>14}{f'std / {force}':>10}"
    for at, residual, std, known in rows:
        if known:
            error = f"{std:.2g}" if isfinite(std) else "-"
            yield f"  {at:>24.4g}{residual:>14.3g}{error:>10}  {_bar(residual, size)}".rstrip()
        else:
            yield f"  {at:>24.4g}{'not determined':>24}"


def _bar(value: float, size: float) -> str:
    """Minus signs to the left of a line, plus signs to the right.

    >>> _bar(-1.0, 2.0)
    '            ------------|'
    """
    length = round(BAR * abs(value) / size)
    return " " * (BAR - length) + "-" * length + "|" if value < 0 else " " * BAR + "|" + "+" * length


def _model(d: Diagnosis) -> Iterator[str]:
    terms = "".join(f" + {term}" for term in d.model_terms)
    named = {name: value for name, value in d.model.items() if not name.startswith("flexible:")}  # these have a table
    yield from _para(f"Model: {baseline_name(d)}{terms}; {_values(named)}{by_calibration(d)}")


def _equations(d: Diagnosis) -> Iterator[str]:
    if d.equations:
        yield TITLE
    yield from (f"  {line}" for line in typed(d.equations, WIDTH - 2))


def _fit(d: Diagnosis) -> Iterator[str]:
    yield f"{f'RMSE per sample / {d.unit}':<24}{'before':>12}{'after':>12}{'noise':>12}"
    yield f"{'  fitted':<24}{d.train.before:>12.4g}{d.train.after:>12.4g}"
    yield f"{'  not fitted':<24}{d.heldout.before:>12.4g}{d.heldout.after:>12.4g}{d.heldout.noise:>12.4g}"
    if d.heldout.grown:
        yield "  the error on what was not fitted GROWS: this model describes the runs, it does not predict others"
    yield from _para(f"not fitted: {d.heldout.what}", "  ")
    white = f"white ({rarity(d.whiteness_p)})" if d.white else f"NOT white ({rarity(d.whiteness_p)}): {NOT_WHITE}"
    yield from _para(f"chi2 per degree of freedom {d.chi2_per_dof:.3f}; what remains is {white}", "  ")


def _next(d: Diagnosis) -> Iterator[str]:
    if d.next_experiment is None:
        return
    n = d.next_experiment
    yield ""
    if not n.steps:
        yield from _para(f"Next experiment: no sweep settles it. {n.why}")
        return
    total = sum(step.duration for step in n.steps)
    yield from _para(f"Next experiment ({total:.0f} s, expected power {n.expected_power:.2f}): {n.why}")
    flow = any(step.flow_speed for step in n.steps)
    for step in n.steps[:MOST_STEPS]:
        water = f", flow {step.flow_speed:.3g} m/s" if flow else ""
        yield f"  {step.command_voltage:+8.3g} {n.unit} for {step.duration:.3g} s{water}"
    if len(n.steps) > MOST_STEPS:
        yield f"  ... and {len(n.steps) - MOST_STEPS} more; all of them are in the JSON"
