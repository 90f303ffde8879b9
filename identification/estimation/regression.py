"""Linear least squares, plain and weighted, by QR. What data cannot tell is said, not raised. Knows no thrusters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from identification.estimation.even_noise import NoiseModel, fit_noise, leverage
from identification.estimation.singular_values import thin_svd
from identification.recording import Floats

RANK_TOLERANCE = 1e-10
"""Smallest over largest singular value of the column-scaled regressor below which a combination counts as unseen."""
PART_OF_COMBINATION = 1e-3
"""A parameter is part of an unseen combination when its scaled share exceeds this."""


@dataclass(frozen=True, slots=True)
class Deficiency:
    """Combinations of parameters that the regressor does not excite (observability condition after eq. 4.5)."""

    combinations: tuple[tuple[tuple[str, float], ...], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters that take part in any of them."""
        found = [name for combination in self.combinations for name, _ in combination]
        return tuple(dict.fromkeys(found))

    @property
    def statement(self) -> str:
        sums = [" ".join(f"{factor:+.3g} {name}" for name, factor in c) for c in self.combinations]
        return "the data cannot tell the combination " + ", nor ".join(sums)


@dataclass(frozen=True, eq=False)
class LinearFit:
    """y = H theta + e. Arrays: theta (p,), cov (p, p), residual (n,), singular_values (p,) of H as weighted."""

    names: tuple[str, ...]
    theta: Floats
    cov: Floats
    residual: Floats
    dof: int
    """n - rank."""
    sigma2: float | None
    """Variance estimated from the residual by eq. 4.12; None when the covariance of y was given."""
    chi2: float | None
    """J_WLS (eq. 4.10) at its minimum; None when sigma2 had to be estimated from the same residual."""
    singular_values: Floats
    condition: float
    """Of the column-scaled regressor: what scaling cannot cure."""
    solver: Floats
    """(p, n) with theta = solver @ y."""
    deficiency: Deficiency | None = None

    @property
    def std(self) -> Floats:
        out: Floats = np.sqrt(np.diag(self.cov))
        return out

    def index(self, name: str) -> int:
        return self.names.index(name)


def weighted(H: Floats, y: Floats, sigma: float | Floats | None) -> tuple[Floats, Floats, Floats | None]:
    """L^-1 H, L^-1 y and L^-1 (as (n,) when Sigma = L L^T is diagonal).

    `sigma` None: nothing known; a number or (n,): standard deviations; (n, n): the full covariance.
    """
    if sigma is None:
        return H, y, None
    array = np.asarray(sigma, dtype=np.float64)
    if array.ndim <= 1:
        if not (np.all(np.isfinite(array)) and np.all(array > 0)):
            raise ValueError("weighted: standard deviations must be finite and above zero")
        root = np.broadcast_to(1.0 / array, y.shape)
        return H * root[:, None], y * root, root
    lower = cholesky(array, lower=True)
    inverse = solve_triangular(lower, np.eye(y.size), lower=True)
    return inverse @ H, inverse @ y, inverse


