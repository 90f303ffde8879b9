"""Recorder, disk, motor, mount or watchdog fail, in virtual time: the motor is at rest each time."""

import sys

import pytest

from rig.campaign.dwell import FixedDwell
from rig.campaign.plan import Plan
from rig.link.front_end_messages import Request
from rig.link.recorder_messages import Close, Open
from rig.recording.ledger import read
from rig.stages.campaign import run
from tests.rig.stages.played import outcome, play
from tests.rig.virtual_bench import PLAN, virtual


def test_recorder_that_can_not_open_ends_before_anything_turns(tmp_path):
    with virtual(tmp_path) as world:
        world.recorder.refuses = "the disk is full"
        play(world)
        assert outcome(world) == ("aborted", "recorder: the disk is full")
        assert not [volts for _, volts in world.motor.sent if volts]


def test_recorder_that_never_answers(tmp_path):
    with virtual(tmp_path) as world:
        play(world, [("mount", 0.0, lambda: setattr(world.recorder, "deaf", True))])
        assert "waited 20 s for the recorder to open" in outcome(world)[1]


def test_recorder_that_does_not_close(tmp_path):
    with virtual(tmp_path) as world:
        world.recorder.mute_close = True
        play(world)
        assert outcome(world)[0] == "aborted"
        assert "waited 20 s for the recorder to close" in outcome(world)[1]


def test_recorder_dies_in_a_run(tmp_path):
    with virtual(tmp_path) as world:
        play(
            world,
            [("hold", 6.0, world.recorder.peer.close), ("hold", 6.0, lambda: setattr(world.recorder, "deaf", True))],
        )
        assert outcome(world)[0] == "tripped"
        assert "the recorder process has ended" in outcome(world)[1]


def test_recorder_falls_silent_or_its_disk_fills(tmp_path):
    with virtual(tmp_path, plan=Plan(PLAN.shape, FixedDwell(30.0), slew=24.0, tare=PLAN.tare)) as world:
        play(world, [("hold", 6.0, lambda: setattr(world.recorder, "deaf", True))])
        assert "nothing was flushed for 15 s" in outcome(world)[1]


def test_little_space_left_ends_in_order(tmp_path):
    with virtual(tmp_path) as world:
        play(world, [("hold", 6.0, lambda: setattr(world.recorder, "free_bytes", 2**20))])
        assert "only 1 MiB left" in outcome(world)[1]
        assert world.recorder.of(Close)[-1].outcome == "tripped"


def test_ledger_that_can_not_be_written_stops_the_run(tmp_path):
    with virtual(tmp_path) as world:
        play(world, [("hold", 6.0, lambda: setattr(world.session.ledger.writer, "error", "the disk is full"))])
        assert outcome(world) == ("tripped", "the disk is full")


def test_motor_that_ignores_stop_is_never_called_at_rest(tmp_path):
    with virtual(tmp_path, thrusters=("T1", "T3")) as world:
        asked = []

        def stop():
            world.motor.ignores, world.motor.timeout = True, None
            asked.append(world.session.loop.signals.append(Request("stop", "a test")))

        seen = play(world, [("hold", 6.0, stop)])
        assert world.session.status.stop_confirmed is False
        assert "STOP NOT CONFIRMED" in world.texts
        assert world.motor.released > 10, "the second way is tried again and again"
        assert seen[-1].stop_confirmed is False


def test_completed_run_that_does_not_come_to_rest_ends_the_campaign(tmp_path):
    """The next thruster must not be mounted on a propeller that may turn."""
    with virtual(tmp_path, thrusters=("T1", "T3")) as world:

        def stuck():
            world.motor.rotation, world.motor.ignores, world.motor.timeout, world.motor.volts = 6.0, True, None, 6.0

        play(world, [("stopping", 0.0, stuck)])
        assert outcome(world)[0] == "tripped"
        assert "STOP NOT CONFIRMED" in outcome(world)[1]
        assert len(world.recorder.of(Open)) == 1


