"""What CANopen motor controllers are sent and believed, by time and words alone: corners that no bench has."""

from __future__ import annotations

import pytest

from drivers.canopen import cia401_conduct
from drivers.canopen.cia402_conduct import Conduct
from drivers.canopen.cia402_options import Options
from drivers.canopen.frames import BOOTED, OPERATIONAL, Emergency

OPTIONS = Options("bus", 5, max_voltage=24.0, watchdog_timeout=0.5, rate_per_volt=1.0)
READY, SWITCHED_ON, ENABLED, OFF, FAULT, QUICK_STOP = 0x0231, 0x0233, 0x0237, 0x0250, 0x0218, 0x0217
STOPPED, PRE_OPERATIONAL = 0x04, 0x7F


def ns(seconds: float) -> int:
    return round(seconds * 1e9)


def drive_at(volts: float, statusword: int) -> tuple[Conduct, float]:
    """A drive that was led to this statusword at 50 Hz, commanded with volts at last; and the time."""
    conduct, t = Conduct("motor", OPTIONS, 0), 0.0
    for told, wanted in ((OFF, 0.0), (READY, 0.0), (SWITCHED_ON, 0.0), (statusword, volts)):
        conduct.note_state(ns(t), told)
        conduct.decide(wanted, ns(t))
        t += 0.02
    return conduct, t


def test_a_drive_that_is_not_enabled_in_time():
    conduct, t = drive_at(5.0, SWITCHED_ON)
    while conduct.fault is None and t < 2.0:
        assert conduct.decide(5.0, ns(t)).word == 0x0F
        t += 0.02
    assert 0.5 < t < 0.7
    assert conduct.fault == (
        "motor does not enable its operation within 0.5 s, its state is switched on: clear its cause, then open again"
    )
    word, feeds, refusal = conduct.decide(5.0, ns(t))
    assert (word, feeds) == (0x00, True)
    assert refusal.startswith("does not enable")


def test_a_drive_that_does_not_come_up_again_after_a_silence():
    conduct, t = drive_at(5.0, ENABLED)
    t += 0.6
    while conduct.fault is None and t < 5.0:
        conduct.note_state(ns(t), OFF)
        assert conduct.decide(0.0, ns(t)).word in (0x06, 0x00)
        t += 0.02
    assert "does not come up again after a silence, its state is switch on disabled" in conduct.fault


def test_a_fault_after_a_silence_is_not_reset_unless_the_drive_told_that_it_is_ours():
    for told in (True, False):
        conduct, t = drive_at(5.0, ENABLED)
        t += 0.6
        if told:
            conduct.note_emergency(ns(t), Emergency(0x8130, 0x11))
        conduct.note_state(ns(t), FAULT)
        words = [conduct.decide(0.0, ns(t + 0.02 * i)).word for i in range(4)]
        assert words == ([0x80, 0x00, 0x80, 0x00] if told else [0x00] * 4)
        assert conduct.fault is None


def test_the_same_emergency_while_we_speak_is_a_fault():
    conduct, t = drive_at(5.0, ENABLED)
    conduct.note_emergency(ns(t), Emergency(0x8130, 0x11))
    assert conduct.fault.startswith("motor reports emergency 0x8130 (monitoring)")
    assert conduct.decide(0.0, ns(t)).word == 0x02, "still enabled: quick stop"


def test_an_error_that_is_over_is_none():
    conduct, t = drive_at(5.0, ENABLED)
    conduct.note_emergency(ns(t), Emergency(0x0000, 0x00))
    assert conduct.fault is None


@pytest.mark.parametrize(
    ("statusword", "sentence"),
    [
        (FAULT, "has a fault: statusword 0x0218"),
        (0x021F, "has a fault: statusword 0x021F"),
        (QUICK_STOP, "stopped by itself: its state is quick stop active"),
        (SWITCHED_ON, "stopped by itself: its state is switched on"),
        (0x0262, "stopped by itself: its state is unknown"),
        (OFF, "stopped by itself: its state is switch on disabled"),
    ],
)
def test_what_ends_a_drive_that_turns(statusword, sentence):
    conduct, t = drive_at(5.0, ENABLED)
    conduct.note_state(ns(t), ENABLED)
    conduct.note_state(ns(t), statusword)
    assert conduct.fault.startswith(f"motor {sentence}")


