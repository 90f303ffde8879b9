"""The rotor's equation against a solver that knows nothing of its closed form: short intervals, holds, turns."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from identification.run_history.held import held_of
from identification.run_history.rotor_lag import Rotor, lag, lag_ends, lag_means, lagged, to_rest
from tests.identification.physics.one_term import integrated, steps

ROTORS = [
    *((0.5, 0.0, 0.0), (0.05, 3.0, 0.0), (5.0, 0.2, 0.0), (0.02, 0.9, 0.0), (0.4, 1e-9, 0.0), (1e-9, 2.0, 0.0)),
    *((1e-5, 2.0, 0.0), (0.05, 3.0, 0.5), (0.25, 3.0, 1.0), (1e-5, 2.0, 0.9), (0.0, 2.0, 0.7)),
]


def equation(quadratic, linear, released):
    def slope(y, v):
        hold = linear * (1 - released) if v == 0 else linear
        return [quadratic * (v * abs(v) - y[0] * abs(y[0])) + hold * (v - y[0])]

    return slope


@pytest.mark.parametrize("rotor", [Rotor(*each) for each in ROTORS])
@pytest.mark.parametrize("longest", [0.3, 40.0])
def test_lag_is_the_rotor_equation_however_long_a_command_is_held(rotor, longest):
    """The longest holds are many time constants; every third asks the rotor to stand."""
    fastest = rotor.quadratic * 20 + rotor.linear
    w, dt = steps(90, low=0.05 / fastest, high=longest / fastest)
    w[::3] = 0.0
    end, mean = lag(w, dt, rotor, start=-3.0)
    ends, means = integrated(equation(*rotor), [-3.0], w, dt)
    assert end == pytest.approx(ends[:, 0], abs=1e-6)
    assert mean == pytest.approx(means, abs=1e-6)
    assert lag_ends(w, dt, rotor, -3.0) == pytest.approx(end, abs=1e-12)


def divided(w, dt, parts=6):
    """Each hold in so many intervals of random length, its value with the rounding of means over them."""
    rng = np.random.default_rng(3)
    share = rng.dirichlet(np.ones(parts), w.size)
    rounding = 1 + 1e-14 * rng.standard_normal(w.size * parts)
    return np.repeat(w, parts) * rounding, (share * dt[:, None]).ravel()


@pytest.mark.parametrize("rotor", [Rotor(*each) for each in ROTORS])
@pytest.mark.parametrize("longest", [0.3, 40.0])
def test_means_of_a_lag_need_one_step_for_each_hold(rotor, longest):
    fastest = rotor.quadratic * 20 + rotor.linear
    w, dt = steps(90, low=0.05 / fastest, high=longest / fastest)
    w[::3] = 0.0
    w, dt = divided(w, dt)
    held = held_of(w, dt)
    assert held.first.size > 40  # some neighbours are held alike
    assert not np.any(held.first % 6)
    found = lag_means(w, dt, rotor, -3.0, held=held)
    assert found == pytest.approx(integrated(equation(*rotor), [-3.0], w, dt)[1], abs=1e-6)


def test_what_moves_within_a_hold_is_followed_interval_by_interval():
    """A supply that sags while the command stands still."""
    command, dt = divided(*steps(60, low=0.1, high=2.0))
    w = command * (1 - 0.002 * (np.arange(command.size) % 7))
    found = lag_means(w, dt, Rotor(0.4, 0.3), 1.0, held=held_of(command, dt))
    assert found.tolist() == lag(w, dt, Rotor(0.4, 0.3), 1.0)[1].tolist()
    assert held_of(w, dt) is None


def test_a_lag_is_the_same_wherever_it_is_sought_from():
    rng = np.random.default_rng(0)
    w = np.repeat(rng.uniform(-10, 10, 200), 30)
    dt = rng.uniform(0.005, 0.05, w.size)
    end, _ = lag(w, dt, Rotor(0.8, 0.1))
    again, _ = lag(w, dt, Rotor(0.8, 0.1), near=lag(w, dt, Rotor(0.1, 0.0))[0])
    assert again == pytest.approx(end, abs=1e-7)


def test_a_rotor_that_coasts_from_its_rate_loses_it_as_one_over_time():
    """n' = -q n^2 has n = n0 / (1 + q n0 t): after 15 s of 8 V, as after a hold of a sweep."""
    since = np.array([0.0, 0.1, 1.0, 15.0])
    found = lagged(np.zeros(4), np.full(4, -8.0), since, Rotor(0.26, 0.0))
    assert found == pytest.approx(-8.0 / (1 + 0.26 * 8.0 * since), abs=1e-12)


@pytest.mark.parametrize("nearly", [0.0, 1e-300, 1e-160, -1e-160, 1e-12])
def test_rounding_of_a_command_of_nothing_brakes_no_rotor(nearly):
    w, dt = np.array([6.0, nearly, nearly]), np.array([3.0, 1.0, 2.0])
    end, mean = lag(w, dt, Rotor(0.26, 0.0), start=-1.0)
    coasting = lag(np.array([6.0, 0.0, 0.0]), dt, Rotor(0.26, 0.0), start=-1.0)
    assert end == pytest.approx(coasting[0], abs=1e-9)
    assert mean == pytest.approx(coasting[1], abs=1e-9)
    assert lag(-w, dt, Rotor(0.26, 0.0), start=1.0)[0] == pytest.approx(-end, abs=1e-12)


@pytest.mark.parametrize("rotor", [Rotor(*each) for each in ROTORS])
def test_a_rotor_turns_round_when_its_equation_says(rotor):
    w, n = np.array([3.0, -8.0, 0.5]), np.array([-7.0, 0.4, -6.0])
    for one, begin, found in zip(w, n, to_rest(w, n, rotor), strict=True):
        solved = solve_ivp(
            lambda t, y, v=one: equation(*rotor)(y, v), (0.0, 2 * found), [begin], rtol=1e-10, atol=1e-12,
            events=lambda t, y: y[0],
        )  # fmt: skip
        assert solved.t_events[0][0] == pytest.approx(found, rel=1e-6)


@pytest.mark.parametrize("nearly", [0.0, 1e-15, -1e-9])
def test_a_mean_that_is_0_but_for_its_rounding_is_rest(nearly):
    w, dt, rotor = np.array([6.0, nearly, nearly]), np.array([3.0, 0.1, 0.2]), Rotor(0.05, 3.0, 0.8)
    asked = lag(np.array([6.0, 0.0, 0.0]), dt, rotor)
    assert lag(w, dt, rotor)[0] == pytest.approx(asked[0], abs=1e-6)
    assert lag(w, dt, rotor._replace(released=0.0))[0][1] < asked[0][1] - 1.0


def test_lag_ends_at_its_command_and_stays_at_rest():
    w = np.full(50, 6.0)
    assert lag(w, np.full(50, 1.0), Rotor(2.0, 0.0))[1][-1] == pytest.approx(6.0)
    assert lag(np.zeros(50), np.full(50, 1.0), Rotor(2.0, 0.0))[1].tolist() == [0.0] * 50
