"""A device that was recognised, as far as it tells by itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Role = Literal["motor", "force", ""]
"""What a bench needs it for; empty: any other channel."""


@dataclass(frozen=True, slots=True)
class Found:
    """One device of a port or bus. Values are SI."""

    kind: str
    """A key of `drivers.KINDS`."""
    identity: str
    """Model, firmware, serial number, as it says them."""
    role: Role = ""
    keys: Mapping[str, object] = field(default_factory=dict)
    """Keys of its table in a bench file that are known now, beside kind, port, baud, framing and bus."""
    untold: Mapping[str, str] = field(default_factory=dict)
    """Keys that it cannot tell -> what they are, and where they are found."""
    settings: tuple[str, ...] = ()
    """One sentence each."""
    rate: str = ""
    """How often it says something, in words."""
    watchdog: str = ""
    """Of a motor controller: what it does when commands stop, and who says so."""
