"""A simulated bench as a child process: started, waited for, and stopped."""

from __future__ import annotations

import json
import select
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sim_devices.wires.ports import ask

ROOT = Path(__file__).resolve().parents[2]
START_TIME = 30.0
"""s a bench may take until it says `ready`, on a machine that is busy."""
STOP_TIME = 10.0
"""s."""


@dataclass(frozen=True, slots=True)
class RunningBench:
    """A bench that has said `ready`. Ports are `links / "load_cell"` and so on."""

    process: subprocess.Popen[bytes]
    links: Path
    truth_path: Path

    def tell(self, line: str) -> str:
        """One line to the control port; returns what comes after `ok`. Raises ValueError with the bench's sentence."""
        answer = ask(self.links / "control", line)
        if answer.startswith("error "):
            raise ValueError(answer.removeprefix("error "))
        return answer.removeprefix("ok ")

    def truth(self, event: str | None = None) -> list[dict[str, Any]]:
        """The truth log until now: whole lines, only those of `event` when one is named."""
        text = self.truth_path.read_text(encoding="utf-8")
        lines = [json.loads(line) for line in text[: text.rfind("\n") + 1].splitlines()]
        return [line for line in lines if event in (None, line["event"])]


@contextmanager
def running(world: Path, links: Path, seed: int | None = None) -> Iterator[RunningBench]:
    """Start the bench of a world file with its links and `truth.jsonl` in `links`; stop it at the end, which comes with
    the end of this process at the latest, killed or not: the bench sees that nobody holds its standard input.

    Raises RuntimeError with the bench's own words when it does not start.
    """
    truth = links / "truth.jsonl"
    words = [sys.executable, "-m", "sim_devices", str(world.absolute()), "--links", str(links.absolute())]
    words += ["--truth", str(truth.absolute()), "--until-eof"] + ([] if seed is None else ["--seed", str(seed)])
    pipe = subprocess.PIPE
    with subprocess.Popen(words, cwd=ROOT, stdin=pipe, stdout=pipe, stderr=pipe, bufsize=0) as process:
        try:
            _wait_until_ready(process)
            yield RunningBench(process, links, truth)
        finally:
            process.terminate()
            try:
                process.wait(STOP_TIME)
            except subprocess.TimeoutExpired:
                process.kill()


def _wait_until_ready(process: subprocess.Popen[bytes]) -> None:
    said = b""
    assert process.stdout is not None
    assert process.stderr is not None
    while b"ready\n" not in said:
        readable, _, _ = select.select([process.stdout], [], [], START_TIME)
        data = process.stdout.read(4096) if readable else b""
        if not data:
            process.kill()
            raise RuntimeError(f"the simulated bench did not start: {process.stderr.read().decode().strip() or said!r}")
        said += data
