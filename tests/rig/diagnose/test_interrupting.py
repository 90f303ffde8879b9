"""Ctrl+C on a running `rig diagnose`, a process of its own with a terminal for its errors."""

from __future__ import annotations

import errno
import os
import pty
import select
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.rig.diagnose.diagnosed_files import ROOT

LONGEST = 100.0
"""s."""


class Running:
    """A process and the terminal that it shows its progress on."""

    def __init__(self, words: list[str]) -> None:
        self._master, slave = pty.openpty()
        command = [sys.executable, "-c", "from rig.cli import entry; entry()", *words]
        self.process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=slave)
        os.close(slave)
        self.shown = ""

    def until(self, text: str) -> None:
        while text not in self.shown:
            ready, _, _ = select.select([self._master], [], [], LONGEST)
            assert ready, f"{text!r} was not shown: {self.shown!r}"
            self.shown += os.read(self._master, 4096).decode()

    @property
    def quiet(self) -> bool:
        """Whether it has shown nothing; of a process that has ended, whose terminal hangs up (EIO) after the rest."""
        try:
            return not os.read(self._master, 4096)
        except OSError as error:
            return error.errno == errno.EIO

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()
        os.close(self._master)


@contextmanager
def running(*words: object) -> Iterator[Running]:
    found = Running([str(word) for word in words])
    try:
        yield found
    finally:
        found.close()


@pytest.mark.timeout(200)
def test_once_it_answers_with_what_it_has(dead) -> None:
    with running("diagnose", dead[0]) as diagnosis:
        diagnosis.until("looking for effects: ")
        diagnosis.process.send_signal(signal.SIGINT)
        diagnosis.until("Ctrl+C again ends at once")
        out, _ = diagnosis.process.communicate(timeout=LONGEST)
        assert diagnosis.process.returncode == 0
        assert "Interrupted before it was asked" in " ".join(out.decode().split())


@pytest.mark.timeout(200)
def test_twice_it_ends_at_once(dead) -> None:
    with running("diagnose", dead[0]) as diagnosis:
        diagnosis.until("looking for effects: ")
        diagnosis.process.send_signal(signal.SIGINT)
        diagnosis.until("Ctrl+C again ends at once")
        diagnosis.process.send_signal(signal.SIGINT)
        out, _ = diagnosis.process.communicate(timeout=LONGEST)
        assert diagnosis.process.returncode == 130
        assert out == b""


@pytest.mark.timeout(200)
def test_it_is_quiet_where_nobody_looks(dead) -> None:
    with running("diagnose", dead[0], "--json", "-") as alone:
        out, _ = alone.process.communicate(timeout=LONGEST)
        assert out.startswith(b"{")
        assert alone.quiet
    command = [sys.executable, "-c", "from rig.cli import entry; entry()", "diagnose", str(dead[0])]
    piped = subprocess.run(command, cwd=ROOT, capture_output=True, timeout=LONGEST, check=True)
    assert piped.stderr == b""
