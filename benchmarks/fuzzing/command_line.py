"""One command in a fork of a process in which all is imported: ten thousand need no ten thousand starts of Python."""

from __future__ import annotations

import os
import resource
import select
import signal
import sys
import traceback
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from rig.cli import COMMANDS, main
from rig.visible_text import HIDDEN

SECONDS = 10.0
MEMORY = 2**30


class Attempt(NamedTuple):
    """How a command ended. `wrong` is empty when it did what a command may do."""

    status: int
    said: str
    seconds: float
    """Of a processor: the machine may be busy."""
    wrong: str


def warm(*commands: str) -> None:
    """Import what these commands need, once and for all children."""
    for command in commands:
        import_module(COMMANDS[command].place.partition(":")[0])
    for module in ("rig.hdf5", "rig.campaign.loading", "rig.importing.convert"):
        import_module(module)


def attempt(arguments: list[str], folder: Path) -> Attempt:
    """Run `rig ARGUMENTS` in `folder` with at most 10 s of a processor and 1 GiB more than this process has."""
    output = os.memfd_create("output")
    child = os.fork()
    if child == 0:
        _child(arguments, folder, output)
    status, seconds = _awaited(child)
    os.lseek(output, 0, os.SEEK_SET)
    with os.fdopen(output, "rb") as file:
        said = file.read(2**20).decode("utf-8", "surrogateescape")
    return Attempt(status, said, seconds, _wrong(status, said))


def _child(arguments: list[str], folder: Path, output: int) -> None:
    status = 70
    try:
        os.chdir(folder)
        for stream in (1, 2):
            os.dup2(output, stream)
        os.dup2(os.open("/dev/null", os.O_RDONLY), 0)
        sys.stdout, sys.stderr = os.fdopen(1, "w", closefd=False), os.fdopen(2, "w", closefd=False)
        resource.setrlimit(resource.RLIMIT_CPU, (int(SECONDS), int(SECONDS)))
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY + pages * resource.getpagesize(),) * 2)
        status = main(arguments)
    except SystemExit as stop:
        status = stop.code if isinstance(stop.code, int) else 70
    except BaseException:  # noqa: BLE001 - whatever it is, it is what is looked for
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _awaited(child: int) -> tuple[int, float]:
    descriptor = os.pidfd_open(child)
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    if not poll.poll(30_000 * SECONDS):
        os.kill(child, signal.SIGKILL)
    os.close(descriptor)
    _, status, used = os.wait4(child, 0)
    return os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime


def _wrong(status: int, said: str) -> str:
    if status < 0:
        return f"ended by {signal.Signals(-status).name}"
    if status not in (0, 1, 2):
        return f"exit status {status}: {said.strip()[-300:]}"
    if "Traceback (most recent call last)" in said:
        return f"a traceback: {said.strip()[-300:]}"
    found = HIDDEN.search(said)
    return f"{found[0]!r} was sent to the terminal" if found else ""
