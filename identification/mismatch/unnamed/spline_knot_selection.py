"""How many knots, and where: least squares of a spline from the moments of fine hat functions.

Whitened hats on fine nodes are made once; every spline with knots among the nodes is a combination of them, so that its
fall of chi-square follows from the hats' Gram matrix alone. A natural cubic spline is a straight line and, for each
inner knot, what has a tent with its top there for second derivative; a broken line is a straight line and tents. So
knots are columns that are put in and taken out. Their number, their places and the degree are chosen by BIC; a knot
whose place was looked for counts twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from identification.mismatch import policy
from identification.recording import Floats
from identification.run_history.splines import spline

Degree = Literal[1, 3]
RIDGE = 1e-13
"""Share of a unit column's square that is added to solve for columns that are nearly one."""
LEAST_NEW = 1e-12
"""Of a unit column's square: less is left of it beside the others, and it is one of them."""
MOST_NODES = 65
"""Places at which a knot may be: a search over more would take longer and choose the same."""
EVEN = (2, 3, 4, 5, 7, 9, 13)
"""Knots at even shares of the data to begin with."""
FEW_NODES = 17
"""At least as many between and beyond common levels."""
ENDS = (0.03, 0.1, 0.3)
"""Of the outermost share of the data: where a limit shows, within the last of a sine."""
MOST_KNOTS = 24
"""Knots of one spline, at most: BIC is to stop it before."""
MOST_MOVES = 4
"""Rounds in which knots are moved to neighbouring nodes, and taken out."""
LEAST_SHARE = 0.003
"""Of all rows: a level met more often than this is a node."""


@dataclass(frozen=True, eq=False, slots=True)
class Moments:
    """Of whitened hats, times each multiplier, against a whitened residual."""

    nodes: Floats
    """(m,) on the axis on which the spline is smooth."""
    gram: Floats
    """(p m, p m), multipliers one after the other."""
    score: Floats
    """(p m,)"""
    rows: int
    constant: tuple[bool, ...]
    """For each multiplier whether a constant is a part of the spline, or of the model already."""


@dataclass(frozen=True, eq=False, slots=True)
class Chosen:
    """The best spline and what it gains."""

    knots: tuple[int, ...]
    """Indices of nodes."""
    degree: Degree
    gain: float
    """Of BIC."""


def nodes_of(values: Floats, must: Sequence[float] = ()) -> Floats:
    """(m,) ascending: the levels where there are few, otherwise shares of the data and even places together.

    >>> nodes_of(np.repeat([0.0, 1.0, 4.0], 10)).tolist()
    [0.0, 1.0, 4.0]
    """
    size = float(np.max(np.abs(values), initial=0.0)) or 1.0
    levels, at, count = np.unique(np.round(values / size, 4), return_inverse=True, return_counts=True)
    common = count > max(LEAST_SHARE * values.size, 2)
    if 2 <= np.count_nonzero(common) <= MOST_NODES and count[common].sum() > 0.6 * values.size:
        rest = max(MOST_NODES - int(np.count_nonzero(common)), FEW_NODES)
        found = np.concatenate([levels[common] * size, _shares(values[~common[at]], rest)])
    else:
        found = _shares(values, MOST_NODES)
    found = np.array([float(f"{x:.6g}") for x in np.unique(np.concatenate([found, np.array(must)]))])
    found = np.unique(found)
    apart = np.concatenate([[True], np.diff(found) > 1e-4 * float(np.ptp(found))])
    out: Floats = found[apart | np.isin(found, np.array(must))]
    return out


def _shares(values: Floats, many: int) -> Floats:
    """(at most `many`,) shares of the values and even places together, closer to both ends."""
    if values.size < many:
        return values
    half = many // 2
    even = np.linspace(0, 1, half - 2 * len(ENDS))
    ends = even[1] * np.array(ENDS)
    shares = np.quantile(values, np.concatenate([even, ends, 1 - ends]))
    return np.concatenate([shares, np.linspace(values.min(), values.max(), many - half)])


