"""Rows of a motor controller: those that live, those that hang, and those that merely repeat themselves."""

import random

import pytest

from drivers.protocols import Sample
from rig.safety.following import Following
from rig.safety.frozen_motor import FrozenMotor, MotorRows
from rig.safety.thrust_rest import ThrustRest

ROWS = MotorRows("motor", 0.02, 0, 1, current_limit=5.0, rest_rate=0.5, max_voltage=24.0)
TICK = 20_000_000


class Wire:
    """Rows of rate and current, 1 rev/s a volt and 0.05 A/V^2, one a tick."""

    def __init__(self, noise=0.0, rows=ROWS):
        self.frozen_motor, self.noise, self.chance = FrozenMotor(rows), noise, random.Random(1)
        self.t_ns, self.row, self.hangs = 0, (0.0, 0.0), False

    def tick(self, volts):
        """The trip of this tick."""
        self.t_ns += TICK
        if not self.hangs:
            step = self.noise and self.chance.choice((-self.noise, 0.0, 0.0, self.noise))
            self.row = (volts + step, 0.05 * volts * abs(volts))
        sample = Sample("motor", self.t_ns, self.row)
        return self.frozen_motor.advance((sample,), volts, self.t_ns * 1e-9)

    def ticks(self, volts):
        """The first trip and the s until it came."""
        for number, one in enumerate(volts, 1):
            if trip := self.tick(one):
                return trip, number * TICK * 1e-9
        return None, None


def ramp(first, last, steps):
    return [first + (last - first) * i / steps for i in range(1, steps + 1)]


def test_rows_of_a_quiet_sensor_may_repeat_themselves_for_ever():
    """Coarse digits, no noise: in a hold nothing changes, and nothing is expected to."""
    wire = Wire()
    assert wire.ticks(ramp(0, 8, 20) + [8.0] * 20_000 + ramp(8, -8, 40) + [-8.0] * 20_000) == (None, None)


def test_rows_at_rest_and_at_0_V_are_not_judged():
    wire = Wire(noise=0.1)
    wire.ticks([6.0] * 200)
    wire.hangs = True
    assert wire.ticks([0.0] * 1000) == (None, None)


def test_noise_that_vanished():
    wire = Wire(noise=0.1)
    assert wire.ticks([6.0] * 500) == (None, None)
    wire.hangs = True
    trip, after = wire.ticks([6.0] * 500)
    assert trip.source == "frozen"
    assert after == pytest.approx(1.0, abs=0.1)


def test_rare_noise_is_given_its_time():
    """A digit that flickers a few times a minute is no reason to expect it every second."""
    wire = Wire()
    for number in range(40):
        wire.noise = 0.1 if number % 2 else 0.0
        wire.row = (0.0, 0.0)
        assert wire.ticks([6.0 + 0.01 * (number % 2)] * 100) == (None, None)
    wire.hangs = True
    trip, after = wire.ticks([wire.row[0]] * 5000)
    assert trip is None or after > 5.0


def test_command_that_moves_without_an_answer():
    wire = Wire()
    wire.ticks([4.0] * 50)
    wire.hangs = True
    trip, after = wire.ticks(ramp(4, 20, 33))  # 24 V/s
    assert "the command moved by" in trip.cause
    assert after <= 0.12


def test_current_is_bounded_by_the_command_while_the_rows_hang():
    """4.05 A at 9 V; at 10 V it would be the 5 A of the limit, which no row will ever show."""
    wire = Wire()
    wire.ticks([9.0] * 50)
    wire.hangs = True
    wire.ticks([9.0] * 3)
    trip, _ = wire.ticks(ramp(9, 11, 50))
    assert "by the command the current may be 5.0" in trip.cause
    assert wire.frozen_motor.trip is trip


def test_rows_that_live_again_are_believed_again():
    wire = Wire()
    wire.ticks([4.0] * 50)
    wire.hangs = True
    assert wire.ticks(ramp(4, 20, 33))[0]
    wire.hangs = False
    assert wire.tick(5.0) is None
    assert wire.frozen_motor.trip is None


@pytest.mark.parametrize("hangs", [False, True])
def test_doubt_sticks_to_rows_that_stood_still(hangs):
    wire, following = Wire(noise=0.1), Following("motor.rotation_rate", 4.0, 0.5)
    wire.ticks([0.0] * 50)
    wire.hangs = hangs
    wire.ticks([0.0] * 100)
    trips = [following.advance(i * 0.02, 5.0, 0.0) for i in range(1, 100)]
    trip = next(trip for trip in trips if trip)
    wire.frozen_motor.doubt(trip)
    assert (wire.frozen_motor.trip is trip) == hangs


def test_no_rate_is_judged_by_no_one_here():
    following = Following("motor.rotation_rate", 4.0, 0.5)
    assert not any(following.advance(i * 0.02, 6.0, None) for i in range(500))


def test_silence_of_the_watchdogs_proof_is_no_drive():
    following = Following("motor.rotation_rate", 4.0, 0.5)
    assert not any(following.advance(1 + i * 0.02, None, 0.0) for i in range(500))


def test_short_holds_add_up():
    """Half a second each, which is too short to be judged by itself."""
    following = Following("motor.rotation_rate", 4.0, 0.5)
    commands = ([0.0] * 50 + [6.0] * 25) * 3
    trips = [following.advance(1 + i * 0.02, volts, 0.0) for i, volts in enumerate(commands)]
    assert not any(trips[:145]), "the second hold ends with tick 149"
    assert any(trips[145:])


def rest(tare, values, now=10.0, hz=100):
    witness = ThrustRest()
    witness.add(tuple((i / hz, value) for i, value in enumerate(tare)))
    witness.tared(tare[-1])
    witness.add(tuple((now - (len(values) - i) / hz, value) for i, value in enumerate(values)))
    return witness


def noisy(mean, n=100):
    chance = random.Random(4)
    return [mean + chance.gauss(0, 0.05) for _ in range(n)]


@pytest.mark.parametrize(
    ("after", "now", "says"),
    [
        (noisy(0.75), 10.0, True),
        (noisy(50.0) + noisy(0.9), 10.0, True),  # creep of 0.3 % of 50 N
        (noisy(50.0), 10.0, False),
        (noisy(50.0) + noisy(6.0), 10.0, False),  # a third of the speed
        (noisy(50.0) + [14.4] * 50, 10.0, None),  # stuck: no witness
        (noisy(50.0) + noisy(0.75), 12.0, None),  # old
        (noisy(50.0) + noisy(0.75) + [float("nan")] * 200, 12.0, None),
    ],
)
def test_thrust_as_a_witness_of_rest(after, now, says):
    assert rest(noisy(0.75), after).judge(now) is says


def test_thrust_without_a_tare_or_with_a_doubtful_one_is_no_witness():
    witness = ThrustRest()
    witness.add(tuple((i / 100, value) for i, value in enumerate(noisy(0.75))))
    assert witness.judge(1.0) is None
    witness.tared(0.75)
    assert witness.judge(1.0) is True
    witness.doubt()
    witness.tared(0.75)
    assert witness.judge(1.0) is None, "the same tare told again is no new one"
    witness.tared(0.8)
    assert witness.judge(1.0) is True
