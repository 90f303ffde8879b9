"""The factors that a run has learnt so far, in words: rotation per volt, thrust per n|n|, current per n|n|, delays."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from statistics import fmean, median, pstdev

from rig.safety.consistency.levels import Level

LEAST = 2
"""Levels from which on there is something to tell."""
UNEXPECTED = 1.6
"""Times the constant that the campaign expects, or a part of it: is told, and ends nothing."""


def factors(levels: Iterable[Level], delays: Sequence[float]) -> str:
    """One clause per factor; empty while too little is known."""
    driven = [each for each in levels if each.volts]
    if len(driven) < LEAST:
        return ""
    said = [text for volts in (1.0, -1.0) for text in _of_one_way([e for e in driven if e.volts * volts > 0], volts)]
    if delays:
        said.append(f"thrust {median(delays):.2f} s after rotation (of {len(delays)} steps)")
    return "; ".join(said)


def doubts(levels: Iterable[Level], expected_C: float | None) -> list[str]:
    """What no run can judge by itself: a sign and a scale that were there from the beginning. `expected_C`: N/V^2."""
    pushing = [each for each in levels if each.volts > 0 and each.push is not None]
    if not pushing:
        return []
    top = max(pushing, key=lambda each: each.volts)
    found = (top.push or 0.0) / top.volts**2
    said = f"{found:.3g} N/V^2 at {top.volts:g} V"
    if found < 0:
        return [f"the thrust is negative at a positive voltage, {said}: wired, mounted or scaled the other way round?"]
    if expected_C is None or 1 / UNEXPECTED <= found / expected_C <= UNEXPECTED:
        return []
    return [
        f"the thrust is {said}, {expected_C:.3g} are expected (expected_C): is the scale of the force sensor right?"
    ]


def _of_one_way(levels: list[Level], volts: float) -> list[str]:
    way = "at +V" if volts > 0 else "at -V"
    per_volt = [e.means.rate / e.volts for e in levels if e.means.rate is not None]
    by = "V|V|" if not per_volt else "n|n|"
    pushes = [e.push / e.turn for e in levels if e.push is not None and e.turn]
    amps = [abs(e.means.current / e.turn) for e in levels if e.means.current is not None and e.turn]
    return [
        *_factor(f"{way} rotation", per_volt, "rev/s per V"),
        *_factor(f"{way} thrust per {by}", pushes, "N"),
        *_factor(f"{way} current per {by}", amps, "A"),
    ]


def _factor(name: str, values: list[float], unit: str) -> list[str]:
    """Mean and spread over the levels: what is no constant spreads."""
    if not values:
        return []
    spread = f" +- {pstdev(values):.2g}" if len(values) > 1 else ""
    return [f"{name} {fmean(values):.4g}{spread} {unit} ({len(values)} level{'s' * (len(values) > 1)})"]
