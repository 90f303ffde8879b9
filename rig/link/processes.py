"""Processes of this machine as the kernel tells of them (proc(5)): whether one is what it was, who has a file open.

Where there is no /proc, a process number alone is believed, and nobody has any file open.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

PROC = Path("/proc")
DEAD = ("Z", "X")
"""States in /proc/PID/stat of a process that runs no more and that its parent has not waited for (proc_pid_stat(5))."""


def started(pid: int) -> str:
    """When it was started, as a text to be compared: the boot of the machine and the ticks since; empty: unknown.

    With its number it tells one process from every other, also after the number was given to another one.
    """
    found = _stat(pid)
    return f"{_boot()} {found[1]}" if found else ""


def alive(pid: int, since: str = "") -> bool:
    """Whether that process runs (or is stopped). `since`: what `started` said of it; empty: whichever it is.

    One that has ended is none, though its parent may not have waited for it yet.
    """
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    found = _stat(pid)
    if not found:
        return not (PROC / "self").exists()
    return found[0] not in DEAD and since in ("", f"{_boot()} {found[1]}")


def holders(path: Path) -> list[int]:
    """Processes of ours, other than this one, that have the file open."""
    file = path.stat()
    ours = (int(entry.name) for entry in PROC.glob("[0-9]*") if int(entry.name) != os.getpid())
    return [pid for pid in ours if (file.st_dev, file.st_ino) in _open_files(pid)]


def _open_files(pid: int) -> set[tuple[int, int]]:
    """Device and inode of each; none for a process of another user, or one that has just ended."""
    found = set()
    with contextlib.suppress(OSError):
        for entry in (PROC / str(pid) / "fd").iterdir():
            with contextlib.suppress(OSError):
                status = entry.stat()
                found.add((status.st_dev, status.st_ino))
    return found


def _stat(pid: int) -> tuple[str, str] | None:
    """State and start time. The command before them may hold spaces and brackets."""
    try:
        fields = (PROC / str(pid) / "stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
    except OSError:
        return None
    return fields[0], fields[19]


def _boot() -> str:
    try:
        return (PROC / "sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return ""
