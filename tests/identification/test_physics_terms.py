"""Every textbook form: absent at its neutral amount, seen at its trials, bounded, told in one sentence; and the
filters behind them against solvers that know nothing of them."""

import ast
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from runs_on_intervals import history, moment, scale, uneven
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import predict
from identification.physics.catalogue import CATALOGUE
from identification.physics.term import STAGES
from identification.run_history import filters
from identification.run_history.remembered import RememberedRun
from identification.run_history.slip import slip

H = history()
S = scale(H)
NAMES = [f"{t.id}-{t.form}" if t.form else t.id for t in CATALOGUE]
every_term = pytest.mark.parametrize("term", CATALOGUE, ids=NAMES)


def term(name, form=""):
    return next(t for t in CATALOGUE if t.id == name and form in (t.form, ""))


def neutral(term):
    """Amounts that take the effect away; inner parameters from the first trial."""
    first = term.trials(S)[0]
    out = [p.neutral if p.neutral is not None else v for p, v in zip(term.parameters(S), first, strict=True)]
    names = [p.name for p in term.parameters(S)]
    if "share_2" in names:  # the second amount of a creep with two constants
        out[names.index("share_2")] = 0.0
    return tuple(out)


def predicted(terms, thetas, h=H, s=S, C=0.5, tare=0.0):
    """`h`: a history, or a run that remembers."""
    run = h if isinstance(h, RememberedRun) else RememberedRun(h)
    return predict(Model(tuple(terms)), Theta(C, tuple(thetas), (tare,)), run, s, tare)


def base(h=H, C=0.5):
    return C * h.driver * np.abs(h.driver)


def with_driver(driver, dt):
    h = history(driver.size)
    edges = np.concatenate([[0.0], np.cumsum(dt)])
    return replace(h, edges=edges, driver=driver, sampled=0.5 * (edges[1:] + edges[:-1]))


# ---------------------------------------------------------------- what all terms have in common


@every_term
def test_a_neutral_amount_changes_nothing(term):
    F, _ = predicted([term], [neutral(term)])
    assert base() == pytest.approx(F, abs=1e-9 * S.thrust)


@every_term
def test_each_trial_is_seen_and_within_bounds(term):
    known = term.parameters(S)
    assert known[0].neutral is not None
    assert term.trials(S)
    for trial in term.trials(S):
        assert len(trial) == len(known)
        for p, value in zip(known, trial, strict=True):
            assert p.low < p.high
            assert p.low <= value <= p.high, p.name
            assert p.neutral is None or p.low <= p.neutral <= p.high
        assert trial[0] != known[0].neutral
        F, _ = predicted([term], [trial])
        assert np.all(np.isfinite(F))
        if not (term.id == "dead_band" and trial[0] < 1.0):  # no level of this run is so small
            assert np.max(np.abs(F - base())) > 3e-5 * S.thrust


@every_term
def test_the_prediction_moves_continuously_with_every_parameter(term):
    """A fit by slopes needs it: a small step of a parameter is a small step of the prediction, twice as far twice as
    much (or it passed a kink)."""
    for trial in term.trials(S)[:2]:
        middle, _ = predicted([term], [trial])
        for j, p in enumerate(term.parameters(S)):
            moved = []
            for step in (1e-7, 1e-5):
                at = list(trial)
                at[j] += step * (p.high - p.low) * (1 if trial[j] < 0.5 * (p.low + p.high) else -1)
                moved.append(np.linalg.norm(predicted([term], [tuple(at)])[0] - middle))
            assert moved[0] < 0.05 * moved[1] + 1e-9 * S.thrust


@every_term
def test_bounds_hold_nothing_that_is_not_finite(term):
    known = term.parameters(S)
    for corner in ([p.low for p in known], [p.high for p in known]):
        F, x = predicted([term], [tuple(corner)])
        assert np.all(np.isfinite(F))
        assert np.all(np.isfinite(x))


