"""Normal equations of samples beside what the means over their intervals can follow, by sums over the intervals.

A mean, and the line through the means of the intervals on either side, are taken out of every column. Written at each
sample that is dense, where the columns themselves are mostly zeros; sums of them over intervals say the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, hstack

from identification.recording import Floats


@dataclass(frozen=True, eq=False)
class Samples:
    """N samples in order, of M intervals."""

    time: Floats
    """(N,) s."""
    interval: NDArray[np.intp]
    """(N,) of each sample, from 0 on."""

    def gram(self, levels: Floats, sparse: csr_array, kept: NDArray[np.bool_]) -> Floats:
        """(2 + B, 2 + B) of `levels` (N, 2) and `sparse` (N, B) over the samples of the intervals that are `kept` (M,).

        Within an interval the line is s t, t from the middle of its samples: the gram of the columns d - mean is
        G - n m m', and with p = sum t d that of d - mean - s t is G - n m m' - s p' - p s' + s s' sum t t.
        """
        many = np.bincount(self.interval, minlength=kept.size)
        ends, filled, count = np.concatenate([[0], np.cumsum(many)]), many > 0, np.maximum(many, 1)
        first = levels[np.minimum(ends[:-1], self.interval.size - 1)]
        columns = hstack([csr_array(levels - first[self.interval]), sparse], format="csr")
        middle = np.bincount(self.interval, weights=self.time, minlength=kept.size) / count
        away = self.time - middle[self.interval]
        mean = _summed(columns, ends, np.ones(away.size)) / count[:, None]
        p = _summed(columns, ends, away)[kept]
        s = self._slopes(mean, first, middle, filled)[kept]
        n, spread = many[kept], np.bincount(self.interval, weights=away**2, minlength=kept.size)[kept]
        m, of_kept = mean[kept], columns[np.flatnonzero(kept[self.interval])]
        across = s.T @ p
        return np.asarray((of_kept.T @ of_kept).toarray() - (n * m.T) @ m - across - across.T + (spread * s.T) @ s)

    @staticmethod
    def _slopes(mean: Floats, first: Floats, middle: Floats, filled: NDArray[np.bool_]) -> Floats:
        """(M, 2 + B) of the lines through the neighbours' means; 0 where one has no samples."""
        level = mean.copy()
        level[:, : first.shape[1]] += first
        slope = np.zeros_like(mean)
        inner = np.flatnonzero(filled[2:] & filled[:-2]) + 1
        slope[inner] = (level[inner + 1] - level[inner - 1]) / (middle[inner + 1] - middle[inner - 1])[:, None]
        return slope


def _summed(columns: csr_array, ends: NDArray[np.intp], weight: Floats) -> Floats:
    """(M, q) of the rows between `ends` (M + 1,), each by its weight."""
    sums = csr_array((weight, np.arange(weight.size), ends), shape=(ends.size - 1, weight.size))
    return np.asarray((sums @ columns).toarray())
