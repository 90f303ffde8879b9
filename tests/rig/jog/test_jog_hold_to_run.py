"""The dead-man's key: what is asked of the controller, by what is typed and when. Keys on a pty, the clock is ours."""

from __future__ import annotations

import os
import tty
from pathlib import Path

import pytest

from rig.campaign.loading import load_bench, load_campaign
from rig.cli import main
from rig.jog.held_key import FIRST, NEXT, HeldKey
from rig.jog.hold_to_run import HoldToRun
from rig.jog.one_hold import write
from rig.link.front_end_messages import Check, Request, Snapshot
from rig.link.sockets import Peer, pair
from rig.operate.check import check_loaded

READY = (Check("motor", "passed", "it is there"),)
BENCH = Path(__file__).parents[3] / "benches" / "roboteq" / "bench.toml"


def test_a_key_is_down_while_it_repeats_and_at_most_the_first_wait_when_it_does_not():
    key = HeldKey()
    assert not key.down(0.0)
    key.pressed(0.0)
    assert key.down(FIRST - 0.01)
    assert not key.down(FIRST)
    key.pressed(10.0)
    key.pressed(10.6)  # the first repeat
    assert key.down(10.6 + NEXT - 0.01)
    assert not key.down(10.6 + NEXT)
    key.pressed(20.0)  # a new press may wait for its first repeat again
    assert key.down(20.0 + NEXT + 0.01)
    key.let_go()
    assert not key.down(20.0)


class Desk:
    """Front end and controller's end of its link in one thread; `tick` lets time pass and says what was asked."""

    def __init__(self) -> None:
        ours, theirs = pair("jog")
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.now = 100.0
        self.controller = Peer(theirs, "front end")
        self.front = HoldToRun(ours, self.slave, clock=lambda: self.now)
        self.seq = 0

    def tick(self, state: str | None = None, keys: bytes = b"", seconds: float = 0.1, **more) -> list[str]:
        self.now += seconds
        if keys:
            os.write(self.master, keys)
        if state is not None:
            self.seq += 1
            self.controller.send(snapshot(self.seq, state, **more))
            self.controller.flush()
        for _ in range(2):  # a key and a snapshot may come one after the other
            self.going = self.front.turn()
        asked = [each for each in self.controller.receive() if isinstance(each, Request)]
        return [each.kind for each in asked if each.kind != "lease"]

    def close(self) -> None:
        self.front.peer.close()
        self.controller.close()
        for each in (self.master, self.slave):
            os.close(each)


def snapshot(seq: int, state: str, **more) -> Snapshot:
    known = {
        "campaign": "jog", "thruster": "jog", "command": 0.0, "time": 0.0, "readings": (), "checks": READY,
        "points": (), "log": (), "log_count": 0, "trace": (), "progress": None, "files": (), "mounted_by_hand": True,
    }  # fmt: skip
    return Snapshot(seq=seq, state=state, **{**known, **more})  # type: ignore[arg-type]  # as a test writes it


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.close()


def test_nothing_starts_without_the_key(desk):
    assert desk.tick("preflight") == []
    assert desk.tick("preflight", seconds=30.0) == []
    assert desk.tick("preflight", keys=b"x") == []


def test_it_starts_with_the_key_and_only_when_every_check_has_passed(desk):
    waiting = (Check("motor rate", "waiting", "comes"),)
    assert desk.tick("preflight", keys=b" ", checks=waiting) == []
    assert desk.tick("preflight", keys=b" ", seconds=0.2) == ["start"]
    assert desk.tick("mount", keys=b" ", seconds=0.05) == ["mounted"]
    assert desk.tick("proving", keys=b" ", seconds=0.05) == []


def running(desk, state: str = "hold") -> None:
    desk.tick("preflight", keys=b" ")
    desk.tick("mount", keys=b" ", seconds=0.03)
    assert desk.tick(state, keys=b" ", seconds=0.03) == []


@pytest.mark.parametrize("state", ["proving", "tare", "ramp", "hold", "rest"])
def test_let_go_is_a_pause_in_every_state(desk, state):
    running(desk, state)
    assert desk.tick(state, seconds=NEXT - 0.1) == []
    assert desk.tick(state, seconds=0.2) == ["pause"]
    assert desk.tick("paused", seconds=0.1) == []
    assert desk.tick("paused", keys=b" ", seconds=0.1) == ["resume"]


def test_let_go_at_once_after_a_resume_is_a_pause_though_no_news_came_yet(desk):
    running(desk)
    desk.tick("hold", seconds=0.5)
    assert desk.tick("paused", keys=b" ") == ["resume"]
    assert desk.tick(None, seconds=FIRST + 0.01) == ["pause"]


def test_a_pause_that_came_too_early_is_asked_for_again(desk):
    desk.tick("preflight", keys=b" ")
    assert desk.tick("mount", keys=b"x", seconds=0.03) == ["pause", "mounted"]
    assert desk.tick("proving", seconds=0.1) == []
    assert desk.tick("proving", seconds=0.3) == ["pause"]


@pytest.mark.parametrize("key", [b"q", b"\x1b", b"\x03", b"\x1b[A"])
def test_keys_that_end_it(desk, key):
    running(desk)
    assert desk.tick("hold", keys=key, seconds=0.03) == ["stop"]
    assert desk.tick("stopping", keys=b" ") == []
    desk.tick("done")
    assert not desk.going


def test_a_check_that_stays_failed_ends_it(desk):
    failed = (Check("motor", "failed", "is not there"),)
    assert desk.tick("preflight", checks=failed) == []
    assert desk.tick("preflight", checks=failed, seconds=9.0, keys=b" ") == []
    assert desk.tick("preflight", checks=failed, seconds=2.0) == ["stop"]


def test_the_end_of_the_terminal_ends_it(desk):
    running(desk)
    os.close(desk.master)
    desk.master = os.dup(desk.slave)
    desk.now += 0.03
    assert desk.tick("hold", seconds=0.03) == ["stop"]


@pytest.mark.parametrize("unproved", [None, 'no rate, "yet"'])
def test_the_campaign_of_a_jog_is_one_that_may_run(tmp_path, unproved):
    bench = load_bench(BENCH)
    report = check_loaded(load_campaign(write(tmp_path, bench, "T1", -3, 2.0, unproved)))
    holds = [step for step in report.steps if step.phase == "hold"]
    assert [(step.voltage, step.min_duration, step.max_duration) for step in holds] == [(-3.0, 2.0, 2.0)]
    assert report.campaign.prove_watchdog == (unproved is None)
    assert [each.reason for each in report.overridden] == ([] if unproved is None else [unproved])
    assert report.campaign.plan.slew == 3.0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["5"], "5 V is more than the 3.6 V that a jog allows (15% of bench.max_voltage)"),
        (["-5"], "-5 V is more than the 3.6 V"),
        (["9", "--limit", "8"], "9 V is more than the 8 V that a jog allows (--limit)"),
        (["9", "--limit", "80"], "--limit must be above 0 and at most bench.max_voltage (24 V), not 80"),
        (["0"], "a jog needs a voltage other than 0"),
        (["nan"], "a jog needs a voltage other than 0, not nan"),
        (["3"], "mounts the thruster by a command: say which one with --thruster"),
        (["3", "--thruster", "T1"], "holds while a key is held, which needs a terminal; --for S holds without one"),
    ],
)
def test_what_is_refused_before_anything_is_opened(capsys, tmp_path, words, sentence):
    assert main(["jog", str(BENCH), *words, "--output", str(tmp_path / "out")]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
