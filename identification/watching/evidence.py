"""The sequential test: likelihood ratios of "a change began there" against "none did", summed over where and what.

Every candidate is a signature that begins after some stretch, with an amplitude drawn from normal laws of a few sizes.
Under every law of the noise (laws.Laws) the data are whitened row by row by a Kalman filter; the static curve is free
(flat prior, REML), the size of the noise is unknown (1 / sigma): what is compared are densities of scale-free
contrasts, so the ratio has expectation 1 whatever tare, curve and loudness are (Perez-Ortiz, Lardy, de Heide and
Grunwald, "E-statistics, group invariance and anytime valid testing", Annals of Statistics 2024). The denominator is
the *largest* over the laws, the numerator a mean over them, so the ratio is an e-value whichever law is the true one
(Wasserman, Ramdas and Balakrishnan, "Universal inference", PNAS 2020). A candidate that begins at hour t carries the
weight rate x dt; the weighted sum reaches 1 within T hours with a probability of at most rate x T, and on average not
before 1 / rate hours (Shiryaev-Roberts; Shin, Ramdas and Rinaldo, "E-detectors", 2023).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.recording import Floats
from identification.watching.laws import TIMES, Laws

SIZES = (2.0, 8.0, 32.0, 128.0)
"""Standard deviations of a candidate's amplitude, in those of a mean over laws.REFERENCE s."""
SLOTS = 20
"""Beginnings that are followed; when one more comes the least likely of the old ones is let go, which only loses."""
LEAST_DOF = 4.0
"""Rows beyond the static columns before anything is judged: with fewer the size of the noise is a guess."""
YOUNG = 6
"""Newest beginnings that are never let go."""
DETERMINED = 1e-9
"""Eigenvalue of the static columns' information, each scaled to 1, from which a direction counts as determined."""


@dataclass(frozen=True, eq=False, slots=True)
class Posterior:
    """What the candidates weigh after the newest row."""

    log_sum: float
    """log of the weighted sum of likelihood ratios: an alarm at 0."""
    weight: Floats
    """(slots, signatures), adds to 1."""
    amplitude: Floats
    """(slots, signatures) N, mean."""
    std: Floats
    """(slots, signatures) N."""
    static: Floats
    """(p,) N, coefficients of the static columns under the best candidate."""


