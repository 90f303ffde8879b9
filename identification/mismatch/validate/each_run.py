"""A name's values by each single run of several: where they differ by much more than their errors, that is said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.model.data import Data
from identification.mismatch.validate.cross_validation import fitted_to
from identification.physics.term import Term

MOST_RUNS = 8
"""Each costs a fit of the whole model."""
Told = tuple[float, float]
"""A value and its standard error."""


@dataclass(frozen=True, slots=True)
class RunDifference:
    """Of one parameter."""

    name: str
    unit: str
    low: float
    high: float
    """By single runs."""
    p_value: float
    """That runs which have one value differ so much, after all parameters of the model."""

    @property
    def statement(self) -> str:
        return (
            f"From run to run its {self.name.replace('_', ' ')} differs by more than its errors: "
            f"{self.low:.2g} to {self.high:.2g} {self.unit}".removesuffix(" 1")
            + "."
        )


def run_differences(estimate: Estimate, data: Data, terms: Sequence[Term]) -> dict[Term, RunDifference]:
    """Of these terms of the model, those of which some parameter is another from run to run: the one that differs most.

    The model is fitted to each run alone; what a run does not determine says nothing.
    """
    runs = len(data.histories)
    if not 2 <= runs <= MOST_RUNS or not terms:
        return {}
    alone = [fitted_to(estimate, data, [i]) for i in range(runs)]
    tests = sum(len(term.parameters(data.scale)) for term in terms)
    out = {}
    for term in terms:
        known = [f for f in alone if bool(np.all(np.isfinite(f.std[f.layout.of(term)])))]  # none at its bounds
        found = [one for k in range(len(term.parameters(data.scale))) if (one := _of(term, k, known, data, tests))]
        if found:
            out[term] = min(found, key=lambda one: one.p_value)
    return out


def _of(term: Term, k: int, alone: Sequence[Fit], data: Data, tests: int) -> RunDifference | None:
    parameter = term.parameters(data.scale)[k]
    told = [(f.values[term][k], float(f.std[f.layout.of(term)][k])) for f in alone]
    p = min(same_value(told) * tests, 1.0)
    if p >= policy.name.RUNS_DIFFER_P:
        return None
    values = [value for value, std in told if determined(value, std)]
    low, high = min(values), max(values)
    if abs(high - low) < policy.name.RUNS_APART * abs(float(np.median(values))):
        return None
    return RunDifference(parameter.name, parameter.unit, low, high, p)


def determined(value: float, std: float) -> bool:
    """Whether a run tells the value at all.

    >>> determined(0.4, 0.1), determined(0.4, 0.5), determined(0.4, float("nan"))
    (True, False, False)
    """
    return bool(np.isfinite(std) and 0 < 2 * std < abs(value))


def same_value(told: Sequence[Told]) -> float:
    """p-value of one value behind all that are determined; 1 of fewer than two.

    >>> round(same_value([(1.0, 0.1), (1.1, 0.1)]), 2), same_value([(1.0, 0.1), (2.0, 0.1), (3.0, 9.0)]) < 1e-10
    (0.48, True)
    """
    known = np.array([(v, s) for v, s in told if determined(v, s)])
    if len(known) < 2:
        return 1.0
    value, weight = known[:, 0], known[:, 1] ** -2.0
    mean = float(value @ weight / weight.sum())
    return float(chi2_sf(float(weight @ (value - mean) ** 2), len(known) - 1))
