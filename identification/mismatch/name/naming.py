"""A name is earned: no rival does as well, the parameter is the same everywhere, and its value is possible."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.at_bounds import at_bound
from identification.mismatch.estimate.estimate import Estimate, fit_without
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.estimate.rate_levels import contradiction
from identification.mismatch.locate.residual_structure_test import ResidualStructure
from identification.mismatch.model.data import Data
from identification.mismatch.model.predictor import predict
from identification.mismatch.model.whitening import Weights
from identification.mismatch.name.named_term import Check, NamedTerm, named_term, part_check
from identification.mismatch.prepare.preparing import DRIVERS
from identification.mismatch.select.exchange.static_pairs import STATIC, static_curve
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.select.forward_selection import SwapTest, Thruster
from identification.mismatch.select.likeliest_trials import alternatives
from identification.mismatch.select.limits import clipping
from identification.mismatch.select.stepwise import stands
from identification.physics.term import Term
from identification.recording import Floats
from identification.run_history.history import TURNING

Named = NamedTerm[Term, Fit]
CLIPPING = "what else was recorded clips with it, or does not"
RATE_LEVELS = "the measured rate stands where it puts it"
REPAIR = "no repair of another shape"
"""What is asked of two shapes on one static curve."""
TOO_FAST = "it is faster than the samples can show"
AT_LEAST = 0.01
"""Of the least time that samples can show: what is no longer ends there."""


def checks(estimate: Estimate, term: Term, data: Data, many: int) -> tuple[Check, ...]:
    """Whether its value is possible and seen, and its parameter the same in halves, directions, at levels, in runs.

    `many`: terms of the model, all of which are asked.
    """
    at = _told(term, estimate.fit.values[term], data)
    ended = at_bound(term, estimate.fit, data, estimate.weights)
    elsewhere = clipping.contradiction(estimate.fit, term, estimate.noise, data)
    before_rotor = static_curve(term, measured=data.with_rate) == "rate"
    change = _raw_effect(estimate.fit, (term,), data)
    cancelled = _cancelled(estimate.fit, term, change, data)
    return (
        Check(
            "possible", "its values are possible", f"it would take values that are not possible: {at}" if ended else ""
        ),
        Check("sampled", "the samples can show it", _why_unseen(estimate.fit, term, data)),
        *((Check("clipping", CLIPPING, elsewhere),) if term.traits.limits else ()),
        *((Check("rate_levels", RATE_LEVELS, contradiction(term, estimate.fit, data)),) if before_rotor else ()),
        *(Check("undone", "no other term undoes it", f"it and {other.id} nearly cancel") for other in cancelled),
        *(() if cancelled else (Check("undone", "no other term undoes it"),)),
        *_constancy(estimate, change, data, many),
    )


def _told(term: Term, theta: Sequence[float], data: Data) -> str:
    """Its values with names and units."""
    told = zip(term.parameters(data.scale), theta, strict=True)
    return ", ".join(f"{p.name.replace('_', ' ')} {v:.3g}{'' if p.unit == '1' else f' {p.unit}'}" for p, v in told)


def _constancy(estimate: Estimate, change: list[Floats], data: Data, many: int) -> Iterator[Check]:
    """The parameter in each part by itself: a score test of a further column, the term's change in one part alone."""
    n = data.size
    basis = orthogonal_basis(estimate.fit.jacobian[:n])
    driver = [h.driver[r] for h, r in zip(data.histories, data.rows, strict=True)]
    middle = [h.middle[r] for h, r in zip(data.histories, data.rows, strict=True)]
    half = np.median(np.abs(np.concatenate(driver)))
    splits = {
        "in both halves of the run": [t > np.median(t) for t in middle],
        "in both directions": [v < 0 for v in driver],
        "at all levels": [np.abs(v) > half for v in driver],
    }
    if len(driver) > 1:
        splits["in all runs"] = [np.full(v.size, i >= len(driver) / 2) for i, v in enumerate(driver)]
    if any(h.static for h in data.histories):
        del splits["in both halves of the run"]  # a table may stand in the order of its levels
    weights = Weights(estimate.weights.thrust)
    whole = float(np.linalg.norm(weights.whiten(change, [])))
    for what, masks in splits.items():
        column = weights.whiten([c * m for c, m in zip(change, masks, strict=True)], [])
        if (
            not policy.name.PART_SIZE
            < float(np.linalg.norm(column)) / max(whole, 1e-300)
            < 1 - policy.name.PART_SIZE**2
        ):
            yield Check("constant", f"the same {what}", told="nearly all of it is in one part", silent=True)
            continue
        residual, tests = estimate.fit.residual[:n], len(splits) * many
        yield part_check(what, column, basis, residual, policy.name.PART_DIFFERENCE, tests)


