"""What the processes of one session measured, in one file."""

from __future__ import annotations

import fcntl
import json
from pathlib import Path


def keep(numbers: dict[str, dict[str, float | str]], of_session: Path, results: Path) -> None:
    """Add the numbers of this process to those that others of the session left, all of them to `results`."""
    with of_session.open("a+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.seek(0)
        together = json.loads(file.read() or "{}") | numbers
        file.truncate(0)
        results.parent.mkdir(exist_ok=True)
        text = json.dumps(together, indent=1) + "\n"
        file.write(text)
        results.write_text(text)
