"""Signals to a console in a real terminal: it goes, its link is closed, and an interrupt is the stop key."""

from __future__ import annotations

import select
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rig.link.clients import Clients
from rig.link.front_end_messages import Request
from rig.link.sockets import listen
from tests.rig.console.feeds import running
from tests.rig.console.terminal import Terminal, on_terminal


@contextmanager
def seated(out: Path, *, leading: bool = True) -> Iterator[tuple[subprocess.Popen[bytes], Terminal]]:
    """A console process that has drawn its first screen."""
    with on_terminal(
        "import runpy; runpy.run_module('tests.rig.console.seated', run_name='__main__')", str(out), leading=leading
    ) as seat:
        seat[1].until(b"T1 hold")
        yield seat


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_it_goes_and_its_link_is_closed(tmp_path, number):
    with seated(tmp_path / "out") as (process, _):
        process.send_signal(number)
    assert process.returncode == 128 + number
    assert (tmp_path / "out").read_text() == f"{128 + number} True"


@pytest.mark.parametrize("leading", [True, False])
def test_it_goes_when_its_terminal_is_gone(tmp_path, leading):
    """Also where the kernel does not say so: a console that is not its session's leader gets no SIGHUP."""
    with seated(tmp_path / "out", leading=leading) as (process, terminal):
        terminal.close()
        assert process.wait(10.0) in (128 + signal.SIGHUP, -signal.SIGALRM)


@pytest.mark.parametrize("keys", [b"\x03", b"\x1b[20~"], ids=["ctrl+c", "f9 as xterm sends it"])
def test_the_stop_key_in_a_real_terminal(tmp_path, keys):
    with seated(tmp_path / "out") as (process, terminal):
        terminal.press(keys)
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


@pytest.mark.parametrize("keys", [b"\x03", b"\x1b[20~"], ids=["ctrl+c", "f9 as xterm sends it"])
def test_the_stop_key_gets_through_while_the_screen_hangs(tmp_path, keys):
    """The thread that reads the keys sends it: whatever is drawn, however long."""
    clients = Clients(listen(tmp_path / "socket"))
    code = "import runpy; runpy.run_module('tests.rig.console.hanging', run_name='__main__')"
    with on_terminal(code, str(tmp_path / "socket")) as (process, terminal):
        until(lambda: clients.poll(0.0) or clients.connected)
        clients.publish(running())
        terminal.until(b"it hangs now")
        clients.poll(0.0)
        terminal.press(keys)
        got = until(lambda: clients.poll(0.0))
        process.kill()
    clients.close()
    assert got == [Request("stop", "console")]


def until(wanted, timeout=30.0):
    """What it returns, once that is something."""
    deadline = time.monotonic() + timeout
    while not (found := wanted()):
        assert time.monotonic() < deadline
        select.select([], [], [], 0.02)
    return found