def _why_unseen(now: Fit, term: Term, data: Data) -> str:
    """Ringing beyond half the sampling rate: between the samples it may be any other delay. Or over within a sample, or
    within what the recording itself says of when its samples were taken. Empty where the samples show it."""
    known = {p.name: (p, value) for p, value in zip(term.parameters(data.scale), now.values[term], strict=True)}
    if term.traits.quick:
        least, value = known[term.traits.quick]
        usual = _usual_time(term, now.values[term], data) or value
        if value <= least.low * (1 + AT_LEAST):
            return TOO_FAST
        return _within_its_own_times(usual, min(h.delay_std for h in data.histories))
    spacing = min(h.spacing for h in data.histories)
    beyond = bool(term.traits.frequency) and known[term.traits.frequency][1] > 0.5 / spacing
    return TOO_FAST if beyond else ""


def _within_its_own_times(time: float, known_to: float) -> str:
    if time > known_to:
        return ""
    return (
        f"it takes {1e3 * time:.3g} ms, and the recording knows its own times to {1e3 * known_to:.3g} ms: that may be"
        " the rotor's, the force sensor's or a part of how the samples were made"
    )


def _usual_time(term: Term, theta: tuple[float, ...], data: Data) -> float | None:
    """Time in s of a rotor at the median level: a quadratic one takes longer at small ones. None of other terms."""
    rotor = term.traits.dynamics(term, theta, data.scale.driver).rotor if term.traits.dynamics else None
    if rotor is None:
        return None
    size = np.abs(np.concatenate([h.driver for h in data.histories]))
    quadratic, linear, _ = rotor
    return 1 / (2 * quadratic * float(np.median(size[size > TURNING * data.scale.driver])) + linear)


def _cancelled(now: Fit, term: Term, change: list[Floats], data: Data) -> list[Term]:
    """Terms that follow a step too and undo nearly all of what this one does: a large lag with a large lead."""
    if "time_since_step" not in term.covariates:
        return []
    found = []
    for other in now.model.terms:
        if other != term and "time_since_step" in other.covariates:
            both = np.concatenate(_raw_effect(now, (term, other), data))
            alone = np.concatenate(_raw_effect(now, (other,), data))
            least = min(float(np.linalg.norm(np.concatenate(change))), float(np.linalg.norm(alone)))
            if float(np.linalg.norm(both)) < policy.name.CANCELLED_SHARE * least:
                found.append(other)
    return found


def _raw_effect(now: Fit, terms: tuple[Term, ...], data: Data) -> list[Floats]:
    smaller = now.less(*terms)
    out = []
    for run, r, tare in zip(data.runs, data.rows, now.theta.tares, strict=True):
        full, _ = predict(now.model, now.theta, run, data.scale, tare)
        less, _ = predict(*smaller, run, data.scale, tare)
        out.append((full - less)[r])
    return out


