"""Thresholds that a fit has found, as sharp as they are.

A search spreads the jump of a threshold over a share of the largest command, so that a slope leads to where it lies. A
tick within that spread turns the rotor half, which it never does: of a threshold of 0.51889 V and a tick of 0.519 V
rows beside the band were 10 sigma off, and a lag was told 6 of its errors too short.
"""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.model.model import extended
from identification.mismatch.observer import UNWATCHED, Observer
from identification.mismatch.select.forward_selection import Selected, Thruster, resumed
from identification.mismatch.select.stepwise import accept_threshold
from identification.physics.term import Scale, Term
from identification.physics.traits import SpreadJump

REACH = (0.0, -0.5, 0.5, -1.0, 1.0)
"""Of the spread, to either side of where the fit has the threshold: elsewhere it would have turned no other tick."""


def sharpened(found: Selected, rng: np.random.Generator, watch: Observer = UNWATCHED) -> Selected:
    """The search gone on with beside sharp thresholds, where the runs speak for them; else as found."""
    if found.undone:
        return found
    out = found
    for term in [t for t in found.after.fit.model.terms if _is_spread(t, found.data.scale)]:
        out = _with_sharp(out, term)
    return found if out is found else resumed(out, out.after, rng, watch)


def _is_spread(term: Term, scale: Scale) -> bool:
    return term.traits.spread and any(p.blur > 0 for p in term.parameters(scale)) and _sharp(term) != term


def _sharp(term: Term) -> Term:
    return cast(Term, cast(SpreadJump, term).sharp())


def _with_sharp(found: Selected, term: Term) -> Selected:
    """With one threshold sharp, in the catalogue too, where chi-square falls by more than a parameter's worth."""
    after, data, sharp = found.after, found.data, _sharp(term)
    best = min(_nearby(found, term, sharp), key=lambda each: each.chi2)
    if best.chi2 > after.fit.chi2 - accept_threshold(1):
        return found
    new = Thruster(data, found.terms).replaced(after, fit(best.model, best.theta, data, after.weights, near=after.fit))
    return replace(found, after=new, terms=tuple(sharp if t == term else t for t in found.terms), standing=None)


def _nearby(found: Selected, term: Term, sharp: Term) -> list[Fit]:
    """With it there or nearby, all other values as they are."""
    now, data, known = found.after.fit, found.data, term.parameters(found.data.scale)
    out = []
    for share in REACH:
        moved = tuple(v + share * p.blur for p, v in zip(known, now.values[term], strict=True))
        model, theta = now.less(term)
        out.append(fit(*extended(model, theta, sharp, moved), data, found.after.weights, most_steps=0))
    return out
