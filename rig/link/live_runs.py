"""Which runs are alive on this machine: a small file per controller process, and a lock per bench."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import tempfile
from dataclasses import asdict, dataclass, replace
from operator import itemgetter
from pathlib import Path
from typing import IO

from rig.errors import LinkError
from rig.link.processes import alive, started


@dataclass(frozen=True, slots=True)
class Run:
    """A controller process and where to reach it."""

    pid: int
    socket: str
    folder: str
    campaign: str
    bench: str
    started: str = ""
    """When the process was started, as `rig.link.processes.started` tells it: numbers are given again."""


def _private_folder() -> Path:
    folder = Path(tempfile.gettempdir()) / f"thruster-rig-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    status = folder.lstat()
    if folder.is_symlink() or status.st_uid != os.getuid() or status.st_mode & 0o077:
        raise LinkError(
            f"{folder} must be a directory of yours with mode 0700: another user may have made it; remove it"
        )
    return folder


def register(run: Run) -> Path:
    """Announce a run; the caller removes the returned file at its end."""
    path = _private_folder() / f"run-{run.pid}.json"
    draft = path.with_suffix(".draft")  # whoever looks meanwhile sees the whole file or none
    told = replace(run, started=run.started or started(run.pid))
    draft.write_text(json.dumps(asdict(told)), encoding="utf-8")
    draft.replace(path)
    return path


def live_runs() -> list[Run]:
    """Runs whose controller process still runs; files of others are removed: a process that has ended, though its
    parent may not have taken note of that, and another one that was given its number."""
    found = []
    for path in _private_folder().glob("run-*.json"):
        try:
            run, since = Run(**json.loads(path.read_text(encoding="utf-8"))), path.stat().st_mtime
        except (FileNotFoundError, ValueError, TypeError):
            continue  # it ended just now, or its file is of another version
        if not isinstance(run.pid, int):
            continue
        if alive(run.pid, run.started):
            found.append((since, run))
        else:
            path.unlink(missing_ok=True)
    return [run for _, run in sorted(found, key=itemgetter(0))]


def find_run(folder: Path | None) -> Run:
    """The live run in `folder`, or the only one there is. Raises LinkError."""
    runs = live_runs()
    if folder is not None:
        runs = [run for run in runs if Path(run.folder) == folder.resolve()]
    if not runs:
        where = f"in {folder}" if folder else "on this machine"
        raise LinkError(f"no run is going on {where}; start one with `rig run CAMPAIGN`")
    if len(runs) > 1:
        folders = ", ".join(run.folder for run in runs)
        raise LinkError(f"{len(runs)} runs are going on; name the folder of one: {folders}")
    return runs[0]


def lock_bench(bench: Path) -> IO[str]:
    """Hold the bench for this process as long as the returned file is open. Raises LinkError that names the holder."""
    name = hashlib.sha256(os.fsencode(bench.resolve())).hexdigest()[:16]
    file = (_private_folder() / f"bench-{name}.lock").open("a+", encoding="utf-8")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.seek(0)
        holder = file.read().strip() or "another process"
        file.close()
        raise LinkError(
            f"bench {bench} is in use by {holder}; stop that run first, or look at it with `rig console`"
        ) from None
    file.seek(0)
    file.truncate()
    file.write(f"process {os.getpid()}")
    file.flush()
    return file
