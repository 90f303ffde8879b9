"""Keys pressed while a dialog closes: they are meant for the page below it, not for the text field that is still there.

The stop key never comes here.
"""

from __future__ import annotations

from textual import events


class KeysAfterEnter:
    """Keeps what comes between the key that closes a dialog and its end."""

    def __init__(self) -> None:
        self._kept: list[events.Key] | None = None

    def takes(self, event: events.Event, *, in_dialog: bool) -> bool:
        """Whether it is a key that is kept for later."""
        if not isinstance(event, events.Key) or event.is_forwarded:
            return False
        if self._kept is not None:
            self._kept.append(event)
            return True
        if in_dialog and event.key in ("enter", "escape"):
            self._kept = []
        return False

    def let_go(self) -> list[events.Key]:
        """The dialog has closed: what was kept, in order."""
        kept, self._kept = self._kept or [], None
        return kept
