"""Put the next thruster on the bench: by the bench's own command, or by the operator, who says when it is there."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

from rig.errors import DeviceError
from rig.link.front_end_messages import Watching
from rig.stages.session import Session

LOG_NAME = "mount.log"
"""What the mount command said, in the campaign's folder."""
LAST_WORDS = 500
"""Characters of it that are shown."""


def mount(session: Session) -> None:
    """Ends when the thruster is there. Raises Stopped, DeviceError, or LinkError when the command takes too long."""
    status, command = session.status, session.campaign.bench.mount
    status.state, status.output = "mount", None
    status.points.clear()
    status.watch = Watching()
    if not command.command:
        session.say("info", f"put {status.thruster} on the bench")
        while not any(request.kind == "mounted" for request in session.turn()):
            pass
        session.say("info", f"{status.thruster} is on the bench, says the operator")
        return
    words = command.words(status.thruster, session.campaign.bench.path.parent)
    what = f"the mount command {words} for {status.thruster}"
    with _running(words, session.folder / LOG_NAME) as child:
        session.wait(lambda: child.poll() is not None, command.timeout, what)
    said = _last_words(session.folder / LOG_NAME)
    if child.returncode != 0:
        raise DeviceError(
            f"{status.thruster} could not be mounted: {words[0]} ended with status {child.returncode}: {said}"
        )
    session.say("info", f"{status.thruster} mounted{': ' + said if said else ''}")


@contextlib.contextmanager
def _running(words: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """The command in a process group of its own, writing into a file: it can't block on a pipe that nobody reads.

    However the wait for it ends, what is left of the group is killed, and nothing waits for more than that.
    """
    try:
        with log.open("wb") as file:
            child = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=file, stderr=file, start_new_session=True)
    except OSError as error:
        raise DeviceError(f"the mount command {words} can't be run: {error.strerror or error}") from error
    try:
        yield child
    finally:
        if child.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGKILL)
            child.wait()


def _last_words(log: Path) -> str:
    return log.read_text(encoding="utf-8", errors="replace").strip()[-LAST_WORDS:]