def choose(
    moments: Moments,
    must: tuple[int, ...] = (),
    degrees: Sequence[Degree] = (3, 1),
    begin: Sequence[tuple[int, ...]] = (),
) -> Chosen | None:
    """The spline of the largest gain. `must`: nodes that are knots always; both ends are anyway.

    `begin`: knots to begin with, beside even ones.
    """
    found = [c for degree in degrees if (c := _of_degree(moments, must, degree, begin)) is not None]
    return max(
        found, key=lambda each: each.gain + (policy.unnamed.BROKEN_LINE_BIC if each.degree == 3 else 0.0), default=None
    )


def heights(moments: Moments, knots: tuple[int, ...], degree: Degree, free: Sequence[tuple[int, ...]]) -> Floats:
    """(q,) least-squares values at the free knots of each multiplier, one multiplier after the other."""
    m = moments.nodes.size
    shape = spline(moments.nodes, moments.nodes[list(knots)], np.eye(len(knots)), degree)
    S = np.zeros((m * len(free), sum(map(len, free))))
    column = 0
    for i, part in enumerate(free):
        S[i * m : (i + 1) * m, column : column + len(part)] = shape[:, list(part)]
        column += len(part)
    gram, score = S.T @ moments.gram @ S, S.T @ moments.score
    size = np.sqrt(np.diag(gram))
    size = np.where(size > 1e-9 * float(size.max(initial=0.0)), size, np.inf)
    out: Floats = np.linalg.pinv(gram / np.outer(size, size), rcond=1e-8, hermitian=True) @ (score / size) / size
    return out


@dataclass(frozen=True, eq=False, slots=True)
class _Columns:
    """Straight line and inner knots, times each multiplier: unit columns' Gram matrix and score."""

    gram: Floats
    score: Floats
    line: tuple[int, ...]
    """Columns that are always in."""
    knots: tuple[tuple[int, ...], ...]
    """For each node its columns; none for the ends and for what no row sees."""
    logn: float

    def left(self, chosen: Sequence[int]) -> tuple[Floats, Floats, float]:
        """Gram and score beyond the knots chosen, and the fall of chi-square with them."""
        used = [*self.line, *(c for j in chosen for c in self.knots[j])]
        inside = self.gram[np.ix_(used, used)] + RIDGE * np.eye(len(used))
        solved = np.linalg.solve(inside, np.column_stack([self.gram[used], self.score[used]]))
        gram = self.gram - self.gram[:, used] @ solved[:, :-1]
        score = self.score - self.gram[:, used] @ solved[:, -1]
        return gram, score, float(self.score[used] @ solved[:, -1])

    def gain(self, chosen: Sequence[int], looked: int) -> float:
        """Of BIC."""
        many = len(self.line) + sum(len(self.knots[j]) for j in chosen)
        return self.left(chosen)[2] - (many + looked) * self.logn

    def best(self, chosen: Sequence[int], among: Sequence[int]) -> int | None:
        """The knot that makes chi-square fall most beside those chosen."""
        gram, score, _ = self.left(chosen)
        falls = []
        for j in among:
            at = list(self.knots[j])
            inside = gram[np.ix_(at, at)]
            seen = float(np.min(np.diag(inside), initial=1.0)) > LEAST_NEW
            falls.append(float(score[at] @ np.linalg.solve(inside + RIDGE * np.eye(len(at)), score[at])) if seen else 0)
        return among[int(np.argmax(falls))] if falls and max(falls) > 0 else None


def _columns(moments: Moments, degree: Degree) -> _Columns:
    z = moments.nodes
    m, p = z.size, len(moments.constant)
    tents = np.minimum((z[:, None] - z[0]) / (z - z[0] + 1e-300), (z[-1] - z[:, None]) / (z[-1] - z + 1e-300))[:, 1:-1]
    inner = tents if degree == 1 else _twice_summed(tents, z)
    functions = np.column_stack([np.ones(m), (z - z[0]) / (z[-1] - z[0]), inner])
    every = np.kron(np.eye(p), functions)
    gram, score = every.T @ moments.gram @ every, every.T @ moments.score
    size = np.sqrt(np.maximum(np.diag(gram), 0.0))
    seen = size > 1e-9 * float(size.max(initial=0.0))
    size = np.where(seen, size, np.inf)
    line = [i * m + c for i in range(p) for c in (0, 1) if seen[i * m + c] and (c or moments.constant[i])]
    knots: list[tuple[int, ...]] = [()] * m
    for j in range(1, m - 1):
        at = [i * m + 1 + j for i in range(p)]
        knots[j] = tuple(c for c in at if seen[c])
    logn = float(np.log(max(moments.rows, 2)))
    return _Columns(gram / np.outer(size, size), score / size, tuple(line), tuple(knots), logn)


