"""Forms of drive, rotor, blade and flow against their formulas."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.at_bounds import out_of_the_question
from identification.run_history.remembered import RememberedRun
from identification.run_history.slip import slip
from tests.identification.physics.one_term import H, S, base, integrated, steps, term
from tests.identification.physics.runs_on_intervals import history, moment


def with_driver(driver, dt):
    h = history(driver.size)
    edges = np.concatenate([[0.0], np.cumsum(dt)])
    return replace(h, edges=edges, driver=driver, sampled=0.5 * (edges[1:] + edges[:-1]))


def test_winding_resistance_solves_the_motor_balance():
    V = np.linspace(-12, 12, 49)
    e = term("winding_resistance").apply(V, moment(H, S), (0.05,))
    assert np.sign(V) * (np.abs(e) + 0.05 * e**2) == pytest.approx(V)


def test_dead_bands():
    V = np.array([-12.0, -2.0, -1.0, 0.0, 0.5, 1.5, 3.0])
    m = moment(H, S)
    assert term("dead_band", "shrink").apply(V, m, (1.2,)).tolist() == pytest.approx([-10.8, -0.8, 0, 0, 0, 0.3, 1.8])
    assert term("dead_band", "jump").apply(V, m, (1.2,)).tolist() == pytest.approx([-12, -2, 0, 0, 0, 1.5, 3])


def test_a_moving_command_passes_the_edge_of_a_dead_band_within_an_interval():
    """A ramp through the threshold in ticks far finer than the intervals."""
    ends = np.linspace(0.0, 6.0, 31)
    fine = np.linspace(ends[:-1], ends[1:], 1001).T
    mean = fine.mean(axis=1)
    moving = replace(H, edges=np.arange(31.0), driver=mean, excess=np.mean(fine**2, axis=1) - mean**2)
    got = term("dead_band", "jump").apply(mean, moment(moving, S), (3.07,))
    assert got == pytest.approx(np.where(fine > 3.07, fine, 0.0).mean(axis=1), abs=0.004)
    shrunk = term("dead_band", "shrink").apply(mean, moment(moving, S), (3.07,))
    assert shrunk == pytest.approx(np.maximum(fine - 3.07, 0.0).mean(axis=1), abs=1e-4)


@pytest.mark.parametrize(
    ("form", "acts"), [("jump", lambda v: np.where(v > 0.44, v, 0.0)), ("shrink", lambda v: np.maximum(v - 0.44, 0.0))]
)
def test_ticks_of_a_command_pass_a_dead_band_one_by_one(form, acts):
    """A ramp in ticks of 0.1 V, three in an interval: one acts or it does not, whatever their mean is."""
    fine = 0.1 * np.arange(30.0).reshape(10, 3) + 0.05
    mean = fine.mean(axis=1)
    ticks = np.arange(30.0) / 3, fine.ravel()
    stairs = replace(H, edges=np.arange(11.0), driver=mean, excess=np.mean(fine**2, axis=1) - mean**2, ticks=ticks)
    got = term("dead_band", form).apply(mean, moment(stairs, S), (0.44,))
    assert got == pytest.approx(acts(fine).mean(axis=1), abs=1e-10)


def test_static_forms_of_the_propeller():
    x = np.array([-12.0, -6.0, 6.0, 12.0])
    m = moment(H, S, x=x)
    T = 0.5 * x * np.abs(x)
    assert term("asymmetry").apply(T, m, (0.8,)) == pytest.approx([-57.6, -14.4, 18.0, 72.0])
    assert term("exponent").apply(T, m, (3.0,)) == pytest.approx([-72.0, -9.0, 9.0, 72.0])
    assert term("linear_term").apply(T, m, (0.5,)) == pytest.approx([-78.0, -21.0, 21.0, 78.0])
    assert term("cavitation", "linear").apply(T, m, (0.1, 7.0)) == pytest.approx([-36.0, -18.0, 18.0, 36.0])
    assert term("cavitation", "square").apply(T, m, (0.1, 7.0)) == pytest.approx([-54.0, -18.0, 18.0, 54.0])
    assert term("cavitation", "linear").apply(T, m, (0.6, 7.0))[0] == 0.0, "thrust never changes sign"
    assert term("torque_crosstalk").apply(T, m, (0.01,)) == pytest.approx([-70.56, -17.64, 18.36, 73.44])
    assert term("command_saturation").apply(x, m, (8.0,)).tolist() == [-8, -6, 6, 8]
    assert term("load_cell_nonlinearity", "quadratic").apply(T, m, (1e-3,))[[0, 3]] == pytest.approx([-77.184, 77.184])
    assert term("load_cell_nonlinearity", "cubic").apply(T, m, (1e-5,))[[0, 3]] == pytest.approx([-75.73248, 75.73248])
    assert term("load_cell_even_bend").apply(T, m, (1e-3,)) == pytest.approx([-66.816, -17.676, 18.324, 77.184])


@pytest.mark.parametrize(("form", "slope"), [("linear", 0.9 / 4), ("square", 0.9**0.5 / 4)])
def test_no_cavitation_takes_all_of_the_thrust(form, slope):
    """A tachometer that leapt was told as cavitation with 320 % of the thrust lost at the largest rate."""
    onset, known = S.driver - 4.0, term("cavitation", form)
    assert out_of_the_question(known, (1.2 * slope, onset), S)
    assert not out_of_the_question(known, (0.9 * slope, onset), S)
    assert "100 % is lost" in known.statement((4.0 * slope, onset), S)


def test_forms_that_read_another_channel():
    m = moment(H, S)
    T, x = base(), H.driver
    U = H.others["flow_speed"]
    assert term("speed_of_advance").apply(T, m, (0.4,)) == pytest.approx(T - 0.4 * np.abs(x) * U)
    assert term("strut_drag").apply(T, m, (-3.0,)) == pytest.approx(T - 3.0 * U * np.abs(U))
    on = H.others["neighbour_thrust"] > 0
    jet = 0.2 * 0.5 * 12.0 * np.abs(x)  # a fifth of 72 N at 12 V, with the neighbour at full
    assert term("thruster_interaction").apply(T, m, (0.2,)) == pytest.approx(np.where(on, T - jet, T))
    assert np.array_equal(term("rotation_coupling").apply(x, moment(replace(H, rate=None), S), (1.0,)), x)
    torque = H.others["torque"]
    assert term("torque_crosstalk", "measured").apply(T, m, (0.7,)) == pytest.approx(T + 0.7 * torque)
    ratio = H.others["bus_voltage"] / H.others["bus_voltage"].max()
    assert term("supply_sag").apply(x, m, (1.0,)) == pytest.approx(x * ratio)
    heated = replace(H, others={"current": np.where(np.arange(H.driver.size) < 200, 8.0, 0.0)})
    rate = term("heating", "winding").apply(np.full(400, 12.0), moment(heated, S), (0.1, 5.0))
    t = H.edges[200]
    warm = (1 - np.exp(-t / 5)) * np.exp(-(H.middle[200:] - t) / 5)
    assert (rate[200:] / 12) ** 2 == pytest.approx(1 - 0.1 * warm, abs=5e-3)


def test_thrust_follows_the_measured_rate_and_not_its_noise():
    slip = 0.8 * np.sin(0.03 * H.middle)
    noise = 0.3 * np.random.default_rng(10).standard_normal(H.driver.size)
    measured = replace(H, rate=2.0 * (H.driver + slip + noise))
    x = term("rotation_coupling").apply(H.driver, moment(measured, S), (1.0,))
    assert np.sqrt(np.mean((x - H.driver - slip) ** 2)) < 0.5 * 0.3
    half = term("rotation_coupling").apply(H.driver, moment(measured, S), (0.5,))
    assert half - H.driver == pytest.approx(0.5 * (x - H.driver))


def test_the_expected_gap_is_neither_damped_nor_followed_by_noise():
    """A wave as small as the noise of one row: regressing it on what is expected of it gives 1, on the rate less."""
    t = 0.1 * np.arange(4001)
    driver = 10.0 * np.sign(np.sin(2 * np.pi * t[:-1] / 31.0))
    h = with_driver(driver, np.diff(t))
    found, errors, plain = [], [], []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        wave = 0.02 * driver * np.sin(2 * np.pi * h.middle / 12.0 + rng.uniform(0, 6))
        rate = 2.0 * (driver + wave + 0.2 * rng.standard_normal(driver.size))
        one = np.ones(driver.size, dtype=np.int64)
        measured = replace(h, rate=rate, rate_count=one, rate_sampled=h.middle, rate_per_driver=2.0)
        gap = slip(RememberedRun(measured), driver, 2.0)
        found.append(gap @ wave / (gap @ gap))
        errors.append(np.mean((gap - wave) ** 2) / np.mean(wave**2))
        raw = rate / 2.0 - driver
        plain.append(raw @ wave / (raw @ raw))
    assert np.mean(found) == pytest.approx(1.0, abs=0.05)
    assert np.mean(errors) < 0.1
    assert np.mean(plain) < 0.6


def test_the_gap_moves_in_proportion_to_what_moves_it():
    """A fit takes slopes of it: what takes the noise out is fixed beforehand."""
    noise = 0.3 * np.random.default_rng(10).standard_normal(H.driver.size)
    measured = replace(H, rate=2.0 * (H.driver + 0.8 * np.sin(0.03 * H.middle) + noise))
    at = [slip(RememberedRun(measured), H.driver + share * np.sign(H.driver), 2.0) for share in (0.0, 0.1, 0.2)]
    assert at[2] - at[1] == pytest.approx(at[1] - at[0], abs=1e-9)
    assert np.any(at[1] != at[0])


def test_what_ticks_do_within_an_interval_is_no_slip():
    slip = 0.5 * np.sin(0.03 * H.middle)
    lead = 0.4 * np.random.default_rng(11).uniform(-1, 1, H.driver.size)  # the rate is read between two ticks
    for followed in (1.0, 0.3):
        measured = replace(H, rate=2.0 * (H.driver + slip + followed * lead), rate_lead=lead)
        x = term("rotation_coupling").apply(H.driver, moment(measured, S), (1.0,))
        assert np.sqrt(np.mean((x - H.driver - slip) ** 2)) < 0.06


def test_memories_end_where_the_formula_says():
    x = np.full(4000, 12.0)
    h = with_driver(x, np.full(4000, 0.25))
    m = moment(h, S)
    T = np.full(4000, 72.0)
    rate = term("recirculation", "rate").apply(T, m, (0.05, 20.0))
    assert rate == pytest.approx(72 - 0.05 * 144 * (1 - np.exp(-h.middle / 20)), abs=1e-3)
    assert term("recirculation", "thrust").apply(T, m, (0.05, 20.0)) == pytest.approx(rate)
    less = term("recirculation", "thrust").apply(0.25 * T, m, (0.05, 20.0))
    assert less[-1] == pytest.approx(18.0 - 0.05 * 12 * 6)
    over = term("inflow_dynamics").apply(T, m, (0.4, 2.0))
    assert over == pytest.approx(72 * (1 + 0.4 * np.exp(-h.middle / 2)), abs=0.03)
    creep = term("load_cell_creep", "two_constants").apply(T, m, (0.1, 5.0, -0.02, 100.0))
    late = 1 + 0.1 * (1 - np.exp(-h.middle / 5)) - 0.02 * (1 - np.exp(-h.middle / 100))
    assert creep == pytest.approx(72 * late, abs=1e-2)
    assert term("zero_drift", "linear").apply(T, m, (0.01,)) == pytest.approx(72 + 0.01 * h.middle)
    drift = term("zero_drift", "exponential").apply(T, m, (3.0, 50.0))
    assert drift == pytest.approx(75 - 3 * np.exp(-h.middle / 50))
    jump = term("zero_offset").apply(T, m, (2.0, 500.0))
    assert jump[h.middle < 499] == pytest.approx(72.0)
    assert jump[h.middle > 501] == pytest.approx(74.0)


def test_the_rotor_follows_its_equation():
    u, dt = steps(60, seed=8, high=0.05)
    h = with_driver(u, dt)
    m = moment(h, S)
    start = u[0]
    _, first = integrated(lambda y, v: [(v - y[0]) / 0.2], [start], u, dt)
    assert term("motor_lag", "first_order").apply(u, m, (0.2,)) == pytest.approx(first, abs=1e-6)
    # near full rate V - x closes with the time constant: x' = (V|V| - x|x|) / (2 tau V_full)
    _, second = integrated(lambda y, v: [(v * abs(v) - y[0] * abs(y[0])) / (2 * 0.2 * S.driver)], [start], u, dt)
    assert term("motor_lag", "quadratic").apply(u, m, (0.2,)) == pytest.approx(second, abs=0.02)


def test_a_rotor_that_a_drive_lets_go_at_rest_is_braked_by_the_water_alone():
    u, dt = steps(60, seed=8, high=0.05)
    u[::3] = 0.0
    m = moment(with_driver(u, dt), S)

    def slope(y, v):
        hold = 0.25 if v == 0 else 1.0
        water = (v * abs(v) - y[0] * abs(y[0])) / (2 * 0.2 * S.driver)
        return [0.4 * water + 0.6 * hold * (v - y[0]) / 0.2]

    _, expected = integrated(slope, [u[0]], u, dt)
    assert term("motor_lag", "coasting").apply(u, m, (0.2, 0.6, 0.75)) == pytest.approx(expected, abs=0.02)


def test_the_wake_is_met_after_a_change_of_direction_only():
    x = np.repeat([0.0, 12.0, 0.0, 12.0, -12.0], 40)
    h = with_driver(x, np.full(200, 0.05))
    m = moment(h, S)
    T = np.full(200, 10.0)
    wake = term("reversal_loss", "wake").apply(T, m, (0.5, 1.0))
    assert wake[:160].tolist() == [10.0] * 160
    assert wake[160:] == pytest.approx(10 * (1 - 0.5 * np.exp(-(h.middle[160:] - 8.0))))
    rested = with_driver(np.repeat([12.0, 0.0, -12.0], 40), np.full(120, 0.05))
    wake, step = (
        term("reversal_loss", form).apply(np.full(120, 10.0), moment(rested, S), (0.5, 1.0))
        for form in ("wake", "step")
    )
    assert wake[80] == pytest.approx(10 * (1 - 0.5 * np.exp(-2.025)))
    assert step[80] == pytest.approx(10 * (1 - 0.5 * np.exp(-0.025)))


def test_a_source_behind_a_switching_drive_loses_the_cube_and_a_winding_the_square_of_the_rate():
    """Of V a share of V^3 against one of V: at half the level an eighth against a half, for small losses."""
    V = np.array([-12.0, 3.6, 7.2, 12.0])
    m = moment(H, S)
    d = 0.3
    felt = term("supply_sag", "loaded").apply(V, m, (d,))
    assert felt[[0, 3]] == pytest.approx([-8.4, 8.4])
    # D = V/V_b of the drop R i of the source, i as the square of what the motor feels
    resistance = d * 12 / 8.4**2
    assert np.abs(V) - np.abs(felt) == pytest.approx((V / 12) ** 2 * resistance * felt**2)
    small = 1 - term("supply_sag", "loaded").apply(V, m, (0.01,)) / V
    assert small[2] / small[3] == pytest.approx(0.6**3, rel=0.02)
    wound = 1 - term("winding_resistance").apply(V, m, (0.01 / 12,)) / V
    assert wound[2] / wound[3] == pytest.approx(0.6, rel=0.02)


def test_a_jet_takes_the_root_of_either_thrust_and_may_reverse_what_is_left():
    x = np.array([12.0, 6.0, 0.6])
    on = history(3)
    for share in (1.0, 0.25):
        beside = replace(on, others={"neighbour_thrust": 40.0 * np.array([share, share, share])})
        beside = replace(beside, others={"neighbour_thrust": np.append(beside.others["neighbour_thrust"], 40.0)})
        m = moment(beside, S, x=np.append(x, 0.0))
        T = 0.5 * np.append(x, 0.0) ** 2
        lost = T - term("thruster_interaction").apply(T, m, (0.2,))
        assert lost[:3] / 72 == pytest.approx(0.2 * np.sqrt(share) * x / 12), "in proportion to n_i and sqrt T_j"
        assert lost[3] == 0.0
        assert (T - lost)[2] < 0 < T[2]


def test_a_water_column_of_a_small_thruster_is_within_bounds_that_its_samples_show():
    inflow = term("inflow_dynamics")
    least = {s: inflow.parameters(replace(S, spacing=s))[1].low for s in (0.0, 0.001, 0.01, 0.02, 0.5)}
    assert least == {0.0: 0.004, 0.001: 0.004, 0.01: 0.01, 0.02: 0.02, 0.5: 0.05}
    assert (0.1, 0.01) in inflow.trials(replace(S, spacing=0.001))
    assert min(tau for _, tau in inflow.trials(replace(S, spacing=0.1))) == 0.1


def test_the_exponents_of_drives_are_within_bounds():
    p = term("exponent").parameters(S)[0]
    assert p.low < 2 / 3 - 0.1
    x = np.array([1.5, 12.0])
    assert term("exponent").apply(0.5 * x**2, moment(H, S, x=x), (2 / 3,))[0] == pytest.approx(72 * (1 / 8) ** (2 / 3))
