"""What is recorded and changes nothing is no sign of an effect."""

from dataclasses import replace

import numpy as np

from sim_devices import concealed
from sim_devices.concealed.cases.bystanders import WARMING, WITH_NEIGHBOUR, WITH_THERMOMETER
from sim_devices.concealed.cases.definition import history, thrust_of

DRAWN = 120


SHORT = {"duration": 60.0, "sampling": 20.0}


def _drawn(*effects, of=DRAWN, **chosen):
    return [concealed.case(np.random.default_rng([7, i]), effects, **SHORT, **chosen) for i in range(of)]


def _neighbours(case):
    (found,) = concealed.rows(case)
    return [c for c in found.columns if c.thruster == "neighbour"]


def test_clean_recordings_hold_neighbours_and_thermometers_at_random():
    cases = _drawn()
    neighbours = sum(bool(case.decoys.get("thruster_interaction")) for case in cases)
    thermometers = [case for case in cases if any(s.quantity == "water_temperature" for s in case.sensors)]
    warmed = sum(case.temperature_drift != 0.0 for case in thermometers)
    assert abs(neighbours - WITH_NEIGHBOUR * DRAWN) < 4 * np.sqrt(WITH_NEIGHBOUR * DRAWN)
    assert abs(len(thermometers) - WITH_THERMOMETER * DRAWN) < 4 * np.sqrt(WITH_THERMOMETER * DRAWN)
    assert 0 < warmed < len(thermometers)
    assert abs(warmed - WARMING * len(thermometers)) < 4 * np.sqrt(WARMING * len(thermometers))
    assert all(case.temperature_drift == 0.0 for case in cases if case not in thermometers)


def test_a_neighbour_that_stands_by_is_recorded_and_takes_no_thrust():
    case = next(case for case in _drawn() if "thruster_interaction" in case.decoys)
    (column,) = _neighbours(case)
    assert set(np.unique(column.value)) == {0.0, round(case.scale.voltage, 1)}
    alone = replace(case, decoys={}, temperature_drift=0.0)
    run = case.runs[0]
    np.testing.assert_array_equal(thrust_of(case, run, history(case, run)), thrust_of(alone, run, history(alone, run)))


def test_an_effect_has_what_it_needs_and_no_bystander_of_that_kind():
    for case in _drawn("thruster_interaction", of=5, strength=40.0):
        assert "thruster_interaction" not in case.decoys
        assert len(_neighbours(case)) == 1
    for case in _drawn("heating", of=40, strength=40.0):
        assert case.temperature_drift == 0.0


def test_named_channels_and_lies_have_no_bystanders():
    for chosen in ({"channels": ["current"]}, {"lie": "frozen"}):
        for case in _drawn(**chosen):
            assert "thruster_interaction" not in case.decoys
            assert "water_temperature" not in [s.quantity for s in case.sensors]
