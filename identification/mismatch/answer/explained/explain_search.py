"""Baseline, noise and rounds of a search in figures: what was selected in, lines out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.model.data import Data
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.select.forward_selection import Selected
from identification.mismatch.select.rounds import Round
from identification.mismatch.select.screening import Screening
from identification.physics.term import Term

MOST_TERMS = 6
"""Terms of a screening that are shown."""
LEAST_P = 1e-12
"""A smaller p-value is not told: no tail is known so far out."""
MOST_TARES = 6
"""Tares that are shown, those of the first recordings."""

Rounds = tuple[Round[Term, Screening], ...]


def label(term: Term) -> str:
    """Effect and form."""
    return f"{term.id} ({term.form.replace('_', ' ')})" if term.form else term.id


def p_text(p: float) -> str:
    """A p-value as it is printed, no smaller than LEAST_P."""
    return f"p < {LEAST_P:g}" if p < LEAST_P else f"p = {p:.2g}"


def values_text(term: Term, values: Sequence[float], data: Data, std: Sequence[float] = ()) -> str:
    """Each parameter with its unit and, where given, its standard error."""
    told = []
    for i, (p, value) in enumerate(zip(term.parameters(data.scale), values, strict=True)):
        unit = "" if p.unit in ("", "1") else f" {p.unit}"
        error = f" +- {std[i]:.2g}" if std and np.isfinite(std[i]) else ""
        told.append(f"{p.name} {value:.4g}{error}{unit}")
    return ", ".join(told)


def searches(selected: Selected) -> tuple[Rounds, Rounds]:
    """Rounds of the search, and of the one that was resumed: a search ends where nothing lasts."""
    first = next(i for i, one in enumerate(selected.rounds) if one.after is None)
    return selected.rounds[: first + 1], selected.rounds[first + 1 :]


def baseline_lines(estimate: Estimate, data: Data) -> Iterator[str]:
    """C, the tares, and the noise beside them."""
    theta, std, at = estimate.fit.theta, estimate.fit.std, estimate.fit.layout
    yield f"C {theta.C:.5g} +- {std[at.C]:.2g} N/{data.scale.driver_unit}^2"
    tares = [f"{tare:.4g} +- {std[at.tare(i)]:.2g}" for i, tare in enumerate(theta.tares[:MOST_TARES])]
    more = " ..." if len(theta.tares) > MOST_TARES else ""
    yield f"tare {', '.join(tares)}{more} N; chi-square {estimate.fit.chi2:.5g} of {estimate.fit.residual.size} rows"
    yield from noise_lines(estimate.noise, data)


def noise_lines(noise: Noise, data: Data) -> Iterator[str]:
    """Standard deviations of one sample, part by part and together."""
    parts = [f"white {np.sqrt(noise.white):.3g} N", f"proportional {100 * np.sqrt(noise.proportional):.2g} % of |F|"]
    yield f"noise of a sample: {', '.join(parts)}"
    slow = [f"{np.sqrt(v):.2g} N ({T:.3g} s)" for T, v in zip(noise.scales, noise.slow, strict=True)]
    yield f"  slow, by its time scale: {', '.join(slow) or 'none'}"
    for (f, quality), v in zip(noise.bands, noise.band, strict=True):
        yield f"  ringing at {f:.4g} Hz, quality {quality:.3g}: {np.sqrt(v):.2g} N"
    rest = noise.white + sum(noise.slow) + sum(noise.band)
    full = rest + noise.proportional * data.scale.thrust**2
    yield f"  together {np.sqrt(rest):.3g} N at rest, {np.sqrt(full):.3g} N at C driver^2"


def round_lines(one: Round[Term, Screening]) -> Iterator[str]:
    """A screening, what was fitted, and what became of it."""
    judged = one.screening
    yield f"model: {' + '.join(['C x|x|', *map(label, one.model)])}"
    passes = "passes" if judged.largest > judged.threshold else "does not pass"
    yield (
        f"largest of {len(judged.directions.terms)} trials {judged.largest:.4g} sigma; {passes} the family-wise "
        f"threshold of {judged.threshold:.4g} ({p_text(judged.p_value)})"
    )
    fitted = {c.term: c for c in one.fitted}
    yield f"  {'term':<42}{'sigma':>8}{'counted':>9}{'chi-square':>12}{'price':>8}"
    for term, sigma, counted in best_trials(judged):
        line = f"  {label(term):<42}{sigma:>8.4g}{counted:>9.4g}"
        c = fitted.pop(term, None)
        yield line + (f"{c.chi2_gain:>12.5g}{c.price:>8.3g}{' at bound' if c.at_bound else ''}" if c else "")
    for c in fitted.values():
        yield f"  {label(c.term):<42}{'':>17}{c.chi2_gain:>12.5g}{c.price:>8.3g}{' at bound' if c.at_bound else ''}"
    yield _became(one)
    if one.hidden is not None:
        yield f"  deviance lower by {one.hidden.gain:.4g}; {one.hidden.asked:.4g} was asked"


def best_trials(judged: Screening) -> list[tuple[Term, float, float]]:
    """Terms with the sigma of their best trial, and what of it counts when shape error is spared."""
    directions = judged.directions
    out = []
    for term, _, sigma in judged.best(MOST_TERMS, share=0.0):
        counted = max(z for t, z in zip(directions.terms, judged.z.tolist(), strict=True) if t == term)
        out.append((term, sigma, counted))
    return out


def _became(one: Round[Term, Screening]) -> str:
    if one.after is None:
        full = len(one.model) >= policy.select.MODEL_TERMS
        return "the search ends: the model is full" if full else "the search ends: nothing that lasts can be added"
    added = [label(t) for t in one.after if t not in one.model]
    gone = [label(t) for t in one.model if t not in one.after]
    why = "most gain for its parameters" if one.hidden is None else "told from noise by estimating both"
    dropped = f"; dropped: {', '.join(gone)}" if gone else ""
    return f"added: {', '.join(added) or 'nothing'}: {why}{dropped}"
