"""A formula as a person writes it, with its coefficients in units and their errors."""

from __future__ import annotations

from math import sqrt

import numpy as np

from identification.flexible_terms.formula import CHANNELS, Formula, Monomial, driver_symbol, is_square
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.model.data import Data
from identification.mismatch.value import Value
from identification.recording import Floats


def told(term: Formula, fitted: Fit, data: Data) -> tuple[str, dict[str, Value]]:
    """`residual = ...` and its coefficients; a square is completed where the formula is one."""
    values, covariance = _coefficients(term, fitted)
    scale = _scales(term, fitted, data)
    values, covariance = values * scale, covariance * np.outer(scale, scale)
    names = [_product(m, fitted, data) for m in term.monomials]
    units = [_unit(m, data, bare=_bare(fitted, term)) for m in term.monomials]
    square = _square(term, values, covariance)
    if square is not None:
        symbol, high, middle, middle_std = square
        unit = _symbol_unit(symbol, data)
        factor = _factor(term.monomials[0], fitted, term, data)
        a, std = float(values[high]), sqrt(float(covariance[high, high]))
        text = f"residual = {_with_error(a, std)} ({symbol} - {_with_error(middle, middle_std)} {unit})^2{factor}"
        return text, {"a": Value(a, std, units[high]), f"{symbol}_0": Value(middle, middle_std, unit)}
    parts: list[str] = []
    coefficients: dict[str, Value] = {}
    for i, (m, name) in enumerate(zip(term.monomials, names, strict=True)):
        c, std = float(values[i]), sqrt(float(covariance[i, i]))
        sign = "" if not parts else " + "
        parts.append(f"{sign}{_with_error(c, std)} {name}{_factor(m, fitted, term, data)}")
        coefficients["ab"[i]] = Value(c, std, units[i])
    return "residual = " + "".join(parts), coefficients


def legend(term: Formula) -> str:
    """What its symbols stand for."""
    symbols = dict.fromkeys(q for m in term.monomials for q, _ in m.powers)
    words = {"V": "command or motor voltage", "t": "time since the recording began"}
    known = {q: CHANNELS[q][0] if q in CHANNELS else words.get(q, "") for q in symbols}
    known |= {q: f"low-pass of {q[q.index('(') + 1 : -1]}, {q[2 : q.index('(')]} s" for q in symbols if q[:2] == "lp"}
    return ", ".join(f"{q}: {what}" for q, what in known.items())


def _number(value: float, std: float) -> str:
    """To the error's second digit at most.

    >>> _number(-0.0021234, 0.00004), _number(18.12, 0.3)
    ('-0.002123', '18.12')
    """
    digits = 3 if std <= 0 or value == 0 else min(max(int(np.ceil(np.log10(abs(value) / std))) + 2, 2), 6)
    return f"{value:.{digits}g}"


def _with_error(value: float, std: float) -> str:
    """In brackets, where there is an error.

    >>> _with_error(-0.0021234, 0.0004), _with_error(18.12, 0.0)
    ('(-0.00212 +- 0.0004)', '18.1')
    """
    return f"({_number(value, std)} +- {std:.2g})" if std > 0 else _number(value, std)


def _coefficients(term: Formula, fitted: Fit) -> tuple[Floats, Floats]:
    values, inside = fitted.values[term], fitted.layout.of(term)
    return np.array(values), np.nan_to_num(fitted.cov[inside, inside])


def _bare(fitted: Fit, term: Formula) -> bool:
    """The formula is all that is added to C V|V|."""
    return fitted.model.terms == (term,) and not fitted.model.given


def _scales(term: Formula, fitted: Fit, data: Data) -> Floats:
    """From coefficients of quantities in units of their size to those of the quantities; thrust as C V|V| if it is."""
    del data
    sizes = dict(term.sizes)
    out = []
    for m in term.monomials:
        size = float(np.prod([sizes[q] ** p for q, p in m.powers]))
        out.append((fitted.theta.C if m.times != "1" and _bare(fitted, term) else 1.0) / size)
    return np.array(out)


def _product(m: Monomial, fitted: Fit, data: Data) -> str:
    del fitted, data
    return " ".join(q if p == 1 else f"{q}^{p}" for q, p in m.powers)


def _factor(m: Monomial, fitted: Fit, term: Formula, data: Data) -> str:
    """What the powers are multiplied by."""
    v = driver_symbol(data.histories[0])
    if m.times == "1":
        return ""
    if _bare(fitted, term):
        return f" {v}|{v}|" if m.times == "F" else f" {v}^2"
    return f" {m.times}"


def _symbol_unit(symbol: str, data: Data) -> str:
    if symbol == "t":
        return "s"
    if symbol in CHANNELS and symbol != driver_symbol(data.histories[0]):
        return CHANNELS[symbol][1]
    unit = data.scale.driver_unit
    squared = symbol.startswith("lp") and is_square(symbol[symbol.index("(") + 1 : -1])
    return f"{unit}^2" if squared else unit


def _unit(m: Monomial, data: Data, *, bare: bool) -> str:
    """Of a coefficient."""
    below = [_symbol_unit(q, data) + (f"^{p}" if p > 1 else "") for q, p in m.powers]
    if m.times != "1" and bare:
        below.insert(0, f"{data.scale.driver_unit}^2")
    top = "N" if m.times == "1" or bare else "1"
    return f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({' '.join(below)})"


def _square(term: Formula, values: Floats, covariance: Floats) -> tuple[str, int, float, float] | None:
    """(symbol, which is the square, middle, its standard error) of a q^2 + b q with the same factor."""
    if len(term.monomials) != 2:
        return None
    one, two = sorted(range(2), key=lambda i: term.monomials[i].degree)
    low, high = term.monomials[one], term.monomials[two]
    if low.times != high.times or low.times == "|F|" or len(low.powers) != 1 or len(high.powers) != 1:
        return None
    (q, p), (r, s) = low.powers[0], high.powers[0]
    if q != r or (p, s) != (1, 2):
        return None
    b, a = float(values[one]), float(values[two])
    middle = -b / (2 * a)
    slope = np.array([-1 / (2 * a), b / (2 * a**2)])
    inside = covariance[np.ix_([one, two], [one, two])]
    return q, two, middle, sqrt(max(float(slope @ inside @ slope), 0.0))
