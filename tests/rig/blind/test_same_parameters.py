"""Parameters that mean the same on both sides: with their true values the catalogue predicts what the world does."""

import numpy as np
import pytest

from identification.mismatch.compare.simulation import Drive, simulate
from identification.physics.term import Scale
from identification.twin import TERMS, Twin, TwinNoise, TwinTerm
from rig.blind.scoring.places import PLACES
from rig.blind.scoring.same_parameters import SAME, true_values
from rig.blind.workers import concealable
from sim_devices.world.settings import read_world
from sim_devices.world.sweep import sweep

TOP, C, K, DRAG, B = 20.0, 0.4, 2.0, 0.25, 7.2
AMPERES = DRAG * (K * TOP) ** 2 / B
SCALE = Scale(TOP, "V", C * TOP**2, 300.0, 0.01, 1.0, 170.0)
THRUSTER = {"C": C, "rotor": "instant", "rate_per_volt": K, "drag": DRAG, "torque_acceleration": B}


def sealed(channels=(), **effects):
    """Of several effects at once, with a motor whose cold current at the largest voltage would warm it by 40 K."""
    return {
        "effects": [{"effect": e, "parameters": p} for e, p in effects.items()],
        "scale": {"rate": K * TOP, "voltage": TOP, "current": AMPERES, "thrust": C * TOP**2},
        "thruster": {"heating": 40.0 / AMPERES**2, "heating_time": 30.0},
        "channels": list(channels),
    }


def thrusts(effect, form, parameters, volts, seconds=3.0, **others):
    """N, of the world and of the catalogue with the world's values, on a hold at `volts`."""
    truth, n = sealed(**{effect: parameters}), round(seconds / 0.01)
    settings = read_world(
        {
            "thrusters": {"T": THRUSTER | truth["thruster"]},
            "effects": {e["effect"]: e["parameters"] for e in truth["effects"]},
        }
    )
    world = sweep(settings, 0.01, np.full(n, volts), np.zeros(n), np.full(n, 18.0)).reading
    values = true_values(effect, form, truth)
    assert set(values) == {p.name for p in TERMS[effect, form].parameters(SCALE)}
    quiet = TwinNoise(0.0, 0.0, (), (), (), ())
    terms = (TwinTerm(effect, form, values, SCALE),)
    twin = Twin("T", "command_voltage", C, terms, (), quiet, (), 0.01, TOP, K)
    beside = {name: (np.array([0.0, seconds]), np.full(2, value)) for name, value in others.items()}
    drive = Drive(np.array([0.0]), np.array([volts]), others=beside)
    return world, simulate(twin, drive, np.arange(0.0, seconds - 0.005, 0.01)).thrust


def test_what_is_compared_is_an_effect_of_the_world_and_has_a_place():
    known = set(concealable().effects)
    assert set(SAME) <= known
    assert known == set(PLACES)
    told = sealed(cavitation={"form": "linear", "slope": 0.1, "onset": 12.0})
    assert true_values("cavitation", "linear", told) == {"slope": 0.2, "onset": 6.0}


@pytest.mark.parametrize("volts", [20.0, 6.0, -13.0])
@pytest.mark.parametrize("neighbour", [C * TOP**2, 40.0, -40.0])
def test_a_neighbour_s_loss_is_that_of_the_world(volts, neighbour):
    jet = {"loss": 0.3, "neighbour_thrust": neighbour, "period": 60.0, "on_time": 60.0}
    world, told = thrusts("thruster_interaction", "", jet, volts, neighbour_thrust=neighbour)
    assert told == pytest.approx(world, rel=1e-9)


@pytest.mark.parametrize("volts", [20.0, 6.0])
@pytest.mark.parametrize("reference", [12.0, 20.0])
def test_a_water_column_s_time_is_that_of_the_world(volts, reference):
    column = {"form": "momentum", "share": 0.3, "time_constant": 0.4, "reference_voltage": reference}
    world, told = thrusts("inflow_dynamics", "momentum", column, volts)
    assert told[1:] == pytest.approx(world[1:], rel=5e-3)
    assert world[1] > 1.2 * world[-1]
    assert true_values("inflow_dynamics", "", sealed(inflow_dynamics=column)) == {}


def test_what_hot_copper_costs_at_full_is_that_of_the_world():
    world, told = thrusts(
        "heating", "winding", {"form": "winding", "resistance": 0.1, "time_constant": 50.0}, TOP, 300.0
    )
    assert told[-1] == pytest.approx(world[-1], rel=1e-4)
    assert world[-1] < 0.98 * world[0]
    assert np.max(np.abs(told - world)) < 0.1 * (world[0] - world[-1]), "and it takes as long"


