"""The whole controller in virtual time: every stage, every way it fails, and the motor at rest each time."""

import os
import signal
import sys
from pathlib import Path

import pytest

from rig.campaign.plan import FixedDwell, Plan, TareConfig
from rig.campaign.shapes import Ramp, Sine
from rig.link.front_end_messages import Request, Snapshot
from rig.link.recorder_messages import Close, Open
from rig.recording.ledger import FILE_NAME, read
from rig.stages.campaign import run
from tests.rig.virtual_bench import PLAN, VirtualBench, flow_meter, starter, stop_input, virtual

HOLDS = [step.index for step in PLAN if step.phase == "hold"]


def play(world: VirtualBench, at=(), each=None) -> list[Snapshot]:
    """Run the campaign with a front end that starts it. `at`: (state, volts, what to do there once)."""
    seen: list[Snapshot] = []
    front = world.front()
    drive = starter(world, front, seen)
    todo = list(at)

    def tick(now: float) -> None:
        drive(now)
        if each is not None:
            each(now)
        status, command = world.session.status, world.session.loop.command
        for item in list(todo):
            state, volts, what = item
            if status.state == state and abs(command - volts) < 1e-9:
                todo.remove(item)
                what()

    world.clock.each = tick
    try:
        run(world.session)
    finally:
        world.recorder.deaf = False
        world.recorder.step(1e9)
        front.close()
    assert not todo, "what was to happen never did"
    assert world.motor.volts == 0.0 or world.motor.ignores or world.motor.refuses
    assert world.motor.closed, "the ports are closed, however it ended"
    return seen


def outcome(world: VirtualBench) -> tuple[str, str]:
    return world.session.status.outcome, world.session.status.cause


def drive_after(world: VirtualBench, now: float) -> list[tuple[float, float]]:
    return [(t, volts) for t, volts in world.motor.sent if t > now and volts]


def test_two_thrusters_are_measured_whole(tmp_path):
    with virtual(tmp_path, thrusters=("T1", "T3"), prove_watchdog=True) as world:
        seen = play(world)
        assert outcome(world) == ("completed", "")
        assert [request.attributes["thruster"] for request in world.recorder.of(Open)] == ["T1", "T3"]
        assert [close.outcome for close in world.recorder.of(Close)] == ["completed", "completed"]
        assert world.motor.released, "the second way to stop is used at the end"
        facts = read(tmp_path)
        assert [f["fact"] for f in facts if f["fact"] != "step"] == (["start", *["run_start", "run_end"] * 2, "end"])
        proofs = [step for step in world.recorder.steps if step.index == -1]
        assert len(proofs) == 1, "the second run trusts the proof of the first"
        assert {s.outcome for s in seen if s.state == "hold"} == {"running"}
        assert seen[-1].state == "done"


def test_recording_is_told_what_came_before_it(tmp_path):
    with virtual(tmp_path, thrusters=("T1", "T3"), prove_watchdog=True) as world:
        play(world)
        events = world.recorder.events
        before = [event.text for event in events if event.time <= 0]
        assert before.count("load_cell: virtual cell 2") == 2, "in each file"
        assert sum(text.startswith("preflight: load_cell rate") for text in before) == 2
        assert any("T3 mounted" in text for text in before)
        assert sum("watchdog proved in the run of T1" in text for text in before) == 1
        assert sum("control loop: worst lateness" in event.text for event in events) == 2
        times = [line.time for line in world.session.status.log]
        assert times == sorted(times), "what people read has one clock"
        assert (tmp_path / "controller.log").read_text().count("worst lateness") == 2


def test_front_end_gone_ends_an_attended_run_in_the_next_tick(tmp_path):
    with virtual(tmp_path, unattended=False) as world:
        left = []

        def leave():
            left.append(world.clock.t_ns * 1e-9)
            world.session.loop.clients.connected[0].peer.close()

        front, seen = world.front(), []
        drive = starter(world, front, seen)

        def tick(now):
            if not left:
                drive(now)
            if world.session.loop.command == 6.0 and not left:
                left.append(now)
                front.close()

        world.clock.each = tick
        run(world.session)
        assert outcome(world)[0] == "tripped"
        assert "the operator is gone" in outcome(world)[1]
        assert drive_after(world, left[0] + 0.021) == []


def test_starting_is_a_lease_too(tmp_path):
    """A front end that starts an attended campaign and never leases: it lapses after 2 s."""
    with virtual(tmp_path, unattended=False) as world:
        front, asked = world.front(), []

        def tick(_):
            front.receive()
            if world.session.status.state == "preflight" and not asked:
                asked.append(front.send(Request("start")))

        world.clock.each = tick
        run(world.session)
        front.close()
        assert outcome(world)[0] == "tripped"
        assert "no operator was seen" in outcome(world)[1]


