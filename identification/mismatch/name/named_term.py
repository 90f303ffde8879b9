"""What speaks for a name, whatever is modelled: how the term stands beside its rivals, and what it was asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Literal

import numpy as np

from identification.estimation.tails import chi2_sf, noncentral_chi2_sf
from identification.mismatch import policy
from identification.mismatch.select.rounds import T
from identification.mismatch.select.stepwise import F, RivalTerm, Standing
from identification.recording import Floats

CheckKind = Literal[
    "possible",
    "sampled",
    "clipping",
    "rate_levels",
    "undone",
    "pays",
    "constant",
    "repair",
    "own_covariate",
    "any_curve",
    "predicts",
    "chance",
]
"""What a check is about: `possible` values, what the samples can show (`sampled`), what else clips, where the measured
rate stands, another term that undoes it, BIC, a parameter that is the same everywhere, the shape (three kinds), what
was not fitted, and what noise makes where something is left."""
PAYS: CheckKind = "pays"
GRAVE: frozenset[CheckKind] = frozenset(
    {"possible", "sampled", "clipping", "rate_levels", "undone", PAYS, "predicts", "chance"}
)
"""Kinds that no share of what could be explained makes up for: a term that fails one is not that physics."""

LEAST_P = 1e-300
"""Smallest p-value that is told: 0 has no logarithm for those who draw it."""


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that a name is asked."""

    kind: CheckKind
    asked: str
    failed: str = ""
    """Why the name is not earned; empty where it passes."""
    told: str = ""
    """Its figures, or why it says nothing here."""
    silent: bool = False
    """Whether it says nothing here."""
    apart: float = 0.0
    """By how much a parameter differs between parts, as a share of itself, where that is asked."""


@dataclass(frozen=True, slots=True)
class Attained:
    """What a name does on what was not fitted."""

    without: float
    """RMSE per sample without it, N."""
    with_it: float
    share: float
    """Of what anything could improve there, 0 to 1."""


@dataclass(frozen=True, eq=False)
class NamedTerm(Generic[T, F]):
    """One term of the final model and what speaks for its name."""

    term: T
    theta: tuple[float, ...]
    std: tuple[float, ...]
    chi2_gain: float
    bic_gain: float
    p_value: float
    """Of the best of `searched` alternatives."""
    probability: float
    """Its weight among the effects that were asked: that it is none of these is not among them."""
    rivals: tuple[RivalTerm[T, F], ...]
    """Other effects within RIVAL_STATED_BIC, best first."""
    checks: tuple[Check, ...]
    """All that it was asked."""
    forms: tuple[RivalTerm[T, F], ...] = ()
    """The same effect in its other textbook forms, best first, however much worse."""
    attained: Attained | None = None
    searched: int = 1
    """Alternatives that were looked at before this one was taken."""
    asked_effects: int = 1
    """Effects that were fitted in its place, and itself."""
    chi2_of_all: float = 0.0
    """Of the whole model, beside which the fits of rivals and forms stand."""

    @property
    def only_unpaid(self) -> bool:
        """Whether all that speaks against it is that it does not pay for its parameters: it follows noise."""
        return [check.kind for check in self.checks if check.failed] == [PAYS]

    @property
    def failed_checks(self) -> tuple[str, ...]:
        """Why the name is not earned; empty when it is."""
        return tuple(check.failed for check in self.checks if check.failed)

    def asked(self, *more: Check) -> NamedTerm[T, F]:
        """The same with further checks."""
        return replace(self, checks=(*self.checks, *more))


def effect_id(term: T) -> str:
    """The effect that a term is a form of: what counts as one where rivals are told."""
    return term.id


