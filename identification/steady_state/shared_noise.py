"""Noise of many windows of one run, found together: a slow part that no single short window can see.

Windows share the kind and the time constant of the slow (correlated) noise. They share its size too, in one of two
ways: the same newtons in every window (the cell and its amplifier), or the same share of the window's own noise (the
flow). Which of these, which kind and which size is a posterior over a grid; a window may depart from the common size,
since a hold can have a disturbance of its own. Each window speaks by Whittle's likelihood of `estimation.even_noise`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.estimation.even_noise import (
    SHARES,
    Likelihood,
    NoiseModel,
    fit_noise,
    likelihood,
    posterior,
    time_constants,
)
from identification.recording import Floats

SIZE_STEP = 1.5
"""Ratio between neighbouring common variances of the grid."""
SIZE_SPREAD = 0.7
"""Windows depart from the common slow variance by this much in log (the grid of shares has steps of about e)."""
OWN_WAY = 0.05
"""Chance beforehand that a window's slow variance has nothing to do with that of the others."""
NONE_AT_ALL = 0.1
"""Chance beforehand that the noise is white in every window: real force measurements seldom are."""
SLOW_POWER = 2.0
"""Prior over the octaves of time constants: rising, since noise too slow for its window is the one that goes unseen."""
TAU_MAX = 1.0
"""Longest time constant as a fraction of the longest window: beyond it windows tell power over tau, not either."""


def fit_noise_jointly(
    residuals: Sequence[Floats], lost: Sequence[Floats | None] | None = None
) -> tuple[NoiseModel, ...]:
    """Noise of each window (n_i,), n_i >= 5, of one run; `lost` as in `fit_noise`.

    A slow part of 0.6 of the white one, hardly seen in one window of 60 samples, is seen in two dozen of them:

    >>> from scipy.signal import lfilter
    >>> rng = np.random.default_rng(2)
    >>> slow = [lfilter([0.2], [1, -0.98], rng.standard_normal(500))[-60:] for _ in range(24)]
    >>> models = fit_noise_jointly([0.6 * s + rng.standard_normal(60) for s in slow])
    >>> bool(all(model.mean_std()[0] > 0.2 for model in models))
    True
    """
    constants = time_constants(max((r.size for r in residuals), default=0), TAU_MAX)
    losses = lost if lost is not None else [None] * len(residuals)
    if len(residuals) < 2:
        return tuple(fit_noise(r, gone) for r, gone in zip(residuals, losses, strict=True))
    found = [likelihood(r, constants, gone) for r, gone in zip(residuals, losses, strict=True)]
    priors = [_share_priors(f, sizes) for f, sizes in zip(found, _sizes(found), strict=True)]
    logs = [prior + f.log.reshape(1, len(SHARES), -1) for prior, f in zip(priors, found, strict=True)]
    by_size = [_log_sum(log, axis=1) for log in logs]
    together = np.sum(by_size, axis=0) + _size_prior(len(by_size[0]))[:, None] + _shape_prior(constants)
    return tuple(
        posterior(f, _log_sum(log + (together - own)[:, None, :], axis=0).ravel())
        for f, log, own in zip(found, logs, by_size, strict=True)
    )


def _log_sum(log: Floats, axis: int = 0) -> Floats:
    """log(sum(exp(log))) along an axis, finite numbers only: scipy's logsumexp, made for more, was half of a fit.

    >>> _log_sum(np.log([[1.0, 2.0], [3.0, 2.0]])).round(6).tolist() == np.log([4.0, 4.0]).round(6).tolist()
    True
    """
    most = log.max(axis=axis, keepdims=True)
    out: Floats = np.log(np.exp(log - most).sum(axis=axis)) + most.squeeze(axis)
    return out


def _sizes(found: Sequence[Likelihood]) -> list[Floats]:
    """For each window the slow variances (M,) that the M common sizes mean for it."""
    own = np.array([max(float(f.variance[: f.variance.size // len(SHARES)].min()), 1e-300) for f in found])
    low, high = float(np.log(own.min() * SHARES[1])), float(np.log(own.max() / (1 - SHARES[-2])))
    same = np.exp(np.arange(low, high, np.log(SIZE_STEP)))
    share = np.exp(np.arange(np.log(SHARES[1]), -np.log(1 - SHARES[-2]), np.log(SIZE_STEP)))
    return [np.concatenate([same, share * variance]) for variance in own]


def _size_prior(count: int) -> Floats:
    """Log prior (1 + M,): white, else every common size alike."""
    sized = np.full(count - 1, (1 - NONE_AT_ALL) / (count - 1))
    out: Floats = np.log(np.concatenate([[NONE_AT_ALL], sized]))
    return out


def _shape_prior(constants: int) -> Floats:
    """Log prior (K,) of first-order and flicker noise by time constant."""
    each = SLOW_POWER * np.log(np.tile(np.arange(constants) + 1.0, 2))
    out: Floats = each - _log_sum(each)
    return out


def _share_priors(found: Likelihood, sizes: Floats) -> Floats:
    """Log prior (1 + M, S, K) of the shares of one window under each common size; the first size is none at all."""
    share = np.array(SHARES)[:, None]
    slow = np.log(np.maximum(share[1:] * found.variance.reshape(len(SHARES), -1)[1:], 1e-300))
    away = -0.5 * np.square((slow - np.log(sizes)[:, None, None]) / SIZE_SPREAD)
    near = np.exp(away - _log_sum(away, axis=1)[:, None])
    anyhow = np.full((len(SHARES), slow.shape[1]), OWN_WAY / len(SHARES))
    white = anyhow.copy()
    white[0] += 1 - OWN_WAY
    sized = np.concatenate([np.zeros((sizes.size, 1, slow.shape[1])), near], axis=1) * (1 - OWN_WAY) + anyhow
    out: Floats = np.log(np.concatenate([white[None], sized]))
    return out
