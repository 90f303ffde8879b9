"""Signals to a console in a real terminal: it goes, its link is closed, and an interrupt is the stop key."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


class Terminal:
    """Our end of a pty of 80x24: reads all that is drawn, in a thread, until the process ends."""

    def __init__(self) -> None:
        self.master, self.slave = pty.openpty()
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        self._seen = b""
        self._news = threading.Condition()

    def read(self, process: subprocess.Popen[bytes]) -> None:
        while process.poll() is None:
            if not select.select([self.master], [], [], 0.05)[0]:
                continue
            try:
                data = os.read(self.master, 65536)
            except OSError:  # EIO: nobody has the other side open any more
                return
            with self._news:
                self._seen += data
                self._news.notify_all()

    def until(self, text: bytes) -> None:
        with self._news:
            assert self._news.wait_for(lambda: text in self._seen, 40.0), self._seen


COMMAND = """import fcntl, runpy, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
runpy.run_module("tests.console.seated", run_name="__main__")"""


@contextmanager
def seated(out: Path) -> Iterator[tuple[subprocess.Popen[bytes], Terminal]]:
    """A console process that has drawn its first screen on a terminal of its own. Leaving waits for its end."""
    terminal = Terminal()
    process = subprocess.Popen(
        [sys.executable, "-c", COMMAND, str(out)],
        stdin=terminal.slave,
        stdout=terminal.slave,
        stderr=terminal.slave,
        start_new_session=True,
        cwd=ROOT,
    )
    os.close(terminal.slave)
    reader = threading.Thread(target=terminal.read, args=(process,))
    reader.start()
    try:
        terminal.until(b"T1 hold")
        yield process, terminal
        process.wait(20.0)
    finally:
        process.kill()
        process.wait()
        reader.join()
        os.close(terminal.master)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_it_goes_and_its_link_is_closed(tmp_path, number):
    with seated(tmp_path / "out") as (process, _):
        process.send_signal(number)
    assert process.returncode == 128 + number
    assert (tmp_path / "out").read_text() == f"{128 + number} True"


@pytest.mark.parametrize("keys", [b"\x03", b"\x1b[20~"], ids=["ctrl+c", "f9 as xterm sends it"])
def test_the_stop_key_in_a_real_terminal(tmp_path, keys):
    with seated(tmp_path / "out") as (process, terminal):
        os.write(terminal.master, keys)
        terminal.until(b"STOP SENT")
        process.send_signal(signal.SIGTERM)
    assert (tmp_path / "out").read_text() == "143 True stop"


def test_an_interrupt_from_outside_is_the_stop_key(tmp_path):
    with seated(tmp_path / "out") as (process, terminal):
        process.send_signal(signal.SIGINT)
        terminal.until(b"STOP SENT")
        assert process.poll() is None
        process.send_signal(signal.SIGTERM)
    assert (tmp_path / "out").read_text() == "143 True stop"
