"""How much data can say at best (section 4.1.2): Fisher information, Cramér-Rao bound, efficiency, excitation.

Information is kept as a root R, M = R'R: R has the condition of the regressor, M its square.

Two remarks on the thesis. Section 4.1.1 prints ``sigma_theta_i^2 = sigma^2 / s_i^2``; that is the variance of the i-th
*combination* v_i'theta (column i of V in H = U S V'). The variance of a parameter is ``sigma^2 sum_j V_ij^2 / s_j^2``,
and so one small singular value spoils every parameter that takes part in it. And the bound of section 4.1.2 holds for
unbiased estimators only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from identification.estimation.regression import Deficiency, least_squares, weighted
from identification.recording import Floats

STEP = float(np.finfo(np.float64).eps) ** (1 / 3)
"""Relative step of a central difference with the least error of rounding and of curvature together."""


@dataclass(frozen=True, eq=False)
class Information:
    """Of p parameters."""

    names: tuple[str, ...]
    root: Floats
    """(k, p), M = root' root."""
    bound: Floats
    """(p, p) Cramér-Rao bound M^-1; NaN for parameters that the data do not determine."""
    deficiency: Deficiency | None

    @property
    def matrix(self) -> Floats:
        """(p, p) Fisher information M."""
        return self.root.T @ self.root

    @property
    def std(self) -> Floats:
        """(p,) least standard deviation of an unbiased estimate of each parameter."""
        out: Floats = np.sqrt(np.diag(self.bound))
        return out


def _information(root: Floats, names: tuple[str, ...]) -> Information:
    fit = least_squares(root, np.zeros(len(root)), names, 1.0)
    return Information(names, np.linalg.qr(root)[1], fit.cov, fit.deficiency)


def linear_information(H: Floats, names: tuple[str, ...], sigma: float | Floats) -> Information:
    """M = H' Sigma^-1 H of y = H theta + e, H (n, p), e normal; `sigma` as in `regression.weighted`.

    >>> found = linear_information(np.array([[1.0], [1.0], [1.0], [1.0]]), ("mean",), 2.0)
    >>> found.std.round(9).tolist()
    [1.0]
    """
    root, _, _ = weighted(H, np.zeros(len(H)), sigma)
    return _information(root, names)


def model_information(
    model: Callable[[Floats], Floats],
    theta: Floats,
    names: tuple[str, ...],
    sigma: float | Floats,
    jacobian: Callable[[Floats], Floats] | None = None,
) -> Information:
    """M = J' Sigma^-1 J of y = model(theta) + e at `theta` (p,), e normal with a Sigma that theta does not change.

    `jacobian`(theta) gives J (n, p); without it central differences serve (about 10 digits of the model's scale).

    >>> found = model_information(lambda theta: theta**2, np.array([3.0]), ("a",), 0.6)
    >>> found.std.round(6).tolist()
    [0.1]
    """
    J = differences(model, theta) if jacobian is None else jacobian(theta)
    return linear_information(J, names, sigma)


def differences(model: Callable[[Floats], Floats], theta: Floats) -> Floats:
    """Jacobian (n, p) of model(theta) by central differences; the step is relative, or absolute at 0."""
    columns = []
    for i, value in enumerate(theta):
        step = np.zeros(theta.size)
        step[i] = STEP * (abs(value) or 1.0)
        above, below = theta + step, theta - step
        columns.append((model(above) - model(below)) / (above[i] - below[i]))
    return np.stack(columns, axis=1)


def score_information(scores: Floats, names: tuple[str, ...]) -> Information:
    """M as the mean outer product of scores (N, p), gradients of the log-likelihood at the true parameters.

    The definition in section 4.1.2, for any law of the noise: draw N sets of data, give the gradient of each.
    """
    return _information(scores / np.sqrt(len(scores)), names)


@dataclass(frozen=True, slots=True)
class Efficiency:
    """Bound over covariance: 1 for an efficient estimator, more only for a biased one or too few runs."""

    per_parameter: tuple[float, ...]
    """Variance the bound allows over the variance of the estimate."""
    worst: float
    """Of any combination of parameters: below it lies none."""
    overall: float
    """(det M^-1 / det cov)^(1/p)."""

    @property
    def statement(self) -> str:
        return (
            f"efficiency {100 * self.overall:.3g} % overall, {100 * self.worst:.3g} % for the worst combination of "
            "parameters (Cramér-Rao bound over variance)"
        )


def efficiency(cov: Floats, information: Information) -> Efficiency | Deficiency:
    """Of an unbiased estimate with covariance `cov` (p, p); a Deficiency when the data do not determine it.

    >>> found = efficiency(np.array([[2.0]]), linear_information(np.array([[1.0]]), ("a",), 1.0))
    >>> round(found.worst, 9)
    0.5
    """
    if information.deficiency is not None:
        return information.deficiency
    ratios = eigh(information.bound, cov, eigvals_only=True)
    each = np.diag(information.bound) / np.diag(cov)
    overall = float(np.exp(np.mean(np.log(ratios))))
    return Efficiency(tuple(float(r) for r in each), float(ratios[0]), overall)


@dataclass(frozen=True, eq=False)
class Excitation:
    """How well a regressor excites its parameters (end of section 4.1.1)."""

    log_det: float
    """ln det H'H; -inf when a combination is not seen."""
    trace: float
    """Of H'H: blind to a combination that is not seen, so never a measure on its own."""
    condition: float
    """Of H'H as it is: it depends on the units."""
    scaled_condition: float
    """Of H with columns of equal length: what no choice of units cures."""
    singular_values: Floats
    """(p,) of H."""
    deficiency: Deficiency | None

    @property
    def det(self) -> float:
        return float(np.exp(self.log_det))

    @property
    def persistently_exciting(self) -> bool:
        """H'H is not singular (observability condition)."""
        return self.deficiency is None

    @property
    def statement(self) -> str:
        if self.deficiency is not None:
            return f"not persistently exciting: {self.deficiency.statement}"
        return f"persistently exciting: condition {self.scaled_condition:.3g} with columns of equal length"


def excitation(H: Floats, names: tuple[str, ...], sigma: float | Floats | None = None) -> Excitation:
    """Of H (n, p); with `sigma` (see `regression.weighted`) of H as the weighted fit sees it.

    >>> V = np.array([10.0, -10.0, 10.0])
    >>> print(excitation(np.column_stack([V * abs(V), V]), ("C", "k")).statement)
    not persistently exciting: the data cannot tell the combination -0.1 C +1 k
    """
    fit = least_squares(H, np.zeros(len(H)), names, sigma)
    s, seen = fit.singular_values, fit.deficiency is None
    return Excitation(
        log_det=float(2 * np.sum(np.log(s))) if seen else float("-inf"),
        trace=float(np.sum(s**2)),
        condition=float((s[0] / s[-1]) ** 2) if seen else float("inf"),
        scaled_condition=fit.condition,
        singular_values=s,
        deficiency=fit.deficiency,
    )
