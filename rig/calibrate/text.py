"""The answer of a calibration for a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

from identification.calibration.answer import CellCalibration

SEEN = 0.01
"""p-value below which a term is said to be seen."""
SAID = {
    "even": "bend, the same in pull and push",
    "odd": "bend, mirrored",
    "cubic": "bend, cubic",
    "lag": "hysteresis, half the loop (+: up reads more)",
    "remanence": "zero after forward less after backward, half",
    "drift": "drift of the zero",
    "zero_temperature": "zero with temperature",
    "gain_temperature": "gain with temperature",
    "creep": "creep of a long hold, beyond that of the steps",
}


def told(found: CellCalibration, steps: int) -> Iterator[str]:
    """Lines."""
    gain = found.gain
    yield f"gain           {gain.value:.7g}, 95 % interval {gain.low:.7g} to {gain.high:.7g} N/N ({steps} steps)"
    dof = f"{gain.dof:.3g}" if isfinite(gain.dof) and gain.dof < 1e6 else "many"
    yield f"               u = {gain.std:.2g}, k = {gain.coverage:.2f} at {dof} effective degrees of freedom"
    yield f"range          {found.curve.low:.5g} to {found.curve.high:.5g} N, zero reads {found.curve.zero:.4g} N"
    for term in found.terms:
        if term.name in SAID:
            seen = "" if term.p_value < SEEN else "   (not seen)"
            seen_creep = term.name == "creep" and found.time_constant is not None
            extra = f", time constant about {found.time_constant:.2g} s" if seen_creep else ""
            yield f"  {SAID[term.name]:<45} {term.value:+.3g} +- {term.std:.2g} {term.unit}{extra}{seen}"
    yield f"scatter        {found.scatter:.3g} N of one load put on again ({found.dof:.3g} degrees of freedom)"
    yield "budget of the gain"
    total = gain.std**2
    for each in sorted(found.budget, key=lambda one: -one.std):
        yield f"  {each.name:<30} {each.kind}   {each.std:.2e}   {100 * each.std**2 / total:5.1f} %"
    yield f"at the ends of the range a force is known within {100 * found.curve.gain_std:.2g} % (1 sigma, with creep)"