@pytest.mark.parametrize("state", ["tare", "ramp", "hold", "rest"])
def test_stop_request_in_any_state(tmp_path, state):
    with virtual(tmp_path) as world:
        volts = {"tare": 0.0, "ramp": 0.48, "hold": 6.0, "rest": 0.0}[state]
        asked = []

        def stop():
            asked.append(world.clock.t_ns * 1e-9)
            world.session.loop.signals.append(Request("stop", "SIGTERM"))

        play(world, [(state, volts, stop)])
        assert outcome(world) == ("aborted", "stopped by SIGTERM")
        assert drive_after(world, asked[0] + 0.021) == []
        assert world.session.status.stop_confirmed is True
        assert world.recorder.of(Close)[-1].outcome == "aborted"


@pytest.mark.parametrize("state", ["connecting", "preflight", "mount"])
def test_stop_request_outside_a_run(tmp_path, state):
    mount = (sys.executable, "-c", "import time; time.sleep(60)")
    with virtual(tmp_path, mount=mount) as world:
        play(world, [(state, 0.0, lambda: world.session.loop.signals.append(Request("stop", "a test")))])
        assert outcome(world) == ("aborted", "stopped by a test")
        assert not world.recorder.of(Open)


@pytest.mark.parametrize(("becomes", "cause"), [(1.0, "EMERGENCY STOP"), (None, "button.emergency_stop is stale")])
def test_emergency_stop_ends_the_run_at_once_and_no_other_begins_while_it_is_pressed(tmp_path, becomes, cause):
    """Promise 12: pressed, or its cable pulled."""
    button = stop_input()
    with virtual(tmp_path, inputs=(button,), thrusters=("T1", "T3")) as world:
        at = []

        def press():
            at.append(world.clock.now_ns() * 1e-9)
            button.value = becomes

        play(world, [("hold", 6.0, press)])
        assert outcome(world)[0] == "tripped"
        assert cause in outcome(world)[1]
        zero = next(t for t, volts in world.motor.sent if t > at[0] and volts == 0.0)
        assert zero - at[0] < (0.1 if becomes else 0.3)
        assert not [volts for t, volts in world.motor.sent if t > zero and volts]
        assert len(world.recorder.of(Open)) == 1


def test_a_pressed_emergency_stop_lets_nothing_begin(tmp_path):
    button = stop_input()
    button.value = 1.0
    with virtual(tmp_path, inputs=(button,)) as world:
        world.clock.at.append((10.0, lambda: world.session.loop.signals.append(Request("stop"))))
        play(world)
        assert not [volts for _, volts in world.motor.sent if volts]
        assert not world.recorder.of(Open)


def test_a_campaign_waits_for_the_water_that_it_is_meant_for(tmp_path):
    """It comes after 10 s; the check follows it."""
    meter, checks = flow_meter(0.02), []
    with virtual(tmp_path, inputs=(meter,), flow_speed=0.5) as world:

        def turn_on():
            checks.append({c.name: c for c in world.session.status.checks}["flow"])
            assert not world.recorder.of(Open)
            meter.value = 0.51

        world.clock.at.append((10.0, turn_on))
        play(world)
        assert checks[0].verdict == "waiting"
        assert checks[0].text.startswith("0.02 m/s measured; the campaign is meant for 0.5 m/s: set the water")
        assert outcome(world)[0] == "completed"
        assert "m/s measured; the campaign is meant for 0.5 m/s" in world.texts


def test_nothing_begins_in_water_that_the_campaign_is_not_meant_for(tmp_path):
    """Not when the operator asks for it, and after a minute it is a failure, at which a headless run gives up."""
    verdicts = []
    with virtual(tmp_path, inputs=(flow_meter(0.02),), flow_speed=0.5) as world:

        def look():
            verdicts.append({c.name: c for c in world.session.status.checks}["flow"].verdict)
            world.session.loop.signals.append(Request("start"))

        world.clock.at += [
            (30.0, look),
            (70.0, look),
            (71.0, lambda: world.session.loop.signals.append(Request("stop"))),
        ]
        play(world)
        assert verdicts == ["waiting", "failed"]
        assert world.texts.count("not started: flow: 0.02 m/s measured") == 2
        assert not world.recorder.of(Open)


def test_stop_while_the_recorder_opens_and_while_it_closes_is_not_lost(tmp_path):
    with virtual(tmp_path) as world:
        world.clock.each = None
        opened = []

        def each(_):
            if world.session.recorder.streams and not opened:
                opened.append(1)
                world.session.loop.signals.append(Request("stop", "in between"))

        play(world, each=each)
        assert outcome(world) == ("aborted", "stopped by in between")
        assert not [volts for _, volts in world.motor.sent if volts]


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


def test_device_that_does_not_open(tmp_path):
    with virtual(tmp_path) as world:
        world.cell.refuses = "load_cell: no cable"
        play(world)
        assert outcome(world) == ("aborted", "load_cell: no cable")
        assert {check.verdict for check in world.session.status.checks} == {"failed", "passed"}


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


