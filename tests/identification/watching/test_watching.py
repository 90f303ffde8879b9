"""Watching on made-up streams: what is seen and where, and what raises no alarm."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.prepare.preparing import Refusal
from identification.twin import TERMS, Twin, TwinNoise, TwinTerm
from identification.watching import Settings, Watch
from identification.watching.evidence import SLOTS, Evidence
from identification.watching.known import expected_of, gain_std
from identification.watching.laws import laws
from identification.watching.stretches import Stretches

LEVELS = (0.0, 5.0, -5.0, 10.0, -10.0)
HOLD, RATE = 3.0, 50
"""s; samples/s."""


def run(watch, thrust, holds=46, *, seed=1, noise=0.3, bus=None, spoil=lambda t, y: y):
    """Feed holds of LEVELS; `thrust`(t, V) in N. The first alarm, or None."""
    rng, first = np.random.default_rng(seed), None
    for k in range(holds):
        volts = LEVELS[k % len(LEVELS)]
        t = HOLD * k + np.arange(round(HOLD * RATE)) / RATE
        watch.command(HOLD * k, volts)
        if bus is not None:
            watch.bus_voltage(t[::10], bus(t[::10]))
        value = np.broadcast_to(thrust(t, volts), t.shape) + 0.7 + rng.normal(0, noise, t.size)
        watch.thrust(t, spoil(t, value))
        said = watch.look()
        first = first or said
    return first


def curve(_, volts):
    return 0.4 * volts * abs(volts)


def after(t, start=90.0):
    return t >= start


def loses(t, volts, share=0.03):
    return curve(t, volts) * (1 - share * after(t))


def watched(**settings):
    return Watch(Settings(10.0, **settings))


def test_clean_run_raises_no_alarm():
    watch = watched()
    assert run(watch, curve, 60) is None
    assert watch.stretches == 59, "the last hold is not over"
    assert watch.log_evidence < -3


@pytest.mark.parametrize(
    ("thrust", "place", "size"),
    [
        (lambda t, v: curve(t, v) + 0.3 * after(t), "zero", 0.3),
        (loses, "running", -1.2),
        (lambda t, v: curve(t, v) * (1 - 0.05 * after(t) * (v > 0)), "forward", -2.0),
        (lambda t, v: curve(t, v) * (1 - 0.05 * after(t) * (v < 0)), "reverse", -2.0),
    ],
)
def test_change_is_seen_soon_and_in_its_place(thrust, place, size):
    first = run(watch := watched(), thrust)
    assert first is not None
    assert first.time - 90.0 < 30.0
    assert watch.alarm.place == place
    assert abs(watch.alarm.began - 90.0) <= 2 * HOLD
    assert watch.alarm.size == pytest.approx(size, rel=0.25)
    assert watch.alarm.began_from <= watch.alarm.began <= watch.alarm.began_to
    assert first.e_value > 1.0
    assert "look at" in watch.alarm.statement


def test_drift_of_the_zero_grows():
    first = run(watch := watched(), lambda t, v: curve(t, v) + 0.02 * np.maximum(t - 90.0, 0.0))
    assert first is not None
    assert watch.alarm.place == "zero"
    assert watch.alarm.growing
    assert watch.alarm.size == pytest.approx(0.02 * 48, rel=0.25)


def test_thrust_that_follows_the_bus_is_said_to_follow_it():
    def bus(t):
        return 48.0 - 3.0 * after(t) * (1 - np.exp(-(t - 90.0) / 30.0))

    def thrust(t, volts):
        return curve(t, volts) * (bus(t) / 48.0) ** 2

    run(watch := watched(), thrust, bus=bus)
    assert watch.alarm.place == "bus"
    run(unseen := watched(), thrust)
    assert unseen.alarm.place in ("running", "high"), "the bus is not measured"


def test_bus_that_sags_alone_is_no_mismatch():
    assert run(watched(), curve, bus=lambda t: 48.0 - 3.0 * after(t)) is None


@pytest.mark.parametrize("tau", [5.0, 40.0])
def test_slow_noise_raises_no_alarm(tau):
    rng = np.random.default_rng(5)
    keep = np.exp(-1 / (RATE * tau))
    slow = np.zeros(60 * round(HOLD * RATE))
    pushes = 0.4 * np.sqrt(1 - keep**2) * rng.standard_normal(slow.size)
    for i in range(1, slow.size):
        slow[i] = keep * slow[i - 1] + pushes[i]

    def thrust(t, volts):
        return curve(t, volts) + slow[np.round(t * RATE).astype(int)]

    assert run(watched(), thrust, 60) is None


def test_nan_and_gaps_leave_a_run_clean_and_a_change_seen():
    def spoil(t, value):
        value = np.where((t % 7.0 < 0.2) | ((t > 40.0) & (t < 52.0)), np.nan, value)
        return np.full_like(value, np.nan) if 60 <= t[0] < 66 else value

    assert run(watched(), curve, spoil=spoil) is None
    assert run(watched(), loses, spoil=spoil) is not None


def test_nothing_is_judged_while_nothing_is_commanded():
    watch = watched()
    t = np.arange(500) / RATE
    watch.thrust(t, np.ones(500))
    watch.command(10.0, float("nan"))
    watch.thrust(t + 10.0, np.ones(500))
    watch.command(20.0, 0.0)
    watch.thrust(t + 20.0, np.ones(500))
    watch.look()
    assert watch.stretches == 1


def test_another_mounting_starts_anew():
    assert run(watched(), curve) is None
    assert run(watched(), lambda t, v: 0.9 * curve(t, v) - 2.0) is None


def test_sweep_is_watched_without_holds():
    rng, watch = np.random.default_rng(2), watched()
    for t in np.arange(0.0, 240.0, 0.1):
        volts = 10.0 * np.sin(2 * np.pi * t / 20.0)
        watch.command(t, round(float(volts), 3))
        at = t + np.array([0.02, 0.06])
        watch.thrust(at, curve(at, volts) * (1 - 0.1 * (at > 120.0)) + rng.normal(0, 0.3, 2))
        watch.look()
    assert watch.stretches > 80
    assert watch.alarm is not None
    assert watch.alarm.place == "running"
    assert 110.0 < watch.alarm.began < 135.0


def test_commands_without_thrust_do_not_pile_up():
    watch = watched()
    for k in range(5000):
        watch.command(0.01 * k, float(k % 7))
    assert len(watch._commands) < 5000
    assert watch.look() is None


def test_memory_of_a_long_run_does_not_grow():
    evidence = Evidence(laws((0.0,)), 1, 1, 2)
    rng = np.random.default_rng(1)
    evidence.begin(-1.0, 1e-3, kept=True)
    for k in range(3 * SLOTS):
        evidence.begin(float(k), 1e-3)
        columns = np.ones((len(evidence.begun), 1))
        evidence.add(float(k), k % 2, 1.0, float(rng.normal()), np.array([1.0]), columns)
        evidence.posterior()
    assert len(evidence.begun) == SLOTS
    assert evidence.begun[0] == -1.0, "kept"
    assert evidence.begun[-1] == 3 * SLOTS - 1
    assert evidence.begun == sorted(evidence.begun)


def test_likelihood_ratio_has_expectation_one_at_most():
    """Under its own null, also one of correlated noise: 200 short runs, static column and scale free."""
    rng, total = np.random.default_rng(8), []
    for _ in range(200):
        evidence, slow = Evidence(laws((0.0,)), 1, 1, 1), 0.0
        scale = float(np.exp(rng.normal(0, 3)))
        for k in range(12):
            if k:
                evidence.begin(k - 0.5, 1.0 / 11)
            slow = 0.8 * slow + 0.6 * float(rng.normal())
            value = scale * (5.0 + 2 * slow + float(rng.normal()))
            columns = np.ones((len(evidence.begun), 1))
            evidence.add(4.0 * k, None, 1.0, value, np.array([1.0]), columns)
        total.append(np.exp(evidence.posterior().log_sum))
    assert np.mean(total) < 1.0
    assert np.mean(np.array(total) > 20.0) < 0.05


def twin(*terms, driver="command_voltage"):
    names = ("C", *(f"{t.effect}.{name}" for t in terms for name in t.parameters))
    cov = tuple(tuple(1e-6 * (i == j) for j in range(len(names))) for i in range(len(names)))
    return Twin("T1", driver, 0.4, terms, names, cov, TwinNoise(0.01, 0.0), (), 0.02, 10.0, 1.1)


def test_run_is_judged_against_its_twin_from_the_start():
    expected = expected_of(twin())
    settings = {"expected": expected, "model_std": gain_std(twin())}
    assert run(watched(**settings), curve) is None
    first = run(watched(**settings), lambda t, v: 1.06 * curve(t, v))
    assert first is not None
    assert first.from_start
    assert first.place == "running"
    assert first.share == pytest.approx(0.06, abs=0.02)
    assert "from the start" in first.headline


def test_change_is_seen_against_a_twin_too():
    run(watch := watched(expected=expected_of(twin())), loses)
    assert watch.alarm is not None
    assert not watch.alarm.from_start


def test_twin_gives_what_it_was_fitted_to():
    expected = expected_of(twin(driver="rotation_rate"))
    assert expected(5.0, float("nan"), 0.0, 3.0) == pytest.approx(0.4 * 9.0)
    assert expected(5.0, float("nan"), 0.0, float("nan")) == pytest.approx(0.4 * (5.0 / 1.1) ** 2, rel=1e-3)


def test_twin_that_needs_what_is_not_fed_is_refused():
    term = next(t for t in TERMS.values() if set(t.needs) - {"bus_voltage", "flow_speed"})
    from identification.physics.term import Scale

    scale = Scale(10.0, "V", 40.0, 100.0, 0.02)
    made = TwinTerm(term.id, term.form, {p.name: 0.5 * (p.low + p.high) for p in term.parameters(scale)}, scale)
    assert isinstance(expected_of(twin(made)), Refusal)
    assert isinstance(expected_of(twin(driver="motor_voltage")), Refusal)


@pytest.mark.parametrize("wrong", [{"highest": 0.0}, {"highest": float("nan")}, {"false_alarms_per_hour": 0.0}])
def test_settings_that_mean_nothing_are_refused(wrong):
    with pytest.raises(ValueError, match="must be"):
        Settings(**({"highest": 10.0} | wrong))


def test_long_hold_makes_several_stretches():
    cut = Stretches(10.0)
    cut.command(0.0, 5.0)
    t = np.arange(2000) / 100
    cut.thrust(t, np.ones(2000))
    assert [round(s.end - s.start) for s in cut.done] == [6, 6, 6]
