"""Short holds with slow noise and a rotor that still settles: what a quick campaign on the simulated bench gives."""

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.recording import Channel, Recording, Step
from identification.steady_state.asymptote import asymptote
from identification.steady_state.shared_noise import fit_noise_jointly
from identification.steady_state.steady import settled_estimate
from identification.thruster.thrust import fit_thrust
from tests.identification.thrust_runs import white

RATE, SLOW_TIME = 92.0, 0.5
PLAN = (0.0, 4.0, -4.0, 8.0, -8.0, 12.0, 0.0, -12.0, 16.0, -16.0, 20.0, -20.0, 0.0)


def noise(rng, n, slow=0.02):
    """0.05 N white, 0.02 N first order with 0.5 s, as benches/simulated/world.toml has it."""
    phi = np.exp(-1 / (RATE * SLOW_TIME))
    pushes = rng.standard_normal(n + 600) * np.sqrt(1 - phi**2)
    return 0.05 * rng.standard_normal(n) + slow * lfilter([1], [1, -phi], pushes)[600:]


def quick_campaign(rng, C=0.412, hold=1.2, tare=1.5):
    """Tares and holds that begin while the rotor settles (0.08 to 0.2 s); proportional noise of 0.001."""
    lengths = [round(RATE * (tare if v == 0 else hold)) for v in PLAN]
    edges = np.cumsum([0, *lengths]) / RATE
    force, before = [], 0.0
    for v, n in zip(PLAN, lengths, strict=True):
        goal, T = C * v * abs(v), RATE / (3 + 0.5 * abs(v))
        start = goal + 0.7 * (before - goal) * (v != 0)
        force.append(goal + (start - goal) * np.exp(-np.arange(n) / T))
        before = goal
    exact = np.concatenate(force)
    F = exact + 0.75 + noise(rng, exact.size) + 0.001 * np.abs(exact) * rng.standard_normal(exact.size)
    steps = tuple(
        Step(i, "tare" if v == 0 else "hold", v, float(edges[i]), float(edges[i + 1])) for i, v in enumerate(PLAN)
    )
    command = Channel("u", "command", "command_voltage", "V", edges[:-1], np.array(PLAN))
    cell = Channel("f", "load_cell", "thrust", "N", np.arange(F.size) / RATE, F)
    return Recording("quick", "T1", (command, cell), steps=steps)


def test_quick_campaigns_are_not_called_underfitted_and_their_C_is_covered():
    rng = np.random.default_rng(7)
    fits = [fit_thrust([quick_campaign(rng)]) for _ in range(100)]
    p = [fit.parameters["C"] for fit in fits]
    assert sum(fit.estimate.underfit.underfitted for fit in fits) <= 7
    assert 0.5 < np.median([fit.chi2_per_dof for fit in fits]) < 2
    assert 90 <= sum(q.low <= 0.412 <= q.high for q in p) <= 100
    assert sum(fit.unsteady for fit in fits) <= 0.05 * 100 * len(PLAN)


def test_slow_noise_that_one_window_cannot_see_is_seen_in_many():
    rng = np.random.default_rng(1)
    lengths = (*[138] * 6, *[56] * 12)
    together, true = [], []
    for _ in range(20):
        windows = [noise(rng, n) for n in lengths]
        together.append([m.mean_std()[0] for m in fit_noise_jointly(windows)])
        true.append([w.mean() for w in windows])
    ratio = np.std(np.array(true) / np.array(together))
    assert ratio < 1.7
    assert np.median(together) > 1.3 * 0.05 / np.sqrt(56)


def test_white_windows_stay_nearly_as_well_known_as_they_are():
    rng = np.random.default_rng(3)
    found = [m.mean_std()[0] for m in fit_noise_jointly(list(white(rng, 60, 24)))]
    assert np.median(found) == pytest.approx(1 / np.sqrt(60), rel=0.35)


def test_one_window_with_a_disturbance_of_its_own_keeps_it():
    rng = np.random.default_rng(4)
    windows = list(0.05 * white(rng, 100, 10))
    windows[3] = windows[3] + 0.5 * np.sin(np.arange(100) / 25)
    found = [m.mean_std()[0] for m in fit_noise_jointly(windows)]
    assert found[3] > 5 * np.median(found)


def test_asymptote_is_unbiased_and_its_error_honest():
    rng = np.random.default_rng(5)
    t = np.arange(110) / RATE
    pulls = []
    for _ in range(200):
        e = settled_estimate(t, 10 + 6 * np.exp(-t / 0.2) + 0.05 * rng.standard_normal(t.size))
        pulls.append((e.mean - 10) / e.std_error)
    assert abs(np.mean(pulls)) < 0.4
    assert np.std(pulls) < 1.5


def test_a_constant_has_itself_as_asymptote():
    found = asymptote(np.full(20, 3.0))
    assert found.value == pytest.approx(3.0)
    assert found.spread == pytest.approx(0.0, abs=1e-9)
