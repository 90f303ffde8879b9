"""Models with flow and by rotation rate, models side by side, and what remains when a parameter is dropped."""

import numpy as np
import pytest

from identification.recording import Channel, Recording
from identification.thruster.model_choice import effective_samples, side_by_side, statement, without
from identification.thruster.thrust import ThrustFit, fit_thrust
from identification.thruster.thrust_data import Unusable, flow_of
from identification.thruster.thrust_forms import FORMS, columns, model_of
from tests.identification.thrust_runs import ar1, sine, staircase

C_T, C_S, K = 0.4, 1.5, 1.1


def with_rate_and_flow(run, rng, *, U=0.8, C_s=C_S, k=K, noise=0.004, flow=True, rate_noise=0.01):
    """The run again with n = k V, a flow U, and thrust C n|n| - C_s |n| U + 1.5."""
    cell = run.first_of("thrust")
    V = run.first_of("command_voltage").held_at(cell.time)
    n = k * V
    F = C_T * n * np.abs(n) - C_s * np.abs(n) * U + 1.5 + rng.normal(0, 0.3, n.size)
    t = np.arange(0.0, cell.time[-1], 0.25)
    channels = [
        run.first_of("command_voltage"),
        Channel("f", "cell", "thrust", "N", cell.time, F),
        Channel("n", "motor", "rotation_rate", "rev/s", cell.time, n + rng.normal(0, rate_noise, n.size)),
    ]
    if flow:
        channels.append(Channel("flow", "flow", "flow_speed", "m/s", t, U + rng.normal(0, noise, t.size)))
    return Recording("flow-1", "T3", tuple(channels), steps=run.steps)


def inside(parameter, truth):
    return abs(parameter.value - truth) < 4 * parameter.std


@pytest.mark.parametrize("steps", [True, False])
def test_flow_term_is_found_by_rate_and_by_voltage(steps):
    rng = np.random.default_rng(1)
    run = with_rate_and_flow(staircase(steps=steps), rng)
    by_rate = fit_thrust([run], "C V|V| - C_s|V|U", "rotation_rate")
    assert by_rate.model == "C_t n|n| - C_s|n|U"
    assert inside(by_rate.parameters["C_t"], C_T)
    assert inside(by_rate.parameters["C_s"], C_S)
    assert by_rate.parameters["C_t"].unit == "N.s^2/rev^2"
    assert by_rate.parameters["C_s"].unit == "N.s^2/(rev.m)"
    by_voltage = fit_thrust([run], "C V|V| - C_s|V|U")
    assert inside(by_voltage.parameters["C"], C_T * K**2)
    assert inside(by_voltage.parameters["C_s"], C_S * K)
    split = fit_thrust([run], "C+/C- - C_s|V|U")
    assert split.difference is not None
    assert split.form.split
    assert split.form.with_flow
    assert fit_thrust([run]).estimate.underfit.underfitted
    assert not by_voltage.estimate.underfit.underfitted


def test_flow_is_told_from_its_noise_and_asked_for_where_it_is_missing():
    rng = np.random.default_rng(2)
    still = with_rate_and_flow(staircase(), rng, U=0.0)
    times = still.first_of("thrust").time
    assert not flow_of(still, times, None).moves
    assert flow_of(with_rate_and_flow(staircase(), rng, U=0.05), times, None).moves
    assert flow_of(staircase(), times, None) is None
    refused = fit_thrust([staircase()], "C V|V| - C_s|V|U")
    assert isinstance(refused, Unusable)
    assert "no flow_speed was recorded" in refused.reason
    with pytest.raises(ValueError, match="needs the flow"):
        columns(FORMS["C V|V| - C_s|V|U", True], np.ones(3), None)
    assert all(model_of(form) == model for (model, _), form in FORMS.items())