@every_term
def test_nothing_depends_on_one_bench_s_volts_and_newtons(term):
    """The same shape of run at 7 times the volts and 1/30 of the newtons: the same relative change."""
    other = history(volts=7.0, newtons=1 / 30, flow=3.0)
    s = scale(other, volts=7.0, newtons=1 / 30, flow=3.0)
    C = 0.5 / 30 / 49
    for mine, theirs in zip(term.trials(S), term.trials(s), strict=True):
        here, _ = predicted([term], [mine], tare=1.0)
        there, _ = predicted([term], [theirs], other, s, C, tare=1 / 30)
        sought = 1e-6 if term.id == "rotation_coupling" else 1e-8  # what an optimiser found beforehand is in it
        assert 30 * there == pytest.approx(here, abs=sought * S.thrust)


@every_term
def test_the_statement_is_one_sentence_with_its_number(term):
    for trial in term.trials(S):
        says = term.statement(trial, S)
        assert re.match(r"[A-Z][a-z-]+( [a-z-]+)*: ", says)
        assert says.endswith(".")
        assert not re.search(r"\.\s", says), "more than one sentence"
        assert re.search(r"\d", says)
        assert not re.search(r"\b(nan|inf)\b", says)
    elsewhere = tuple(0.3 * p.low + 0.7 * p.high for p in term.parameters(S))
    assert term.statement(elsewhere, S) != term.statement(term.trials(S)[0], S)


@every_term
def test_it_says_what_it_is_and_what_it_needs(term):
    assert term.stage in STAGES
    assert term.physics
    assert term.physics[0].islower()
    assert term.covariates
    assert set(term.needs) <= set(H.others)
    bare = replace(H, others={}, rate=None, rate_count=None, rate_sampled=None)
    if not term.needs:
        predicted([term], [term.trials(S)[-1]], bare)


def test_ids_and_forms_are_unique():
    assert len({(t.id, t.form) for t in CATALOGUE}) == len(CATALOGUE)
    assert len({t.id for t in CATALOGUE}) == 27


@every_term
def test_finer_trials_reach_to_the_neighbours(term):
    where = 1 if term.id == "stand_resonance" else -1  # frequency, or place of the jump
    places = sorted({t[where] for t in term.trials(S)})
    for trial in term.trials(S):
        finer = np.array(term.finer(trial, S))
        if finer.size:
            tried = np.unique(np.abs(finer[:, where]))  # a delay has both signs
            at = places.index(trial[where])
            assert tried.min() <= 0.05 * places[at] + 0.95 * places[max(at - 1, 0)]
            assert tried.max() >= 0.05 * places[at] + 0.95 * places[min(at + 1, len(places) - 1)]
            assert np.all(np.diff(tried) < 0.2 * np.maximum(max(np.diff(places).min(), trial[where]), tried[1:]))


def test_only_jumps_delays_and_ringing_have_finer_trials():
    finer = {(t.id, t.form) for t in CATALOGUE if t.finer(t.trials(S)[0], S)}
    assert finer == {("zero_offset", ""), ("dead_band", "jump"), ("stand_resonance", ""), ("time_skew", "")}


# ---------------------------------------------------------------- filters against independent solvers


def integrated(slope, y0, u, dt, seen=0):
    """Ends (M, k) and means (M,) of component `seen` of y' = slope(y, u), u constant in each interval."""
    y, ends, means = np.append(y0, 0.0), [], []
    for value, width in zip(u, dt, strict=True):
        y[-1] = 0.0
        found = solve_ivp(lambda _t, z, v=value: [*slope(z[:-1], v), z[seen]], (0.0, width), y, rtol=1e-10, atol=1e-12)
        y = found.y[:, -1].copy()
        ends.append(y[:-1].copy())
        means.append(y[-1] / width)
    return np.array(ends), np.array(means)


