"""The watchdog proof, alone and inside a run."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_sequencer import FIXED, PERIOD, PROOF, SHORT, World, asks, run

from rig.safety.watchdog_proof import Proof, Proved, Refused
from rig.sequence.sequencer import Sequencer

SETTINGS = replace(FIXED, proof=PROOF)


def prove(world: World, settings=PROOF):
    """The verdict and the commands of one proof."""
    proof, sent = Proof(settings), []
    for _ in range(2000):
        volts, verdict = proof.advance(world.time, None if world.blind else world.rotation)
        sent.append(volts)
        if verdict is not None:
            return verdict, sent
        world.step(volts)
    raise AssertionError("a proof must end")


@settings(deadline=None)
@given(st.floats(0.1, 1.0))
def test_effective_watchdog_is_proved_and_timed(watchdog):
    verdict, sent = prove(World(watchdog=watchdog))
    assert isinstance(verdict, Proved)
    assert verdict.time_to_zero_s == pytest.approx(watchdog + 0.2 * 2.08, abs=0.1)  # 0.2 s ln(4 / 0.5)
    assert sent[0] == 0.0
    assert sent[sent.index(None) :].index(0.0) == sent.count(None)  # silence is one piece, then 0 V
    assert len(sent) * PERIOD <= PROOF.worst


def test_time_to_zero_is_in_the_run_and_its_rows():
    ran = run(SHORT, SETTINGS)
    assert ran.last.time_to_zero_s == pytest.approx(0.9, abs=0.1)
    assert (ran.rows[0].index, ran.rows[0].phase) == (-1, "free")
    assert ran.said("watchdog proved: at rest 0.9")
    silence = [i for i, o in enumerate(ran.outputs) if o.volts is None]
    assert ran.outputs[silence[-1] + 1].volts == 0.0  # the first command after the lapse
    assert ran.outputs[0].state == "proving"
    assert ran.outputs[0].remaining == pytest.approx(SHORT.duration().expected + 2 * PROOF.expected)
    between = next(output for output in ran.outputs if output.state == "tare")
    assert between.remaining == pytest.approx(SHORT.duration().expected + PROOF.expected), "the one at the first rest"


def test_time_that_is_left_counts_a_proof_once_and_not_after_it():
    ran = run(SHORT, SETTINGS)
    last = max(i for i, output in enumerate(ran.outputs) if output.state == "proving")
    after = ran.outputs[last + 1]
    steps = tuple(SHORT)
    assert after.state == "rest"
    assert after.remaining == pytest.approx(sum(step.expected for step in steps[after.step :]))
    assert len([o for o in ran.outputs if o.state == "proving" and o.step_elapsed == 0.0]) == 2


@pytest.mark.parametrize("watchdog", [1.6, 1e9])
def test_watchdog_that_is_late_or_broken_is_refused(watchdog):
    ran = run(SHORT, SETTINGS, World(watchdog=watchdog))
    assert ran.last.outcome == "tripped"
    assert "watchdog is refused" in ran.last.cause
    assert "without a command and still it turns" in ran.last.cause
    assert ran.last.stop_confirmed is True
    assert ran.points == []


def test_propeller_that_coasts_too_long_is_refused():
    verdict, _ = prove(World(lag=1.0), replace(PROOF, coast_time=0.5))
    assert isinstance(verdict, Refused)
    assert "not at rest" in verdict.cause


def test_propeller_that_does_not_turn_is_refused():
    verdict, _ = prove(World(runs_away=True))
    assert isinstance(verdict, Refused)
    assert "turns 0.00 rev/s at 4 V" in verdict.cause


def test_without_a_rotation_rate_nothing_is_proved():
    verdict, sent = prove(World(blind=True))
    assert isinstance(verdict, Refused)
    assert "no rotation rate is measured" in verdict.cause
    assert set(sent) == {0.0}


def test_rotation_lost_in_the_silence_is_no_rest():
    world, proof, verdict = World(), Proof(PROOF), None
    while verdict is None:
        volts, verdict = proof.advance(world.time, None if world.blind else world.rotation)
        world.blind = volts is None
        world.step(volts)
    assert isinstance(verdict, Refused)


def test_motor_that_moves_again_by_itself_is_refused():
    world, proof, silent = World(), Proof(PROOF), False
    for _ in range(2000):
        volts, verdict = proof.advance(world.time, world.rotation)
        if verdict:
            break
        world.step(volts)
        silent = silent or volts is None
        if silent and volts == 0.0:
            world.rotation = 3.0
    assert isinstance(verdict, Refused)
    assert "moves again" in verdict.cause


def test_windmilling_in_the_flow_is_taken_into_account():
    world, proof, verdict, sent = World(), Proof(PROOF), None, []
    while verdict is None:
        volts, verdict = proof.advance(world.time, world.rotation + 1.5)
        sent.append(volts)
        world.step(volts)
    assert isinstance(verdict, Proved)
    assert sum(v == 0.0 for v in sent) * PERIOD >= PROOF.coast_time  # it was waited for before


def test_watchdog_that_breaks_after_its_proof_is_noticed_at_the_next_rest():
    world, sequencer = World(), Sequencer(SHORT, SETTINGS)
    output = sequencer.advance(world.tick())
    while not output.done:
        world.step(output.volts)
        output = sequencer.advance(world.tick())
        if output.state == "hold":
            world.watchdog = 1e9
    assert output.outcome == "tripped"
    assert "the motor's own watchdog is refused" in output.cause
    assert output.time_to_zero_s == pytest.approx(0.9, abs=0.1), "it was proved before"


def test_a_motor_that_was_proved_in_an_earlier_run_is_proved_at_the_first_rest():
    ran = run(SHORT, replace(SETTINGS, proved=True))
    assert ran.last.outcome == "completed"
    assert ran.outputs[0].state == "tare"
    proofs = [row for row in ran.rows if row.index == -1]
    assert len(proofs) == 1
    assert proofs[0].t_start > min(row.t_end for row in ran.rows if row.phase == "hold")


def test_a_stop_in_the_silence_of_the_proof_is_in_the_rows_at_0_volts():
    silent = run(SHORT, SETTINGS)
    number = next(i for i, output in enumerate(silent.outputs) if output.volts is None) + 2
    ran = run(SHORT, SETTINGS, at={number: asks("stop")})
    assert ran.outputs[number - 1].volts is None
    assert ran.outputs[number].volts == 0.0
    assert (ran.rows[0].index, ran.rows[0].phase, ran.rows[0].command_voltage) == (-1, "free", 0.0)
