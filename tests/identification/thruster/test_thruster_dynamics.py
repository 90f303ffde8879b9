"""The rotor model found again from rate and voltage that another integrator made."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import chi2

from identification.recording import Channel, Recording
from identification.thruster.dynamics import DynamicsFit, fit_dynamics
from identification.thruster.dynamics_report import levels_table, sentence, verdicts
from identification.thruster.rotor_data import Drive, drive
from identification.thruster.rotor_simulation import simulate
from identification.thruster.thrust_data import Unusable
from tests.identification.thrust_runs import ar1, white

ALPHA, K, GAMMA, DELAY = 0.2, 1.1, 4.0, 0.03
LEVELS = (8.0, -8.0, 16.0, -16.0, 5.0, 12.0)


def motion(alpha=ALPHA, k=K, gamma=GAMMA, delay=DELAY, levels=LEVELS, hold=2.0, rate=50.0, offset=0.0):
    """Command rows (0 V, then each level, then 0 V) and the exact rate, by scipy's DOP853."""
    rows = np.arange(len(levels) + 2) * hold
    V = np.array([0.0, *levels, 0.0])
    t, n = [np.zeros(1)], [np.zeros(1)]
    edges = np.append(rows + delay, rows[-1] + hold)
    for low, high, level in zip(edges[:-1], edges[1:], V, strict=True):
        push = alpha * (k * level) * abs(k * level) + gamma * k * level - offset * np.sign(level) * gamma
        inside = np.arange(np.ceil(low * rate), high * rate) / rate
        found = solve_ivp(
            lambda _, x, push=push: push - (alpha * np.abs(x) + gamma) * x, (low, high), [n[-1][-1]], "DOP853",
            t_eval=np.append(inside[inside > low], high), rtol=1e-10, atol=1e-10,
        )  # fmt: skip
        t.append(found.t)
        n.append(found.y[0])
    time, speed = np.concatenate(t), np.concatenate(n)
    even = np.arange(0, rows[-1] * rate) / rate
    return rows, V, even, np.interp(even, time, speed)


def recorded(parts, rng, sigma=0.02, noise=white, recording_id="r1", quantity="command_voltage"):
    rows, V, t, n = parts
    rate = Channel("n", "motor", "rotation_rate", "rev/s", t, n + sigma * noise(rng, t.size)[0])
    unit = Channel("u", "command", quantity, "V", rows, V)
    return Recording(recording_id, "T3", (unit, rate))


TRUTH = {"alpha": ALPHA, "k": K, "gamma": GAMMA, "delay": DELAY}


@pytest.mark.parametrize("noise", [white, ar1(0.9)], ids=["white", "correlated"])
def test_parameters_are_found_within_their_intervals(noise):
    rng, parts = np.random.default_rng(5), motion()
    fits = [fit_dynamics([recorded(parts, rng, noise=noise)]) for _ in range(4)]
    for name, truth in TRUTH.items():
        z = np.array([(f.estimate[name] - truth) / f.estimate.std_of(name) for f in fits])
        dof = np.median([f.dof[name] for f in fits])
        assert np.sum(z**2) * (dof - 2) / dof < chi2.ppf(0.9999, len(fits)), name
        assert fits[0].estimate.std_of(name) < 0.1 * truth
    assert all(f.with_gamma for f in fits)
    assert fits[0].rmse_without_gamma > 2 * fits[0].rmse
    plain = fits[0].uncorrected / [fits[0].estimate.std_of(name) for name in TRUTH]
    assert np.median(plain) > 0.6 if noise is white else np.median(plain) < 0.7


def test_the_simulation_agrees_with_another_integrator():
    rows, V, t, n = motion()
    found = drive(recorded((rows, V, t, n), np.random.default_rng(0), sigma=0.0))
    assert isinstance(found, Drive)
    sets = [np.array([x, x]) for x in (ALPHA, K, GAMMA, DELAY)]
    seen = simulate([found], *sets)
    assert np.abs(seen[0] - found.rate).max() < 0.05
    assert np.sqrt(np.mean((seen[0] - found.rate) ** 2)) < 0.006
    assert np.array_equal(seen[0], seen[1])


