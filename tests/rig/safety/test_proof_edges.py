"""The proof of the watchdog at its very limits: what benchmarks/controller/mutation.py would change."""

from dataclasses import replace
from math import inf, nextafter

import pytest

from rig.safety.watchdog_proof import PROOFS_OF_A_RUN, Proof, ProofSettings, ProofStep, Proved, Refused

SETTINGS = ProofSettings(voltage=4.0, slew=8.0, rest_rate=0.5, watchdog_limit=1.0, coast_time=3.0)
PUSHING = replace(SETTINGS, unit="N")
NEEDED = 2.0
"""rev/s at which the propeller certainly turns: four times the rest rate."""


def above(value):
    return nextafter(value, inf)


def below(value):
    return nextafter(value, -inf)


def spinning(settings=SETTINGS, idle=0.0):
    """A proof whose motor has the proof voltage since 0 s."""
    proof = Proof(settings)
    if idle:
        proof.advance(-3.5, idle)
        assert proof.advance(-0.5, idle) == ProofStep(0.0), "so long it may coast"
    else:
        proof.advance(-0.5, 0.0)
    assert proof.advance(0.0, idle).volts == settings.voltage
    return proof


def silent(settings=SETTINGS, speed=10.0):
    """A proof that has sent nothing since 0 s, of a motor that turned so fast."""
    proof = Proof(settings)
    proof.advance(-3.0, 0.0)
    assert proof.advance(-2.0, 0.0).volts == settings.voltage
    assert proof.advance(0.0, speed) == ProofStep(settings.voltage), "the last command"
    return proof


def verdict(step):
    return type(step.verdict)


def test_how_long_it_takes():
    assert SETTINGS.expected == pytest.approx(0.5 + 1.3 + 0.5 + 0.3 + 0.5)
    assert replace(SETTINGS, watchdog_limit=3.0).expected == pytest.approx(0.5 + 1.3 + 1.5 + 0.3 + 0.5)
    assert SETTINGS.worst == pytest.approx(3.0 + 0.5 + 2.5 + 1.0 + 3.0 + 0.3)
    assert PROOFS_OF_A_RUN == 2


def test_what_slows_down_is_told_by_rate_or_by_thrust():
    assert SETTINGS.slowed == pytest.approx(0.8)
    assert PUSHING.slowed == pytest.approx(0.64), "thrust goes with the square"


def test_before_it_a_propeller_is_at_rest_or_has_coasted():
    proof = Proof(SETTINGS)
    assert proof.advance(0.0, above(0.5)) == ProofStep(0.0)
    assert proof.advance(2.9, -above(0.5)) == ProofStep(0.0)
    proof.advance(2.95, -0.5)
    assert proof.advance(3.0, 0.5).volts == pytest.approx(0.4), "at the rest rate it is at rest"
    waits = Proof(SETTINGS)
    waits.advance(0.0, 1.0)
    waits.advance(below(3.0), 1.0)
    assert waits.advance(3.0, 1.0) == ProofStep(0.0)
    assert waits.advance(3.25, 1.0).volts == pytest.approx(2.0), "so long it may coast, and flow may turn it"


@pytest.mark.parametrize(("settings", "what"), [(SETTINGS, "no rotation rate"), (PUSHING, "no thrust")])
def test_without_a_value_nothing_is_proved(settings, what):
    proof = Proof(settings)
    proof.advance(0.0, None)
    step = proof.advance(3.0, None)
    assert step == (0.0, Refused(f"the watchdog can't be proved: {what} is measured"))


def test_voltage_rises_by_its_slew_and_no_further():
    proof = Proof(SETTINGS)
    proof.advance(10.0, 0.0)
    assert proof.advance(10.125, 0.0).volts == 1.0
    assert proof.advance(10.375, 0.0).volts == 3.0
    assert proof.advance(10.5, 0.0).volts == 4.0
    assert proof.advance(11.0, 0.0).volts == 4.0