def steps(n, seed=3, low=0.004, high=0.25):
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(-10, 10, n // 5), 5), uneven(rng, n // 5 * 5, low, high)


@pytest.mark.parametrize("tau", [0.002, 0.1, 3.0, 300.0])
def test_lowpass_is_the_first_order_equation(tau):
    u, dt = steps(60)
    end, mean = filters.lowpass(u, dt, tau, start=2.0)
    ends, means = integrated(lambda y, v: [(v - y[0]) / tau], [2.0], u, dt)
    assert end == pytest.approx(ends[:, 0], abs=1e-7)
    assert mean == pytest.approx(means, abs=1e-7)


def test_lowpass_on_an_even_grid_is_a_recursive_filter():
    u = np.random.default_rng(4).standard_normal(5000)
    a = np.exp(-0.02 / 0.7)
    end, _ = filters.lowpass(u, np.full(u.size, 0.02), 0.7)
    assert end == pytest.approx(lfilter([1 - a], [1, -a], u), abs=1e-12)


@pytest.mark.parametrize(("quadratic", "linear"), [(0.5, 0.0), (0.05, 3.0), (5.0, 0.2)])
def test_lag_is_the_rotor_equation(quadratic, linear):
    """Intervals short against the lag, as preparing lays them after a step."""
    fastest = quadratic * 20 + linear
    u, dt = steps(100, low=0.05 / fastest, high=0.3 / fastest)
    mean = filters.lag(u, dt, quadratic, linear, start=-3.0)[1]
    _, means = integrated(
        lambda y, v: [quadratic * (v * abs(v) - y[0] * abs(y[0])) + linear * (v - y[0])], [-3.0], u, dt
    )
    assert mean == pytest.approx(means, abs=0.02)  # of 10: the mean rate within an interval stands for the rate


def test_lag_ends_at_its_command_and_stays_at_rest():
    u = np.full(50, 6.0)
    assert filters.lag(u, np.full(50, 1.0), 2.0, 0.0)[1][-1] == pytest.approx(6.0)
    assert filters.lag(np.zeros(50), np.full(50, 1.0), 2.0, 0.0)[1].tolist() == [0.0] * 50


@pytest.mark.parametrize(("frequency", "damping"), [(0.5, 0.02), (3.0, 0.3), (12.0, 0.9)])
def test_resonant_is_a_mass_on_a_spring(frequency, damping):
    u, dt = steps(50)
    w = 2 * np.pi * frequency
    mean = filters.resonant(u, dt, frequency, damping)
    _, means = integrated(lambda y, v: [y[1], w**2 * (v - y[0]) - 2 * damping * w * y[1]], [0.0, 0.0], u, dt)
    assert mean == pytest.approx(means, abs=1e-6)


@pytest.mark.parametrize("delay", [-7.3, -0.21, 0.0, 0.0013, 0.4, 100.0])
def test_delayed_is_the_overlap_of_shifted_intervals(delay):
    value, dt = steps(40)
    edges = 5.0 + np.concatenate([[0.0], np.cumsum(dt)])
    moved = edges + delay
    moved[0], moved[-1] = -1e9, 1e9  # held constant outside
    expected = []
    for a, b in pairwise(edges):
        shared = np.maximum(np.minimum(b, moved[1:]) - np.maximum(a, moved[:-1]), 0.0)
        expected.append(shared @ value / (b - a))
    assert filters.delayed(value, edges, delay) == pytest.approx(np.array(expected), abs=1e-9)


@pytest.mark.parametrize("width", [0.0, 0.7, 6.0, 50.0])
def test_play_is_moved_only_by_its_edges(width):
    u = np.random.default_rng(5).uniform(-10, 10, 300)
    y, expected = 0.0, []
    for v in u:
        if v - y > width:
            y = v - width
        elif y - v > width:
            y = v + width
        expected.append(y)
    got = filters.play(u, width)
    assert got == pytest.approx(np.array(expected), abs=1e-12)
    assert np.all(np.abs(got - u) <= width + 1e-12)
    assert np.array_equal(filters.play(np.repeat(u, 3), width), np.repeat(got, 3)), "play has no time of its own"


def opposite_by_hand(x, dt, turning):
    """One interval after the other, as the words say it."""
    out, t = [], 0.0
    sign = ended = began = 0
    other_end = {1: None, -1: None}
    for value, width in zip(x, dt, strict=True):
        now = 1 if value > turning else -1 if value < -turning else 0
        if now and now != sign:
            sign, began = now, t
        ended = other_end[-sign] if sign else None
        out.append((t + width / 2 - ended, t + width / 2 - began) if ended is not None else None)
        t += width
        if now:
            other_end[now] = t
    return out


def test_since_opposite_counts_from_the_last_turn_the_other_way():
    rng = np.random.default_rng(6)
    x = np.repeat(rng.choice([-5.0, -0.1, 0.0, 0.1, 4.0], 80), 4)
    x[:12] = 0.0
    dt = uneven(rng, x.size)
    since, began, known = filters.since_opposite(x, dt, 0.24)
    expected = opposite_by_hand(x, dt, 0.24)
    assert known.tolist() == [e is not None for e in expected]
    assert 0 < known.sum() < known.size
    for i in np.flatnonzero(known):
        assert (since[i], began[i]) == pytest.approx(expected[i], abs=1e-9)


def test_a_run_in_one_direction_has_no_opposite():
    assert not filters.since_opposite(np.array([0.0, 1.0, 2.0, 0.0]), np.ones(4), 0.1)[2].any()


def test_reconstructed_is_exact_on_a_line_and_flat_at_steps_and_peaks():
    rng = np.random.default_rng(7)
    edges = np.concatenate([[0.0], np.cumsum(uneven(rng, 60))])
    middle = 0.5 * (edges[1:] + edges[:-1])
    at = edges[:-1] + rng.uniform(0, 1, 60) * np.diff(edges)
    line = filters.reconstructed(3 * middle - 1, middle, at)
    assert line[1:-1] == pytest.approx(3 * at[1:-1] - 1)
    level = np.where(middle > middle[30], 5.0, 1.0)
    assert np.array_equal(filters.reconstructed(level, middle, at), level)
    peak = -np.abs(middle - middle[30])
    assert filters.reconstructed(peak, middle, at)[30] == peak[30]
    bent = filters.reconstructed(middle**2, middle, at)  # never beyond what both neighbours allow
    flat = np.minimum(np.diff(middle**2)[:-1] / np.diff(middle)[:-1], np.diff(middle**2)[1:] / np.diff(middle)[1:])
    assert bent[1:-1] == pytest.approx(middle[1:-1] ** 2 + flat * (at - middle)[1:-1])


def test_integral_is_held_constant_outside():
    edges = np.array([1.0, 2.0, 4.0])
    found = filters.integral(np.array([2.0, 3.0]), edges, np.array([-1.0, 1.0, 1.5, 4.0, 6.0]))
    assert found.tolist() == [-4.0, 0.0, 1.0, 8.0, 14.0]


# ---------------------------------------------------------------- forms against their formula


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
    assert got == pytest.approx(np.where(fine > 3.07, fine, 0.0).mean(axis=1), abs=0.04)
    shrunk = term("dead_band", "shrink").apply(mean, moment(moving, S), (3.07,))
    assert shrunk == pytest.approx(np.maximum(fine - 3.07, 0.0).mean(axis=1), abs=1e-4)


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


def test_forms_that_read_another_channel():
    m = moment(H, S)
    T, x = base(), H.driver
    U = H.others["flow_speed"]
    assert term("speed_of_advance").apply(T, m, (0.4,)) == pytest.approx(T - 0.4 * np.abs(x) * U)
    assert term("strut_drag").apply(T, m, (-3.0,)) == pytest.approx(T - 3.0 * U * np.abs(U))
    on = H.others["neighbour_thrust"] > 0
    assert term("thruster_interaction").apply(T, m, (0.2,)) == pytest.approx(np.where(on, 0.8 * T, T))
    assert np.array_equal(term("rotation_coupling").apply(x, moment(replace(H, rate=None), S), (1.0,)), x)
    torque = H.others["torque"]
    assert term("torque_crosstalk", "measured").apply(T, m, (0.7,)) == pytest.approx(T + 0.7 * torque)
    ratio = H.others["bus_voltage"] / H.others["bus_voltage"].max()
    assert term("supply_sag").apply(x, m, (1.0,)) == pytest.approx(x * ratio)
    heated = replace(H, others={"current": np.where(np.arange(H.driver.size) < 200, 8.0, 0.0)})
    warm = term("heating", "winding").apply(np.ones(400), moment(heated, S), (0.3, 5.0))
    t = H.edges[200]
    assert warm[200:] == pytest.approx(1 - 0.3 * (1 - np.exp(-t / 5)) * np.exp(-(H.middle[200:] - t) / 5), abs=3e-3)


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
    assert term("heating", "winding").apply(T, m, (0.3, 40.0))[-1] == pytest.approx(0.7 * 72)
    twice = term("heating", "magnet").apply(T, m, (0.3, 40.0, 40.0))
    s = h.middle / 40
    assert twice == pytest.approx(72 * (1 - 0.3 * (1 - (1 + s) * np.exp(-s))), abs=0.01)
    warm = replace(h, others={**h.others, "motor_temperature": np.where(h.middle < 20.0, 15.0, 35.0)})
    by_reading = term("heating", "measured_winding").apply(T, moment(warm, S), (0.01,))
    assert by_reading[[0, -1]] == pytest.approx([72.0, 72 * 0.8])
    later = term("heating", "measured_magnet").apply(T, moment(warm, S), (0.01, 40.0))
    since = h.middle - 20.0
    assert later[since > 0] == pytest.approx(72 * (1 - 0.2 * (1 - np.exp(-since[since > 0] / 40))), abs=0.02)
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


def test_stand_forms_use_their_filters():
    T = base()
    m = moment(H, S)
    assert np.array_equal(term("hysteresis").apply(T, m, (2.0,)), filters.play(T, 2.0))
    rung = filters.resonant(T, H.dt, 3.0, 0.1)
    assert term("stand_resonance").apply(T, m, (0.5, 3.0, 0.1)) == pytest.approx(0.5 * (T + rung))
    assert term("time_skew").apply(T, m, (0.3,)) == pytest.approx(filters.delayed(T, H.edges, 0.3))


def test_a_clipping_cell_shows_the_mean_of_samples_that_clip_one_by_one():
    """Monte Carlo of noisy samples round the limit, tare and all."""
    value = np.linspace(-110.0, 110.0, 41)
    s = replace(S, noise=4.0)
    still = np.zeros(41)
    got = term("load_cell_saturation").apply(value, moment(H, s, tare=7.0, x=still), (90.0,))
    noise = 4.0 * np.random.default_rng(9).standard_normal((41, 40_000))
    expected = np.clip(value[:, None] + 7.0 + noise, -90.0, 90.0).mean(axis=1) - 7.0
    assert got == pytest.approx(expected, abs=5 * 4.0 / 200)
    assert not np.allclose(got, np.clip(value + 7.0, -90.0, 90.0) - 7.0, atol=0.5), "the bend at the limit is rounded"
    hard = term("load_cell_saturation").apply(value, moment(H, replace(S, noise=0.0), tare=7.0, x=still), (90.0,))
    assert hard == pytest.approx(np.clip(value + 7.0, -90.0, 90.0) - 7.0)


def of_levels(level, thrust):
    """A run of levels of one second each with their samples (n, 100)."""
    n = level.size
    return replace(
        H,
        edges=np.arange(n + 1.0),
        driver=np.sqrt(level),
        thrust=thrust.mean(axis=1),
        excess=np.zeros(1),
        sample_time=np.repeat(np.arange(n), 100) + np.tile((np.arange(100) + 0.5) / 100, n),
        sample_thrust=thrust.ravel(),
    )


@pytest.mark.parametrize("dof", [4, np.inf])
def test_a_clipping_cell_knows_how_its_samples_scatter_in_the_tails(dof):
    """Levels of 100 samples each; Student's noise of four degrees of freedom, or normal."""
    rng = np.random.default_rng(3)
    level = np.concatenate([rng.uniform(40.0, 80.0, 90), np.linspace(94.0, 106.0, 40)])
    e = rng.standard_normal((level.size, 100)) if np.isinf(dof) else rng.standard_t(dof, (level.size, 100))
    run = of_levels(level, np.clip(level[:, None] + e, -100.0, 100.0))
    std, tails = run.scatter
    assert std == pytest.approx(1.0, rel=0.1)
    assert tails == pytest.approx(0.0 if np.isinf(dof) else 0.12, abs=0.04)
    got = term("load_cell_saturation").apply(
        level, moment(run, replace(S, noise=1.0), x=np.zeros(level.size)), (100.0,)
    )
    many = rng.standard_normal(40_000) if np.isinf(dof) else rng.standard_t(dof, 40_000)
    expected = np.minimum(level[:, None] + many, 100.0).mean(axis=1)
    assert got == pytest.approx(expected, abs=0.03)


def test_noise_that_is_proportional_scatters_most_where_the_cell_clips():
    rng = np.random.default_rng(4)
    level = np.concatenate([rng.uniform(5.0, 85.0, 300), np.linspace(97.0, 103.0, 10)])
    thrust = level[:, None] + np.hypot(0.5, 0.02 * level)[:, None] * rng.standard_normal((level.size, 100))
    std, tails = of_levels(level, np.clip(thrust, -100.0, 100.0)).scatter
    assert std == pytest.approx(np.hypot(0.5, 0.02 * 100.0), rel=0.05)
    assert tails < 0.03


def through_zero():
    """A ramp from -14 V to 14 V, and the command within each interval (30, 4001)."""
    ends = np.linspace(-14.0, 14.0, 31)
    fine = np.linspace(ends[:-1], ends[1:], 4001).T
    mean = fine.mean(axis=1)
    return replace(H, edges=np.arange(31.0), driver=mean, excess=np.mean(fine**2, axis=1) - mean**2), fine


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_ramp_through_the_limit_of_the_cell_clips_in_a_part_of_each_interval(noise):
    ramp, fine = through_zero()
    mean = ramp.driver
    e = noise * np.random.default_rng(2).standard_normal(fine.shape)
    force = 0.5 * fine * np.abs(fine)
    expected = np.clip(force + e, -60.0, 60.0).mean(axis=1)
    at = moment(ramp, replace(S, noise=noise), x=mean)
    got = term("load_cell_saturation").apply(force.mean(axis=1), at, (60.0,))
    assert got == pytest.approx(expected, abs=0.06 + 5 * noise / 60)
    assert np.max(np.abs(np.clip(force.mean(axis=1), -60.0, 60.0) - expected)) > 0.3, "not the clipped mean"
    share = term("load_cell_saturation").shown(ramp, 0.5, mean, got, (60.0,))
    assert share == pytest.approx((np.abs(force) < 60.0).mean(axis=1), abs=0.03 + 0.3 * noise)


def compressed(size, bend, onset):
    """Its slope 1 - bend (size - onset) integrated numerically."""
    fine = np.linspace(0.0, size, 20_001)
    return np.trapezoid(np.clip(1 - bend * np.maximum(fine - onset, 0.0), 0.0, 1.0), fine)


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_ramp_through_the_knee_of_the_cell(noise):
    ramp, fine = through_zero()
    mean = ramp.driver
    force = 0.5 * fine * np.abs(fine) + noise * np.random.default_rng(2).standard_normal(fine.shape)
    bend, onset = 0.02, 40.0
    e = np.clip(np.abs(force) - onset, 0.0, 1 / bend)
    expected = (np.sign(force) * (np.minimum(np.abs(force), onset) + e - 0.5 * bend * e**2)).mean(axis=1)
    knee = term("load_cell_saturation", "knee")
    got = knee.apply(force.mean(axis=1), moment(ramp, replace(S, noise=noise), x=mean), (bend, onset))
    assert got == pytest.approx(expected, abs=0.02 + 0.01 * noise)
    assert knee.shown(ramp, 0.5, mean, np.array([compressed(60.0, bend, onset)]), (bend, onset)) == pytest.approx(0.6)


def test_a_command_in_a_knee_moves_the_rotor_by_the_slope():
    volts = np.array([5.0, 12.0, 16.0, -16.0, 25.0])
    still = replace(H, edges=np.arange(6.0), driver=volts, excess=np.zeros(5))
    knee = term("command_saturation", "knee")
    got = knee.apply(volts, moment(still, S, x=volts), (0.1, 10.0))
    assert got == pytest.approx([np.sign(v) * compressed(abs(v), 0.1, 10.0) for v in volts])
    assert knee.passed(still, (0.1, 10.0)) == pytest.approx([1.0, 0.8, 0.4, 0.4, 0.0])
    assert knee.apply(volts, moment(still, S, x=volts), (0.0, 10.0)) == pytest.approx(volts)


def test_a_jet_on_a_circuit_comes_later():
    dt = np.full(400, 0.5)
    steady = replace(H, edges=np.append(0.0, np.cumsum(dt)), driver=np.full(400, 10.0), excess=np.zeros(400))
    at = moment(steady, S, x=np.full(400, 10.0))
    late, prompt = (
        term("recirculation", kind).apply(np.full(400, 50.0), at, (0.04, 20.0)) for kind in ("circuit", "rate")
    )
    t = steady.edges[1:] - 0.25
    assert late == pytest.approx(50.0 - 4.0 * (1 - (1 + t / 20.0) * np.exp(-t / 20.0)), abs=2e-3)
    assert np.all(late >= prompt - 1e-9)


# ---------------------------------------------------------------- the chain of stages


def test_terms_act_in_the_order_of_the_bench():
    clip, uneven_blade, linear = term("command_saturation"), term("asymmetry"), term("load_cell_nonlinearity")
    F, x = predicted(Model().plus(linear).plus(uneven_blade).plus(clip).terms, [(8.0,), (0.5,), (1e-3,)])
    volts = np.clip(H.driver, -8, 8)
    T = np.where(volts < 0, 0.5, 1.0) * 0.5 * volts * np.abs(volts)
    assert x == pytest.approx(volts)
    assert pytest.approx(T * (1 + 1e-3 * np.abs(T))) == F


def test_a_term_that_reads_the_measured_rate_does_not_explain_that_rate():
    F, x = predicted([term("rotation_coupling")], [(1.0,)])
    assert np.array_equal(x, H.driver)
    n = term("rotation_coupling").apply(H.driver, moment(H, S), (1.0,))
    assert not np.allclose(n, x, atol=0.1)
    assert pytest.approx(0.5 * n * np.abs(n)) == F


def test_what_is_remembered_is_what_is_computed():
    fresh, old = history(), RememberedRun(history())
    lag, clip = term("motor_lag"), term("load_cell_saturation")
    for C, tau, limit, tare in [
        (0.5, 0.1, 60.0, 0.0),
        (0.5, 0.1, 50.0, 3.0),
        (0.6, 0.1, 50.0, 3.0),
        (0.5, 0.1, 60.0, 0.0),
    ]:
        again, _ = predicted([lag, clip], [(tau,), (limit,)], old, S, C, tare)
        first, _ = predicted([lag, clip], [(tau,), (limit,)], fresh, S, C, tare)
        assert np.array_equal(again, first)


def test_the_engine_names_no_effect():
    """Groups of effects are traits of the terms: adding one is its file, its page, its line in the catalogue."""
    ids = {term.id for term in CATALOGUE} - {"current"}
    engine = Path(__file__).parents[2] / "identification" / "mismatch"
    found = [
        (path.name, node.value)
        for path in engine.rglob("*.py")
        if "vehicle" not in path.parts
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and node.value in ids
    ]
    assert found == []
    rooms = {term.__class__.__module__ for term in CATALOGUE}
    reached = [
        path.name for path in engine.rglob("*.py") if rooms & set(re.findall(r"from (\S+) import", path.read_text()))
    ]
    assert reached == []
