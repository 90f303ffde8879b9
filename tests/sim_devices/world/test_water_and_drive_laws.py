"""A neighbour's jet, the water column, drives that hold torque or power, a cell that stops: closed forms and limits."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sim_devices.tables import WorldError
from sim_devices.world import World, read_world
from sim_devices.world.headless import run
from sim_devices.world.history import clock
from sim_devices.world.sweep import sweep

C, K = 0.4, 1.5
THRUSTER = {"C": C, "rotor": "instant", "rate_per_volt": K}


def swept(volts, effects, dt=1e-3, seconds=4.0):
    settings = read_world({"thrusters": {"T": THRUSTER}, "effects": effects})
    n = round(seconds / dt)
    command = np.full(n, volts) if np.isscalar(volts) else volts(clock(n, dt))
    return sweep(settings, dt, command, np.zeros(n), np.full(n, 18.0))


def beside(volts, neighbour, loss=0.26):
    """Thrust at `volts` beside a neighbour that runs all the time."""
    jet = {"loss": loss, "neighbour_thrust": neighbour, "period": 10.0, "on_time": 10.0}
    return swept(volts, {"thruster_interaction": jet}).reading[-1]


def test_behind_an_equal_thrust_the_share_is_left_that_the_rule_of_the_field_says():
    """ABS: 1 - 0.75^((x/D)^(2/3)) in line, 0.37 at two diameters and 0.74 at ten."""
    for distance, left in ((2.0, 0.37), (5.0, 0.57), (10.0, 0.74)):
        loss = 0.75 ** (distance ** (2.0 / 3.0))
        assert 1.0 - loss == pytest.approx(left, abs=5e-3)
        for volts in (3.0, 12.0):
            assert beside(volts, C * volts**2, loss) == pytest.approx((1.0 - loss) * C * volts**2, rel=1e-9)


def test_a_jet_takes_with_the_rate_and_the_root_of_its_thrust():
    taken = {(v, t): C * v * abs(v) - beside(v, t) for v in (2.0, 4.0, -4.0) for t in (10.0, 40.0, -40.0)}
    assert taken[4.0, 10.0] / taken[2.0, 10.0] == pytest.approx(2.0)
    assert taken[4.0, 40.0] / taken[4.0, 10.0] == pytest.approx(2.0)
    assert taken[4.0, -40.0] == pytest.approx(-taken[4.0, 40.0])  # a jet from behind
    assert taken[-4.0, 40.0] == pytest.approx(taken[4.0, 40.0])  # -C_s |n| U whichever way it turns
    assert beside(0.0, 40.0) == 0.0
    assert beside(0.5, 40.0) < 0.0  # at small rates more than the thrust itself


@pytest.mark.parametrize("form", ["first_order", "momentum"])
def test_the_water_column_is_what_scipy_integrates(form):
    """Bachmayer's u' = (n|n| - u|u|)/(2 n_ref tau), and the first-order law that it is for small changes."""
    tau, reference, share = 0.012, 20.0, 0.3
    inflow = {"share": share, "time_constant": tau, "form": form, "reference_voltage": reference}

    def command(t):
        return np.where(t < 0.1005, 14.0, np.where(t < 0.3005, -6.0, 20.0))

    h = swept(command, {"inflow_dynamics": inflow}, seconds=0.5)

    def slope(t, u):
        n = K * command(np.asarray(t))
        return (n - u) / tau if form == "first_order" else (n * abs(n) - u * np.abs(u)) / (2.0 * K * reference * tau)

    u = solve_ivp(slope, (-5e-4, h.t[-1]), [0.0], t_eval=h.t, max_step=2e-4, rtol=1e-8, atol=1e-8).y[0]
    expected = C / K**2 * (h.n * np.abs(h.n) + share * np.abs(h.n) * (h.n - u))
    assert h.reading == pytest.approx(expected, abs=0.02 * C * 400.0 * share)
    assert np.sqrt(np.mean((h.reading - expected) ** 2)) < 2e-3 * C * 400.0 * share


def test_a_column_of_water_is_slower_at_low_drive():
    """Small steps at V_max and at a quarter of it: the time constant is four times as long."""

    def left(volts, after):
        """Of a small step, `after` s later."""
        inflow = {"share": 1.0, "time_constant": 0.05, "form": "momentum", "reference_voltage": 20.0}
        h = swept(lambda t: np.where(t < 3.0, volts, 1.01 * volts), {"inflow_dynamics": inflow})
        over = h.reading - C * h.command**2
        step = int(np.searchsorted(h.t, 3.0))
        return over[step + round(after / 1e-3)] / over[step]

    assert left(20.0, 0.05) == pytest.approx(np.exp(-1.0), rel=0.03)
    assert left(5.0, 0.2) == pytest.approx(np.exp(-1.0), rel=0.03)


@pytest.mark.parametrize(("exponent", "held"), [(2.0, "rate"), (1.0, "torque"), (2.0 / 3.0, "power")])
def test_a_drive_that_holds_something_else_moves_rate_and_current_with_it(exponent, held):
    """In proportion to the command: n at 2, Q ~ n^2 at 1, P ~ n^3 at 2/3; thrust has the exponent itself."""
    low, high = (swept(v, {"exponent": {"exponent": exponent, "form": "drive"}}) for v in (-3.0, -9.0))
    what = {"rate": lambda h: h.n[-1], "torque": lambda h: h.current[-1], "power": lambda h: h.n[-1] * h.current[-1]}
    assert abs(what[held](high) / what[held](low)) == pytest.approx(3.0)
    assert high.reading[-1] / low.reading[-1] == pytest.approx(3.0**exponent)
    assert swept(12.0, {"exponent": {"exponent": exponent, "form": "drive"}}).reading[-1] == pytest.approx(C * 144.0)
    water = swept(-9.0, {"exponent": {"exponent": exponent}})
    assert (water.n[-1], water.reading[-1]) == pytest.approx((-9.0 * K, high.reading[-1]))


@pytest.mark.parametrize(("place", "spread"), [("output", 0.0), ("cell", 0.3)])
def test_a_cell_that_stops_before_its_amplifier_still_has_noise(place, spread):
    settings = read_world(
        {
            "thrusters": {"T": THRUSTER},
            "effects": {"load_cell_saturation": {"limit": 50.0, "place": place}},
            "noise": {"thrust": {"white": 0.3}},
        }
    )
    seen = run(settings, [0.0], [20.0], 40.0, rates={"thrust": 50.0}, rng=np.random.default_rng(1))["thrust"].value
    late = seen[500:]
    assert np.mean(late) == pytest.approx(50.0, abs=0.05)
    assert np.std(late) == pytest.approx(spread, rel=0.1)
    world = World(settings, np.random.default_rng(1))
    for _ in range(2000):
        world.step(1e-3, 20.0)
    assert np.std([world.sample("thrust") for _ in range(1000)]) == pytest.approx(spread, rel=0.1)


@pytest.mark.parametrize("volts", [20.0, -20.0, 5.0])
def test_the_zero_of_a_cell_that_stops_is_a_load_on_it(volts):
    tables = {"thrusters": {"T": THRUSTER}, "cell": {"zero_offset": 4.0}}
    clipped = read_world(tables | {"effects": {"load_cell_saturation": {"limit": 50.0, "place": "cell"}}})
    live = World(clipped, np.random.default_rng(1))
    for _ in range(2000):
        live.step(1e-3, volts)
    assert live.exact("thrust") == pytest.approx(np.clip(C * volts * abs(volts) + 4.0, -50.0, 50.0), rel=1e-6)
    told = sweep(clipped, 0.01, np.full(200, volts), np.zeros(200), np.full(200, 18.0))
    assert told.reading[-1] + 4.0 == pytest.approx(live.exact("thrust"), rel=1e-6)


@pytest.mark.parametrize(
    ("effect", "sentence"),
    [
        ({"load_cell_saturation": {"limit": 50.0, "place": "wire"}}, "place must be one of output, cell"),
        ({"load_cell_saturation": {"place": "cell"}}, "limit must be above zero"),
        ({"exponent": {"exponent": 1.0, "form": "gear"}}, "form must be one of propeller, drive"),
        ({"inflow_dynamics": {"share": 0.1, "time_constant": 1.0, "form": "x"}}, "form must be one of first_order"),
        ({"thruster_interaction": {"loss": 0.1, "neighbour_thrust": 1.0, "thrust_scale": 1.0}}, "thrust_scale"),
    ],
)
def test_laws_that_cannot_be(effect, sentence):
    with pytest.raises(WorldError, match=sentence):
        read_world({"thrusters": {"T": THRUSTER}, "effects": effect})
