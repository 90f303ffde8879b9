"""C where several models of the same recordings stand beside one another: its interval holds what each makes of it.

Of models that are as likely a priori the odds are exp(-BIC/2); what is known of C is the mixture of what they say,
each in proportion to its odds (Hoeting, Madigan, Raftery and Volinsky, Stat. Sci. 14, 1999, 382, eq. 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.tails import normal_sf
from identification.mismatch import policy
from identification.mismatch.answer.report_assembly import constant_of
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.model.data import Data
from identification.mismatch.name.naming import Named
from identification.mismatch.select.stepwise import RivalTerm
from identification.mismatch.value import QUANTILE, Value
from identification.physics.term import Term
from identification.recording import Floats

BEYOND = 0.025
"""Probability that is left on either side of a 95 % interval."""
REACH = 10.0
"""Standard errors, beyond which no law has anything."""
HALVINGS = 60
"""Of the way between the ends of all intervals: a quantile as exact as a float."""


@dataclass(frozen=True, slots=True)
class Answered:
    """C by one model."""

    value: float
    std: float
    odds: float
    """Of it to the model that is told."""
    instead: str
    """What has another effect or form in its place, of the model told; empty where that comes beside all of it."""
    place: str
    """The same with that."""


def averaged(
    constant: Value,
    beside: Fit,
    data: Data,
    named: Sequence[Named],
    unclaimed: Sequence[RivalTerm[Term, Fit]] = (),
) -> tuple[Value, tuple[str, ...]]:
    """C with the interval of the mixture, and what is said of rivals whose C is not within that of the model told.

    `beside`: the fit beside which rivals and other forms of the names stand, and with one term more each what is
    `unclaimed`. The value stays that of the model told.
    """
    moved = constant.value - constant_of(beside, data)[0]
    known = [(n.term, r) for n in named for r in (*n.rivals, *n.forms) if _within_reach(r)]
    every = (_answered(moved, data, told, r) for told, r in (*known, *((None, r) for r in unclaimed)))
    others = sorted((each for each in every if each.std > 0), key=lambda each: -each.odds)
    if not others or not constant.std > 0:
        return constant, ()
    values = np.array([constant.value, *(each.value for each in others)])
    stds = np.array([constant.std, *(each.std for each in others)])
    odds = np.array([1.0, *(each.odds for each in others)])
    own = constant.interval
    ends = [quantile(values, stds, odds / odds.sum(), p) for p in (BEYOND, 1 - BEYOND)]
    low, high = min(ends[0], own[0]), max(ends[1], own[1])
    elsewhere = {each.instead or each.place: each for each in reversed(others) if not own[0] <= each.value <= own[1]}
    told = tuple(_said(each, constant.unit, (low, high)) for each in elsewhere.values())
    if (low, high) == own:
        return constant, told
    far = max(high - constant.value, constant.value - low)
    return replace(constant, std=far / QUANTILE, ends=(low, high)), told


def quantile(values: Floats, stds: Floats, weights: Floats, p: float) -> float:
    """Below which a mixture (m,) of normal laws has the probability p.

    >>> one = np.array([1.0, 2.0]), np.array([0.1, 0.1]), np.array([1.0, 0.0])
    >>> two = np.array([1.0, 2.0]), np.array([0.1, 0.1]), np.array([0.5, 0.5])
    >>> [round(quantile(*law, p), 3) for law in (one, two) for p in (0.025, 0.975)]
    [0.804, 1.196, 0.836, 2.164]
    """
    low, high = float(np.min(values - REACH * stds)), float(np.max(values + REACH * stds))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below = float(weights @ normal_sf((values - middle) / stds))
        low, high = (middle, high) if below < p else (low, middle)
    return 0.5 * (low + high)


def _within_reach(rival: RivalTerm[Term, Fit]) -> bool:
    """A fit that was ended early, for it would not come within reach, says nothing of C."""
    return rival.bic_loss < policy.select.RIVAL_STATED_BIC


def _answered(moved: float, data: Data, term: Term | None, rival: RivalTerm[Term, Fit]) -> Answered:
    """A rare effect has the odds of meeting one against it, an ordinary one has them for it. `moved`: by how much C of
    the model told is not that of the fit beside which rivals stand. `term`: in whose place it is; None: beside all."""
    rarer = int(rival.term.traits.rare) - int(term is not None and term.traits.rare)
    loss = max(rival.bic_loss + rarer * policy.select.RARE_TERM_BIC, 0.0)
    value, std = constant_of(rival.fit, data)
    told, other = _labels(term, rival.term) if term is not None else ("", rival.term.id.replace("_", " "))
    return Answered(value + moved, float(np.nan_to_num(std)), float(np.exp(-loss / 2)), told, other)


def _labels(term: Term, other: Term) -> tuple[str, str]:
    """Effects; of one effect its forms."""
    one = [each.id if term.id != other.id or not each.form else f"{each.id} ({each.form})" for each in (term, other)]
    return one[0].replace("_", " "), one[1].replace("_", " ")


def _said(other: Answered, unit: str, ends: tuple[float, float]) -> str:
    held = "holds both" if ends[0] <= other.value <= ends[1] else "does not reach so far, as that is rarely met"
    where = f"in the place of {other.instead}" if other.instead else "beside what is told"
    return (
        f"With {other.place} {where}, which the recordings do not rule out, C would be "
        f"{other.value:.4g} {unit}: its interval {held}."
    )
