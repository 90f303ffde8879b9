"""Units by name: each against its definition, and what is asked for where a name does not suffice."""

from math import pi

import numpy as np
import pytest

from rig.errors import ConfigError, RecordingError
from rig.importing.units import conversion, factor_to_si, known_units, seconds
from tests.rig.importing.small_imports import PLAIN, imported, plan, values

POUND, G = 0.45359237, 9.80665
"""kg and m/s^2, exact by definition."""


@pytest.mark.parametrize(
    ("quantity", "unit", "value", "si"),
    [
        ("rotation_rate", "rpm", 60.0, 1.0),
        ("rotation_rate", "RPM", 60.0, 1.0),
        ("rotation_rate", "min⁻¹", 60.0, 1.0),
        ("rotation_rate", "rad/s", 2 * pi, 1.0),
        ("rotation_rate", "Hz", 3.0, 3.0),
        ("thrust", "lbf", 1.0, POUND * G),
        ("thrust", "gf", 1000.0, G),
        ("thrust", "kgf", 1.0, G),
        ("thrust", "mN", 1.0, 1e-3),
        ("thrust", "ozf", 16.0, POUND * G),
        ("torque", "Nm", 2.0, 2.0),
        ("torque", "N·m", 2.0, 2.0),
        ("torque", "mN m", 2.0, 2e-3),
        ("torque", "N-cm", 2.0, 0.02),
        ("torque", "lbf·in", 1.0, POUND * G * 0.0254),
        ("torque", "ft-lb", 1.0, POUND * G * 0.3048),
        ("torque", "kgf cm", 1.0, G / 100),
        ("current", "mA", 1500.0, 1.5),
        ("bus_voltage", "mV", 12000.0, 12.0),
        ("water_temperature", "°C", 20.0, 20.0),
        ("water_temperature", "°F", 212.0, 100.0),
        ("motor_temperature", "K", 273.15, 0.0),
        ("flow_speed", "kn", 1.0, 1852 / 3600),
        ("flow_speed", "mm/s", 10.0, 0.01),
        ("heading", "deg", 180.0, pi),
        ("speed", "deg/s", 180.0, pi),
        ("depth", "ft", 10.0, 3.048),
        ("acceleration", "m/s²", 1.0, 1.0),
        ("acceleration", "g", 1.0, G),
    ],
)
def test_a_unit_is_what_it_is_defined_to_be(quantity, unit, value, si):
    found = conversion(quantity, unit)
    assert found.apply(np.array([value]), {})[0] == pytest.approx(si, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    ("unit", "value", "parameters", "volts"),
    [
        ("µs", 1900.0, {"pulse_stop": 1500, "pulse_span": 400, "nominal_voltage": 16}, 16.0),
        ("ms", 1.3, {"pulse_stop": 1500, "pulse_span": 400, "nominal_voltage": 16}, -8.0),
        ("%", -50.0, {"nominal_voltage": 12}, -6.0),
        ("% duty", 25.0, {"nominal_voltage": 12}, 3.0),
        ("1", 0.5, {"nominal_voltage": 12}, 6.0),
        ("mV", 500.0, {}, 0.5),
    ],
)
def test_a_command_that_is_no_voltage_becomes_one(unit, value, parameters, volts):
    found = conversion("command_voltage", unit)
    assert set(found.needs) <= set(parameters)
    assert found.apply(np.array([value]), parameters)[0] == pytest.approx(volts)


def test_times_have_units_too(tmp_path):
    assert [seconds(unit) for unit in ("s", "ms", "µs", "min", "h")] == [1.0, 1e-3, 1e-6, 60.0, 3600.0]
    _, _, found = imported(tmp_path, "t,f\n0,1\n2,2\n", plan(time={"column": "t", "unit": "h"}))
    assert found["thrust"].time.tolist() == [0.0, 7200.0]
    with pytest.raises(ConfigError, match="time in 'fortnight': not a unit that is known; known are s, sec, seconds"):
        seconds("fortnight")