def test_nothing_is_cut_off_before_rate_and_current_have_settled():
    proof = spinning()
    assert proof.advance(below(1.3), NEEDED) == ProofStep(4.0)
    assert proof.advance(1.3, NEEDED) == ProofStep(4.0), "once more, and no longer"
    assert proof.advance(1.4, NEEDED).volts is None
    slow = spinning()
    slow.advance(1.3, below(NEEDED))
    assert slow.advance(1.4, below(NEEDED)).volts == 4.0
    unknown = spinning()
    unknown.advance(1.3, None)
    assert unknown.advance(1.4, None).volts == 4.0
    assert "the propeller turns 0.00 rev/s" in unknown.advance(2.5, None).verdict.cause


def test_what_flow_turned_before_is_no_answer_to_the_voltage():
    proof = spinning(idle=1.0)
    proof.advance(1.3, -0.99)
    assert proof.advance(1.4, 2.99).volts == 4.0
    assert proof.advance(1.5, -1.0).volts == 4.0
    assert proof.advance(1.6, -1.0).volts is None


def test_a_propeller_that_does_not_turn_is_refused_at_its_time():
    proof = spinning()
    assert proof.advance(below(2.5), 1.0) == ProofStep(4.0)
    step = proof.advance(2.5, 1.0)
    assert step.volts == 0.0
    assert step.verdict == Refused(
        "the watchdog can't be proved: the propeller turns 1.00 rev/s at 4 V, at least 2 rev/s are needed; raise "
        "bench.proof_voltage"
    )


@pytest.mark.parametrize(("settings", "kept"), [(SETTINGS, 8.0), (PUSHING, 6.4)])
def test_a_motor_that_keeps_its_speed_is_refused_after_the_limit(settings, kept):
    proof = silent(settings)
    assert proof.advance(1.3, above(kept)) == ProofStep(None)
    step = proof.advance(above(1.3), above(kept))
    assert step.volts == 0.0
    assert "1.30 s without a command and still it turns, 1 s are allowed" in step.verdict.cause


def test_a_motor_that_once_slowed_may_coast_until_its_time():
    proof = silent()
    assert proof.advance(1.0, below(8.0)) == ProofStep(None)
    assert proof.advance(2.0, 9.0) == ProofStep(None), "what it lost is not taken back by a value or two"
    assert proof.advance(3.9, None) == ProofStep(None)
    assert proof.advance(4.0, 1.0) == ProofStep(None)
    step = proof.advance(above(4.0), 1.0)
    assert step.volts == 0.0
    assert "not at rest 4.00 s after the last command, 1 s and 3 s of coasting are allowed" in step.verdict.cause


def test_exactly_the_share_is_not_slowed():
    proof = silent()
    proof.advance(1.0, 8.0)
    assert verdict(proof.advance(1.4, 8.0)) is Refused


def test_unknown_is_no_rest():
    proof = silent()
    assert proof.advance(0.5, None) == ProofStep(None)
    assert verdict(proof.advance(1.4, None)) is Refused


def test_time_to_zero_is_from_the_last_command_to_rest():
    proof = silent()
    assert proof.advance(0.75, above(0.5)) == ProofStep(None)
    assert proof.advance(1.0, -0.5) == ProofStep(0.0), "the first command after the lapse is 0"
    assert proof.advance(1.25, 1.9) == ProofStep(0.0)
    assert proof.advance(1.5, 0.0) == ProofStep(0.0, Proved(1.0))


def test_the_quiet_after_it_has_its_time():
    proof = silent()
    proof.advance(0.25, 0.0)
    assert proof.advance(0.25 + below(0.3), 0.0) == ProofStep(0.0)
    assert proof.advance(0.25 + above(0.3), 0.0) == ProofStep(0.0, Proved(0.25))


@pytest.mark.parametrize(("settings", "does"), [(SETTINGS, "turns -2.00 rev/s"), (PUSHING, "pushes -2.00 N")])
def test_a_motor_that_moves_again_is_refused(settings, does):
    proof = silent(settings)
    proof.advance(1.0, 0.0)
    assert proof.advance(1.1, below(NEEDED)) == ProofStep(0.0)
    assert proof.advance(1.15, None) == ProofStep(0.0)
    step = proof.advance(1.2, -NEEDED)
    assert step.volts == 0.0
    assert f"moves again at command 0 after its watchdog: the propeller {does}; look at" in step.verdict.cause
