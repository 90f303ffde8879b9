"""Rest and the proof of the watchdog where no rotation rate is measured: by thrust, current and time."""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.safety.stopping import Stop, without_a_rate
from rig.safety.thrust_rest import ThrustRest
from rig.safety.watchdog_proof import Proof, ProofSettings, Proved, Refused
from rig.stages.preflight import rest_check
from tests.rig.stages.test_preflight import reading
from tests.rig.virtual_bench import bench_config

COAST = 3.0


def ends(thrust, current, until=4.0):
    """(s, confirmed) of a stop whose witnesses are functions of the time; and when it was released."""
    stop, released = Stop(0.0, 0.5, COAST, without_rate=True), None
    for tick in range(round(until / 0.02)):
        time = tick * 0.02
        confirmed, release = stop.advance(time, None, thrust(time), current(time))
        released = time if release and released is None else released
        if confirmed is not None:
            return time, confirmed, released
    raise AssertionError("it never ended")


def test_both_witnesses_for_the_whole_coast_time():
    assert ends(lambda t: t > 0.5, lambda t: t > 1.0) == (pytest.approx(COAST), True, None)


@pytest.mark.parametrize(
    ("thrust", "current"),
    [(True, None), (None, True), (True, False), (False, True), (None, None)],
)
def test_one_alone_confirms_nothing(thrust, current):
    time, confirmed, released = ends(lambda _: thrust, lambda _: current)
    assert (time, confirmed) == (pytest.approx(COAST), False)
    assert released == pytest.approx(COAST / 2)


def test_a_push_at_the_end_of_the_coast_time_is_no_rest():
    assert ends(lambda t: t < 2.9, lambda _: True)[1] is False


def test_a_rate_that_is_measured_is_not_replaced():
    stop = Stop(0.0, 0.5, COAST)
    assert stop.advance(COAST, None, True, True).confirmed is False


def test_the_sentences_say_on_what_it_rests():
    assert without_a_rate(True, True).startswith(
        "the thrust is back at its tare and the current drives nothing; no rotation"
    )
    assert "still drives something" in without_a_rate(None, False)
    assert "the thrust is no witness and the current is not known" in without_a_rate(None, None)


def test_a_limit_of_the_thrust_takes_the_place_of_the_noise():
    rest = ThrustRest(1.0)
    assert rest.push(0.0) is None
    rest.add(tuple((0.01 * i, 0.7 + 0.01 * (i % 2)) for i in range(30)))
    assert rest.push(0.3) is None, "no tare yet"
    rest.tared(0.705)
    assert rest.push(0.3) == pytest.approx(0.0, abs=0.01)
    rest.add(tuple((0.3 + 0.01 * i, 1.6 + 0.01 * (i % 2)) for i in range(30)))
    assert (rest.push(0.6), rest.judge(0.6)) == (pytest.approx(0.9, abs=0.02), True)
    rest.add(tuple((0.6 + 0.01 * i, 1.8 + 0.01 * (i % 2)) for i in range(30)))
    assert rest.judge(0.9) is False
    assert rest.push(5.0) is None, "old rows say nothing"


PROOF = ProofSettings(voltage=6.0, slew=24.0, rest_rate=1.0, watchdog_limit=1.0, coast_time=3.0, unit="N")


def proved(watchdog=0.5, C=0.4, settings=PROOF):
    """A propeller that follows its voltage within 0.2 s and is let go `watchdog` s after the last command."""
    proof, rate, volts, fed = Proof(settings), 0.0, 0.0, 0.0
    for tick in range(1000):
        time = tick * 0.02
        sent, verdict = proof.advance(time, C * rate * abs(rate))
        if verdict is not None:
            return verdict
        if sent is not None:
            volts, fed = sent, time
        driven = 0.0 if time - fed > watchdog else volts
        rate += (driven - rate) * 0.1
    raise AssertionError("no verdict")


def test_the_watchdog_is_proved_by_the_thrust():
    verdict = proved()
    assert isinstance(verdict, Proved)
    assert 0.6 < verdict.time_to_zero_s < 1.2


def test_a_watchdog_that_never_comes_or_a_push_that_is_too_small_is_refused():
    verdict = proved(watchdog=100.0)
    assert isinstance(verdict, Refused)
    assert "the motor's own watchdog is refused" in verdict.cause
    verdict = proved(C=0.05)
    assert isinstance(verdict, Refused)
    assert "the propeller pushes 1.80 N at 6 V, at least 4 N are needed; raise bench.proof_voltage" in verdict.cause
    verdict = Proof(PROOF)
    for tick in range(200):
        found = verdict.advance(tick * 0.02, None).verdict
    assert isinstance(found, Refused)
    assert found.cause == "the watchdog can't be proved: no thrust is measured"
    assert replace(PROOF, unit="rev/s").slowed == 0.8
    assert PROOF.slowed == pytest.approx(0.64)


def test_the_preflight_says_on_what_rest_will_rest():
    config = bench_config(Path(), rest_thrust=1.0, rest_current=0.2)
    check = rest_check([reading("current", 0.1)], config)
    assert check.verdict == "warning"
    assert "within 1 N of its tare and current at most 0.2 A; a propeller that turns too slowly" in check.text
    assert rest_check([reading("current", 0.3)], config).verdict == "failed"
    assert rest_check([reading("current", None)], config).verdict == "failed"
    assert "no current is measured either" in rest_check([], config).text
    assert (
        "unless bench.rest_thrust and bench.rest_current"
        in rest_check([reading("current", 0.1)], bench_config(Path())).text
    )
