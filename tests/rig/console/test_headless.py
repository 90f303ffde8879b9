"""The front end without a screen: what a log file gets, and how an operator answers in a plain terminal."""

from __future__ import annotations

import io
import os
import pty
import select
import subprocess
import sys
import threading
from collections.abc import Callable
from importlib import import_module

import pytest
from rich.console import Console

from rig.cli import COMMANDS
from rig.link.attention import Bell
from rig.link.front_end_messages import Check, LogLine, Progress, Request
from rig.link.sockets import Peer, pair
from rig.operate import headless as headless_module
from rig.operate.headless import Headless
from rig.operate.narration import Narration
from tests.rig.console.feeds import CHECKS, running, snapshot


def narration() -> tuple[Narration, io.StringIO]:
    out = io.StringIO()
    return Narration(Console(file=out, width=80)), out


def test_a_log_file_gets_a_line_per_event_and_finished_step_however_long():
    told, out = narration()
    event = LogLine(1.0, "warning", "motor: [mount] " + "seen " * 40)
    with told.shown():
        for t in (46.0, 47.0, 51.0, 51.1):
            told.tell(running(t=t, log=(event,), log_count=1))
    lines = out.getvalue().splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("    1.00 s  warning  motor: [mount] seen")
    assert "step 24/31  T1 hold -6.00 V" in lines[1]


def test_the_step_under_way_when_a_run_is_stopped_is_not_called_finished():
    told, out = narration()
    stopped = running("stopping", outcome="aborted", log=(), log_count=0)
    for each in (running(log=(), log_count=0), stopped, running("done", outcome="aborted", log=(), log_count=0)):
        told.tell(each)
    assert out.getvalue() == ""


def test_the_bar_says_what_is_waited_for_and_the_time_left_by_plan():
    out = io.StringIO()
    told = Narration(Console(file=out, width=200, force_terminal=True))
    with told.shown():
        told.tell(running("wait", log=(), log_count=0, command=0.0, reason="water settles: 43 s left"))
    said = out.getvalue()
    assert "T1 wait · step 24/31 · +0.0 V · water settles: 43 s left" in said
    assert "about 0:04:01 left" in said


@pytest.mark.parametrize(("bell", "terminal", "rings"), [(True, True, 4), (False, True, 0), (True, False, 0)])
def test_a_terminal_rings_where_somebody_is_wanted(bell, terminal, rings):
    out = io.StringIO()
    told = Narration(Console(file=out, width=80, force_terminal=terminal), bell=Bell() if bell else None)
    for state, more in (("preflight", {}), ("mount", {"mounted_by_hand": True}), ("hold", {}), ("paused", {}),
                        ("paused", {}), ("stopping", {"outcome": "tripped"}), ("done", {})):  # fmt: skip
        told.tell(running(state, log=(), log_count=0, **more))
    assert out.getvalue().count("\a") == rings


def played(terminal: int | None, play: Callable[[Peer], None]) -> tuple[Headless, str]:
    """A headless front end followed to its end, with `play` as its controller."""
    ours, theirs = pair("the controller")
    controller = Peer(theirs, "a front end")
    told, out = narration()
    thread = threading.Thread(target=play, args=(controller,))
    thread.start()
    headless = Headless(ours, told, terminal)
    headless.follow(start=True)
    thread.join()
    ours.close()
    controller.close()
    return headless, out.getvalue()


def until(peer: Peer, kind: str) -> Request:
    """The next request of that kind."""
    while True:
        select.select([peer], [], [], 1.0)
        for message in peer.receive():
            if isinstance(message, Request) and message.kind == kind:
                return message


MOUNT = running("mount", thruster="T4", mounted_by_hand=True, progress=Progress(0, 0, 0, 0, 0, 2, 1.0, 60.0, 0.1))


def test_the_operator_is_asked_for_the_thruster_and_answers_with_enter():
    master, slave = pty.openpty()

    def play(peer: Peer) -> None:
        os.write(master, b"\n")  # before the question: no answer to it
        peer.send(MOUNT)
        until(peer, "lease")
        os.write(master, b"\n")
        until(peer, "mounted")
        peer.send(running("done", outcome="completed"))

    headless, said = played(slave, play)
    os.close(master)
    os.close(slave)
    assert "put T4 on the bench, then press Enter: the motor turns after that" in said
    assert headless.last is not None
    assert headless.last.outcome == "completed"


def test_with_nobody_to_ask_the_only_thruster_is_the_one_on_the_bench():
    alone = running("mount", mounted_by_hand=True, progress=Progress(0, 0, 0, 0, 0, 1, 1.0, 60.0, 0.1))

    def play(peer: Peer) -> None:
        peer.send(alone)
        until(peer, "mounted")
        peer.send(running("done"))

    played(None, play)


def test_it_starts_when_all_checks_have_passed():
    def play(peer: Peer) -> None:
        peer.send(snapshot("preflight", checks=CHECKS))
        until(peer, "start")
        peer.send(running("done"))

    played(None, play)


RED = (*CHECKS, Check("tunnel", "failed", "its port is not there"))


def test_a_device_that_comes_late_is_waited_for():
    def play(peer: Peer) -> None:
        peer.send(snapshot("preflight", checks=RED))
        until(peer, "lease")
        peer.send(snapshot("preflight", checks=CHECKS))
        until(peer, "start")
        peer.send(running("done"))

    _, said = played(None, play)
    assert "waiting up to 10 s for tunnel: its port is not there" in said


def test_a_device_that_never_comes_is_given_up(monkeypatch):
    monkeypatch.setattr(headless_module, "PATIENCE", 0.0)
    asked = []

    def play(peer: Peer) -> None:
        peer.send(snapshot("preflight", checks=RED))
        until(peer, "lease")
        peer.send(snapshot("preflight", checks=RED))
        asked.append(until(peer, "stop").text)
        peer.send(running("done"))

    played(None, play)
    assert asked == ["the preflight: tunnel: its port is not there"]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_where_the_table_says(name):
    module, _, attribute = COMMANDS[name].place.partition(":")
    assert getattr(import_module(module), attribute).name == name


def test_help_imports_no_mathematics_no_screen_and_no_file_format():
    code = "import sys; from rig.cli import main; main(['--help']); print(sorted(sys.modules))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    for name in COMMANDS:
        assert f"  {name} " in said
    assert not [heavy for heavy in ("numpy", "scipy", "h5py", "textual", "can", "pydantic") if f"'{heavy}'" in said]
