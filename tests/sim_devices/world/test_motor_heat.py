"""A motor that warms, and what a sagging source takes: each against its balance, solved by scipy or written out."""

import numpy as np
import pytest
from scipy.optimize import brentq

from sim_devices.tables import WorldError
from sim_devices.world import World, read_world
from sim_devices.world.sweep import sweep

TOP = 20.0
"""V_max."""
DT = 0.01
DRAG, B = 0.25, 7.2
THRUSTER = {"C": 0.4, "rotor": "instant", "rate_per_volt": 1.5, "drag": DRAG, "torque_acceleration": B}
LOSS = DRAG * 1.5**2 / B
"""1/V for each ohm: R I = R LOSS e^2."""


def settled(volts, effects, heating=0.0, heating_time=0.5, seconds=8.0):
    """The last moment of a long hold at `volts`; the winding is then `heating` I^2 warmer."""
    thruster = {**THRUSTER, "heating": heating, "heating_time": heating_time}
    settings = read_world({"thrusters": {"T": thruster}, "effects": effects})
    n = round(seconds / DT)
    return sweep(settings, DT, np.full(n, volts), np.zeros(n), np.full(n, 18.0))


def fifth():
    """ohm of a winding that takes a fifth of V_max when cold: e = 0.8 V_max, R LOSS e^2 = 0.2 V_max."""
    return 0.2 * TOP / (LOSS * (0.8 * TOP) ** 2)


def warmed(volts, kelvin, **effect):
    """Thrust of a motor that `kelvin` have warmed over that of the same motor cold."""
    cold = {"winding_resistance": {"resistance": effect["resistance"]}} if "resistance" in effect else {}
    before = settled(volts, cold)
    both = {**cold, "heating": {"time_constant": 0.01, **effect}}
    # the rise is heating I^2: heating so chosen that it comes out as asked
    scale = brentq(lambda c: settled(volts, both, heating=c).motor_rise[-1] - kelvin, 1e-9, 100.0 * kelvin, xtol=1e-9)
    after = settled(volts, both, heating=scale)
    return after.reading[-1] / before.reading[-1], after.current[-1] / before.current[-1]


def test_hot_copper_costs_what_the_table_of_the_field_says():
    """-4.9 % at V_max and -0.9 % at a tenth of it for 40 K where the winding takes a fifth of V_max."""
    high, _ = warmed(TOP, 40.0, resistance=fifth())
    low, _ = warmed(0.1 * TOP, 40.0, resistance=fifth())
    assert (high - 1.0, low - 1.0) == pytest.approx((-0.049, -0.009), abs=5e-4)


@pytest.mark.parametrize("order", [("winding_resistance", "heating"), ("heating", "winding_resistance")])
def test_of_what_is_in_series_the_copper_alone_warms(order):
    """0.3 ohm in series, 0.1 of it copper that warms: V = e + (0.3 + 0.1 copper dT) LOSS e^2, thrust goes as e^2."""
    kinds = {"winding_resistance": {"resistance": 0.3}, "heating": {"resistance": 0.1, "copper": 0.004}}
    after = settled(TOP, {name: kinds[name] for name in order}, heating=0.3)
    rise = after.motor_rise[-1]
    loss = (0.3 + 0.1 * 0.004 * rise) * LOSS
    e = brentq(lambda e: e + loss * e * e - TOP, 0.0, TOP)
    assert rise > 5.0
    assert after.reading[-1] == pytest.approx(0.4 * e * e, rel=1e-6)


def test_hot_magnets_let_a_voltage_fed_motor_turn_faster_and_draw_more():
    """+2.2 % for 20 K where the winding takes a fifth, +4 % where it takes a fiftieth."""
    thrust, current = warmed(TOP, 20.0, resistance=fifth(), copper=0.0, magnet=0.0011, form="both")
    assert thrust - 1.0 == pytest.approx(0.022, abs=5e-4)
    assert current == pytest.approx(thrust / (1.0 - 0.0011 * 20.0), rel=1e-6)
    fiftieth = 0.02 * TOP / (LOSS * (0.98 * TOP) ** 2)
    light, _ = warmed(TOP, 20.0, resistance=fiftieth, copper=0.0, magnet=0.0011, form="both")
    assert light - 1.0 == pytest.approx(0.043, abs=5e-4)
    without, _ = warmed(TOP, 20.0, magnet=0.0011, form="magnet")
    assert without == pytest.approx((1.0 - 0.022) ** -2, rel=1e-6)


