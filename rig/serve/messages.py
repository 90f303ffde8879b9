"""What the script of textual-serve says over the websocket, as JSON. Pure."""

from __future__ import annotations

import json
from typing import Final, NamedTuple

SMALLEST, WIDEST, HIGHEST = 1, 500, 200
"""Cells of a terminal that a browser may ask for."""
ALIVE: Final = '["alive"]'
"""Sent every second: by its absence the page knows that it shows the past. The script of textual-serve ignores it."""


class Keys(NamedTuple):
    """As a terminal sends them."""

    data: bytes


class Resize(NamedTuple):
    """Cells of the browser's terminal."""

    width: int
    height: int


def heard(text: str) -> Keys | Resize | None:
    r"""None: nothing that a console is told.

    >>> heard('["stdin", "\\u0003"]'), heard('["resize", {"width": 100000, "height": 30}]'), heard('["ping", "1"]')
    (Keys(data=b'\x03'), Resize(width=500, height=30), None)
    """
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        return None
    match message:
        case ["stdin", str(keys)]:
            return Keys(keys.encode(errors="replace"))
        case ["resize", {"width": int(width), "height": int(height)}]:
            return size(width, height)
        case _:
            return None


def size(width: int, height: int) -> Resize:
    """Within what a console can draw."""
    return Resize(min(max(width, SMALLEST), WIDEST), min(max(height, SMALLEST), HIGHEST))
