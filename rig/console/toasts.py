"""Where short notices stand: below the head, over the progress lines or a panel's frame, and over no event."""

from __future__ import annotations

from textual.screen import Screen
from textual.widgets._toast import ToastRack  # the toolkit has no public name for it


def place(screen: Screen[object], below: int) -> None:
    """On the rows from `below` on."""
    for rack in screen.query(ToastRack):
        rack.styles.margin = (below, 0, 0, 0)
