"""A twin out of its file, as `rig.twin.writing` writes it; what is wrong with the file is said in one sentence."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from identification.flexible_terms.flexible import MULTIPLIERS, Flexible
from identification.physics.term import Scale, Term
from identification.twin import TERMS, Alternative, Source, Twin, TwinLine, TwinNoise, TwinTerm, names_of
from rig.errors import TwinError
from rig.twin.writing import FORMAT, VERSION

DRIVERS = ("command_voltage", "motor_voltage", "rotation_rate")
ASYMMETRY = 1e-9
"""Relative: a covariance matrix less symmetric than this is none."""


def read_twin(path: Path) -> Twin:
    """Raises TwinError naming file, key, what was expected and what came."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise TwinError(f"{path} can't be read ({error.strerror}); give a twin that --save-twin wrote") from error
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise TwinError(f"{path} is no twin: it is not JSON ({error}); give a twin that --save-twin wrote") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        found = content.get("format") if isinstance(content, dict) else type(content).__name__
        raise TwinError(f"{path} is no twin: its format is {found!r} where {FORMAT!r} is expected")
    top = Table(path, "", content)
    if top.whole("version") > VERSION:
        raise TwinError(f"{path}: version {content['version']} is later than {VERSION}; install a later thruster-rig")
    return _twin(top)


class Table(NamedTuple):
    """One JSON object of the file, and where it is, for messages."""

    path: Path
    place: str
    content: Mapping[str, Any]

    def name(self, key: str) -> str:
        return f"{self.place}.{key}" if self.place else key

    def wrong(self, key: str, expected: str) -> TwinError:
        return TwinError(f"{self.path}: {self.name(key)} must be {expected}, got {self.content[key]!r:.60}")

    def get(self, key: str) -> Any:
        if key not in self.content:
            raise TwinError(f"{self.path}: {self.name(key)} is missing; it was there when --save-twin wrote it")
        return self.content[key]

    def number(self, key: str, least: float = -np.inf) -> float:
        value = self.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value) or value < least:
            raise self.wrong(key, "a finite number" + (f" of at least {least:g}" if isfinite(least) else ""))
        return float(value)

    def whole(self, key: str) -> int:
        value = self.get(key)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.wrong(key, "a whole number")
        return value

    def text(self, key: str) -> str:
        value = self.get(key)
        if not isinstance(value, str):
            raise self.wrong(key, "text")
        return value

    def table(self, key: str) -> Table:
        value = self.get(key)
        if not isinstance(value, dict):
            raise self.wrong(key, "an object")
        return Table(self.path, self.name(key), value)

    def tables(self, key: str) -> list[Table]:
        value = self.get(key)
        if not isinstance(value, list) or not all(isinstance(each, dict) for each in value):
            raise self.wrong(key, "a list of objects")
        return [Table(self.path, f"{self.name(key)}[{i}]", each) for i, each in enumerate(value)]

    def numbers(self, key: str, least: float = -np.inf) -> tuple[float, ...]:
        value = self.get(key)
        if not isinstance(value, list):
            raise self.wrong(key, "a list of numbers")
        inner = Table(self.path, self.name(key), {str(i): each for i, each in enumerate(value)})
        return tuple(inner.number(str(i), least) for i in range(len(value)))


def _twin(top: Table) -> Twin:
    driver = top.text("driver")
    if driver not in DRIVERS:
        raise top.wrong("driver", f"one of {', '.join(DRIVERS)}")
    terms = tuple(_term(each) for each in top.tables("terms"))
    names = names_of(terms)
    rate, slip = top.get("rate_per_driver"), top.content.get("slip_rate_per_driver")
    return Twin(
        thruster=top.text("thruster"),
        driver_quantity=driver,
        C=top.number("C"),
        constant_interval=_interval(top) if "C_interval" in top.content else None,
        terms=terms,
        names=names,
        covariance=_covariance(top.table("covariance"), names),
        noise=_noise(top.table("noise")),
        lines=tuple(map(_line, top.tables("lines"))) if "lines" in top.content else (),
        alternatives=tuple(map(_alternative, top.tables("alternatives"))) if "alternatives" in top.content else (),
        sources=tuple(_source(each) for each in top.tables("recordings")),
        interval=top.number("interval", 1e-6),
        highest_driver=top.number("highest_driver", 0.0),
        rate_per_driver=None if rate is None else top.number("rate_per_driver"),
        slip_rate_per_driver=None if slip is None else top.number("slip_rate_per_driver"),
        created=top.text("created"),
        software=top.text("software"),
        origin=f"the twin {top.path.name}",
    )


def _interval(top: Table) -> tuple[float, float]:
    ends = top.numbers("C_interval")
    if len(ends) != 2 or not ends[0] <= top.number("C") <= ends[1]:
        raise top.wrong("C_interval", "two numbers with C between them")
    return ends[0], ends[1]


def _term(table: Table) -> TwinTerm:
    effect, form = table.text("effect"), table.text("form")
    own = _flexible(table.table("flexible")) if "flexible" in table.content else None
    term = _of_catalogue(table, effect, form) if own is None else own
    if (term.id, term.form) != (effect, form):
        raise table.wrong("effect", f"{term.id!r} of form {term.form!r}, as its shape is")
    sizes = table.table("scale")
    scale = Scale(
        driver_unit=sizes.text("driver_unit"),
        **{
            f.name: sizes.number(f.name, 0.0)
            for f in fields(Scale)
            if f.name != "driver_unit" and (f.default is MISSING or f.name in sizes.content)
        },
    )
    inside = table.table("parameters")
    expected = term.parameters(scale)
    odd = sorted(set(inside.content) - {p.name for p in expected})
    if odd:
        raise TwinError(
            f"{table.path}: {inside.place} has {', '.join(odd)}; the parameters of {effect} are "
            f"{', '.join(p.name for p in expected)}"
        )
    values = {}
    for p in expected:
        entry = inside.table(p.name)
        values[p.name] = entry.number("value")
        if entry.text("unit") != p.unit:
            raise entry.wrong("unit", repr(p.unit))
        if not p.low <= values[p.name] <= p.high:
            raise entry.wrong("value", f"within {p.low:g} and {p.high:g} {p.unit}")
    return TwinTerm(effect, form, values, scale, own)