def test_a_rate_that_is_still_settling_is_taken_where_it_goes():
    """Thrust and rate with the same lag: C_t is right although no hold is long enough for either."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(3)
    base = staircase(hold=1.0, rate=100.0)
    cell = base.first_of("thrust")
    a = np.exp(-1 / (0.25 * 100.0))
    n = lfilter([1 - a], [1, -a], base.first_of("command_voltage").held_at(cell.time))
    channels = (
        base.first_of("command_voltage"),
        Channel("f", "cell", "thrust", "N", cell.time, 0.4 * n * np.abs(n) + rng.normal(0, 0.05, n.size)),
        Channel("n", "motor", "rotation_rate", "rev/s", cell.time, n + rng.normal(0, 0.01, n.size)),
    )
    fit = fit_thrust([Recording("slow", "T1", channels, steps=base.steps)], voltage="rotation_rate")
    assert fit.parameters["C_t"].value == pytest.approx(0.4, rel=0.01)
    assert fit.runs[0].points.voltage[3] == pytest.approx(12.0, abs=0.15)


def test_models_side_by_side_name_the_one_that_made_the_data():
    run = staircase(C_minus=0.36)
    fits = [fit_thrust([run], model) for model in ("C V|V|", "C+/C-")]
    single, split = side_by_side(fits)
    assert split.bic == 0.0
    assert single.bic > 10
    assert "very strong" in statement([single, split])
    even = side_by_side([fit_thrust([staircase()], model) for model in ("C V|V|", "C+/C-")])
    assert "no model beside it" in statement(even)
    other = side_by_side([fits[0], fit_thrust([staircase(tare=2.0)])])
    assert other[1].bic is None
    assert "no other model" in statement(other)
    one_way = fit_thrust([staircase(levels=(0.0, 6.0, 12.0, 18.0, 9.0, 0.0))], "C+/C-")
    assert side_by_side([one_way])[0].insignificant == ("C_minus",)


def test_correlated_samples_count_for_less():
    fits = [fit_thrust([sine(noise=ar1(0.95), rng=np.random.default_rng(0))], m) for m in ("C V|V|", "C+/C-")]
    p = fits[0].parameters["C"]
    assert p.std_uncorrected < 0.5 * p.std_statistical
    assert effective_samples(fits[0]) < 0.25 * fits[0].estimate.rows.y.size
    assert all(found.bic is not None for found in side_by_side(fits))
    slow = fit_thrust([staircase(noise=ar1(0.9), sigma=0.3, rng=np.random.default_rng(1))])
    assert slow.parameters["C"].std_uncorrected < 0.6 * slow.parameters["C"].std_statistical


def test_what_remains_without_a_parameter():
    fit = fit_thrust([staircase(C_minus=0.36)], "C+/C-")
    left = without(fit, "C_minus")
    assert left.rmse > 10 * fit.rmse
    assert [name for name, _, _ in left.others] == ["C_plus", "tare[run-1]"]
    assert left.chi2_per_dof > 1
    assert without(fit, "tare[run-1]").rmse > fit.rmse
    with pytest.raises(KeyError, match="no parameter"):
        without(fit, "C_s")


def test_covariance_has_the_scatter_and_the_common_gain():
    fit = fit_thrust([staircase(calibration={"gain_std": 0.01})], "C+/C-")
    assert fit.names == ("C_plus", "C_minus", "tare[run-1]")
    std = [p.std for p in (*fit.parameters.values(), *fit.tare.values())]
    assert np.sqrt(np.diag(fit.cov)) == pytest.approx(std, rel=1e-9)
    correlation = fit.cov[0, 1] / (std[0] * std[1])
    assert correlation > 0.9
    assert abs(fit.cov_statistical[0, 1]) < 0.8 * np.sqrt(fit.cov_statistical[0, 0] * fit.cov_statistical[1, 1])
    correlated = fit_thrust([sine(noise=ar1(0.9))], "C+/C-")
    assert np.linalg.eigvalsh(correlated.cov).min() > 0
    one_way = fit_thrust([staircase(levels=(0.0, 6.0, 12.0, 18.0))], "C+/C-")
    assert np.isnan(one_way.cov[1, 1])
    assert np.isfinite(one_way.cov[0, 0])
    contrast = np.array([1.0, -1.0, 0.0])
    plain = fit.cov_statistical
    assert np.sqrt(contrast @ plain @ contrast) == pytest.approx(fit.difference.std, rel=0.05)


def test_bad_input_says_what_is_wrong():
    t = np.arange(200.0)
    V = Channel("u", "c", "command_voltage", "V", t, np.repeat([0.0, 5.0, -5.0, 9.0], 50))
    stuck = Channel("f", "c", "thrust", "N", t, np.full(200, 1.5))
    both = (
        Channel("a", "c", "thrust", "N", t, t, thruster="T1"),
        Channel("b", "c", "thrust", "N", t, t, thruster="T2"),
    )
    few = (
        Channel("u", "c", "command_voltage", "V", np.array([0.0, 1.0]), np.array([4.0, -4.0])),
        Channel("f", "c", "thrust", "N", np.array([0.0, 1.0]), np.array([6.0, -6.0])),
    )
    cases = {
        "has no variance": (Recording("r", "T", (V, stuck)), "C V|V|"),
        "one thruster in one recording": (Recording("r", "T", (V, *both)), "C V|V|"),
        "for 3 parameters": (Recording("r", "T", few), "C+/C-"),
    }
    for expected, (recording, model) in cases.items():
        refused = fit_thrust([recording], model)
        assert isinstance(refused, Unusable), expected
        assert expected in refused.reason
    assert isinstance(fit_thrust([Recording("r", "T", few)]), ThrustFit)