def _twice_summed(second: Floats, z: Floats) -> Floats:
    """(m, q) whose second derivative over z is `second`, a straight line between nodes."""
    h = np.diff(z)[:, None]
    slope = np.vstack([np.zeros((1, second.shape[1])), np.cumsum(0.5 * h * (second[1:] + second[:-1]), axis=0)])
    rise = h * slope[:-1] + h**2 * (second[:-1] / 3 + second[1:] / 6)
    out: Floats = np.vstack([np.zeros((1, second.shape[1])), np.cumsum(rise, axis=0)])
    return out


def _of_degree(
    moments: Moments, must: tuple[int, ...], degree: Degree, begin: Sequence[tuple[int, ...]]
) -> Chosen | None:
    """Even knots first, then one at a time in, moved, and out."""
    columns = _columns(moments, degree)
    if not columns.line:
        return None
    many = moments.nodes.size
    always = [j for j in must if columns.knots[j]]
    evenly = (np.linspace(0, many - 1, k).round().astype(int).tolist() for k in EVEN if k <= many)
    starts = [sorted({j for j in (*each, *always) if columns.knots[j]}) for each in (*evenly, *begin)]
    chosen = max(starts, key=lambda each: columns.gain(each, 0))
    chosen, looked = _in(columns, chosen, always)
    chosen = _out(columns, chosen, always, looked)
    return Chosen((0, *chosen, many - 1), degree, columns.gain(chosen, looked))


def _in(columns: _Columns, chosen: list[int], always: Sequence[int]) -> tuple[list[int], int]:
    """Knots put in, each followed by a round of moves, while that gains; and how many were looked for."""
    looked, gain = 0, columns.gain(chosen, 0)
    while len(chosen) < MOST_KNOTS:
        more = columns.best(chosen, [j for j, c in enumerate(columns.knots) if c and j not in chosen])
        if more is None:
            break
        new = _moved(columns, sorted((*chosen, more)), always)
        if columns.gain(new, looked + 1) <= gain:
            if looked:
                break
            more = columns.best(new, [j for j, c in enumerate(columns.knots) if c and j not in new])
            pair = new if more is None else _moved(columns, sorted((*new, more)), always)
            if columns.gain(pair, 2) <= gain:  # a jump takes two
                break
            chosen, looked, gain = pair, 2, columns.gain(pair, 2)
            continue
        chosen, looked, gain = new, looked + 1, columns.gain(new, looked + 1)
    return chosen, looked


def _moved(columns: _Columns, chosen: list[int], always: Sequence[int]) -> list[int]:
    """Each knot to the best node between its neighbours, while that gains."""
    gain = columns.gain(chosen, 0)
    for _ in range(MOST_MOVES):
        before = gain
        for i, j in enumerate(chosen):
            if j in always:
                continue
            rest = [*chosen[:i], *chosen[i + 1 :]]
            low = chosen[i - 1] if i else 0
            high = chosen[i + 1] if i + 1 < len(chosen) else len(columns.knots) - 1
            best = columns.best(rest, [k for k in range(low + 1, high) if columns.knots[k]])
            if best is not None and columns.gain(trial := sorted((*rest, best)), 0) > gain:
                chosen, gain = trial, columns.gain(trial, 0)
        if gain <= before + 1e-6:
            break
    return chosen


def _out(columns: _Columns, chosen: list[int], always: Sequence[int], looked: int) -> list[int]:
    """Knots taken out while that gains."""
    gain = columns.gain(chosen, looked)
    while True:
        less = [[k for k in chosen if k != j] for j in chosen if j not in always]
        best = max(less, key=lambda each: columns.gain(each, looked), default=None)
        if best is None or columns.gain(best, looked) <= gain:
            return chosen
        chosen, gain = best, columns.gain(best, looked)