def named_term(
    term: T,
    fitted: F,
    stands: Standing[F, T],
    asked: tuple[Check, ...],
    effect_of: Callable[[T], str] = effect_id,
    searched: int = 1,
) -> NamedTerm[T, F]:
    """A term of a model beside its rivals: of each other effect the best form; `effect_of`: what counts as one.

    `searched`: alternatives that were looked at. The p-value is that of the best of so many, whatever their
    correlations (Bonferroni).
    """
    less, others = stands
    gain, values = less.chi2 - fitted.chi2, fitted.values[term]
    bic_gain = gain - len(values) * float(np.log(max(fitted.residual.size, 2)))
    unique: dict[str, RivalTerm[T, F]] = {}
    for r in others:
        if min(r.bic_loss, r.aic_loss) < policy.select.RIVAL_STATED_BIC and effect_of(r.term) != effect_of(term):
            unique.setdefault(effect_of(r.term), r)
    return NamedTerm(
        term,
        values,
        tuple(map(float, fitted.std[fitted.layout.of(term)])),
        gain,
        bic_gain,
        min(max(searched * float(chi2_sf(max(gain, 0.0), len(values))), LEAST_P), 1.0),
        probability_beside([r.bic_loss for r in unique.values()]),
        tuple(unique.values()),
        (*asked, _pays(bic_gain)),
        tuple(r for r in others if effect_of(r.term) == effect_of(term)),
        searched=searched,
        asked_effects=len({effect_of(r.term) for r in others} | {effect_of(term)}),
        chi2_of_all=fitted.chi2,
    )


def _pays(bic_gain: float) -> Check:
    """What does not pay for its parameters has no name, whatever else speaks for it."""
    failed = "" if bic_gain > 0 else f"it does not pay for its parameters (BIC worse by {-bic_gain:.1f})"
    return Check(PAYS, "it pays for its parameters", failed, f"BIC better by {bic_gain:.4g}" if bic_gain > 0 else "")


def restated(named: Sequence[NamedTerm[T, F]], final: F) -> list[NamedTerm[T, F]]:
    """The same with their values in the final model, where they are in it."""
    values, at, std = final.values, final.layout, final.std
    return [
        replace(n, theta=values[n.term], std=tuple(map(float, std[at.of(n.term)]))) if n.term in values else n
        for n in named
    ]


def probability_beside(losses: Sequence[float]) -> float:
    """Of a name beside rivals whose BIC is worse by these."""
    return float(1.0 / (1.0 + sum(np.exp(-0.5 * max(loss, 0.0)) for loss in losses)))


@dataclass(frozen=True, slots=True)
class PartDifference:
    """Of an effect in one part of the recordings, as a share of itself."""

    share: float
    error: float
    """Standard error."""
    p_value: float
    """That it is no more than what is spared."""


def part_difference(column: Floats, basis: Floats, residual: Floats, spared: float) -> PartDifference | None:
    """By how much an effect differs there; None where that part tells too little.

    `column` (n,): all that it does there, whitened; `basis` (n, p): orthonormal, what the model can follow. A share of
    `spared` counts as the same.
    """
    rest = column - basis @ (basis.T @ column)
    size = float(np.linalg.norm(rest))
    if size < 1e-3 * float(np.linalg.norm(column)) or size < policy.name.PART_SIGMA:
        return None
    score = float(rest @ residual) / size
    p = float(noncentral_chi2_sf(score**2, 1, (spared * size) ** 2))
    return PartDifference(abs(score) / size, 1 / size, p)


def part_check(what: str, column: Floats, basis: Floats, residual: Floats, spared: float, tests: int) -> Check:
    """Whether a parameter is the same in `what`, of `tests` such questions; arrays as of `part_difference`."""
    asked = f"the same {what}"
    apart = part_difference(column, basis, residual, spared)
    if apart is None:
        return Check("constant", asked, told="the parts tell too little", silent=True)
    p = apart.p_value * tests
    says = f"{100 * apart.share:.0f} % apart"
    failed = f"its parameter is not the same {what} ({says})" if p < policy.name.INCONSTANT_P else ""
    return Check(
        "constant", asked, failed, f"{says}, +- {100 * apart.error:.0f} %; p {min(p, 1.0):.2g}", apart=apart.share
    )
