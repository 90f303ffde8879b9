"""What the interpreter itself does, kept short: while it collects garbage, the thread that reads the stop key waits."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from typing import Final

from textual._styles_cache import StylesCache

SETTLED: Final = 2.0
"""s after which a screen has all that it keeps."""
_CLEAR: Final[Callable[[], None] | None] = getattr(getattr(StylesCache, "get_inner_outer", None), "cache_clear", None)
"""Of a method of Textual whose lru_cache is of all widgets there ever were; None: of this Textual it is not."""
SWITCH: Final = 0.001
"""s that a thread waits for another one's turn; Python's own is 5 ms, and a key that is read takes several turns."""


def settle() -> None:
    """No later collection looks at what is there now: a full one took 70 ms of a processor, in one piece."""
    sys.setswitchinterval(SWITCH)
    gc.collect()
    gc.freeze()


def forget_closed() -> None:
    """Let go what closed dialogs have drawn, which Textual's cache keeps of the last hundred of them: then a full
    collection, and each dialog that is opened begins one, takes 200 ms and more."""
    if _CLEAR is not None:
        _CLEAR()