@pytest.mark.parametrize("state", ["tare", "ramp", "hold", "rest", "sine", "stopping"])
def test_pause_in_any_state_and_resume_gives_every_point(tmp_path, state):
    """Promise 24. A pause while the end is waited for is refused."""
    shape = Sine(3.0, (2.0,), 2) if state == "sine" else PLAN.shape
    plan = Plan(shape, FixedDwell(0.6, 0.2), slew=60.0 if state == "sine" else 24.0, rest=0.3, tare=PLAN.tare)
    with virtual(tmp_path, plan=plan) as world:
        done = []

        def each(now):
            signals, here = world.session.loop.signals, world.session.status.state
            if here == state and not done:
                done.append(now)
                signals.append(Request("pause"))
            elif here == "paused" and now > done[0] + 1.0 and len(done) == 1:
                done.append(now)
                signals.append(Request("resume"))

        play(world, each=each)
        assert outcome(world) == ("completed", "")
        assert len(done) == (1 if state == "stopping" else 2)
        assert [point.step for point in world.session.status.points] == [s.index for s in plan if s.phase == "hold"]


def test_later_tare_that_is_not_stable_leaves_the_one_before_and_completes(tmp_path):
    with virtual(tmp_path) as world:

        def each(now):
            output = world.session.status.output
            if output is not None and output.step > 1 and output.state == "tare":
                world.cell.spoil = lambda value: value + 5.0 * now

        play(world, each=each)
        assert outcome(world) == ("completed", "")
        assert "stays in use" in world.texts


def test_hold_without_a_point_is_no_completed_run(tmp_path):
    """Promise 27: ended by `skip` before it had a sample after its settling time."""
    with virtual(tmp_path) as world:
        play(world, [("hold", 6.0, lambda: world.session.loop.signals.append(Request("skip")))])
        assert outcome(world)[0] == "aborted"
        assert f"step {HOLDS[0]} (hold) has no data" in outcome(world)[1]
        ends = [fact for fact in read(tmp_path) if fact["fact"] == "run_end"]
        assert [end["outcome"] for end in ends] == ["aborted"]


@pytest.mark.parametrize("shape", [Ramp(4.0, 4.0), Sine(3.0, (2.0,), 2)])
def test_swept_and_sine_plans_complete(tmp_path, shape):
    plan = Plan(shape, FixedDwell(1.0), slew=60.0, rest=0.3, tare=TareConfig(0.4, 0.2, 2.0))
    with virtual(tmp_path, plan=plan) as world:
        play(world)
        assert outcome(world) == ("completed", "")


def test_notes_detaching_and_spoilt_frames_are_in_the_records(tmp_path):
    with virtual(tmp_path, unattended=False) as world:
        world.cell.bad, world.cell.dropped = 1, 2

        def say():
            signals = world.session.loop.signals
            signals.extend((Request("note", "bubbles"), Request("detach")))

        play(world, [("hold", 6.0, say)])
        texts = [event.text for event in world.recorder.events]
        assert "note: bubbles" in texts
        assert any("only front end of an attended run" in text for text in texts)
        assert any("frames could not be understood, first: half a line" in text for text in texts)
        assert any("2 frames were lost" in text for text in texts)


def test_resumed_campaign_goes_on_with_the_same_devices_only(tmp_path):
    before = ({"fact": "start", "identities": {"motor": "virtual motor 9"}},)
    with virtual(tmp_path, before=before) as world:
        play(world)
        assert "motor is virtual motor 1, but the campaign was begun with virtual motor 9" in outcome(world)[1]


def test_resumed_run_counts_its_attempts(tmp_path):
    before = ({"fact": "start", "identities": {}}, {"fact": "run_start", "thruster": "T1"})
    with virtual(tmp_path, before=before) as world:
        (tmp_path / "T1.h5").write_bytes(b"of the first attempt")
        play(world)
        request = world.recorder.of(Open)[0]
        assert (Path(request.path).name, request.attributes["attempt"]) == ("T1-2.h5", 2)
        assert "attempt 2 of T1" in world.texts
        assert next(fact["fact"] for fact in read(tmp_path)) == "resume"
        assert (tmp_path / FILE_NAME).exists()


def test_signal_at_any_instant_is_a_request(tmp_path):
    from rig.stages.controller import stop_on_signals

    with virtual(tmp_path) as world:
        handlers = {n: signal.getsignal(n) for n in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)}
        try:
            stop_on_signals(world.session)
            play(world, [("hold", 6.0, lambda: os.kill(os.getpid(), signal.SIGHUP))])
        finally:
            for number, handler in handlers.items():
                signal.signal(number, handler)
        assert outcome(world) == ("aborted", "stopped by SIGHUP")