def _of_catalogue(table: Table, effect: str, form: str) -> Term:
    known = sorted({e for e, _ in TERMS})
    if effect not in known:
        raise table.wrong("effect", f"an effect of the catalogue ({', '.join(known)})")
    if (effect, form) not in TERMS:
        forms = ", ".join(repr(f) for e, f in TERMS if e == effect)
        raise table.wrong("form", f"a form of {effect} ({forms})")
    return TERMS[effect, form]


def _flexible(table: Table) -> Flexible:
    """The shape of a flexible term."""
    knots = table.numbers("knots")
    if not knots or any(b <= a for a, b in pairwise(knots)):
        raise table.wrong("knots", "a list of ascending numbers")
    zero, times = table.get("zero"), table.get("times")
    if not isinstance(zero, list) or any(i not in range(len(knots)) for i in zero):
        raise table.wrong("zero", "a list of places in knots")
    if not isinstance(times, list) or not times or any(m not in MULTIPLIERS for m in times):
        raise table.wrong("times", f"a list of some of {', '.join(MULTIPLIERS)}")
    if table.whole("degree") not in (1, 3):
        raise table.wrong("degree", "1 or 3")
    return Flexible(
        table.text("quantity"),
        table.text("unit"),
        knots,
        tuple(zero),
        tuple(times),
        1 if table.whole("degree") == 1 else 3,
        table.number("memory", 0.0),
        table.number("period", 0.0),
    )


def _covariance(table: Table, names: Sequence[str]) -> tuple[tuple[float, ...], ...]:
    if table.get("names") != list(names):
        raise table.wrong("names", f"{list(names)!r}, in the order of C and the terms")
    rows = table.get("matrix")
    if not isinstance(rows, list):
        raise table.wrong("matrix", "a list of rows")
    inner = Table(table.path, table.name("matrix"), {str(i): row for i, row in enumerate(rows)})
    matrix = tuple(inner.numbers(str(i)) for i in range(len(rows)))
    if len(matrix) != len(names) or any(len(row) != len(names) for row in matrix):
        raise table.wrong("matrix", f"{len(names)} rows of {len(names)} numbers")
    full = np.array(matrix)
    std = np.sqrt(np.abs(np.diag(full)))
    size = np.where(std > 0, std, 1.0)
    scaled = full / np.outer(size, size)
    if np.any(np.diag(full) < 0) or np.any(np.abs(scaled - scaled.T) > ASYMMETRY):
        raise table.wrong("matrix", "symmetric, with no variance below zero")
    return matrix


def _noise(table: Table) -> TwinNoise:
    pairs = table.get("bands")
    if not isinstance(pairs, list):
        raise table.wrong("bands", "a list of pairs")
    inner = Table(table.path, table.name("bands"), {str(i): pair for i, pair in enumerate(pairs)})
    bands = [inner.numbers(str(i), 0.0) for i in range(len(pairs))]
    noise = TwinNoise(
        white=table.number("white", 0.0),
        proportional=table.number("proportional", 0.0),
        scales=table.numbers("scales", 1e-9),
        slow=table.numbers("slow", 0.0),
        bands=tuple((b[0], b[1]) for b in bands if len(b) == 2),
        band=table.numbers("band", 0.0),
    )
    if len(noise.scales) != len(noise.slow):
        raise table.wrong("slow", f"as long as scales ({len(noise.scales)})")
    if len(noise.bands) != len(noise.band) or len(bands) != len(noise.bands):
        raise table.wrong("bands", f"pairs, as many as band has numbers ({len(noise.band)})")
    return noise


def _line(table: Table) -> TwinLine:
    def entry(key: str, least: float = -np.inf) -> tuple[float, float]:
        inner = table.table(key)
        return inner.number("value", least), inner.number("std", 0.0)

    kind, turns = table.text("kind"), table.text("turns")
    if kind not in ("fixed", "rotation"):
        raise table.wrong("kind", "fixed or rotation")
    if turns not in ("rev", "V s"):
        raise table.wrong("turns", "rev or V s")
    if kind == "rotation" and table.get("ratio") is None:
        raise table.wrong("ratio", "an object: the line goes with the rotor")
    (amplitude, amplitude_std), (frequency, frequency_std) = entry("amplitude", 0.0), entry("frequency", 0.0)
    ratio, ratio_std = (None, 0.0) if kind == "fixed" else entry("ratio", 0.0)
    phase, phase_std = (None, 0.0) if table.get("phase") is None else entry("phase")
    return TwinLine(
        amplitude,
        amplitude_std,
        frequency,
        frequency_std,
        ratio,
        ratio_std,
        "rev" if turns == "rev" else "V s",
        phase,
        phase_std,
        table.number("growth", 0.0) if "growth" in table.content else 0.0,
        table.number("at_speed", 0.0) if "at_speed" in table.content else 0.0,
    )


def _alternative(table: Table) -> Alternative:
    terms = tuple(_term(each) for each in table.tables("terms"))
    return Alternative(table.number("C"), terms, table.number("loss"), table.number("gain"))


def _source(table: Table) -> Source:
    file = table.text("file") if "file" in table.content else ""
    return Source(table.text("recording_id"), table.text("sha256"), table.number("tare"), file)
