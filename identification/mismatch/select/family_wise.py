"""Whether the best of many looks is more than noise: arrays in, p-values and thresholds of a whole family out.

Looks are correlated, so the largest of all is judged against the largest of its own null distribution, drawn from the
data by changing the sign of whole blocks of the residual at random (symmetric noise of any colour within a block), and
from white normal noise. A look is one unit column, or a span (n, q): an orthonormal basis of all that it may take.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.estimation.singular_values import thin_svd
from identification.estimation.tails import chi2_sf, normal_sf
from identification.mismatch import policy
from identification.recording import Floats

SURROGATES = 1000
"""Draws of the null distribution: 1 % of them are ten, and beyond them its tail is fitted."""
BLOCKS = 120
"""Blocks whose signs are drawn, at most: more would be shorter, and noise is correlated within them."""
LEAST_DIRECTION = 1e-6
"""Share of a direction that must remain when the present model is projected out."""
PLAINLY_OWN = 3e-5
"""Share of a column that must be its own, beside the model's: less is what is left of a difference of likes."""
MOST_PLAIN = 10
"""Directions taken out, at most: more would take noise with them."""


def lengths(columns: Floats) -> Floats:
    """(q,) Euclidean norms of columns (n, q), without a copy of them."""
    out: Floats = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    return out


def orthogonal_basis(columns: Floats) -> Floats:
    """(n, r) orthonormal basis of what columns span."""
    if columns.shape[1] == 0:
        return columns
    size = np.linalg.norm(columns, axis=0)
    scaled = columns[:, size > 0] / size[size > 0]
    u, s, _ = thin_svd(scaled)
    out: Floats = u[:, s > 1e-9 * s[0]] if s.size else scaled
    return out


def beside(columns: Floats, basis: Floats) -> Floats:
    """(n, r) columns less what an orthonormal basis (n, p) can follow; without those of which only rounding is left,
    for made unit they would be directions of their own."""
    before = lengths(columns)
    rest = columns - basis @ (basis.T @ columns)
    out: Floats = rest[:, lengths(rest) > LEAST_DIRECTION * before]
    return out


def beyond(columns: Floats, basis: Floats) -> Floats:
    """(n, r) orthonormal basis of what columns (n, q) plainly span outside another orthonormal `basis` (n, p)."""
    size = lengths(columns)
    scaled = columns[:, size > 0] / size[size > 0]
    left = scaled - basis @ (basis.T @ scaled)
    left = left - basis @ (basis.T @ left)
    if not left.shape[1]:
        return left
    u, s, _ = thin_svd(left)
    out: Floats = u[:, s > PLAINLY_OWN]
    return out


def matching_pursuit(columns: Floats, residual: Floats, least: float, most: int) -> tuple[list[int], Floats]:
    """Indices of unit columns (n, q) that take more than `least` sigma, one after the other, and what is left (n,)."""
    chosen: list[int] = []
    taken = np.empty((residual.size, 0))
    left = residual
    score = columns.T @ left
    size = np.ones(columns.shape[1])
    for _ in range(most):
        z = np.where(size > 1e-2, np.abs(score) / np.maximum(size, 1e-12), 0.0)
        j = int(np.argmax(z)) if z.size else 0
        rest = float(left @ left) - float(z[j] ** 2) if z.size else 0.0
        # Student's t of the direction: what it takes is not held against it
        if not z.size or z[j] ** 2 * max(residual.size - len(chosen) - 1, 1) < least**2 * max(rest, 0.0):
            break
        chosen.append(j)
        q = columns[:, j] - taken @ (taken.T @ columns[:, j])
        q /= np.linalg.norm(q)
        taken = np.column_stack([taken, q])
        left = left - q * (q @ left)
        overlap = columns.T @ q
        size = np.sqrt(np.maximum(size**2 - overlap**2, 0.0))
        score = columns.T @ left
    return chosen, left


def quiet(residual: Floats, columns: Floats) -> Floats:
    """The residual without what is plainly no noise in the span of unit columns: what surrogates are made from."""
    return matching_pursuit(columns, residual, policy.select.PLAIN_DIRECTION_SIGMA, MOST_PLAIN)[1]