def test_motor_whose_wire_refuses(tmp_path):
    with virtual(tmp_path) as world:
        play(world, [("hold", 6.0, lambda: setattr(world.motor, "refuses", True))])
        assert outcome(world)[0] == "tripped"
        assert "did not take a command" in outcome(world)[1] or "link to motor" in outcome(world)[1]
        assert world.motor.released >= 1, "the second way is tried although the first is refused"
        assert abs(world.motor.rotation) < 0.5, "its own timeout has stopped it"


@pytest.mark.parametrize("resumes", [False, True])
def test_no_motion_after_a_lapse(tmp_path, resumes):
    """Promise 10: a controller that goes on at any command is sent 0 first, and nothing else."""
    with virtual(tmp_path) as world:
        world.motor.resumes = resumes
        lapsed = []

        def stall():
            lapsed.append(world.clock.t_ns * 1e-9)
            world.clock.stall(3.0)

        play(world, [("hold", 6.0, stall)])
        assert outcome(world)[0] == "tripped"
        assert "late" in outcome(world)[1]
        after = [volts for t, volts in world.motor.sent if t > lapsed[0] + 1.0]
        assert set(after) == {0.0}


def test_error_of_the_program_itself_still_ends_at_rest(tmp_path):
    with virtual(tmp_path, thrusters=("T1", "T3")) as world:

        def broken():
            raise ZeroDivisionError("a mistake of the program")

        with pytest.raises(ZeroDivisionError):
            play(world, [("hold", 6.0, broken)])
        assert outcome(world) == ("aborted", "the controller failed; its log says where")
        assert world.motor.volts == 0.0
        assert abs(world.motor.rotation) < 0.5, "rest was waited for and measured"
        assert world.session.status.stop_confirmed is True
        assert world.recorder.of(Close)[-1].outcome == "aborted"
        assert read(tmp_path)[-1]["outcome"] == "aborted"


def test_mount_command_fails_hangs_or_is_not_there(tmp_path):
    for number, (words, text) in enumerate(
        [
            ((sys.executable, "-c", "print('it turns'); raise SystemExit(2)"), "ended with status 2: it turns"),
            ((sys.executable, "-c", "import time; time.sleep(60)"), "waited 2 s for the mount command"),
            (("/no/such/command",), "can't be run: No such file"),
        ]
    ):
        folder = tmp_path / str(number)
        folder.mkdir()
        with virtual(folder, mount=words, mount_timeout=2.0 if "sleep" in words[-1] else 1e6) as world:
            play(world)
            assert outcome(world)[0] == "aborted"
            assert text in outcome(world)[1]


def test_mount_command_that_talks_a_lot_and_leaves_a_child_holds_nothing_up(tmp_path):
    """A pipe that nobody reads would block it, and a child that inherits it would block us."""
    script = "import subprocess, sys; print('x' * 200_000); subprocess.Popen(['sleep', '5'])"
    with virtual(tmp_path, mount=(sys.executable, "-c", script)) as world:
        play(world)
        assert outcome(world) == ("completed", "")


def test_operator_mounts(tmp_path):
    with virtual(tmp_path, mount=()) as world:
        play(world, [("mount", 0.0, lambda: world.session.loop.signals.append(Request("mounted")))])
        assert outcome(world) == ("completed", "")
        assert "put T1 on the bench" in world.texts


@pytest.mark.parametrize(("timeout", "text"), [(None, "off or unknown"), (3.0, "longer than this bench's limit")])
def test_watchdog_that_is_off_or_too_long_is_not_started(tmp_path, timeout, text):
    """Promise 9."""
    with virtual(tmp_path) as world:
        world.motor.timeout = timeout
        front, seen = world.front(), []

        def each(now):
            seen.extend(front.receive())
            front.send(Request("start"))
            if now > 5:
                world.session.loop.signals.append(Request("stop", "a test"))

        world.clock.each = each
        run(world.session)
        front.close()
        assert "not started: watchdog: " in world.texts
        assert text in world.texts
        assert not [volts for _, volts in world.motor.sent if volts]


def test_campaign_that_nobody_starts_lets_the_bench_go(tmp_path):
    with virtual(tmp_path) as world:
        run(world.session)
        assert outcome(world)[0] == "aborted"
        assert "nobody started" in outcome(world)[1]
