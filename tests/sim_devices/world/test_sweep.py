"""A whole run at once is the same physics as the world stepped: two forms of every effect that referee each other."""

import numpy as np
import pytest

from sim_devices.tables import WorldError
from sim_devices.world import World, read_world
from sim_devices.world.effects import EFFECTS
from sim_devices.world.effects.channel import KINDS, ChannelFault
from sim_devices.world.effects.uncatalogued import UNCATALOGUED
from sim_devices.world.filters import play
from sim_devices.world.history import clock
from sim_devices.world.sweep import sweep
from tests.sim_devices.world.test_world import SHOWN

DT = 2e-3
T = clock(8000, DT)
COMMAND = np.array([0.0, 18.0, 4.0, -18.0, 0.5, 0.0])[np.searchsorted([2.0, 6.0, 8.0, 12.0, 14.0], T, side="right")]
FLOW = np.where(T < 9.0, 0.5, -0.3)

OUTSIDE = {
    "gain_step": {"amount": 0.1, "start": 5.0},
    "reversed_flow_loss": {"amount": 0.1},
    "crossed_flow_loss": {"amount": 0.1},
    "temperature_squared": {"amount": 0.1, "reference": 18.0, "span": 1.0},
    "gain_wave": {"amount": 0.1, "period": 10.0},
    "level_bump": {"amount": 0.1, "rate": 18.0, "width": 2.0},
    "upsweep_loss": {"amount": 0.1},
    "wall_effect": {"amount": 0.1, "rate": 15.0, "width": 1.0},
    "fouling": {"amount": 0.1, "start": 5.0, "time_constant": 4.0},
    "thermal_derating": {"amount": 0.1, "limit": 0.1},
    "aeration_pulses": {"amount": 0.1, "period": 3.0001, "length": 1.0},
}
OTHER_FORMS = [
    ("motor_lag", {"time_constant": 0.2, "form": "quadratic"}),
    ("dead_band", {"half_width": 0.9, "form": "jump"}),
    ("cavitation", {"onset": 15.0, "slope": 0.05, "form": "square"}),
    ("recirculation", {"coefficient": 0.02, "time_constant": 5.0, "form": "thrust"}),
    ("heating", {"magnet": 0.01, "form": "magnet", "time_constant": 5.0}),
    ("periodic_disturbance", {"amplitude": 0.5, "blades": 3, "phase": 1.0}),
    ("torque_crosstalk", {"coefficient": 0.01, "form": "torque"}),
    ("load_cell_creep", {"share": 0.02, "time_constant": 3.0, "share_2": 0.02, "time_constant_2": 20.0}),
    ("zero_drift", {"amplitude": 1.0, "time_constant": 5.0}),
    ("zero_drift", {"root": 0.5}),
    ("dead_band", {"half_width": 0.9, "form": "smooth"}),
    ("command_saturation", {"limit": 12.0, "form": "soft"}),
    ("command_saturation", {"onset": 10.0, "form": "knee", "bend": 0.2}),
    ("winding_resistance", {"resistance": 0.1, "form": "linearised"}),
    ("motor_lag", {"time_constant": 0.2, "form": "two_lags"}),
    ("cavitation", {"onset": 15.0, "slope": 0.05, "form": "exponential"}),
    ("recirculation", {"coefficient": 0.02, "time_constant": 5.0, "form": "late", "delay": 1.5}),
    ("load_cell_saturation", {"limit": 100.0, "form": "soft"}),
    ("load_cell_saturation", {"onset": 80.0, "form": "knee", "bend": 0.02}),
    ("recirculation", {"coefficient": 0.02, "time_constant": 5.0, "form": "circuit"}),
    ("heating", {"resistance": 0.3, "copper": 0.05, "magnet": 0.01, "form": "both", "time_constant": 5.0}),
    ("exponent", {"exponent": 2.0 / 3.0, "form": "drive"}),
    ("inflow_dynamics", {"share": 0.3, "time_constant": 0.4, "form": "momentum"}),
    ("periodic_disturbance", {"amplitude": 0.5, "blades": 2, "resonance": 30.0, "damping": 0.1}),
    ("load_cell_saturation", {"limit": 100.0, "place": "cell"}),
]
SLOWER = {
    "stand_resonance": {"frequency": 2.0, "damping": 0.05},
    "periodic_disturbance": {"amplitude": 0.5, "frequency": 0.5},
}  # DT is then a small part of a period
ALL = [*((name, p) for name, p in {**SHOWN, **OUTSIDE, **SLOWER}.items() if name != "channel_fault"), *OTHER_FORMS]


def world_of(effects):
    thrusters = {"T": {"C": 0.4, "rotor": "instant", "rate_per_volt": 1.1, "heating_time": 10.0}}
    return read_world({"thrusters": thrusters, "tunnel": {"temperature_drift": 0.1}, "effects": effects})