def _repaired(estimate: Estimate, data: Data, less: Mapping[Term, Fit]) -> dict[Term, tuple[str, ...]]:
    """Two shapes on one static curve that explain nearly the same, but for a little that one repairs of the other: the
    curve has neither shape, and one that is not in the catalogue would do as well. One that alone leaves far less than
    the other alone is not doubted for the little that the other repairs.

    `less`: the fit without each term.
    """
    out: dict[Term, tuple[str, ...]] = {}
    for one, other in combinations(estimate.fit.model.terms, 2):
        curve = static_curve(one, measured=data.with_rate)
        if not curve or curve != static_curve(other, measured=data.with_rate):
            continue
        neither = fit_without(replace(estimate, fit=less[one]), other, data).chi2
        together = neither - estimate.fit.chi2
        adds = [less[term].chi2 - estimate.fit.chi2 for term in (one, other)]
        if (
            min(adds) < policy.name.REPAIR_SHARE * together
            and max(adds) < (1 - policy.name.REPAIRED_ALONE_SHARE) * together
        ):
            share = 100 * (1 - max(adds) / together)
            for (term, own), (beside, others) in permutations(zip((one, other), adds, strict=True)):
                if own > policy.name.CLEARLY_BETTER_ALONE * others:
                    continue  # the other alone leaves so many times what this one alone leaves
                told = (
                    f"it and {beside.id.replace('_', ' ')} mend each other: that by itself does {share:.0f} % of what "
                    "the two do together"
                )
                out[term] = (*out.get(term, ()), told)
    return out


def _not_repaired(told: tuple[str, ...]) -> tuple[Check, ...]:
    return tuple(Check("repair", REPAIR, each) for each in told) or (Check("repair", REPAIR),)


def name(
    estimate: Estimate, data: Data, terms: Sequence[Term], standing: Mapping[Term, SwapTest] | None = None
) -> tuple[Named, ...]:
    """Every term of the model with its rivals and checks, the largest gain first."""
    many, searched = max(len(estimate.fit.model.terms), 1), alternatives(terms, data.scale)
    system = Thruster(data, tuple(terms))
    standing = {term: (standing or {}).get(term) or stands(system, estimate, term) for term in estimate.fit.model.terms}
    repaired = _repaired(estimate, data, {term: less for term, (less, _) in standing.items()})
    out = []
    for term, stand in standing.items():
        asked = (*checks(estimate, term, data, many), *_not_repaired(repaired.get(term, ())))
        out.append(named_term(term, estimate.fit, stand, asked, searched=searched))
    return tuple(sorted(out, key=lambda n: -n.chi2_gain))


def with_joint_checks(named: Sequence[Named], left: ResidualStructure | None, *, measured: bool) -> tuple[Named, ...]:
    """Doubts that only show when all terms and what is left are seen together.

    Something left over a term's own covariate: its shape is not the textbook's. Many static shapes on one curve: any
    curve can be made of enough of them. `measured`: the rate, as a response.
    """
    shapes = Counter(static_curve(n.term, measured=measured) for n in named)
    clear = (
        {g.covariate.quantity: g for g in left.groups if g.p_value < policy.name.OWN_COVARIATE_P}
        if left is not None
        else {}
    )
    out = []
    for n in named:
        names = {d for c in n.term.covariates for d in (DRIVERS if c in STATIC else (c,))}
        own = [
            q
            for q, g in clear.items()
            if q in names and g.statistic - g.dof > policy.name.OWN_COVARIATE_SHARE * n.chi2_gain
        ]
        over = f"what is left still goes with {own[0].replace('_', ' ')}" if own else ""
        curve = static_curve(n.term, measured=measured)
        any_curve = bool(curve) and shapes[curve] >= policy.name.CURVE_OF_ANY_SHAPE_TERMS
        many = f"{shapes[curve]} shapes on one static curve can draw any curve" if any_curve else ""
        own_shape = Check("own_covariate", "nothing is left over its own covariate", over)
        out.append(n.asked(own_shape, Check("any_curve", "few shapes on a curve", many)))
    return tuple(out)
