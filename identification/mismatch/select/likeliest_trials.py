"""Trials that the residual itself points to, where no grid would be fine enough: instants of a jump, lines of a stand.

Under slow noise a step is seen by what changes within seconds of it: a trial half a minute off sees nothing. Resonances
are looked for in what the ticks of the command tell: many more can be tried on their few rows than on all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import acting
from identification.mismatch.model.step_response import told
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.family_wise import lengths
from identification.physics.term import Scale, Term
from identification.recording import Floats

TRIED = 600
"""Instants, evenly over the rows: the p-value of the likeliest is multiplied by it."""
SIZED = 60
"""Of these the sigmas are worked out, and of as many that look likeliest; between them the size is interpolated."""
APART = 4.0
"""Hz: what is followed for a tenth of a second tells no finer."""
SHARP, DULL = 0.05, 0.3
"""Damping."""
LOWEST = 5.0
"""Hz: what rings more slowly is among the term's own trials."""
LONG = 0.03
"""Damping of what rings on for five periods, and by how much trials of it are apart."""


def alternatives(terms: Sequence[Term], scale: Scale) -> int:
    """How many trials a search looks at: those of all terms and forms, and every instant at which one may jump.

    More of a delay or of a ring, where a recording asks for them, are near to one of these.
    """
    return max(sum(len(t.trials(scale)) + (TRIED if t.traits.instant else 0) for t in terms), 1)


def likeliest_jumps(
    fitted: Fit, data: Data, weights: Weights, basis: Floats, most: int, of: Sequence[Floats] | None = None
) -> tuple[float, ...]:
    """Up to `most` times in s at which a step of the reading explains most of the residual, the best first.

    `basis` (n, p): orthonormal, what the present model can follow. `of`: per run (n,), what jumps; None: the zero.
    """
    when, _ = jumps(fitted.residual, data, weights, basis, of)
    found: list[float] = []
    for at in when:
        if all(abs(at - other) > policy.select.JUMPS_APART * data.scale.duration for other in found):
            found.append(float(at))
        if len(found) == most:
            break
    return tuple(found)


def jumps(
    residual: Floats, data: Data, weights: Weights, basis: Floats, of: Sequence[Floats] | None = None
) -> tuple[Floats, Floats]:
    """(k,) s and sigmas of steps of the reading, the largest first; `residual` and `basis` whitened."""
    runs = [h.sampled[r] for h, r in zip(data.histories, data.rows, strict=True)]
    of = [np.ones(at.size) for at in runs] if of is None else of
    when = np.unique(np.quantile(np.concatenate(runs), np.linspace(0.01, 0.99, TRIED)))
    thrust = Weights(weights.thrust)
    residual, basis = residual[: data.size], basis[: data.size]
    residual = residual - basis @ (basis.T @ residual)  # no trifle where a step is nearly what the model follows
    some = np.unique(np.linspace(0, when.size - 1, SIZED).astype(int))
    size = np.interp(np.arange(when.size), some, np.sqrt(np.maximum(_sizes(runs, of, when[some], thrust, basis), 0.0)))
    rough = np.abs(_products(runs, of, when, thrust, residual)) / np.where(size > 0, size, np.inf)
    likely = np.sort(np.argsort(-_peaks(rough))[:SIZED])
    exact = np.sqrt(np.maximum(_sizes(runs, of, when[likely], thrust, basis), 0.0))
    score = rough[likely] * size[likely] / np.where(exact > 0, exact, np.inf)
    order = np.argsort(-score)
    return when[likely[order]], score[order]


def _products(runs: Sequence[Floats], of: Sequence[Floats], when: Floats, thrust: Weights, residual: Floats) -> Floats:
    """Of the whitened residual with the whitened step at each instant, whose columns are never made."""
    total = np.zeros(when.size)
    begin = 0
    for at, size, whitener in zip(runs, of, thrust.thrust, strict=True):
        weighed = size * whitener.weighed(residual[begin : begin + at.size])
        after = np.concatenate([np.cumsum(weighed[::-1])[::-1], [0.0]])
        total += after[np.searchsorted(at, when, side="left")]
        begin += at.size
    return total


def _sizes(runs: Sequence[Floats], of: Sequence[Floats], when: Floats, thrust: Weights, basis: Floats) -> Floats:
    """Squared length of the whitened step at each instant beside what the model can follow."""
    columns = thrust.whiten([size[:, None] * (at[:, None] >= when) for at, size in zip(runs, of, strict=True)], [])
    columns -= basis @ (basis.T @ columns)
    out: Floats = np.einsum("ij,ij->j", columns, columns)
    return out


def _peaks(score: Floats) -> Floats:
    """The score where no neighbour's is larger, elsewhere next to nothing."""
    beside = np.maximum(np.append(score[1:], 0.0), np.append(0.0, score[:-1]))
    return np.where(score >= beside, score, 1e-3 * score)


def likeliest_rings(fitted: Fit, data: Data, term: Term, most: int) -> tuple[tuple[float, ...], ...]:
    """Up to `most` trials of a stand_resonance, the best of each damping first."""
    highest = term.parameters(data.scale)[1].high
    rows = sum(each.target.size for each in data.ticks)
    residual = fitted.residual[fitted.residual.size - rows :]
    base = _told(fitted, data, None)
    out: list[tuple[float, ...]] = []
    for damping, tried in (
        (SHARP, np.arange(LOWEST, highest, APART)),
        (DULL, np.geomspace(LOWEST, max(highest, 2 * LOWEST), 18)),
    ):
        trials = [(1.0, float(f), damping) for f in tried]
        change = np.column_stack([_told(fitted, data, (term, values)) - base for values in trials])
        size = np.linalg.norm(change, axis=0)
        score = np.abs(change.T @ residual) / np.where(size > 0, size, np.inf)
        out += [trials[j] for j in np.argsort(-score)[: most // 2]]
    return tuple(out)


def sharp_rings(
    fitted: Fit, data: Data, weights: Weights, basis: Floats, term: Term, most: int
) -> tuple[tuple[float, ...], ...]:
    """Up to `most` trials of a stand_resonance that rings on for periods, the best first: where steps are few and large
    it is seen for so long that a trial a tenth of its frequency off sees nothing."""
    highest = term.parameters(data.scale)[1].high
    if highest <= LOWEST:
        return ()
    tried = np.geomspace(LOWEST, highest, max(int(np.ceil(np.log(highest / LOWEST) / LONG)), 2))
    base, _ = raw(fitted.model, fitted.theta, data, with_rate=False)
    made = [raw(*fitted.more(term, (1.0, f, LONG)), data, with_rate=False)[0] for f in tried.tolist()]
    thrust = [np.column_stack([each[i] for each in made]) - own[:, None] for i, own in enumerate(base)]
    change = Weights(weights.thrust).whiten(thrust, [])
    basis = basis[: data.size]
    change -= basis @ (basis.T @ change)
    size = lengths(change)
    score = _peaks(np.abs(change.T @ fitted.residual[: data.size]) / np.where(size > 0, size, np.inf))
    return tuple((1.0, float(tried[j]), LONG) for j in np.argsort(-score)[:most])


def _told(fitted: Fit, data: Data, more: tuple[Term, tuple[float, ...]] | None) -> Floats:
    terms = acting(fitted.model, fitted.theta, data.scale)
    if more is not None:
        terms = [*terms, (*more, data.scale)]
    return np.concatenate([told(rows, terms, fitted.theta.C, fitted.theta.shift) for rows in data.ticks])
