"""The simulated world: exact where nothing is concealed, changed where something is."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from sim_devices.tables import WorldError
from sim_devices.world import World, read_world
from sim_devices.world.effects import EFFECTS
from sim_devices.world.effects.limit import CommandSaturation
from sim_devices.world.headless import run

C = 0.4
PLAIN = {"thrusters": {"T1": {"C": C}, "T2": {"C": 0.3, "rate_per_volt": 1.1}}}
WORLD_TOML = Path(__file__).parents[3] / "benches" / "simulated" / "world.toml"

# One setting per effect that is plain to see, and a profile that shows it.
SHOWN = {
    "command_saturation": {"limit": 15.0},
    "supply_sag": {"source_resistance": 0.5},
    "dead_band": {"half_width": 0.9},
    "winding_resistance": {"resistance": 0.2},
    "exponent": {"exponent": 1.8},
    "asymmetry": {"ratio": 0.85},
    "inflow_dynamics": {"share": 0.3, "time_constant": 0.4},
    "cavitation": {"onset": 15.0, "slope": 0.02},
    "heating": {"resistance": 0.3, "copper": 0.05},
    "reversal_loss": {"loss": 0.2, "time_constant": 1.5},
    "linear_term": {"coefficient": 0.5},
    "speed_of_advance": {"coefficient": 0.5},
    "recirculation": {"coefficient": 0.02, "time_constant": 5.0},
    "thruster_interaction": {"loss": 0.1, "neighbour_thrust": 100.0, "period": 4.0, "on_time": 2.0},
    "strut_drag": {"coefficient": -5.0},
    "torque_crosstalk": {"coefficient": 0.01},
    "stand_resonance": {"frequency": 8.0, "damping": 0.05},
    "hysteresis": {"width": 1.0},
    "time_skew": {"delay": 0.05},
    "load_cell_creep": {"share": 0.02, "time_constant": 10.0},
    "load_cell_nonlinearity": {"quadratic": 1e-4},
    "load_cell_even_bend": {"coefficient": 1e-4},
    "periodic_disturbance": {"amplitude": 0.5, "frequency": 17.0},
    "zero_drift": {"rate": 0.05},
    "load_cell_saturation": {"limit": 50.0},
    "motor_lag": {"time_constant": 0.2},
    "rotation_coupling": {"amplitude": 0.02},
    "zero_offset": {"offset": 1.0, "start": 5.0},
    "channel_fault": {"channel": "thrust", "kind": "rescaled", "factor": 1.1},
}
TIMES, VOLTS = (0.0, 2.0, 6.0, 8.0, 12.0, 14.0), (0.0, 18.0, 4.0, -18.0, 0.5, 0.0)


def thrust(effects, flow=((0.0, 0.5),), **tables):
    settings = read_world({**PLAIN, **tables, "effects": effects})
    rng = np.random.default_rng(3)
    return run(settings, TIMES, VOLTS, 16.0, rates={"thrust": 100.0}, rng=rng, flow=flow)["thrust"].value


def settled(world, volts, seconds=6.0):
    for _ in range(round(seconds / 1e-3)):
        world.step(1e-3, volts)
    return world


@pytest.mark.parametrize("name", ["T1", "T2"])
@pytest.mark.parametrize("volts", [-24.0, -7.3, 0.0, 0.4, 3.0, 24.0])
def test_the_plain_world_settles_at_c_v_v(name, volts):
    world = World(read_world({**PLAIN, "mounted": name}), np.random.default_rng(1))
    expected = PLAIN["thrusters"][name]["C"] * volts * abs(volts)
    assert settled(world, volts).sample("thrust") == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_gain_error_and_zero_offset_are_in_the_reading_and_not_in_the_thrust():
    settings = read_world({**PLAIN, "cell": {"gain_error": 0.0002, "zero_offset": 0.75}})
    world = settled(World(settings, np.random.default_rng(1)), 10.0)
    assert world.state.thrust == pytest.approx(100 * C, rel=1e-9)
    assert world.sample("thrust") == pytest.approx(100 * C * 1.0002 + 0.75, rel=1e-9)


def test_the_rotor_follows_a_step_in_a_tenth_to_a_fifth_of_a_second():
    world = World(read_world(PLAIN), np.random.default_rng(1))
    settled(world, 9.0)
    steps = 0
    while world.state.n < 9.0 + 2.0 * (1 - np.exp(-1)):
        world.step(1e-3, 11.0)
        steps += 1
    assert 0.1 < steps * 1e-3 < 0.2


def test_a_released_rotor_coasts_and_a_driven_one_is_pulled_down():
    released, driven = (settled(World(read_world(PLAIN), np.random.default_rng(1)), 20.0) for _ in range(2))
    for _ in range(500):
        released.step(1e-3, None)
        driven.step(1e-3, 0.0)
    assert released.state.n > driven.state.n > 0.5
    for _ in range(1500):
        released.step(1e-3, None)
    assert 0.0 < released.state.n < 0.5
    assert released.state.current == 0.0


def test_every_effect_of_the_catalogue_is_tried_here():
    assert set(SHOWN) == set(EFFECTS)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_changes_the_prediction(name):
    change = thrust({name: SHOWN[name]}) - thrust({})
    assert np.nanmax(np.abs(change)) > 0.1


def test_what_is_not_named_is_exactly_absent():
    world = World(read_world(PLAIN), np.random.default_rng(1))
    assert not any((world._command, world._hydro, world._stand, world._cell, *world._outputs.values()))
    assert np.array_equal(thrust({}), thrust({}, flow=((0.0, 0.0),)))


def at(effects, volts, **tables):
    """Steady reading of a world with these effects."""
    world = settled(World(read_world({**PLAIN, **tables, "effects": effects}), np.random.default_rng(1)), volts)
    return world.exact("thrust")


def test_steady_effects_have_their_textbook_shape():
    assert at({"dead_band": {"half_width": 0.9}}, -5.0) == pytest.approx(-C * 4.1**2, rel=1e-6)
    assert at({"dead_band": {"half_width": 0.9, "form": "jump"}}, 1.0) == pytest.approx(C, rel=1e-6)
    assert at({"dead_band": {"half_width": 0.9, "form": "jump"}}, 0.8) == pytest.approx(0.0, abs=1e-6)
    assert at({"asymmetry": {"ratio": 0.85}}, -10.0) == pytest.approx(-85 * C, rel=1e-6)
    assert at({"linear_term": {"coefficient": 0.5}}, 10.0) == pytest.approx(100 * C + 5.0, rel=1e-6)
    assert at({"command_saturation": {"limit": 15.0}}, 20.0) == pytest.approx(225 * C, rel=1e-6)
    assert at({"exponent": {"exponent": 1.5, "reference_voltage": 4.0}}, 16.0) == pytest.approx(256 * C / 2, rel=1e-6)
    assert at({"cavitation": {"onset": 15.0, "slope": 0.02}}, 20.0) == pytest.approx(400 * C * 0.9, rel=1e-6)
    assert at({"torque_crosstalk": {"coefficient": 0.01}}, -10.0) == pytest.approx(-100 * C + 1.0, rel=1e-6)
    assert at({"load_cell_even_bend": {"coefficient": 1e-3}}, -10.0) == pytest.approx(-40.0 + 1.6, rel=1e-6)
    assert at({"stand_resonance": {"frequency": 8.0, "damping": 0.2}}, 10.0) == pytest.approx(100 * C, rel=1e-6)


def test_flow_effects_have_their_textbook_shape():
    tunnel = {"flow_speed": 0.5}
    advance = at({"speed_of_advance": {"coefficient": 0.4}}, -10.0, tunnel=tunnel)
    assert advance == pytest.approx(-100 * C - 0.4 * 10 * 0.5, rel=1e-6)
    assert at({"strut_drag": {"coefficient": -5.0}}, 0.0, tunnel=tunnel) == pytest.approx(-1.25, rel=1e-6)


def test_winding_resistance_solves_its_quadratic():
    world = settled(
        World(read_world({**PLAIN, "effects": {"winding_resistance": {"resistance": 0.3}}}), np.random.default_rng(1)),
        20.0,
    )
    s = world.state
    assert s.n / s.rate_per_volt + 0.3 * s.current == pytest.approx(20.0, rel=1e-6)


def test_supply_sag_moves_the_bus_voltage_that_is_measured():
    effects = {"supply_sag": {"source_resistance": 0.5}}
    world = settled(World(read_world({**PLAIN, "effects": effects}), np.random.default_rng(1)), 20.0)
    s = world.state
    assert world.sample("bus_voltage") == pytest.approx(48.0 - 0.5 * s.input_current, rel=1e-3)
    assert s.thrust == pytest.approx(C * (20.0 * s.bus_voltage / 48.0) ** 2, rel=1e-3)


def test_a_limit_with_a_knee_bends_from_its_onset():
    """Slope 1 - 0.25 e beyond 10: 0 at 14, where 12 is reached."""
    world = World(read_world(PLAIN), np.random.default_rng(1))
    limit = CommandSaturation(onset=10.0, form="knee", bend=0.25)
    seen = [limit.apply(v, world.state, 0.01) for v in (8.0, 10.0, 12.0, 14.0, 20.0, -12.0)]
    assert seen == pytest.approx([8.0, 10.0, 11.5, 12.0, 12.0, -11.5])


def test_a_clipping_cell_clips_its_noise_too():
    tables = {"effects": {"load_cell_saturation": {"limit": 50.0}}, "noise": {"thrust": {"white": 0.1}}}
    world = settled(World(read_world({**PLAIN, **tables}), np.random.default_rng(1)), 20.0)
    assert {world.sample("thrust") for _ in range(50)} == {50.0}


def test_noise_has_the_size_it_was_given_and_repeats_with_its_seed():
    noise = {"thrust": {"white": 0.3, "slow": 0.4, "slow_time": 0.05}}
    first, second, other = (
        run(
            read_world({**PLAIN, "noise": noise}),
            [0.0],
            [0.0],
            60.0,
            rates={"thrust": 50.0},
            rng=np.random.default_rng(s),
        )
        for s in (5, 5, 6)
    )
    assert np.array_equal(first["thrust"].value, second["thrust"].value)
    assert not np.array_equal(first["thrust"].value, other["thrust"].value)
    assert np.std(first["thrust"].value) == pytest.approx(0.5, rel=0.1)


def test_a_dropout_gives_no_number():
    effects = {"channel_fault": {"channel": "thrust", "kind": "dropout", "factor": 0.2}}
    assert np.mean(np.isnan(thrust(effects))) == pytest.approx(0.2, abs=0.02)


def test_the_coarse_step_of_a_headless_run_changes_nothing_that_matters():
    plain = thrust({})
    fine = thrust({"time_skew": {"delay": 1e-9}})  # forces the fine step and delays by nothing
    assert np.max(np.abs(plain - fine)) < 1e-3


def test_mounting_is_refused_while_the_rotor_turns():
    world = settled(World(read_world(PLAIN), np.random.default_rng(1)), 5.0)
    with pytest.raises(ValueError, match=r"T1 turns at 5.0 rev/s, expected rest"):
        world.mount("T2")
    for _ in range(6000):
        world.step(1e-3, None)
    world.mount("T2")
    assert settled(world, 10.0).state.thrust == pytest.approx(30.0, rel=1e-6)


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ({"effects": {"deadband": {"half_width": 1.0}}}, "did you mean 'dead_band'"),
        ({"effects": {"dead_band": {"halfwidth": 1.0}}}, "did you mean 'half_width'"),
        ({"effects": {"dead_band": {}}}, "'half_width' is missing"),
        ({"effects": {"dead_band": {"half_width": -1.0}}}, "half_width must be above zero"),
        ({"effects": {"dead_band": {"half_width": "wide"}}}, "expected float, got 'wide'"),
        ({"effects": {"dead_band": 3}}, "expected a table"),
        ({"effects": {"torque_crosstalk": {"coefficient": 1.0, "form": "odd"}}}, "form must be one of even, torque"),
        ({"effects": {"periodic_disturbance": {"amplitude": 1.0}}}, "either frequency"),
        ({"mounted": "T9"}, "mounted: unknown name 'T9'"),
        ({"noise": {"thrst": {}}}, "did you mean 'thrust'"),
        ({"thrusters": {}}, "at least one table"),
    ],
)
def test_a_world_that_cannot_be_says_why(tables, sentence):
    with pytest.raises(WorldError, match=sentence):
        read_world({**PLAIN, **tables})


def test_the_world_of_the_example_bench_can_be_read():
    tables = tomllib.loads(WORLD_TOML.read_text())
    assert len(tables["thrusters"]) == 8
    assert read_world({k: tables[k] for k in ("thrusters", "tunnel", "cell", "noise")}).mounted == "T1"


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("frozen", 1.0), ("reversed", -40.0), ("unsigned", 40.0), ("rescaled", 20.0), ("nan", np.nan)],
)
def test_a_channel_lies_as_it_is_told(kind, expected):
    fault = {"channel": "thrust", "kind": kind, "factor": 0.5, "start": 3.0, "duration": 6.0}
    settings = read_world({**PLAIN, "effects": {"channel_fault": fault}, "cell": {"zero_offset": 0.0}})
    volts = (5.0**0.5 / 2.0**0.5, 10.0)  # 1 N, then 40 N
    value = run(settings, (0.0, 3.0), volts, 12.0, rates={"thrust": 10.0}, rng=np.random.default_rng(1))["thrust"].value
    assert value[80] == pytest.approx(expected, rel=1e-2, nan_ok=True)
    assert value[100] == pytest.approx(40.0, rel=1e-6)


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ({"channel_fault": {"channel": "thrst", "kind": "nan"}}, "channel must be one of"),
        ({"channel_fault": {"channel": "thrust", "kind": "shy"}}, "kind must be one of"),
        ({"channel_fault": {"channel": "thrust", "kind": "nan", "duration": -1.0}}, "duration must be above zero"),
    ],
)
def test_a_lie_that_cannot_be_told(tables, sentence):
    with pytest.raises(WorldError, match=sentence):
        read_world({**PLAIN, "effects": tables})


def test_blade_pass_is_silent_at_rest():
    effects = {"periodic_disturbance": {"amplitude": 0.5, "blades": 3, "reference_voltage": 10.0}}
    assert at(effects, 0.0) == 0.0
    rng = np.random.default_rng(1)
    trace = run(read_world({**PLAIN, "effects": effects}), [0.0], [10.0], 20.0, rates={"thrust": 500.0}, rng=rng)
    wave = trace["thrust"].exact[-5000:] - 100 * C
    line = np.argmax(np.abs(np.fft.rfft(wave))) / 10.0
    assert line == pytest.approx(30.0, abs=0.1)
    assert np.max(wave) == pytest.approx(0.5, rel=0.01)


def test_a_run_that_cannot_be():
    settings, rng = read_world(PLAIN), np.random.default_rng(1)
    with pytest.raises(ValueError, match="must ascend"):
        run(settings, [1.0, 0.0], [0.0, 0.0], 2.0, rates={"thrust": 1.0}, rng=rng)
    with pytest.raises(ValueError, match="above zero"):
        run(settings, [0.0], [0.0], 2.0, rates={"thrust": 0.0}, rng=rng)
    with pytest.raises(ValueError, match="expected one of thrust"):
        run(settings, [0.0], [0.0], 2.0, rates={"thrst": 1.0}, rng=rng)


def test_every_sensor_gives_its_quantity():
    world = settled(World(read_world({**PLAIN, "tunnel": {"flow_speed": 0.3}}), np.random.default_rng(1)), 10.0)
    expected = {"rotation_rate": 10.0, "bus_voltage": 48.0, "flow_speed": 0.3, "water_temperature": 18.0}
    expected |= {"pressure": 1.04e5, "current": 25.0 / 7.2, "input_current": 25.0 / 7.2 * 10.0 / 48.0}
    assert {name: world.sample(name) for name in expected} == pytest.approx(expected)
    assert 18.0 < world.sample("motor_temperature") < 19.0
    assert 23.0 < world.sample("fet_temperature") < 24.0