def swept(effects):
    return sweep(world_of(effects), DT, COMMAND, FLOW, 18.0 + 0.1 * T)


def stepped(effects):
    """The reading after each step."""
    world = World(world_of(effects), np.random.default_rng(1))
    world.state.t = -DT  # the first step ends at the first point of the grid
    readings = np.empty(T.size)
    for i, (volts, flow) in enumerate(zip(COMMAND.tolist(), FLOW.tolist(), strict=True)):
        world.state.flow = flow
        world.step(DT, volts)
        readings[i] = world.state.reading
    return readings


def test_every_effect_outside_the_catalogue_is_tried_here():
    assert set(OUTSIDE) == set(UNCATALOGUED)
    assert not set(EFFECTS) & set(UNCATALOGUED)


def test_a_clean_sweep_is_c_v_v_and_nothing_else():
    h = swept({})
    assert np.max(np.abs(h.reading - 0.4 * COMMAND * np.abs(COMMAND))) < 1e-12
    assert np.array_equal(h.n, 1.1 * COMMAND)
    assert set(h.bus_voltage.tolist()) == {48.0}


@pytest.mark.parametrize(("name", "parameters"), ALL)
def test_an_effect_is_the_same_stepped_and_at_once(name, parameters):
    clean, whole, steps = swept({}).reading, swept({name: parameters}).reading, stepped({name: parameters})
    size = np.sqrt(np.mean((whole - clean) ** 2))
    assert size > 0.01 or name == "load_cell_saturation"
    # a sweep's command changes halfway between points, the stepped world's at the point before: DT/2 of each transient
    assert np.sqrt(np.mean((whole - steps) ** 2)) < 0.04 * size + 1e-9


def test_a_sag_stands_still_and_moves_the_bus():
    h = swept({"supply_sag": {"source_resistance": 0.5, "discharge": 0.01}})
    held = (T > 4.0) & (T < 5.9)
    drawn = np.cumsum(h.input_current)[held] * DT
    assert np.allclose(h.bus_voltage[held], 48.0 - 0.5 * h.input_current[held] - 0.01 * drawn, atol=0.01)
    assert np.allclose(h.volts[held], 18.0 * h.bus_voltage[held] / 48.0, atol=1e-4)


def test_a_drive_that_makes_up_for_the_sag_leaves_the_thrust_alone():
    h = swept({"supply_sag": {"source_resistance": 0.5, "exponent": 0.0}})
    assert np.min(h.bus_voltage) < 47.0
    assert np.array_equal(h.reading, swept({}).reading)


def test_the_quadratic_lag_rests_at_k_v_and_passes_through_zero():
    h = swept({"motor_lag": {"time_constant": 0.05, "form": "quadratic"}})
    assert h.n[T < 6.0][-1] == pytest.approx(1.1 * 18.0, rel=1e-9)
    assert np.all(np.diff(h.n[(T > 8.0) & (T < 12.0)]) <= 1e-9)


def test_the_lags_answer_a_step_as_their_equations_say():
    for form, after in (("first_order", 1.0 - np.exp(-1.0)), ("quadratic", np.tanh(1.0 * 18.0 / (2.0 * 12.0)))):
        n = swept({"motor_lag": {"time_constant": 0.5, "form": form, "reference_voltage": 12.0}}).n
        at = np.searchsorted(T, 2.0 + 0.5 - DT / 2.0)
        assert n[at] == pytest.approx(1.1 * 18.0 * after, rel=0.01)


def test_play_is_half_its_width_behind():
    values = np.concatenate([np.linspace(0, 10, 50), np.linspace(10, -10, 50)])
    y = play(values, 1.0)
    assert y[49] == pytest.approx(9.0)
    assert y[-1] == pytest.approx(-9.0)
    assert np.max(np.abs(values - y)) <= 1.0 + 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_a_lie_is_the_same_sample_by_sample_and_at_once(kind):
    h = swept({})
    told = {"channel": "thrust", "kind": kind, "factor": 0.3, "start": 3.0, "duration": 7.0}
    whole, one = ChannelFault(**told), ChannelFault(**told)
    world = World(world_of({}), np.random.default_rng(1))
    singly = []
    for t, value in zip(T.tolist(), h.reading.tolist(), strict=True):
        world.state.t = t
        singly.append(one.apply(value, world.state, 0.0))
    assert np.array_equal(whole.over(h.reading, h), np.array(singly), equal_nan=True)


def test_a_rotor_that_is_not_known():
    with pytest.raises(WorldError, match="rotor must be one of servo, instant"):
        read_world({"thrusters": {"T": {"C": 0.4, "rotor": "slow"}}})
