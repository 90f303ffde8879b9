"""Dead weights on the stand of the simulated world, and what its cell makes of them."""

import numpy as np
import pytest

from sim_devices.bench.control import hang
from sim_devices.tables import WorldError
from sim_devices.world import World
from sim_devices.world.hysteresis import Plays
from sim_devices.world.settings import read_world

PLAIN = {"thrusters": {"T": {"C": 0.4}}}


def world(**tables):
    return World(read_world({**PLAIN, **tables}), np.random.default_rng(0))


def reads(made, force, seconds=0.01, volts=0.0):
    made.state.hung = force
    for _ in range(round(seconds / 0.005)):
        made.step(0.005, volts)
    return made.exact("thrust")


def test_a_weight_is_a_load_on_the_cell_and_no_thrust():
    made = world(cell={"gain_error": 0.01, "zero_offset": 0.5})
    assert reads(made, 100.0) == pytest.approx(101.5)
    assert made.state.thrust == 0.0
    assert reads(made, -50.0) == pytest.approx(-50.0)


def test_bends_and_creep_of_the_cell_are_those_of_its_effects():
    made = world(effects={"load_cell_even_bend": {"coefficient": 1e-4}})
    assert (reads(made, 100.0), reads(made, -100.0)) == pytest.approx((101.0, -99.0))
    slow = world(effects={"load_cell_creep": {"share": 0.01, "time_constant": 2.0}})
    assert reads(slow, 100.0) == pytest.approx(100.0, abs=0.02)
    assert reads(slow, 100.0, 20.0) == pytest.approx(101.0, abs=0.01)


def test_temperature_of_gain_and_zero():
    warm = world(
        tunnel={"water_temperature": 28.0},
        cell={"gain_temperature": 1e-4, "zero_temperature": 0.02, "reference_temperature": 18.0},
    )
    assert reads(warm, 200.0) == pytest.approx(200.0 * 1.001 + 0.2)


def test_loops_close_at_their_ends_and_have_the_stated_width():
    plays = Plays(0.3, 200.0)
    course = np.concatenate([np.linspace(0, 200, 401), np.linspace(200, 0, 401)])
    for _ in range(2):  # the first loop begins where no other has
        read = np.array([plays.follow(float(force)) for force in course])
    up, down = read[:401], read[401:][::-1]
    assert up[0] == pytest.approx(down[0], abs=1e-9)
    assert up[-1] == pytest.approx(down[-1], abs=1e-9)
    assert 0.5 * (down - up)[200] == pytest.approx(0.3)
    assert np.all(down - up > -1e-9)


def test_absent_hysteresis_is_exactly_absent():
    assert reads(world(), 123.456) == 123.456
    with pytest.raises(WorldError, match="hysteresis must be at least 0 N"):
        world(cell={"hysteresis": -1.0})


class Bench:
    def __init__(self, made):
        self.world, self.said = made, []

    def log(self, event, **fields):
        self.said.append((event, fields))


def test_nothing_is_hung_on_a_stand_whose_propeller_turns():
    bench = Bench(world())
    hang(bench, 19.6)
    assert (bench.world.state.hung, bench.said) == (19.6, [("hang", {"force": 19.6})])
    reads(bench.world, 0.0, 2.0, volts=8.0)
    with pytest.raises(ValueError, match="stop the motor before a hand comes near"):
        hang(bench, 9.8)
    with pytest.raises(ValueError, match="finite force"):
        hang(bench, float("nan"))
