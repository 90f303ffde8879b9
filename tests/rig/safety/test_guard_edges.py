"""The guard exactly at its limits, and what it takes for granted where nothing is said: mutants of it survived here."""

from dataclasses import replace

import pytest

from rig.campaign.limits import GuardedChannel
from rig.safety.guard import MIN_LATENESS, Allowances, Latest, Recorder, Trip, Vitals, allowances, check

THRUST = GuardedChannel("load_cell.thrust", "N", 0.25, -300.0, 300.0, max_frozen=4.0)
VITALS = Vitals(now=10.0, started=0.0)
ALLOWED = Allowances()


def ask(newest: Latest | None = None, watch: GuardedChannel = THRUST, **vitals) -> Trip | None:
    return check((watch,), {watch.channel: newest or Latest(1.0, 10.0)}, replace(VITALS, **vitals), ALLOWED)


@pytest.mark.parametrize(
    ("at_limit", "beyond", "source"),
    [
        ({"slept": ALLOWED.lateness}, {"slept": 0.26}, "slept"),
        ({"lateness": ALLOWED.lateness}, {"lateness": 0.26}, "late"),
        ({"lease_age": ALLOWED.lease_age}, {"lease_age": 2.01}, "lease"),
        ({"newest": Latest(1.0, 9.75)}, {"newest": Latest(1.0, 9.74)}, "stale"),
        (
            {"newest": Latest(1.0, 10.0, 4.0), "driven": 9.0},
            {"newest": Latest(1.0, 10.0, 4.01), "driven": 9.0},
            "frozen",
        ),
        (
            {"newest": Latest(1.0, 10.0, 9.0), "driven": 4.0},
            {"newest": Latest(1.0, 10.0, 9.0), "driven": 4.01},
            "frozen",
        ),
        (
            {"recorder": Recorder(free_bytes=64 * 2**20)},
            {"recorder": Recorder(free_bytes=64 * 2**20 - 1)},
            "recorder",
        ),
        ({"recorder": Recorder(silence=15.0)}, {"recorder": Recorder(silence=15.01)}, "recorder"),
    ],
)
def test_at_its_limit_a_value_passes_and_beyond_it_not(at_limit, beyond, source):
    assert ask(**at_limit) is None
    trip = ask(**beyond)
    assert trip is not None
    assert (trip.source, trip.kind, trip.time) == (source, "cut", 10.0)


def test_a_machine_that_slept_says_for_how_long():
    trip = ask(slept=31.25)
    assert trip is not None
    assert (trip.cause, trip.value, trip.limit) == (
        "this machine slept for 31.2 s; look at the bench, then start anew",
        31.25,
        MIN_LATENESS,
    )


def test_a_pressed_emergency_stop_names_what_released_is():
    button = GuardedChannel("button.emergency_stop", "1", 0.25, stops=True)
    assert ask(Latest(0.0, 10.0), button) is None
    trip = ask(Latest(1.0, 10.0), button)
    assert trip is not None
    assert (trip.value, trip.limit, trip.channel) == (1.0, 0.0, "button.emergency_stop")


@pytest.mark.parametrize(
    ("rate", "timeout", "lateness"),
    [
        (50.0, None, 0.25),
        (10.0, None, 0.5),
        (50.0, 0.5, 0.25),
        (50.0, 0.2, 0.18),
        (50.0, 0.01, 0.02),
        (10.0, 0.4, 0.3),
        (10.0, 0.05, 0.1),
    ],
)
def test_lateness_ends_a_period_before_the_motor_lets_go(rate, timeout, lateness):
    """A motor that was let go would be driven again without having been armed."""
    assert allowances(rate, timeout).lateness == pytest.approx(lateness)


def test_what_is_not_said_is_no_time():
    assert (VITALS.lateness, VITALS.driven, VITALS.slept, Recorder().silence) == (0.0, 0.0, 0.0, 0.0)
    assert (Latest(1.0, 10.0).same, Recorder().failed, VITALS.ledger_error) == (0.0, "", "")
