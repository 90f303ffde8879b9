"""What the interpreter itself does, kept short: while it collects garbage, the thread that reads the stop key waits."""

from __future__ import annotations

import gc
import sys
from typing import Final

SETTLED: Final = 2.0
"""s after which a screen has all that it keeps."""
SWITCH: Final = 0.001
"""s that a thread waits for another one's turn; Python's own is 5 ms, and a key that is read takes several turns."""


def settle() -> None:
    """No later collection looks at what is there now: a full one took 70 ms of a processor, in one piece."""
    sys.setswitchinterval(SWITCH)
    gc.collect()
    gc.freeze()
