"""The truth log: what the motor really did, one JSON object a line, each line on the disk's side at once.

Every line has `event`, `t_ns` (time.monotonic_ns of this machine, the clock of the rig) and `thruster`.
`header`: the true constants. `command`: a set-point accepted by the drive that differs from the one before.
`state`: command and applied volts, rotation rate (rev/s), thrust and force (N), at most at 100 Hz.
`timeout`, `fault`, `clear`, `mount`, `flow`: what the name says.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


class TruthLog:
    """Path None: nothing is kept."""

    def __init__(self, path: Path | None) -> None:
        self._file = None
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("w", encoding="utf-8", buffering=1)

    def write(self, event: str, t_ns: int, thruster: str, **fields: Any) -> None:
        if self._file is not None:
            line = {"event": event, "t_ns": t_ns, "thruster": thruster, **fields}
            self._file.write(json.dumps(line) + "\n")

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None
