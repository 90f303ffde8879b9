"""What a search went through, round by round: told by `rig diagnose --explain`, and nothing is decided by it."""

from __future__ import annotations

from dataclasses import dataclass

from identification.mismatch.select.screening import Screening
from identification.physics.term import Term


@dataclass(frozen=True, eq=False, slots=True)
class Candidate:
    """A term that was fitted beside a model."""

    term: Term
    chi2_gain: float
    price: float
    """In chi-square: log n for each parameter."""
    at_bound: bool
    """Whether a parameter is pressed against the end of what is possible."""


@dataclass(frozen=True, eq=False, slots=True)
class Unhidden:
    """A term that was told from noise by estimating both."""

    gain: float
    """In deviance."""
    asked: float
    """The gain from which it is believed."""


@dataclass(frozen=True, eq=False, slots=True)
class Round:
    """One round of the search: a model, what could be added to it, and what became of it."""

    model: tuple[Term, ...]
    screening: Screening
    fitted: tuple[Candidate, ...]
    """Those that passed and earn their parameters; of several tries those of the first."""
    hidden: Unhidden | None
    """Of what was added, where it passed no screening, for the noise had taken it for its own."""
    after: tuple[Term, ...] | None
    """The model that lasts, after pruning; None where nothing lasted."""
