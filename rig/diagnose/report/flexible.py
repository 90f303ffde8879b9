"""What is modelled without being explained: the flexible terms as figures, the formula in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from identification.mismatch.unexplained import FlexibleShape, Remainder, Spline
from identification.mismatch.value import Value
from rig.diagnose.report.figures import spline_over
from rig.diagnose.report.words import axis, effect_name, not_drawn, rarity, value_cells, words
from rig.report.page import Picture, Remark
from rig.report.regression_figures import Curve, Group

ORDINATES: Mapping[str, tuple[str, float]] = {
    "force": ("force / N", 1.0),
    "rate": ("force at full drive / N", 1.0),
    "gain": ("% of the thrust", 100.0),
    "even": ("% of the size of the thrust", 100.0),
    "step": ("% of the step", 100.0),
    "reversed": ("% of the thrust", 100.0),
    "late": ("% of the thrust that comes late", 100.0),
    "drive": ("drive / its unit", 1.0),
}
"""Label and factor of what a spline multiplies."""


def modelled_remarks(u: Remainder) -> Iterator[Remark]:
    """What takes the place of physics, and how well it does on data that it has not seen."""
    for shape in u.flexible:
        yield Remark(words(shape.statement))
    if u.flexible and u.replaces:
        names = ", ".join(map(effect_name, u.replaces))
        yield Remark(f"It stands in the place of {names}, whose name was not earned.")
    if not u.flexible:
        yield Remark("No free curve predicts better what was not fitted; the model is left as it is.", "doubt")
    if u.formula is None:
        return
    f = u.formula
    told = "; ".join(f"{name} = {_told(value)}" for name, value in f.coefficients.items())
    yield Remark(words(f"Formula, not a physics: {f.text}, with {told} ({f.symbols})."))
    yield Remark(
        f"Alone it takes the error on data that were not fitted from {f.heldout_before:.4g} to {f.heldout_after:.4g} "
        f"N; its coefficients are the same in both halves ({rarity(f.halves_p)})."
    )
    if f.equals:
        yield Remark(words(f"About as good (F is the thrust): {', '.join(f.equals)}."))


def _told(value: Value) -> str:
    shown, _, unit = value_cells(value)
    return f"{shown} {unit.replace('degC', '°C')}".strip()


def flexible_pictures(u: Remainder, driver: str) -> Iterator[Picture]:
    """Each spline with its band beside the residual in bins."""
    for f in u.flexible:
        for s in f.splines:
            yield _picture(f, s, driver)


def _picture(f: FlexibleShape, s: Spline, driver: str) -> Picture:
    y, factor = ORDINATES[s.times]
    at, _, measured, std = np.array(s.table)[s.told].T
    points = Group("measured", at, factor * measured, 1.96 * factor * std)
    over, value, half = s.at[s.drawn], s.value[s.drawn], 1.96 * s.std[s.drawn]
    curve = Curve("free curve", over, factor * value, factor * (value - half), factor * (value + half))
    x = axis(f.covariate, driver)
    x = f"{x} (low-pass of {f.memory:g} s)" if f.memory else x
    x = f"{x} (within each {f.period:.4g} s)" if f.period else x
    plot = spline_over(points, curve, x, y, spread_out=f.covariate == "time_since_step")
    name = x.split(" / ")[0]
    kind = "cubic spline" if f.degree == 3 else "broken line"
    caption = (
        f"A {kind} with {len(f.knots)} knots that {s.what}, with its 95 % band; points: what the model without it "
        "lacks, in bins, with 95 % intervals. No physics is claimed; beyond the range it is constant."
        + not_drawn(len(s.table) - at.size)
    )
    return Picture(f"Free curve over {name}: {s.times}", plot, caption)
