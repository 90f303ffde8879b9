"""The noise of all runs as one whitening of rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.singular_values import thin_svd
from identification.mismatch.model.data import Data, PriorPredictionFactor
from identification.mismatch.noise.covariance import Noise, Rows, Whitener
from identification.recording import Floats


@dataclass(frozen=True, eq=False)
class Weights:
    """Whiteners of the thrust and, where it is a response, of the rate."""

    thrust: tuple[Whitener, ...]
    rate: tuple[Whitener, ...] = ()
    ticks: bool = False
    """Whether what the ticks tell has rows, after all others."""
    prior_factor: Floats | None = None
    """(n, k) whitened columns of a baseline's uncertainty, orthogonal, each as long as its variance is large."""

    def whiten(self, thrust: Sequence[Floats], rate: Sequence[Floats], ticks: Sequence[Floats] = ()) -> Floats:
        """Columns of all runs, one under the other; those of the ticks are white already."""
        parts = [w.whiten(c) for w, c in zip(self.thrust, thrust, strict=True)]
        parts += [w.whiten(c) for w, c in zip(self.rate, rate, strict=True)]
        parts += ticks
        out: Floats = np.concatenate(parts) if len(parts) > 1 else parts[0]
        if self.prior_factor is None or out.shape[0] != self.prior_factor.shape[0]:
            return out
        # noise I + A A' with A = U diag(s): its inverse root is I + U diag(1/sqrt(1 + s^2) - 1) U'
        size = np.linalg.norm(self.prior_factor, axis=0)
        U = self.prior_factor / size
        shrunk = (1 / np.sqrt(1 + size**2) - 1)[:, None] * (U.T @ out.reshape(out.shape[0], -1))
        whitened: Floats = out + (U @ shrunk).reshape(out.shape)
        return whitened

    @property
    def log_det(self) -> float:
        total = sum(w.log_det for w in (*self.thrust, *self.rate))
        if self.prior_factor is not None:
            total += float(np.sum(np.log1p(np.sum(self.prior_factor**2, axis=0))))
        return total


def weights(
    data: Data,
    noise: Noise,
    thrust_size: Sequence[Floats],
    rate_noise: Noise | None,
    rows: Sequence[Rows] | None = None,
    *,
    unit: bool = False,
) -> Weights:
    """Factor the covariances. `thrust_size`: predicted F without tare at the thrust rows, run by run. `unit`: of the
    noise alone, without the baseline's own uncertainty."""
    shapes = data.predictor.shapes
    used = data.thrust_rows if rows is None else rows
    thrust = tuple(Whitener(noise, r, np.abs(s), shapes) for r, s in zip(used, thrust_size, strict=True))
    rate: tuple[Whitener, ...] = ()
    if rate_noise is not None:
        rate = tuple(Whitener(rate_noise, r, np.zeros(r.time.size), shapes) for r in data.rate_rows)
    known = Weights(thrust, rate)
    if unit:
        return known
    if data.prior_factor is None:
        return replace(known, ticks=bool(data.ticks))
    return replace(known, prior_factor=_whitened_prior(known, data, data.prior_factor))


def _whitened_prior(known: Weights, data: Data, spread: PriorPredictionFactor) -> Floats | None:
    """Whitened, and turned into orthogonal columns."""
    u, s, _ = thin_svd(known.whiten(data.of_rows(spread.thrust), spread.rate if known.rate else ()))
    kept = s > 1e-6
    return u[:, kept] * s[kept] if kept.any() else None
