"""A motor that warms, water that follows and a cell that clips on the simulated bench, as a saved model has them."""

from __future__ import annotations

import numpy as np
import pytest

from sim_devices.tables import WorldError
from sim_devices.world.effects.limit import LoadCellSaturation
from sim_devices.world.settings import read_world
from sim_devices.world.state import State
from sim_devices.world.sweep import sweep
from sim_devices.world.twin import world_of
from tests.rig.diagnose.in_the_world.acted_twins import acted, entry, file_of, told

WARM = [
    ([entry("heating", "winding", 0.1, 20.0)], -0.1),
    ([entry("heating", "own_winding", 0.1, 20.0, 0.33)], -0.1),
    ([entry("heating", "magnet", 0.03, 20.0, 30.0)], 0.97**-2 - 1.0),
    ([entry("heating", "winding_and_magnet", 0.08, 20.0, 0.03, 30.0)], None),
    ([entry("winding_resistance", "", 0.02), entry("heating", "winding", 0.1, 20.0)], -0.1),
    ([entry("winding_resistance", "", 0.02), entry("heating", "magnet", 0.03, 20.0, 30.0)], None),
    ([entry("winding_resistance", "", 0.02), entry("heating", "winding_and_magnet", 0.08, 20.0, 0.03, 30.0)], None),
]


@pytest.mark.parametrize(("terms", "gained"), WARM)
def test_a_motor_that_has_warmed_at_the_largest_voltage_is_the_twin_s(terms, gained):
    twin, world = told(terms, 20.0, 400.0), acted(terms, 20.0, 400.0)
    assert world[-1] == pytest.approx(twin[-1], rel=1e-4)
    assert world[0] == pytest.approx(twin[0], rel=1e-3), "cold"
    assert abs(twin[-1] / twin[0] - 1.0) > 0.01
    if gained is not None:
        assert world[-1] / world[0] - 1.0 == pytest.approx(gained, rel=0.01)
    change = world[-1] - world[0]
    assert np.max(np.abs(world - twin)) < 0.2 * abs(change), "on the way the world's current has changed too"


@pytest.mark.parametrize(
    ("term", "words"),
    [
        (entry("heating", "measured_winding", 0.001), "follows a recorded motor temperature"),
        (entry("heating", "magnet", 0.2, 30.0, 30.0), "lose 20 % of their flux .* would warm without end"),
    ],
)
def test_warmth_that_the_world_cannot_act_is_said(term, words):
    with pytest.raises(WorldError, match=words):
        world_of(file_of(term))


def test_magnets_that_lose_more_than_a_seventh_would_warm_without_end():
    """Without resistance the current goes as (1 - m)^-3, its heat as (1 - m)^-6, and m (1 - m)^6 is largest there."""

    def settled(share, more):
        thruster, effects = world_of(file_of(entry("heating", "magnet", share, 5.0, 5.0)))
        effects["heating"]["magnet"] *= more
        settings = read_world({"thrusters": {"T": thruster}, "effects": effects})
        n = 4000
        return 1.0 - sweep(settings, 0.1, np.full(n, 20.0), np.zeros(n), np.full(n, 18.0)).flux[-1]

    assert settled(0.11, 1.0) == pytest.approx(0.11, abs=1e-4)
    assert settled(0.11, 1.2) > 0.5
    with pytest.raises(WorldError, match="without end"):
        settled(0.145, 1.0)


def test_steps_of_the_water_and_a_clip_before_the_noise_are_the_twin_s():
    water = [entry("inflow_dynamics", "momentum", 0.3, 0.4)]
    assert acted(water, 12.0, 6.0)[1:] == pytest.approx(told(water, 12.0, 6.0)[1:], rel=0.02)
    clipped = world_of(file_of(entry("load_cell_saturation", "before_noise", 40.0)))[1]
    assert clipped == {"load_cell_saturation": {"limit": 40.0, "place": "cell"}}
    clip = world_of(file_of(entry("load_cell_saturation", "hard", 40.0)))[1]
    assert clip == {"load_cell_saturation": {"limit": 40.0, "form": "hard"}}


def test_readings_end_at_the_two_values_of_the_twin():
    stop = [entry("load_cell_saturation", "off_centre_before_noise", 40.0, 3.0)]
    for volts, end in ((12.0, 43.0), (-12.0, -37.0)):
        assert acted(stop, volts, 2.0)[-1] == pytest.approx(end)
        assert told(stop, volts, 2.0)[-1] == pytest.approx(end)
    converter = world_of(file_of(entry("load_cell_saturation", "off_centre", 40.0, 3.0)))[1]["load_cell_saturation"]
    assert converter == {"limit": 40.0, "middle": 3.0, "form": "hard"}
    assert LoadCellSaturation(**converter).apply(-50.0, State(), 0.1) == -37.0
