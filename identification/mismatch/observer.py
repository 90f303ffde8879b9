"""Who watches a diagnosis: is told how far it is, and may end the search with what it has."""

from __future__ import annotations

from typing import Protocol


class Interrupted(Exception):
    """The search is to end with what it has; raised by an observer, and caught where there is a model to go on with."""


class Observer(Protocol):
    """Told while a diagnosis goes on. It decides nothing but whether the search ends."""

    def stage(self, name: str, /) -> None:
        """A stage begins. Raises nothing: there is no answer without it."""

    def trying(self, what: str, /) -> None:
        """What a search does next, a second's work or so. Raises Interrupted where it is to end."""


class Unwatched:
    """Nobody looks."""

    def stage(self, name: str, /) -> None: ...

    def trying(self, what: str, /) -> None: ...


UNWATCHED = Unwatched()