@pytest.mark.parametrize("winding", [None, 0.02, 0.3])
def test_a_kelvin_costs_what_the_first_one_costs_the_world(winding):
    """Beside a winding resistance that is all that is in series; of 0.02 ohm the truth was stated 30 % too small."""
    copper = {"form": "winding", "resistance": 0.1, "time_constant": 50.0}
    cold = {} if winding is None else {"winding_resistance": {"resistance": winding}}
    (per_kelvin,) = true_values("heating", "measured_winding", sealed(heating=copper, **cold)).values()

    def reading(kelvins):
        thruster = THRUSTER | {"heating": kelvins / AMPERES**2, "heating_time": 1.0}
        settings = read_world({"thrusters": {"T": thruster}, "effects": {"heating": copper} | cold})
        return sweep(settings, 0.01, np.full(1000, TOP), np.zeros(1000), np.full(1000, 18.0))

    warm, cool = reading(0.1), reading(1e-9)
    assert (1.0 - warm.reading[-1] / cool.reading[-1]) / warm.motor_rise[-1] == pytest.approx(per_kelvin, rel=1e-3)


def test_of_warm_magnets_only_what_a_thermometer_tells_is_the_same():
    magnet = sealed(heating={"form": "magnet", "magnet": 0.001, "time_constant": 50.0})
    assert true_values("heating", "measured_magnet", magnet) == {
        "magnet_time_constant": 50.0,
        "flux_loss_per_kelvin": 0.001,
    }
    assert true_values("heating", "magnet", magnet) == {}
    both = sealed(heating={"form": "both", "magnet": 0.001, "resistance": 0.1, "time_constant": 50.0})
    assert true_values("heating", "winding_and_magnet", both) == {"magnet_time_constant": 50.0, "time_constant": 30.0}
    assert true_values("heating", "measured_winding_and_magnet", both) == {"magnet_time_constant": 50.0}
    assert true_values("heating", "winding", both) == true_values("heating", "magnet", both) == {}
    copper = {"form": "winding", "resistance": 0.1, "time_constant": 50.0}
    assert true_values("heating", "winding", sealed(["current"], heating=copper)) == {"time_constant": 30.0}


def test_an_order_of_the_rotor_has_its_size_at_the_speed_that_the_finding_says():
    line = {"amplitude": 0.3, "blades": 4, "reference_voltage": TOP, "phase": 0.0}
    told, orders = sealed(periodic_disturbance=line), {"periods_per_turn": 4.0, "periods_per_volt_second": 4.0 * K}
    at_rate = {"growth": 2.0, "at_speed": 30.0, "periods_per_turn": 4.0}
    force = true_values("periodic_disturbance", "rotation", told, at_rate)
    assert force == orders | {"amplitude": pytest.approx(0.3 * (30.0 / (K * TOP)) ** 2)}
    at_volts = {"growth": 2.0, "at_speed": 15.0, "periods_per_volt_second": 8.0}
    assert true_values("periodic_disturbance", "rotation", told, at_volts) == force
    assert true_values("periodic_disturbance", "rotation", told, {"periods_per_turn": 4.0}) == orders, "of one size"
    rings = sealed(periodic_disturbance=line | {"resonance": 40.0})
    assert true_values("periodic_disturbance", "rotation", rings, at_rate) == orders
    stand = sealed(periodic_disturbance=line, stand_resonance={"frequency": 9.0, "damping": 0.1})
    assert true_values("periodic_disturbance", "rotation", stand, at_rate) == orders
    assert true_values("periodic_disturbance", "fixed", told) == {}
    mains = sealed(periodic_disturbance={"amplitude": 0.3, "frequency": 50.0})
    assert true_values("periodic_disturbance", "fixed", mains) == {"amplitude": 0.3, "frequency": 50.0}
    assert true_values("periodic_disturbance", "rotation", mains) == {}


@pytest.mark.parametrize("form", ["hard", "before_noise", "averaged"])
def test_a_limit_is_the_same_wherever_the_noise_comes_in_and_a_soft_one_is_none(form):
    for where in ({}, {"place": "cell"}):
        assert true_values("load_cell_saturation", form, sealed(load_cell_saturation={"limit": 40.0} | where)) == {
            "limit": 40.0
        }
    soft = sealed(load_cell_saturation={"limit": 40.0, "form": "soft"})
    assert true_values("load_cell_saturation", form, soft) == {}
    assert true_values("load_cell_saturation", "knee", sealed(load_cell_saturation={"limit": 40.0})) == {}


def test_what_the_cold_winding_takes_is_that_of_the_world():
    """V = e + w e^2 at the largest command, at which the drive makes up for the cold drop: e is the command."""
    winding = {"form": "winding", "resistance": 0.6, "time_constant": 50.0}
    w = 0.6 * AMPERES / TOP**2
    for form in ("own_winding", "measured_own_winding"):
        assert true_values("heating", form, sealed(heating=winding))["cold_loss"] == pytest.approx(
            w * TOP / (1 + w * TOP)
        )
