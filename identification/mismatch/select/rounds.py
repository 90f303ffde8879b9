"""What a search went through, round by round: told by `rig diagnose --explain`, and nothing is decided by it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar


class Effect(Protocol):
    """A term as a search knows it: an effect in one textbook form."""

    @property
    def id(self) -> str: ...

    @property
    def form(self) -> str: ...

    def parameters(self, scale: Any, /) -> Any:
        """In the order of its values."""

    def statement(self, theta: tuple[float, ...], scale: Any, /) -> str:
        """One sentence a person can act on."""


T = TypeVar("T", bound=Effect)
Judged = TypeVar("Judged")
"""What a screening says."""


@dataclass(frozen=True, eq=False, slots=True)
class Candidate(Generic[T]):
    """A term that was fitted beside a model."""

    term: T
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
class Round(Generic[T, Judged]):
    """One round of the search: a model, what could be added to it, and what became of it."""

    model: tuple[T, ...]
    screening: Judged
    fitted: tuple[Candidate[T], ...]
    """Those that passed and earn their parameters; of several tries those of the first."""
    hidden: Unhidden | None
    """Of what was added, where it passed no screening, for the noise had taken it for its own."""
    after: tuple[T, ...] | None
    """The model that lasts, after pruning; None where nothing lasted."""