class Evidence:
    """Rows in, posterior out. Memory and time per row do not grow."""

    def __init__(self, laws: Laws, static: int, signatures: int, levels: int) -> None:
        """`static`, `signatures`: numbers of columns; `levels`: of bins with a deviation of their own."""
        H, m = laws.slow.shape
        self._laws, self._m, self._p, self._g = laws, m, static, signatures
        S, K = m + levels, 1 + static + SLOTS * signatures
        self._P = np.zeros((H, S, S))
        self._P[:, np.arange(m), np.arange(m)] = laws.slow
        self._P[:, np.arange(m, S), np.arange(m, S)] = laws.level[:, None]
        self._Z = np.zeros((H, S, K))
        self._white = np.zeros((H, K - 1 - static))
        self._XX = np.zeros((H, static, static))
        self._Xy = np.zeros((H, static))
        self._yy = np.zeros(H)
        self._logdet = np.zeros(H)
        self._XS = np.zeros((H, static, K - 1 - static))
        self._Sy = np.zeros((H, K - 1 - static))
        self._SS = np.zeros((H, K - 1 - static))
        self.begun: list[float] = []
        """s, of each slot in use."""
        self.weights: list[float] = []
        self._rows = 0
        self._kept: list[bool] = []
        self._last = 0.0
        self._slot_evidence = np.zeros(0)
        self.prior = np.zeros(static)
        """Information that is there already about each static column, in units of the white noise; 0: a flat prior."""

    def begin(self, time: float, weight: float, *, kept: bool = False) -> None:
        """From the next row on a change may have begun, at `time` s; `kept`: its slot is never given away."""
        if len(self.begun) == SLOTS:
            self._let_go()
        self.begun.append(time)
        self.weights.append(weight)
        self._kept.append(kept)

    def _let_go(self) -> None:
        with np.errstate(divide="ignore"):
            likely = np.log(self.weights) + self._slot_evidence
        likely[np.array(self._kept)] = np.inf
        likely[-YOUNG:] = np.inf
        gone, g, p = int(np.argmin(likely)), self._g, self._p
        move = np.concatenate([np.delete(np.arange(SLOTS), gone), [gone]])
        columns = (move[:, None] * g + np.arange(g)).ravel()
        self._Z[:, :, 1 + p :] = self._Z[:, :, 1 + p :][:, :, columns]
        for each in (self._XS, self._Sy, self._SS):
            each[...] = each[..., columns]
        last = slice((SLOTS - 1) * g, SLOTS * g)
        self._Z[:, :, 1 + p :][:, :, last] = 0.0
        for each in (self._XS, self._Sy, self._SS):
            each[..., last] = 0.0
        for kept in (self.begun, self.weights, self._kept):
            del kept[gone]

    def add(
        self, time: float, level: int | None, white: float, value: float, static: Floats, candidates: Floats
    ) -> None:
        """One row at `time` s: value in N, static (p,), candidates (slots in use, signatures), white variance."""
        used = len(self.begun) * self._g
        row = np.concatenate([[value], static, candidates.ravel()])
        v = self._whitened(time - self._last if self._rows else 0.0, level, white, row)
        self._last, self._rows = time, self._rows + 1
        y, X, S = v[:, 0], v[:, 1 : 1 + self._p], v[:, 1 + self._p :]
        self._yy += y * y
        self._Xy += X * y[:, None]
        self._XX += X[:, :, None] * X[:, None, :]
        self._XS[:, :, :used] += X[:, :, None] * S[:, None, :]
        self._Sy[:, :used] += S * y[:, None]
        self._SS[:, :used] += S * S

    def _whitened(self, dt: float, level: int | None, white: float, row: Floats) -> Floats:
        """(H, columns): one step of the Kalman filter of every law for every column."""
        m, P = self._m, self._P
        Z = self._Z[:, :, : row.size]
        keep = np.exp(-dt / np.array(TIMES))
        full = np.ones(P.shape[1])
        full[:m] = keep
        P *= full[:, None] * full
        P[:, np.arange(m), np.arange(m)] += self._laws.slow * (1 - keep**2)
        Z[:, :m] *= keep[:, None]
        seen = [*range(m)] if level is None else [*range(m), m + level]
        Ph = P[:, :, seen].sum(axis=2)
        variance = Ph[:, seen].sum(axis=1) + white
        innovation = row - Z[:, seen].sum(axis=1)
        gain = Ph / variance[:, None]
        Z += gain[:, :, None] * innovation[:, None, :]
        P -= gain[:, :, None] * Ph[:, None, :]
        self._logdet += np.log(variance)
        out: Floats = innovation / np.sqrt(variance)[:, None]
        return out

    def posterior(self) -> Posterior | None:
        """None until LEAST_DOF more rows are there than static columns that they determine."""
        g, used = self._g, len(self.begun) * self._g
        nothing = self._nothing()
        if nothing is None or not used:
            self._slot_evidence = np.zeros(len(self.begun))
            return None
        XS = np.einsum("pr,hpk->hrk", nothing.basis, self._XS[:, :, :used])
        solved = np.linalg.solve(nothing.M, XS)
        own, rss, dof = self._SS[:, :used], nothing.rss[:, None], nothing.dof
        information = own - np.einsum("hrk,hrk->hk", XS, solved)
        information = np.where(information > DETERMINED * own, information, 0.0)
        gain = np.where(information > 0, self._Sy[:, :used] - np.einsum("hrk,hr->hk", XS, nothing.beta), 0.0)
        A2 = np.array(SIZES)[:, None, None] ** 2
        precision = information + 1 / A2
        share = np.minimum(gain**2 / precision / rss, 1 - 1e-12)
        log_ratio = -0.5 * np.log1p(A2 * information) - 0.5 * dof * np.log1p(-share)
        log_ratio += (nothing.log_density - nothing.log_density.max())[:, None] + np.repeat(np.log(self.weights), g)
        log_ratio -= np.log(rss.size * len(SIZES) * g)
        top = float(log_ratio.max())
        mass = np.exp(log_ratio - top)
        column = np.maximum(mass.sum(axis=(0, 1)), 1e-300)
        self._slot_evidence = np.log(column.reshape(-1, g).sum(axis=1)) - np.log(self.weights)
        mean = (mass * gain / precision).sum(axis=(0, 1)) / column
        variance = (mass * rss * (1 - share) / dof / precision).sum(axis=(0, 1)) / column
        _, h, k = np.unravel_index(int(np.argmax(log_ratio)), log_ratio.shape)
        return Posterior(
            log_sum=top + float(np.log(mass.sum())),
            weight=(column / column.sum()).reshape(-1, g),
            amplitude=mean.reshape(-1, g),
            std=np.sqrt(variance).reshape(-1, g),
            static=nothing.basis @ (nothing.beta[h] - solved[h, :, k] * mean[k]),
        )

    def _nothing(self) -> _Nothing | None:
        """The static columns fitted under every law; None while there is too little to judge by."""
        known = self._XX + np.diag(self.prior)
        scale = np.sqrt(np.maximum(np.diag(known[0]), 1e-300))
        values, vectors = np.linalg.eigh(known[0] / np.outer(scale, scale))
        basis = vectors[:, values > DETERMINED] / scale[:, None]
        dof = self._rows - basis.shape[1] + int(np.count_nonzero(self.prior))
        M, Xy = basis.T @ known @ basis, self._Xy @ basis
        beta = np.asarray(np.linalg.solve(M, Xy[:, :, None])[:, :, 0], dtype=np.float64)
        rss = self._yy - np.einsum("hr,hr->h", beta, Xy)
        if dof < LEAST_DOF or np.any(rss <= 1e-12 * self._yy):
            return None
        density = -0.5 * (self._logdet + np.linalg.slogdet(M)[1] + dof * np.log(rss))
        return _Nothing(basis, M, beta, rss, float(dof), density)


@dataclass(frozen=True, eq=False, slots=True)
class _Nothing:
    """Nothing has changed: its fit under every law."""

    basis: Floats
    """(p, r) directions of the static columns that the rows so far tell apart."""
    M: Floats
    """(H, r, r) their information."""
    beta: Floats
    """(H, r) fitted."""
    rss: Floats
    """(H,) what they leave, whitened."""
    dof: float
    log_density: Floats
    """(H,) of scale-free contrasts."""


def level_of(v: float, bins: int) -> int | None:
    """The bin of a command v in -1..1 that has a deviation of its own; None at rest, where the tare says it.

    >>> level_of(0.0, 16), level_of(-1.0, 16), level_of(1.0, 16), level_of(0.02, 16)
    (None, 0, 15, 8)
    """
    if v == 0.0:
        return None
    return int(np.clip(np.floor((v + 1) / 2 * bins), 0, bins - 1))
