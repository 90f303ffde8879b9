from dataclasses import replace

import numpy as np
import pytest

from identification.estimation.least_squares import Rows, estimate, excess_std
from identification.recording import Channel, Recording
from identification.steady_state.pooling import inverse_trigamma, moderate
from identification.thruster.thrust import ThrustFit, fit_runs, fit_thrust
from identification.thruster.thrust_data import Unusable, gain_std, prepare
from identification.thruster.thrust_report import digits, sentence, table, verdicts
from tests.identification.thrust_runs import (
    LEVELS,
    ar1,
    level_table,
    rov_levels,
    sine,
    staircase,
    t200_levels,
    voltage_sine_stand,
    white,
)  # fmt: skip

SHORT = (0.0, 9.0, -9.0, 18.0, -18.0, 0.0, 13.0, -13.0)


def c_and_cover(make, runs, truth=0.4):
    rng = np.random.default_rng(2024)
    fits = [fit_thrust([make(rng)]).parameters["C"] for _ in range(runs)]
    return np.mean([p.low <= truth <= p.high for p in fits])


@pytest.mark.timeout(600)
@pytest.mark.parametrize(("noise", "hold"), [(white, 1.0), (ar1(0.9), 4.0)], ids=["white", "autocorrelated"])
def test_interval_of_C_covers_the_truth(noise, hold):
    covered = c_and_cover(lambda rng: staircase(noise=noise, hold=hold, rate=100.0, levels=SHORT, rng=rng), 500)
    assert 0.93 <= covered <= 0.975


def test_interval_covers_on_level_tables_and_with_poor_repeatability():
    V = np.array(LEVELS)

    def levels(rng):
        return level_table(V, 0.4 * V * np.abs(V) + 1.5 + 0.3 * rng.standard_normal(V.size))

    def poor(rng):
        shift = np.repeat(rng.normal(0, 0.5, len(SHORT)), 50)
        return staircase(levels=SHORT, hold=1.0, rng=rng, mend=lambda t, V, F: F + shift)

    assert 0.91 <= c_and_cover(levels, 400) <= 0.985
    assert 0.90 <= c_and_cover(poor, 200) <= 0.99


def test_interval_covers_on_the_samples_of_a_sine():
    assert c_and_cover(lambda rng: sine(noise=ar1(0.9), rng=rng), 150) >= 0.88


def test_weighted_is_no_worse_than_plain_where_noise_differs():
    def loud(t, V, F):
        return F + np.where(np.abs(V) > 14, 5.0, 0.0) * rng.standard_normal(t.size)

    errors = {"wls": [], "ls": []}
    for seed in range(60):
        rng = np.random.default_rng(seed)
        run = staircase(rng=rng, mend=loud)
        for method, found in errors.items():
            found.append(fit_thrust([run], method=method).parameters["C"].value - 0.4)
    assert np.std(errors["wls"]) < np.std(errors["ls"])


def test_noise_free_run_is_recovered_exactly():
    fit = fit_thrust([staircase(sigma=0.0)])
    assert fit.parameters["C"].value == pytest.approx(0.4, rel=1e-9)
    assert fit.chi2_per_dof is None
    assert fit.rmse < 1e-9


def test_several_recordings_share_C_and_keep_their_tares():
    rng = np.random.default_rng(1)
    runs = [staircase(tare=b, rng=rng, recording_id=f"r{k}") for k, b in enumerate((1.5, -20.0, 4.0))]
    fit = fit_thrust(runs)
    assert [fit.tare[f"r{k}"].value for k in range(3)] == pytest.approx([1.5, -20, 4], abs=0.15)
    assert fit.parameters["C"].std < fit_thrust(runs[:1]).parameters["C"].std
    assert len(table(fit)) == 4
    assert "of 3 recordings" in sentence(fit)


def test_mixed_runs_are_fitted_on_samples():
    fit = fit_thrust([staircase(), sine()])
    assert fit.rmse_of == "samples"
    assert fit.parameters["C"].value == pytest.approx(0.4, abs=0.01)
    assert any("motor_voltage" in text for text in verdicts(fit_thrust([sine()])))


