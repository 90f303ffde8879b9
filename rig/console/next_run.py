"""What a console that has ended leaves to whoever opened it: the campaign to be run next."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class NextRun:
    """The next sweep of a diagnosis."""

    campaign: Path
    recordings: tuple[str, ...]
    """Those that proposed it: what it records is diagnosed together with them."""
    others: tuple[Path, ...] = ()
    """Campaigns of its other flow speeds, to be run after it."""
