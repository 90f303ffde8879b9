"""The whole controller in virtual time: what a campaign records, and that pauses and notes lose nothing of it."""

import os
import signal
from pathlib import Path

import pytest

from rig.campaign.dwell import FixedDwell
from rig.campaign.plan import TARE_AGAIN, Plan, TareConfig
from rig.campaign.shapes import Ramp, Sine
from rig.link.front_end_messages import Request
from rig.link.recorder_messages import Close, Open
from rig.recording.ledger import FILE_NAME, read
from tests.rig.stages.played import outcome, play
from tests.rig.virtual_bench import PLAN, virtual

HOLDS = [step.index for step in PLAN if step.phase == "hold"]


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
        assert len(proofs) == 3, "before the first run, and at the first rest of each"
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
    """Promise 27: ended by `accept` before it had a sample after its settling time."""
    with virtual(tmp_path) as world:
        play(world, [("hold", 6.0, lambda: world.session.loop.signals.append(Request("accept")))])
        assert outcome(world)[0] == "aborted"
        assert f"step {HOLDS[0] + 1} (hold) has no data" in outcome(world)[1]
        ends = [fact for fact in read(tmp_path) if fact["fact"] == "run_end"]
        assert [end["outcome"] for end in ends] == ["aborted"]


@pytest.mark.parametrize("asked", ["skip", "bad"])
def test_a_run_is_whole_without_what_an_operator_left_out_or_marked(tmp_path, asked):
    """The hold at -6 V follows that at 6 V: in it 6 V is the last that was measured."""
    with virtual(tmp_path) as world:
        play(world, [("hold", -6.0, lambda: world.session.loop.signals.append(Request(asked)))])
        assert outcome(world) == ("completed", "")
        points = {point.step for point in world.session.status.points}
        assert points == set(HOLDS) - {HOLDS[1] if asked == "skip" else HOLDS[0]}
        marked = [row for row in world.recorder.steps if row.phase == "void"]
        assert [row.index for row in marked] == ([] if asked == "skip" else [HOLDS[0]])


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


def test_resumed_run_goes_on_at_its_first_step_that_is_not_measured(tmp_path):
    """Promise 22: a proof and a tare come first, then the steps that are left, each under its own index."""
    left = HOLDS[1]
    kept = {"fact": "kept", "thruster": "T1", "recordings": ["T1.h5"], "continues": "id-1", "steps": list(range(left))}
    before = ({"fact": "start", "identities": {}}, {"fact": "run_start", "thruster": "T1"}, kept)
    with virtual(tmp_path, before=before, prove_watchdog=True) as world:
        seen = play(world)
        assert outcome(world) == ("completed", "")
        assert world.recorder.of(Open)[0].attributes["continues"] == "id-1"
        rows = [(row.index, row.phase) for row in world.recorder.steps]
        proofs = [(-1, "free")] * 2
        plan = [(step.index, step.phase) for step in PLAN]
        assert rows[:3] == [proofs[0], (TARE_AGAIN, "tare"), (left, "ramp")]
        assert [row for row in rows[3:-1] if row not in proofs and row[1] != "ramp"] == [
            row for row in plan[left:] if row[1] != "ramp"
        ]
        assert f"attempt 2 of T1: it goes on at step {left + 1} (hold) after a tare" in world.texts
        assert [point.step for point in world.session.status.points] == [left]
        shown = [s.progress for s in seen if s.state == "hold"]
        assert {(each.step, each.steps) for each in shown} == {(left, len(plan))}, "as people count them"


def test_run_that_lacks_a_step_of_its_rest_is_not_completed(tmp_path):
    kept = {"fact": "kept", "thruster": "T1", "recordings": ["T1.h5"], "continues": "id-1", "steps": [0, 1, 2]}
    before = ({"fact": "start", "identities": {}}, {"fact": "run_start", "thruster": "T1"}, kept)
    with virtual(tmp_path, before=before) as world:
        play(world, [("hold", -6.0, lambda: world.session.loop.signals.append(Request("accept")))])
        assert f"step {HOLDS[1] + 1} (hold) has no data" in outcome(world)[1]


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