def test_asymmetry_is_seen_and_absent_where_it_is_not():
    run = staircase(C_minus=0.36, steps=False)
    single, split = fit_thrust([run]), fit_thrust([run], "C+/C-")
    assert split.difference.significant
    assert split.parameters["C_minus"].value == pytest.approx(0.36, abs=0.003)
    assert single.estimate.underfit.underfitted
    assert single.estimate.birge_ratio > 5
    assert single.estimate.excess_std > 0.5
    said = " ".join(verdicts(single, [split]))
    assert "use --model C+/C-" in said
    assert "Birge" in said
    even = fit_thrust([staircase()], "C+/C-")
    assert not even.difference.significant
    assert "not significant" in " ".join(verdicts(even))
    slight = fit_thrust([staircase(C_minus=0.3985, sigma=0.05)], "C+/C-")
    assert "% only" in " ".join(verdicts(slight))


def test_one_direction_cannot_tell_C_minus():
    run = staircase(levels=(0.0, 6.0, 12.0, 18.0, 9.0, 0.0))
    split = fit_thrust([run], "C+/C-")
    assert np.isnan(split.parameters["C_minus"].std)
    assert split.parameters["C_plus"].value == pytest.approx(0.4, abs=0.01)
    assert split.difference is None
    said = " ".join(verdicts(split))
    assert "cannot be compared" in said
    assert "C_minus" in said
    assert "not determined" in sentence(split)


def test_calibration_adds_in_quadrature_and_dominates_when_large():
    run = staircase(calibration={"gain_std": 0.01})
    p = fit_thrust([run]).parameters["C"]
    assert p.std_calibration == pytest.approx(0.01 * p.value)
    assert p.std == pytest.approx(np.hypot(p.std_statistical, p.std_calibration))
    assert p.high - p.low == pytest.approx(2 * 1.96 * p.std, rel=0.01)
    two = fit_thrust([run, staircase(recording_id="b")])
    assert "largest was used" in " ".join(verdicts(two))


@pytest.mark.parametrize("stated", ["0.1", None, -1.0, float("nan")])
def test_calibration_that_is_no_number_counts_as_not_stated(stated):
    channel = Channel("f", "c", "thrust", "N", np.zeros(1), np.zeros(1), calibration={"gain_std": stated})
    assert gain_std(channel) == 0.0


def test_what_cannot_be_used_says_why():
    t = np.arange(100.0)
    F = Channel("f", "c", "thrust", "N", t, t)
    V = Channel("u", "c", "command_voltage", "V", t, np.full(100, 3.0))
    late = Channel("u", "c", "command_voltage", "V", t + 1000, np.full(100, 3.0))
    cases = {
        "no channel of quantity thrust": Recording("r", "T", (V,)),
        "no command_voltage nor": Recording("r", "T", (F,)),
        "at least two are needed": Recording("r", "T", (F, V)),
        "vehicle trial": Recording("r", "T", (F, V), kind="vehicle"),
        "all of 100 are missing": Recording("r", "T", (F, late)),
    }
    for expected, recording in cases.items():
        refused = fit_thrust([recording])
        assert isinstance(refused, Unusable)
        assert expected in refused.reason
    assert isinstance(fit_thrust([]), Unusable)


def test_a_level_whose_thrust_has_no_scatter_is_refused():
    run = prepare(staircase(sigma=0.01), "command_voltage")
    first, *others = run.points.points
    still = replace(first, thrust=replace(first.thrust, std_error=6.4e-323))
    refused = fit_runs([replace(run, points=replace(run.points, points=(still, *others)))])
    assert isinstance(refused, Unusable)
    assert "its samples there stand still or are damaged" in refused.reason


def test_skipped_samples_are_counted_and_said():
    fit = fit_thrust([staircase(mend=lambda t, V, F: np.where(t < 0.2, np.nan, F))])
    assert fit.skipped == 10
    assert "10 thrust samples" in " ".join(verdicts(fit))