def block_edges(size: int) -> NDArray[np.intp]:
    """Where the blocks of `size` rows begin."""
    blocks = min(BLOCKS, max(size // 4, 1))
    return np.linspace(0, size, blocks + 1).astype(np.intp)[:-1]


def surrogate_scores(columns: Floats, residual: Floats, rng: np.random.Generator) -> Floats:
    """(SURROGATES, q) scores after the signs of blocks of the residual were drawn anew."""
    parts = np.add.reduceat(columns * residual[:, None], block_edges(residual.size), axis=0)
    signs = rng.choice((-1.0, 1.0), size=(SURROGATES, parts.shape[0]))
    out: Floats = signs @ parts
    return out


def normal_scores(columns: Floats, rng: np.random.Generator) -> Floats:
    """(4 SURROGATES, q) scores of white normal residuals."""
    gram = columns.T @ columns
    values, vectors = np.linalg.eigh(gram)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    out: Floats = rng.standard_normal((4 * SURROGATES, values.size)) @ root.T
    return out


def p_of_largest(largest: float, null: Floats, normal: Floats) -> float:
    """The larger of both; beyond the draws the tail of as many normal deviates as they act like."""
    found = []
    for draws in (null, normal):
        share = (1 + np.count_nonzero(draws >= largest)) / (1 + draws.size)
        if share > 20 / draws.size:
            found.append(float(share))
            continue
        # tail of the normal maximum: as of one normal deviate, times the number of independent ones it acts like
        at = max(float(np.quantile(draws, 0.95)), 1e-6)
        many = 0.05 / max(float(normal_sf(at)), 1e-300)
        found.append(min(many * float(normal_sf(largest)), float(share)))
    return max(found)


def family_p_value(
    p_values: Sequence[float], spans: Sequence[Floats], residual: Floats, rng: np.random.Generator
) -> float:
    """Of the smallest of the p-values of all spans (n, q), by draws of the residual (n,) over them."""
    clean = _without_structure(p_values, spans, residual)
    least = min(p_values)
    p = max(_p_of_smallest(least, smallest, len(spans)) for smallest in _smallest_drawn(spans, clean, rng))
    return float(max(min(p, 1.0), min(1.0, least)))


def family_threshold(
    p_values: Sequence[float], spans: Sequence[Floats], residual: Floats, rng: np.random.Generator, alarm: float
) -> float:
    """The p-value that noise alone falls below in some span with probability `alarm`."""
    clean = _without_structure(p_values, spans, residual)
    return float(min(np.quantile(smallest, alarm) for smallest in _smallest_drawn(spans, clean, rng)))


def _without_structure(p_values: Sequence[float], spans: Sequence[Floats], residual: Floats) -> Floats:
    """What surrogates are made from: a structure of many small parts would be in the draws, and hide itself."""
    clean = quiet(residual, np.column_stack(spans))
    plain = [Q for Q, p in zip(spans, p_values, strict=True) if p < policy.locate.PLAIN_STRUCTURE_P]
    if plain:
        known = orthogonal_basis(np.column_stack(plain))
        clean = clean - known @ (known.T @ clean)
    return clean


def _smallest_drawn(spans: Sequence[Floats], clean: Floats, rng: np.random.Generator) -> list[Floats]:
    """Of blocks' signs: heavy tails and colour within a block are in them; of white normal noise: few blocks are not.

    (s,) each: the smallest p-value of all spans in each draw.
    """
    every = np.column_stack(spans)
    ends = np.cumsum([Q.shape[1] for Q in spans])[:-1]
    out = []
    for scores in (surrogate_scores(every, clean, rng), normal_scores(every, rng)):
        parts = np.split(scores**2, ends, axis=1)
        out.append(np.min([chi2_sf(s.sum(axis=1), s.shape[1]) for s in parts], axis=0))
    return out


def _p_of_smallest(least: float, smallest: Floats, many: int) -> float:
    """How often the smallest p-value of `many` spans is as small as `least`, by draws of it (s,).

    Beyond the draws scaled so that the family behaves as they do.
    """
    p = float((1 + np.count_nonzero(smallest <= least)) / (1 + smallest.size))
    if p < 20 / smallest.size:
        at = float(np.quantile(smallest, 0.05))
        p = min(p, max(0.05 / max(at, 1e-300), float(many)) * least)
    return p
