"""Signatures of known effects: the right shape, and error bars that mean what they say."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.compare.reported_runs import runs_of
from identification.mismatch.compare.signature import profile, shape, signature
from identification.mismatch.diagnosis import Adequate, Curves, Diagnosis, Finding, HeldOutRmse, Rmse
from identification.mismatch.value import Value

LEVELS = np.array([0.0, 8.0, -8.0, 2.0, 16.0, -16.0, -2.0, 0.0, 12.0, 4.0, -12.0, -4.0])
HOLD, RATE, C = 10.0, 20.0, 0.4
T = np.arange(0.0, HOLD * LEVELS.size, 1 / RATE) + 0.5 / RATE
V = LEVELS[(T / HOLD).astype(int)]
F = C * V * np.abs(V)


def diagnosis(*curves):
    base = {"C": Value(C, 0.001, "N/V^2")}
    ids = tuple(c.recording_id for c in curves)
    some = (Rmse(1.0, 0.1), HeldOutRmse(1.0, 0.1, 0.1, ""), 1.0, 0.5, ())
    return Diagnosis(ids, "T1", Adequate(), "C V|V|", base, (), (), base, *some, curves)


def runs(true, model=None, noise=0.1, seed=0):
    thrust = true + np.random.default_rng(seed).normal(0, noise, T.size)
    return runs_of(diagnosis(Curves("a", T, V, thrust, F, F if model is None else model)))


def found(effect):
    return Finding(effect, "", "", {}, 0.0, 1.0, 1.0, ())


def test_gain_over_time():
    true = F * (1 - 0.1 * (T > 60))
    seen = signature(runs(true, true), found("heating"))
    assert (seen.quantity, seen.kind, seen.alone) == ("time", "gain", False)
    assert seen.measured[seen.at > 62] == pytest.approx(-0.1, abs=0.01)
    assert seen.measured[seen.at < 58] == pytest.approx(0.0, abs=0.01)
    assert seen.modelled[-1] == pytest.approx(-0.1, abs=1e-9)


def test_lag_over_the_time_since_a_step():
    since = T % HOLD
    before = np.concatenate([[0.0], LEVELS])[(T / HOLD).astype(int)]
    step = F - C * before * np.abs(before)
    seen = signature(runs(F - step * np.exp(-since / 0.5)), found("motor_lag"))
    assert (seen.quantity, seen.kind) == ("time_since_step", "step")
    assert seen.measured == pytest.approx(-np.exp(-seen.at / 0.5), abs=0.08)


def test_static_shape_loop_and_reversal():
    dead = signature(runs(F - 0.3 * np.sign(V)), found("dead_band"))
    assert dead.measured == pytest.approx(-0.3 * np.sign(dead.at), abs=0.05)
    assert dead.at.size == np.unique(LEVELS).size
    before = np.concatenate([[0.0], LEVELS])[(T / HOLD).astype(int)]
    loop = signature(runs(F - 0.5 * np.sign(V - before)), found("hysteresis"))
    assert loop.measured == pytest.approx(-0.5, abs=0.05)
    assert signature(runs(F), found("reversal_loss")).quantity == "time_since_reversal"


def test_what_was_not_recorded_is_seen_over_time_or_level():
    assert signature(runs(F), found("supply_sag")).quantity == "time"
    assert signature(runs(F), found("strut_drag")).quantity == "driver"
    assert shape(runs(F), "bus_voltage") is None
    assert profile(runs(F), "bus_voltage") is None
    assert shape(runs(F), "previous_voltage").kind == "gain"


def test_nothing_to_see_is_none():
    still = Curves("a", T, np.full(T.size, 5.0), F, F, F)
    assert signature(runs_of(diagnosis(still)), found("reversal_loss")) is None
    assert signature(runs_of(diagnosis()), found("motor_lag")) is None
    assert profile(runs_of(diagnosis(still)), "time_since_reversal") is None
    assert signature(runs(F), found("periodic_disturbance")) is None
    one = Curves("a", T[:1], V[:1], F[:1], F[:1], F[:1])
    assert shape(runs_of(diagnosis(one)), "driver") is None


def test_rms_before_and_after():
    seen = profile(runs(F + 3.0 * (V > 10), F + 3.0 * (V > 10)), "driver")
    assert seen.before[seen.at > 10] == pytest.approx(3.0, abs=0.1)
    assert seen.after == pytest.approx(0.1, abs=0.03)


@pytest.mark.parametrize("colour", [0.0, 0.7])
def test_error_bars_cover(colour):
    outside = []
    for seed in range(40):
        white = np.random.default_rng(seed).normal(0, 0.1, T.size)
        noise = white.copy()
        for i in range(1, T.size):
            noise[i] += colour * noise[i - 1]
        seen = shape(runs_of(diagnosis(Curves("a", T, V, F + noise, F, F))), "driver")
        outside.append(np.abs(seen.measured) > 1.96 * seen.std)
    assert 0.02 < np.mean(outside) < 0.09


def test_two_runs_are_averaged_together():
    one = Curves("a", T, V, F + 1.0, F, F)
    both = shape(runs_of(diagnosis(one, replace(one, recording_id="b", thrust=F - 1.0))), "driver")
    assert both.measured == pytest.approx(0.0, abs=1e-9)