def test_without_back_emf_the_texts_model_remains():
    parts = motion(gamma=0.0, delay=0.0, levels=(10.0, -10.0, 18.0, -18.0, 14.0))
    rng = np.random.default_rng(6)
    fit = fit_dynamics([recorded(parts, rng), recorded(parts, rng, recording_id="r2")])
    assert not fit.with_gamma
    assert fit.model == "n' = beta V|V| - alpha n|n|"
    assert fit.recordings == ("r1", "r2")
    beta, std = fit.beta
    assert abs(beta - ALPHA * K**2) < 4 * std
    assert fit.rmse_without_gamma == fit.rmse
    said = " ".join(verdicts(fit))
    assert "tried and dropped" in said
    assert "not significant" in said
    for level in fit.levels:
        assert level.time_constant == pytest.approx(1 / (2 * ALPHA * K * abs(level.voltage)), rel=0.02)
        assert level.model_rate == pytest.approx(K * level.voltage, rel=0.01)
    assert len(levels_table(fit)) == len(fit.levels) + 1
    assert "time constant" in sentence(fit)


def test_a_dead_band_is_seen_in_the_settled_rates():
    levels = (6.0, -6.0, 16.0, -16.0, 11.0, -11.0)
    fit = fit_dynamics([recorded(motion(offset=1.0, levels=levels), np.random.default_rng(7))])
    assert fit.offset.significant
    assert fit.offset.value < 0
    assert "dead band or static load" in " ".join(verdicts(fit))
    even = fit_dynamics([recorded(motion(levels=levels), np.random.default_rng(7))])
    assert abs(even.offset.value) < 0.05


def test_a_measured_voltage_will_do():
    rows, V, t, n = motion(delay=0.0)
    volts = V[np.searchsorted(rows, t, side="right") - 1]
    rng = np.random.default_rng(8)
    channels = (
        Channel("n", "motor", "rotation_rate", "rev/s", t, n + rng.normal(0, 0.02, n.size)),
        Channel("u", "motor", "motor_voltage", "V", t, volts + rng.normal(0, 0.01, n.size)),
    )
    fit = fit_dynamics([Recording("m", "T3", channels)])
    assert isinstance(fit, DynamicsFit)
    assert fit.estimate["alpha"] == pytest.approx(ALPHA, rel=0.1)
    assert fit.estimate["k"] == pytest.approx(K, rel=0.01)


def test_too_few_holds_leave_the_steady_relation_open():
    fit = fit_dynamics([recorded(motion(levels=(9.0, -9.0)), np.random.default_rng(9))])
    assert fit.offset is None
    assert "cannot be told" in " ".join(verdicts(fit))


def test_a_rate_that_lost_its_sign_is_told_as_such():
    """As where it was given the command's, though it had its own: negative while the rotor is on its way alone."""
    rows, V, t, n = motion()
    commanded = V[np.searchsorted(rows, t, side="right") - 1]
    found = fit_dynamics([recorded((rows, V, t, n * np.sign(commanded)), np.random.default_rng(10))])
    assert isinstance(found, Unusable)
    assert "goes the same way for both signs of the voltage; give it its sign" in found.reason


def test_a_rate_that_is_noise_alone_has_no_rotor_model():
    rows, V, t, n = motion(levels=(8.0, -8.0, 16.0, -16.0))
    found = fit_dynamics([recorded((rows, V, t, 0 * n), np.random.default_rng(1), sigma=1.0)])
    assert isinstance(found, Unusable)
    assert "no rotor model n' = beta T - alpha n|n|" in found.reason


def test_what_cannot_be_used_says_why():
    rows, V, t, n = motion(levels=(8.0, -8.0))
    rate = Channel("n", "motor", "rotation_rate", "rev/s", t, n)
    unit = Channel("u", "command", "command_voltage", "V", rows, V)
    unsigned = Channel("n", "motor", "rotation_rate", "rev/s", t, np.abs(n))
    rest = Channel("u", "command", "command_voltage", "V", rows, 0 * V)
    still = Channel("n", "motor", "rotation_rate", "rev/s", t, 0 * n)
    cases = {
        "no rotation_rate was recorded": (unit,),
        "no voltage was recorded": (rate,),
        "give it its sign": (unit, unsigned),
        "fewer than 50 samples": (rest, rate),
        "does not follow the voltage": (unit, still),
    }
    for expected, channels in cases.items():
        refused = fit_dynamics([Recording("r", "T3", channels)])
        assert isinstance(refused, Unusable), expected
        assert expected in refused.reason
    assert isinstance(fit_dynamics([]), Unusable)