def least_squares(H: Floats, y: Floats, names: tuple[str, ...], sigma: float | Floats | None = None) -> LinearFit:
    """LS (eq. 4.3 to 4.6, 4.12) without `sigma`, WLS (eq. 4.8, 4.9, 4.10) with it; see `weighted` for its forms.

    With the covariance of y as `sigma` it is the best linear unbiased estimator (BLUE, property 4 of section 4.1.1:
    `solver` is the C of eq. 4.7), and for normal errors the most likely one (section 4.1.3). H (n, p), y (n,). Raises
    ValueError for shapes that do not fit, no rows, or numbers that are not finite.

    >>> fit = least_squares(np.array([[1.0, 1], [2, 1], [3, 1]]), np.array([2.0, 4, 6]), ("a", "b"))
    >>> (fit.theta.round(6) + 0.0).tolist(), fit.dof
    ([2.0, 0.0], 1)
    """
    n, p = H.shape
    if y.shape != (n,) or len(names) != p:
        raise ValueError(f"least_squares: H {H.shape}, y {y.shape} and {len(names)} names do not fit together")
    if n == 0 or p == 0:
        raise ValueError(f"least_squares: there is nothing to fit: {n} rows, {p} parameters")
    if not (np.all(np.isfinite(H)) and np.all(np.isfinite(y))):
        raise ValueError("least_squares: H and y must be finite; leave out missing samples first")
    A, b, root = weighted(H, y, sigma)
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0] = 1.0
    Q, R = np.linalg.qr(A / scale, mode="reduced")
    U, s, Vt = np.linalg.svd(R, full_matrices=True)
    seen = np.zeros(p, dtype=np.bool_)
    seen[: s.size] = s > RANK_TOLERANCE * s[0]
    kept = seen[: s.size]
    back = (Vt[seen].T / s[kept]) @ (Q @ U[:, : s.size][:, kept]).T / scale[:, None]
    theta = back @ b
    left = b - A @ theta
    J, dof = float(left @ left), n - int(seen.sum())
    sigma2 = None if sigma is not None else J / dof if dof > 0 else float("nan")
    cov = (Vt[seen].T / s[kept] ** 2) @ Vt[seen] / np.outer(scale, scale) * (1.0 if sigma2 is None else sigma2)
    deficiency = None if seen.all() else _deficiency(Vt[~seen], scale, names)
    if deficiency is not None:
        lost = [names.index(name) for name in deficiency.names]
        cov[lost, :] = cov[:, lost] = np.nan
    condition = float(s[0] / s[-1]) if seen.all() else float("inf")
    solver = back if root is None else back * root if root.ndim == 1 else back @ root
    values = np.linalg.svd(R * scale, compute_uv=False)
    chi2 = None if sigma is None else J
    return LinearFit(names, theta, cov, y - H @ theta, dof, sigma2, chi2, values, condition, solver, deficiency)


def _deficiency(unseen: Floats, scale: Floats, names: tuple[str, ...]) -> Deficiency:
    """Rows of `unseen` (k, p) are directions of scaled parameters along which the prediction does not change."""
    combinations = []
    for row in unseen:
        parts = np.flatnonzero(np.abs(row) > PART_OF_COMBINATION * np.abs(row).max())
        factors = row[parts] / scale[parts]
        factors = factors / factors[np.argmax(np.abs(factors))]
        combinations.append(tuple((names[i], float(f)) for i, f in zip(parts, factors, strict=True)))
    return Deficiency(tuple(combinations))


def correlated_std(fit: LinearFit, contrast: Floats, noise: Sequence[NoiseModel]) -> tuple[float, float]:
    """Standard deviation and effective dof of contrast @ theta when residuals are correlated in time.

    Sandwich covariance S Sigma S^T, S the solver of an unweighted fit; Sigma is block-diagonal, one noise model for the
    rows of each recording, in their order (`block_noise`).
    """
    weights = contrast @ fit.solver
    variance, spread, start = 0.0, 0.0, 0
    for model in noise:
        std, dof = model.combination_std(weights[start : start + model.n])
        start += model.n
        variance += std**2
        spread += std**4 / dof
    if variance == 0.0:
        return 0.0, float(fit.dof)
    return float(np.sqrt(variance)), min(variance**2 / spread, float(fit.dof))


def block_noise(H: Floats, residual: Floats, blocks: Sequence[slice]) -> tuple[NoiseModel, ...]:
    """Noise of each block of rows (a recording each, even in time) from the residual of an unweighted fit on H (n, p).

    What the fit took out of the residual at each frequency is allowed for.
    """
    scale = np.linalg.norm(H, axis=0)
    U, s, _ = thin_svd(H / np.where(scale > 0, scale, 1.0))
    basis = U[:, s > RANK_TOLERANCE * s[0]]
    return tuple(fit_noise(residual[rows], leverage(basis[rows])) for rows in blocks)
