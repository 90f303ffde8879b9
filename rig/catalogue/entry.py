"""One line of the catalogue: what a file says of a recording, campaign, fit, twin, diagnosis or calibration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from math import isfinite
from typing import Any, Final

ONE: Final = {
    "recordings": "recording",
    "campaigns": "campaign",
    "fits": "fit",
    "twins": "twin",
    "diagnoses": "diagnosis",
    "calibrations": "calibration",
}
WHAT: Final = tuple(ONE)
"""What `--what` takes."""
UNREADABLE: Final = "unreadable"
"""Outcome of a file that tells nothing; `reason` says why."""
UNREAD: Final = "unread"
"""Fact of an unreadable one: what ended its reading is not in the file, which is read again the next time."""
UNCLOSED: Final = "unclosed"
"""Outcome of a recording or campaign that says `running` although nothing was written to it for a while."""


@dataclass(frozen=True, slots=True)
class Entry:
    """Absent facts are empty or None. Times are s since 1970, UTC; durations are s."""

    what: str
    """One of WHAT."""
    path: str
    """Of the file, relative to the folder that is listed."""
    id: str = ""
    """A recording's own; of a document the beginning of its hash, of a calibration that of its text."""
    thruster: str = ""
    kind: str = ""
    campaign: str = ""
    stated: float | None = None
    """When it began, as the file says."""
    began: float | None = None
    """The same; where the file does not say, the time of the recordings that it is of, or of the file."""
    duration: float | None = None
    outcome: str = ""
    """Of a diagnosis its verdict."""
    operator: str = ""
    bench: str = ""
    said: str = ""
    """What else there is to say, in a few words."""
    reason: str = ""
    """Why it can't be read, or is not whole."""
    facts: Mapping[str, Any] = field(default_factory=dict)
    """As JSON has it; other keys for each of WHAT."""
    recordings: tuple[str, ...] = ()
    """Ids of the recordings that it is of."""


def seconds_of(text: str) -> float | None:
    """An ISO 8601 time in s since 1970; one without a zone is UTC. None for what is no time.

    >>> seconds_of("2026-03-01T12:00:00+00:00"), seconds_of("2026-03-01"), seconds_of("soon")
    (1772366400.0, 1772323200.0, None)
    """
    try:
        when = datetime.fromisoformat(text.strip())
        return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return None


def date_of(seconds: float | None, spec: str = "minutes") -> str:
    """ISO 8601 in UTC, empty for None and for what is beyond a calendar.

    >>> date_of(1772366400.0), date_of(None)
    ('2026-03-01 12:00', '')
    """
    try:
        return "" if seconds is None else datetime.fromtimestamp(seconds, UTC).replace(tzinfo=None).isoformat(" ", spec)
    except (ValueError, OverflowError, OSError):
        return ""


def finite(value: object) -> float | None:
    """A number out of JSON; None for anything else."""
    good = isinstance(value, int | float) and not isinstance(value, bool)
    try:
        return float(value) if good and isfinite(value) else None  # type: ignore[arg-type]  # `good` says it
    except OverflowError:
        return None