@pytest.mark.parametrize("volts", [TOP, 7.0, -13.0, 0.5])
def test_the_hot_motor_is_at_the_root_of_its_balance(volts):
    """V = k_e (1 - b dT) n + R (1 + a dT) I with I k_t (1 - b dT) = Q(n): all three of them as the world has them."""
    resistance, copper, magnet = 0.4, 0.0039, 0.0011
    heating = {"resistance": resistance, "magnet": magnet, "form": "both", "time_constant": 0.5}
    h = settled(
        volts, {"winding_resistance": {"resistance": resistance}, "heating": heating}, heating=0.2, seconds=15.0
    )
    rise = 0.2 * h.current[-1] ** 2
    assert h.motor_rise[-1] == pytest.approx(rise, rel=1e-6)
    flux, ohm = 1.0 - magnet * rise, resistance * (1.0 + copper * rise)
    k = THRUSTER["rate_per_volt"]

    def left(n):
        return abs(volts) - flux * n / k - ohm * DRAG * n * n / (B * flux)

    assert abs(h.n[-1]) == pytest.approx(brentq(left, 0.0, 2.0 * k * abs(volts)), rel=1e-7)
    assert h.current[-1] == pytest.approx(DRAG * h.n[-1] * abs(h.n[-1]) / (B * flux), rel=1e-9)


def test_a_cold_motor_is_the_baseline():
    cold = settled(TOP, {"heating": {"resistance": 0.5, "magnet": 0.001, "form": "both"}}, heating=0.0)
    assert np.max(np.abs(cold.reading - 0.4 * TOP**2)) < 1e-9


def test_the_live_world_warms_as_the_sweep_does():
    effects = {"heating": {"resistance": 0.4, "magnet": 0.0011, "form": "both", "time_constant": 2.0}}
    thruster = {**THRUSTER, "heating": 0.2, "heating_time": 1.0}
    world = World(read_world({"thrusters": {"T": thruster}, "effects": effects}), np.random.default_rng(1))
    for _ in range(8000):
        world.step(1e-3, TOP)
    told = settled(TOP, effects, heating=0.2, heating_time=1.0)
    assert world.state.n == pytest.approx(told.n[-1], rel=1e-4)
    assert world.state.current == pytest.approx(told.current[-1], rel=1e-3)
    driven = {"thrusters": {"T": {**thruster, "rotor": "servo"}}, "effects": effects}
    servo = World(read_world(driven), np.random.default_rng(1))
    for _ in range(8000):
        servo.step(1e-3, TOP)
    assert servo.state.n == pytest.approx(told.n[-1], rel=1e-4)


def test_the_sweep_passes_until_magnets_that_make_themselves_hotter_stand_still():
    """As (1 - m)^-6: cold they would lose 5.5 % here; at rest m (1 - m)^6 = 0.055."""
    cold = (DRAG * (THRUSTER["rate_per_volt"] * TOP) ** 2 / B) ** 2
    effects = {"heating": {"magnet": 0.055 / cold, "form": "magnet", "time_constant": 2.0}}
    told = settled(TOP, effects, heating=1.0, heating_time=1.0, seconds=150.0)
    lost = brentq(lambda m: m * (1.0 - m) ** 6 - 0.055, 0.0, 1.0 / 7.0)
    assert 1.0 - told.flux[-1] == pytest.approx(lost, rel=1e-3)
    assert lost > 0.1


@pytest.mark.parametrize(
    ("effect", "sentence"),
    [
        ({}, "resistance must be above zero"),
        ({"form": "magnet"}, "magnet must be above zero"),
        ({"form": "oil", "resistance": 1.0}, "form must be one of winding, magnet, both"),
        ({"loss_per_kelvin": 0.001}, "loss_per_kelvin"),
    ],
)
def test_heat_that_cannot_be(effect, sentence):
    with pytest.raises(WorldError, match=sentence):
        read_world({"thrusters": {"T": THRUSTER}, "effects": {"heating": effect}})


def lost(volts, effects):
    """Share of the voltage that does not come to the rotor."""
    return 1.0 - settled(volts, effects).n[-1] / (THRUSTER["rate_per_volt"] * volts)


def test_a_sag_behind_a_switching_drive_goes_with_the_third_power_and_a_winding_with_the_first():
    sag = {"supply_sag": {"source_resistance": 0.02}}
    winding = {"winding_resistance": {"resistance": 0.0005}}
    assert lost(TOP / 2.0, sag) / lost(TOP, sag) == pytest.approx(1.0 / 8.0, rel=0.02)
    assert lost(TOP / 2.0, winding) / lost(TOP, winding) == pytest.approx(1.0 / 2.0, rel=0.02)


def test_the_source_gives_the_power_that_the_motor_takes_copper_and_all():
    """At the terminals: what the winding turns to heat comes from the supply as well."""
    effects = {"supply_sag": {"source_resistance": 0.3}, "winding_resistance": {"resistance": 0.4}}
    h = settled(TOP, effects)
    at_rotor = h.n[-1] / THRUSTER["rate_per_volt"] * h.current[-1]
    assert h.bus_voltage[-1] * h.input_current[-1] == pytest.approx(at_rotor + 0.4 * h.current[-1] ** 2, rel=1e-5)
    duty = TOP / 48.0  # the motor sees the source as duty^2 times its resistance
    assert h.terminals[-1] == pytest.approx(TOP - duty**2 * 0.3 * h.current[-1], rel=1e-5)