def test_an_unknown_unit_lists_what_is_known():
    for quantity in ("thrust", "command_voltage", "rotation_rate", "water_temperature"):
        with pytest.raises(ConfigError, match="not a unit that is known for it") as found:
            conversion(quantity, "smoots")
        assert all(name in str(found.value) for name in known_units(quantity))
    with pytest.raises(ConfigError, match=r"did you mean N\.mm"):
        conversion("torque", "N.mmm")
    with pytest.raises(ConfigError, match="or give a number"):
        factor_to_si("smoots")


def channel(**facts):
    return plan(streams={"s": {"channels": {"x": facts}}})


def test_a_unit_stands_beside_factor_sign_and_expressions(tmp_path):
    thrust = {"quantity": "thrust", "unit": "kgf", "column": "f", "factor": 2.0, "offset": 1.0, "sign": -1}
    _, _, found = imported(tmp_path, "t,f\n0,1\n1,2\n", channel(**thrust))
    assert values(found["x"]) == [round(-3 * G, 6), round(-5 * G, 6)]
    assert found["x"].unit == "N"
    assert str(found["x"].calibration["imported_as"]).endswith(", kgf -> N: x 9.80665")
    _, _, found = imported(tmp_path, "t,f\n0,1\n1,2\n", channel(quantity="rotation_rate", unit="rpm", value="60 * f"))
    assert values(found["x"]) == [1, 2]


def test_any_of_takes_units_and_numbers(tmp_path):
    columns = {"load": {"any_of": [["Load (gf)", "gf"], ["Load (N)", 1.0]]}}
    streams = {"s": {"channels": {"x": {"quantity": "thrust", "unit": "N", "value": "load"}}}}
    for header, wanted in (("Load (gf)", G), ("Load (N)", 1000.0)):
        _, _, found = imported(tmp_path, f"t,{header}\n0,1000\n", plan(columns=columns, streams=streams))
        assert values(found["x"]) == [pytest.approx(wanted)]


def test_the_header_may_tell_the_unit(tmp_path):
    facts = {"quantity": "current", "unit": "header", "column": "I [mA]"}
    _, _, found = imported(tmp_path, "t,I [mA]\n0,250\n", channel(**facts))
    assert values(found["x"]) == [0.25]
    with pytest.raises(RecordingError, match="no unit in brackets at the end of 'I'"):
        imported(tmp_path, "t,I\n0,250\n", channel(**{**facts, "column": "I"}))
    with pytest.raises(ConfigError, match="is for a channel whose `column` is a name"):
        imported(tmp_path, "t,I\n0,250\n", channel(**{**facts, "column": 2}))


def test_electrical_speed_needs_the_pole_pairs(tmp_path):
    facts = channel(quantity="rotation_rate", unit="erpm", column="f")
    with pytest.raises(ConfigError, match=r"does not say pole_pairs.*--set pole_pairs=7"):
        imported(tmp_path, "t,f\n0,4200\n", facts)
    _, _, found = imported(tmp_path, "t,f\n0,4200\n", facts, pole_pairs=7)
    assert values(found["x"]) == [10]


def test_a_sign_may_be_a_parameter(tmp_path):
    facts = {"quantity": "thrust", "unit": "N", "column": "f", "sign": "thrust_sign"}
    changed = {**channel(**facts), "parameters": {"thrust_sign": -1.0}}
    assert values(imported(tmp_path, "t,f\n0,3\n", changed)[2]["x"]) == [-3]
    assert values(imported(tmp_path, "t,f\n0,3\n", changed, thrust_sign=1)[2]["x"]) == [3]
    with pytest.raises(ConfigError, match="thrust_sign must be 1 or -1, got 2"):
        imported(tmp_path, "t,f\n0,3\n", changed, thrust_sign=2)
    with pytest.raises(ConfigError, match="sign must be 1, -1 or a name of"):
        imported(tmp_path, "t,f\n0,3\n", channel(**facts))


def test_a_plain_map_says_its_units(tmp_path):
    summary, _, _ = imported(tmp_path, "t,f\n0,1\n1,2\n", PLAIN)
    assert summary.sentences[0] == (
        "understood: time 't' in s, 2 rows over 1 s, a log (no command in it); no command; units thrust N"
    )