@pytest.mark.parametrize(
    ("state", "sentence"),
    [(BOOTED, "has started anew"), (STOPPED, "is stopped, no longer operational"), (0x33, "is in an unknown state")],
)
def test_heartbeats_that_end_a_drive(state, sentence):
    conduct, t = drive_at(5.0, ENABLED)
    conduct.note_heartbeat(ns(t), OPERATIONAL)
    assert conduct.fault is None
    conduct.note_heartbeat(ns(t), state)
    assert conduct.fault.startswith(f"motor {sentence}")


def test_the_first_fault_is_the_one_that_is_told():
    conduct, t = drive_at(5.0, ENABLED)
    conduct.note_emergency(ns(t), Emergency(0x2310, 0x03))
    conduct.note_state(ns(t), FAULT)
    conduct.note_mode(ns(t), 0, 3)
    assert "0x2310" in conduct.fault


# -- analogue output ---------------------------------------------------------------------------------------------------


def output() -> cia401_conduct.Conduct:
    made = cia401_conduct.Conduct("motor", watchdog=0.5, heartbeat=0.1, now_ns=0)
    assert made.decide(0.0, ns(0.0)) == (False, None)
    assert made.decide(5.0, ns(0.02)) == (False, None)
    return made


def test_an_output_is_started_once_and_waited_for():
    made = output()
    made.stopped()
    made.note_heartbeat(ns(0.1), STOPPED)
    starts, refusal = made.decide(5.0, ns(0.12))
    assert starts
    assert refusal.startswith("the module was stopped")
    made.note_heartbeat(ns(0.13), STOPPED)  # was under way
    starts, refusal = made.decide(5.0, ns(0.14))
    assert not starts
    assert refusal is not None
    made.note_heartbeat(ns(0.2), OPERATIONAL)
    assert made.decide(5.0, ns(0.22)) == (False, None)
    assert made.fault is None


def test_an_output_that_does_not_start_again():
    made = output()
    made.stopped()
    t = 0.04
    while made.fault is None and t < 3.0:
        made.note_heartbeat(ns(t), PRE_OPERATIONAL)
        made.decide(0.0, ns(t))
        t += 0.02
    assert 1.0 < t < 1.2
    assert "does not become operational again" in made.fault
    made.stopped()
    assert made.decide(0.0, ns(t)) == (False, None), "it is not started again"
    assert made.decide(5.0, ns(t)).refusal is not None


@pytest.mark.parametrize(
    ("state", "sentence"),
    [(BOOTED, "has started anew"), (STOPPED, "is stopped, no longer"), (PRE_OPERATIONAL, "is pre-operational")],
)
def test_heartbeats_that_end_an_output(state, sentence):
    made = output()
    made.note_heartbeat(ns(0.05), state)
    assert made.fault.startswith(f"motor {sentence}")


def test_what_an_output_does_for_our_silence_is_no_fault():
    made = output()
    made.note_emergency(ns(0.53), Emergency(0x8130, 0x11))
    made.note_heartbeat(ns(0.6), STOPPED)
    assert made.fault is None
    assert made.decide(0.0, ns(0.62)).starts
    made = output()
    made.note_emergency(ns(0.1), Emergency(0x8130, 0x11))
    assert made.fault.startswith("motor reports emergency 0x8130")


def test_an_output_that_is_silent():
    made = output()
    made.note_heartbeat(ns(0.1), OPERATIONAL)
    made.judge_silence(ns(0.44))
    assert made.fault is None
    made.judge_silence(ns(0.46))
    assert made.fault.startswith("motor is silent: its last heartbeat is 0.36 s old")
