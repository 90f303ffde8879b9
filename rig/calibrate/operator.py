"""Who hangs the weights: a person at a terminal, asked line by line, or a command that does it. Nothing blocks."""

from __future__ import annotations

import contextlib
import os
import select
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol

import click

from identification.calibration.loads import Load
from rig.calibrate.loads_file import Hang
from rig.errors import DeviceError, RigError

if TYPE_CHECKING:
    from rig.calibrate.session import Session

Answer = Literal["go", "again", "keep", "skip", "probable", "stop"]


@dataclass(frozen=True, slots=True)
class Back:
    """A step of the plan, from 0, is to be hung and read again."""

    index: int


@dataclass(frozen=True, slots=True)
class Hung:
    """It hangs, but what hangs is other than the plan has it."""

    load: Load


TURN = Callable[[], None]
"""What goes on while somebody is waited for: readings are drained and recorded."""


class StoppedError(RigError):
    """The operator has ended the calibration before its last step."""


class Operator(Protocol):
    """Hangs what is asked for, and answers what is doubtful."""

    def begin(self, session: Session) -> None:
        """Who shows more of a session than what is told looks into it from here on."""

    def hang(self, prompt: str, load: Load, force: float, turn: TURN) -> Answer | Back | Hung:
        """`go` once it hangs, or Hung; `skip` it; `again`: the step before is to be read again instead, or Back."""

    def doubt(self, text: str, turn: TURN) -> Answer:
        """`again` or `keep` a step whose reading does not go with the others, or it was the `probable` load."""

    def tell(self, text: str) -> None: ...


@dataclass
class Terminal:
    """A person. Lines come from the file descriptor `fd`, however many at once."""

    fd: int = 0
    _buffer: bytes = b""
    _ended: bool = False

    def begin(self, session: Session) -> None:
        del session

    def hang(self, prompt: str, load: Load, force: float, turn: TURN) -> Answer:
        del load, force
        self.tell(f"{prompt}: Enter when it hangs free and still; r: read the step before again; q: stop")
        return self._answer({"": "go", "r": "again", "q": "stop"}, turn)

    def doubt(self, text: str, turn: TURN) -> Answer:
        self.tell(f"{text}\nr: hang it and read it again; k: keep it as it is; q: stop")
        return self._answer({"r": "again", "k": "keep", "q": "stop"}, turn)

    def tell(self, text: str) -> None:
        click.echo(text)

    def _answer(self, known: dict[str, Answer], turn: TURN) -> Answer:
        while True:
            said = self._line(turn).strip().lower()
            if said in known:
                if known[said] == "stop":
                    raise StoppedError("stopped by the operator; the recording is kept, no calibration was written")
                return known[said]
            self.tell(f"expected one of {', '.join(each or 'Enter' for each in known)}; came {said[:40]!r}")

    def _line(self, turn: TURN) -> str:
        while b"\n" not in self._buffer:
            if self._ended:
                raise StoppedError(
                    "the input has ended before the last step: nobody is at this terminal; with a [hang] command in "
                    "the loads file use --yes"
                )
            if select.select([self.fd], [], [], 0.0)[0]:
                data = os.read(self.fd, 4096)
                self._buffer, self._ended = self._buffer + data, not data
            turn()
        line, _, self._buffer = self._buffer.partition(b"\n")
        return line.decode("utf-8", "replace")


@dataclass
class Command:
    """The loads file's `[hang]` command. A doubtful step is hung and read once more, and then kept: the end judges."""

    settings: Hang
    bench_dir: Path
    now: Callable[[], float]
    """s"""
    doubted: set[str] = field(default_factory=set)

    def begin(self, session: Session) -> None:
        del session

    def hang(self, prompt: str, load: Load, force: float, turn: TURN) -> Answer:
        words = self.settings.words(force, load, self.bench_dir)
        self.tell(prompt)
        try:
            child = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        except OSError as error:
            raise DeviceError(f"the hang command {words} can't be run: {error.strerror or error}") from error
        with child:
            end = self.now() + self.settings.timeout
            try:
                while child.poll() is None and self.now() < end:
                    turn()
            finally:
                if child.poll() is None:
                    child.kill()
            said = child.stderr.read().decode("utf-8", "replace").strip()[-300:] if child.stderr else ""
        if child.returncode != 0:
            raise DeviceError(f"the hang command {words} for {load.said} ended with status {child.returncode}: {said}")
        return "go"

    def doubt(self, text: str, turn: TURN) -> Answer:
        del turn
        self.tell(text)
        step = text.partition(":")[0]
        again = step not in self.doubted
        self.doubted.add(step)
        return "again" if again else "keep"

    def tell(self, text: str) -> None:
        with contextlib.suppress(BrokenPipeError):  # who read it has left; the readings go on
            click.echo(text)
