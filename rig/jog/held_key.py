"""Whether a key is held down, from the characters that a terminal repeats while it is. Pure: time is given.

A terminal says nothing when a key is let go. The first repeat comes after up to 0.66 s (X11; a Linux console 0.25 s),
the others some 30 times a second. Where nothing repeats, a key counts as held for the first of these times, no longer.
"""

from __future__ import annotations

from math import inf

FIRST = 0.8
"""s after the first character in which a second must come."""
NEXT = 0.3
"""s between two characters after that; ten times what a terminal takes."""


class HeldKey:
    """Told of each character; asked whether the key is still down."""

    def __init__(self) -> None:
        self._last = -inf
        self._repeated = False

    def pressed(self, now: float) -> None:
        self._repeated = self.down(now)
        self._last = now

    def let_go(self) -> None:
        """Another key, or the end of the terminal."""
        self._last = -inf

    def down(self, now: float) -> bool:
        return now - self._last < (NEXT if self._repeated else FIRST)
