"""Maximum likelihood for models that are not linear in their parameters, with what is known beforehand carried in.

Measurements are y ~ N(f(theta), Sigma), whitened by the caller; earlier knowledge of some parameters (a calibrated
thruster, an earlier step) is one more measurement of them with its full covariance. Gauss and Newton's steps are
scipy's; what data cannot tell is said by singular values, as in `identification.estimation.regression`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, cholesky, solve_triangular
from scipy.optimize import least_squares

from identification.estimation.regression import Deficiency
from identification.recording import Floats

UNSEEN = 1e-5
"""Smallest over largest singular value of the column-scaled Jacobian that finite differences can tell from nothing."""
PART_OF_COMBINATION = 1e-2


@dataclass(frozen=True, eq=False)
class Gaussian:
    """Parameters known together: mean (p,) and covariance (p, p); NaN where data do not determine them.

    >>> known = Gaussian(("k", "m"), np.array([100.0, 500.0]), np.diag([4.0, 100.0]))
    >>> known["m"], known.std_of("k"), known.select(("m",)).names
    (500.0, 2.0, ('m',))
    """

    names: tuple[str, ...]
    mean: Floats
    cov: Floats

    def __post_init__(self) -> None:
        p = len(self.names)
        if self.mean.shape != (p,) or self.cov.shape != (p, p) or len(set(self.names)) != p:
            raise ValueError(
                f"Gaussian: {p} names (each once) need mean ({p},) and cov ({p}, {p}), "
                f"got {self.mean.shape} and {self.cov.shape}"
            )

    def __getitem__(self, name: str) -> float:
        return float(self.mean[self.names.index(name)])

    def std_of(self, name: str) -> float:
        i = self.names.index(name)
        return float(np.sqrt(self.cov[i, i]))

    def select(self, names: Sequence[str]) -> Gaussian:
        """Marginal of some of them, in the order asked for."""
        at = [self.names.index(name) for name in names]
        return Gaussian(tuple(names), self.mean[at], self.cov[np.ix_(at, at)])

    def determined(self) -> Gaussian:
        """Those with a finite standard deviation."""
        good = np.isfinite(np.diag(self.cov))
        return self.select([name for name, keep in zip(self.names, good, strict=True) if keep])


NOTHING = Gaussian((), np.zeros(0), np.zeros((0, 0)))
"""No earlier knowledge."""


def independent(*known: Gaussian) -> Gaussian:
    """Pieces of knowledge that have nothing to do with one another, as one."""
    names = tuple(name for g in known for name in g.names)
    return Gaussian(names, np.concatenate([g.mean for g in known]), block_diag(*(g.cov for g in known)))


@dataclass(frozen=True, eq=False)
class Maximum:
    """Where the likelihood is greatest. Arrays over n whitened measurements and p parameters."""

    estimate: Gaussian
    misfit: Floats
    """(n,) whitened: measurements less prediction."""
    gain: Floats
    """(p, n + q): how the estimate answers to each whitened measurement and to each of q pieces of prior knowledge."""
    prior_misfit: Floats
    """Whitened distance of the estimate from what was known beforehand."""
    deficiency: Deficiency | None
    converged: bool

    @property
    def chi2(self) -> float:
        return float(self.misfit @ self.misfit + self.prior_misfit @ self.prior_misfit)

    @property
    def dof(self) -> int:
        """Measurements and pieces of earlier knowledge less parameters."""
        return max(self.misfit.size + self.prior_misfit.size - len(self.estimate.names), 0)

    def with_noise(self, noise: Floats) -> Floats:
        """Covariance (p, p) when the whitened measurements are not white: gain noise gain^T + what the prior leaves.

        `noise` (n, n) is their covariance.
        """
        measured, known = self.gain[:, : self.misfit.size], self.gain[:, self.misfit.size :]
        out: Floats = measured @ noise @ measured.T + known @ known.T
        out[np.isnan(self.estimate.cov)] = np.nan
        return out

    def spread(self, gradient: Floats) -> float:
        """Standard deviation of gradient (p,) @ theta along what the data do see; for ratios of unseen parameters."""
        return float(np.linalg.norm(gradient @ self.gain))


Misfit = Callable[[Floats], Floats]
"""(k, p) parameter sets -> (k, n) whitened misfits: many sets at once, as a vectorised simulation likes it."""


def _differences(misfit: Misfit, theta: Floats, step: Floats) -> Floats:
    """Central differences (n, p), every set in one call."""
    p = theta.size
    both = misfit(np.vstack([theta + np.diag(step), theta - np.diag(step)]))
    out: Floats = ((both[:p] - both[p:]) / (2 * step[:, None])).T
    return out


def maximise(
    names: tuple[str, ...], start: Floats, scale: Floats, misfit: Misfit, known: Gaussian = NOTHING, steps: int = 60
) -> Maximum:
    """Most likely theta (p,) from `start`; `scale` (p,) says in what steps each parameter is of interest.

    `known` may name any of the parameters. Raises ValueError when shapes or names do not fit.

    >>> y, x = np.array([1.0, 2.1, 2.9]), np.array([1.0, 2.0, 3.0])
    >>> found = maximise(("a",), np.array([0.5]), np.array([1.0]), lambda t: (y - t * x) / 0.1)
    >>> round(found.estimate["a"], 4), round(found.estimate.std_of("a"), 4)
    (0.9929, 0.0267)
    """
    if start.shape != (len(names),) or scale.shape != start.shape or not np.all(scale > 0):
        raise ValueError(f"maximise: {len(names)} names need as many starts and positive scales")
    strangers = set(known.names) - set(names)
    if strangers:
        raise ValueError(f"maximise: {', '.join(sorted(strangers))} known beforehand, but no parameter of the model")
    root, at = _root(known), [names.index(name) for name in known.names]

    def whole(u: Floats) -> Floats:
        theta = u * scale
        left: Floats = np.concatenate([misfit(theta[None])[0], root @ (known.mean - theta[at])])
        return left

    def slope(u: Floats) -> Floats:
        J = _differences(misfit, u * scale, 1e-4 * scale)
        prior = np.zeros((root.shape[0], len(names)))
        prior[:, at] = -root
        out: Floats = np.vstack([J, prior]) * scale
        return out

    found = least_squares(whole, start / scale, jac=slope, x_scale="jac", max_nfev=steps, xtol=1e-10, ftol=1e-10)
    n = found.fun.size - len(at)
    cov, gain, deficiency = _covariance(np.asarray(found.jac), scale, names)
    estimate = Gaussian(names, found.x * scale, cov)
    return Maximum(estimate, found.fun[:n], -gain, found.fun[n:], deficiency, bool(found.status > 0))


def _root(known: Gaussian) -> Floats:
    """L^-1 of the covariance L L^T; ValueError when it is no covariance."""
    if not known.names:
        return np.zeros((0, 0))
    std = np.sqrt(np.diag(known.cov))
    if not (np.all(np.isfinite(known.cov)) and np.all(std > 0)):
        raise ValueError(f"known beforehand ({', '.join(known.names)}): variances must be finite and above zero")
    lower = cholesky(known.cov / np.outer(std, std) + 1e-12 * np.eye(std.size), lower=True)
    out: Floats = solve_triangular(lower, np.diag(1 / std), lower=True)
    return out


def _covariance(J: Floats, scale: Floats, names: tuple[str, ...]) -> tuple[Floats, Floats, Deficiency | None]:
    """Covariance and pseudo-inverse from the Jacobian (n, p) by scaled parameters, and what it does not see."""
    size = np.linalg.norm(J, axis=0)
    size[size == 0] = 1.0
    U, s, Vt = np.linalg.svd(J / size, full_matrices=J.shape[0] < J.shape[1])  # V whole, U never wider than needed
    seen = np.zeros(len(names), dtype=np.bool_)
    seen[: s.size] = s > UNSEEN * (s[0] if s.size else 1.0)
    kept = seen[: s.size]
    back = (Vt[seen].T / s[kept]) @ U[:, : s.size][:, kept].T * (scale / size)[:, None]
    cov = back @ back.T
    if seen.all():
        return cov, back, None
    combinations = []
    for row in Vt[~seen]:
        parts = np.flatnonzero(np.abs(row) > PART_OF_COMBINATION * np.abs(row).max())
        factors = row[parts] * (scale / size)[parts]
        factors = factors / factors[np.argmax(np.abs(factors))]
        combinations.append(tuple((names[i], float(f)) for i, f in zip(parts, factors, strict=True)))
    deficiency = Deficiency(tuple(combinations))
    lost = [names.index(name) for name in deficiency.names]
    cov[lost, :] = cov[:, lost] = np.nan
    return cov, back, deficiency