def test_two_levels_and_two_parameters_leave_the_fit_unjudged():
    fit = fit_thrust([staircase(levels=(0.0, 10.0))])
    assert np.isfinite(fit.parameters["C"].std)
    assert "cannot be judged" in " ".join(verdicts(fit))
    assert fit.chi2_per_dof is None
    table_fit = fit_thrust([level_table([0, 10], [0, 40])])
    assert "standard error unknown" in sentence(table_fit)


def test_unsteady_and_poorly_excited_are_said():
    run = staircase(mend=lambda t, V, F: F + np.where((t >= 12) & (t < 14), 9 * (t - 12), 0.0))
    assert "not steady" in " ".join(verdicts(fit_thrust([run])))
    far = level_table([10.0, 10.001, 10.002, 10.003], [40, 40.1, 39.9, 40])
    assert "poorly excited" in " ".join(verdicts(fit_thrust([far])))


def test_digits():
    assert digits(float("nan"), 1.0) == "not determined"
    assert digits(123.456, 20.0) == "123"


def test_excess_is_zero_when_points_agree_and_found_when_not():
    rng = np.random.default_rng(0)
    H, ones = np.ones((400, 1)), np.ones(400)
    agree = Rows(H, rng.normal(0, 0.5, 400), ("m",), (slice(0, 400),), ones, 50 * ones)
    assert excess_std(agree) == 0.0
    differ = Rows(H, rng.normal(0, 3.0, 400), ("m",), (slice(0, 400),), ones, 50 * ones)
    found = estimate(differ)
    assert found.excess_std == pytest.approx(np.sqrt(8), rel=0.15)
    assert found.spread(np.ones(1)).std == pytest.approx(3 / 20, rel=0.1)
    exact = Rows(H, rng.normal(0, 1.0, 400), ("m",), (slice(0, 400),), ones, np.inf * ones)
    assert estimate(exact).spread(np.ones(1)).std == pytest.approx(1 / 20, rel=1e-6)


def test_moderation_follows_the_load_and_leaves_few_points_alone():
    rng = np.random.default_rng(3)
    load = np.repeat([0.0, 100.0], 20)
    true = np.where(load > 0, 1.0, 0.1)
    raw = true * np.sqrt(rng.chisquare(6, 40) / 6)
    shared = moderate(raw, np.full(40, 6.0), load)
    assert np.mean(np.log(shared.std_error / true) ** 2) < 0.3 * np.mean(np.log(raw / true) ** 2)
    few = moderate(raw[:3], np.full(3, 6.0), load[:3])
    assert few.std_error is not None
    assert np.array_equal(few.std_error, raw[:3])
    wild = moderate(np.array([0.01, 1, 100, 0.1, 10, 3]), np.full(6, 200.0), np.zeros(6))
    assert wild.std_error == pytest.approx([0.01, 1, 100, 0.1, 10, 3], rel=0.1)
    assert inverse_trigamma(1e-3) == pytest.approx(1000.5, rel=1e-3)


@pytest.mark.parametrize(("number", "single", "split"), [(2, 5.34, 3.06), (5, 5.31, 2.93), (6, 5.07, 2.91)])
def test_voltage_sine_stand(number, single, split):
    run = voltage_sine_stand(number)
    assert fit_thrust([run]).rmse == pytest.approx(single, abs=0.02)
    fit = fit_thrust([run], "C+/C-")
    assert fit.rmse == pytest.approx(split, abs=0.02)
    assert fit.difference.significant


def test_rov_levels_cannot_see_their_asymmetry_before_the_dead_band():
    single, split = fit_thrust([rov_levels()]), fit_thrust([rov_levels()], "C+/C-")
    assert single.rmse == pytest.approx(3.51, abs=0.01)
    assert single.parameters["C"].value == pytest.approx(1.948, abs=0.001)
    assert not split.difference.significant
    assert not single.whiteness.white


def test_t200_levels():
    single, split = fit_thrust([t200_levels()]), fit_thrust([t200_levels()], "C+/C-")
    assert isinstance(split, ThrustFit)
    assert single.rmse == pytest.approx(2.89, abs=0.01)
    assert split.rmse == pytest.approx(2.00, abs=0.01)
    assert split.difference.significant
