"""Ticks of a command as a rotor, a stand and a delay pass them on: closed forms of the response to each tick."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter, lsim

from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.model import Model
from identification.mismatch.prepare.chain.acquisition import as_sampled
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.baseline import start
from identification.physics.motor_lag import MotorLag
from identification.physics.stand_resonance import StandResonance
from identification.recording import Acquisition, Channel, Recording
from identification.run_history.rotor_lag import Rotor, lag_ends
from identification.run_history.ticks.sub_interval_dynamics import Passed

TICK = 0.05
TAU = 0.003
AT = np.arange(0.0, 60.0, TICK) + 0.0031
VOLTS = 2.0 + 8.0 * np.abs((AT / 10.0) % 2 - 1)


def lagging(t):
    return 1 - np.exp(-t / TAU)


def ringing(t, f=30.0, damping=0.1):
    w = 2 * np.pi * f
    wd = w * np.sqrt(1 - damping**2)
    return 1 - 0.6 * np.exp(-damping * w * t) * (np.cos(wd * t) + damping * w / wd * np.sin(wd * t))


def both(t):
    """The ringing as it comes out of a lag, in small steps."""
    h = 1e-5
    fine = np.arange(0.0, 1.0, h)
    rung = ringing(fine)
    keep = np.exp(-h / TAU)
    late = np.concatenate([[0.0], lfilter([1 - keep], [1, -keep], 0.5 * (rung[1:] + rung[:-1]))])
    return np.interp(t, fine, late)


def answered(t, response, delay=0.0, value=VOLTS):
    out = np.full(t.size, value[0])
    for at, change in zip(AT[1:], np.diff(value), strict=True):
        since = t - at - delay
        out += change * np.where(since >= 0, response(np.maximum(since, 0.0)), 0.0)
    return out


def ticks_before(time, when):
    """Of each time the last tick before it, and s since then."""
    last = np.maximum(np.searchsorted(when, time, side="right") - 1, 0)
    return last, np.maximum(time - when[last], 0.0)


def rates(passed, when, value):
    """Of the rotor at each tick; it was settled before the first."""
    if passed.rotor is None:
        return value
    return np.concatenate([value[:1], lag_ends(value[:-1], np.diff(when), passed.rotor, value[0])])


def rung(passed, t, when, value):
    """Rate |rate| as the stand shows it."""
    rate = passed.followed(*ticks_before(t, when), value, rates(passed, when, value))
    knots = passed.knots(when, value)
    last, since = ticks_before(t, knots[0])
    return rate * np.abs(rate) + sum(mode.at(since, last) for mode in passed.ring_modes(*knots))


@pytest.mark.parametrize(
    ("response", "passed", "delay"),
    [
        (lagging, Passed(Rotor(0.0, 1 / TAU)), 0.0),
        (ringing, Passed(ring=(0.6, 30.0, 0.1)), 0.0013),
        (both, Passed(Rotor(0.0, 1 / TAU), (0.6, 30.0, 0.1)), 0.0),
    ],
    ids=["lag", "ringing, late", "lag and ringing"],
)
def test_each_tick_is_answered_as_the_dynamics_do(response, passed, delay):
    t = np.arange(0.0, 12.0, 0.01)
    before = ticks_before(t - delay, AT)
    if response is lagging:
        assert passed.followed(*before, VOLTS, rates(passed, AT, VOLTS)) == pytest.approx(
            answered(t, response), abs=1e-9
        )
        return
    found = rung(passed, t - delay, AT, VOLTS)
    assert found == pytest.approx(answered(t, response, delay, VOLTS**2), abs=0.01 if response is both else 1e-9)


def turned_on(rotor, w, n, h):
    """Its rate `h` s later, by Runge and Kutta."""

    def slope(rate):
        return rotor.quadratic * (w * abs(w) - rate * abs(rate)) + rotor.linear * (w - rate)

    first = slope(n)
    second = slope(n + 0.5 * h * first)
    third = slope(n + 0.5 * h * second)
    return n + h / 6 * (first + 2 * second + 2 * third + slope(n + h * third))


@pytest.mark.parametrize(
    "rotor", [Rotor(0.0, 10.0), Rotor(1.2, 0.0), Rotor(0.5, 4.0)], ids=["linear", "square", "both"]
)
def test_a_stand_rings_by_what_the_force_of_a_rotor_does_however_large_the_step(rotor):
    """A force that goes as the square of a rate sets out from rest with no slope, and turns round with one: taken as a
    first-order lag of its own it was up to 28 V^2 off, in a step of 288."""
    c, f, z, h = 0.8, 18.0, 0.05, 1e-4
    when = 0.02 * np.arange(100)
    value = np.array([0.0, 12.0, -12.0, 5.0])[np.minimum(when // 0.5, 3).astype(int)]
    fine = h * np.arange(round(2.0 / h) + 1)
    held = value[ticks_before(fine + 1e-9, when)[0]].tolist()
    n = [0.0]
    for w in held[:-1]:
        n.append(turned_on(rotor, w, n[-1], h))
    force = np.array(n) * np.abs(n)
    system = ([(2 * np.pi * f) ** 2], [1.0, 4 * np.pi * f * z, (2 * np.pi * f) ** 2])
    _, shown, _ = lsim(system, force, fine)
    t = np.arange(0.005, 1.99, 0.0037)
    expected = np.interp(t, fine, force + c * (shown - force))
    found = rung(Passed(rotor, (c, f, z)), t, when, value)
    assert found == pytest.approx(expected, abs=0.01 if rotor.quadratic == 0 else 0.3)


def test_a_rotor_that_turns_round_follows_the_torque_balance():
    """n' = q (w|w| - n|n|) from n0 < 0 to w > 0: n = w tan(q w t + atan(n0/w)) until it stands, then w tanh(q w t)."""
    q, w, n0 = 2.0, 3.0, -0.6
    stands = -np.arctan(n0 / w) / (q * w)
    t = np.linspace(0.0, 0.4, 81)
    when = np.concatenate([[-1.0], np.linspace(0.0, 0.4, 41)])
    passed, value = Passed(Rotor(q, 0.0)), np.concatenate([[n0], np.full(41, w)])
    found = passed.followed(*ticks_before(t, when), value, rates(passed, when, value))
    turned = w * np.where(t < stands, np.tan(q * w * t + np.arctan(n0 / w)), np.tanh(q * w * (t - stands)))
    assert found == pytest.approx(turned, abs=2e-3)


def test_samples_in_step_with_the_ticks_of_a_ramp_are_foretold():
    """100 Hz: five samples a tick, the first 6.9 ms after it."""
    t = np.arange(0.0, 60.0, 0.01)
    x = answered(t, lagging)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", AT, VOLTS),
        Channel("thrust", "cell", "thrust", "N", t, 0.5 * x * np.abs(x)),
    )
    history = history_of(Recording("ramps", "T1", channels, source="ramps.h5"))
    data, theta = start([history])
    theta = replace(theta, C=0.5, tares=(0.0,))

    def missed(tau):
        model = Model((MotorLag("first_order"),))
        (told,), _ = raw(model, replace(theta, terms=((tau,),)), data, with_rate=False)
        return float(np.sqrt(np.mean((told - data.thrust[0])[50:-50] ** 2)))

    assert missed(TAU) < 0.002
    assert missed(TAU) < 0.2 * min(missed(0.8 * TAU), missed(1.25 * TAU))


def test_ticks_of_a_fast_ramp_are_no_steps():
    """Ramps of 4 % of full scale a tick: rates read once a tick, and thrust, are foretold wherever they were read."""
    at = 0.02 * np.arange(3000.0)
    volts = 25.0 * np.clip(2.5 * np.sin(2 * np.pi * at / 7), -1, 1)
    assert 0.03 < np.max(np.abs(np.diff(volts))) / 25 < 0.06

    def held(t):
        return volts[np.searchsorted(at, t, side="right") - 1]

    t, turning = np.arange(0.003, 60.0, 0.0119), at + 0.016
    x = held(t)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", at, volts),
        Channel("thrust", "cell", "thrust", "N", t, 0.5 * x * np.abs(x)),
        Channel("rotation_rate", "esc", "rotation_rate", "rev/s", turning, 0.8 * held(turning)),
    )
    data, theta = start([history_of(Recording("ramps", "T1", channels, source="ramps.h5"))])
    (thrust,), (rate,) = raw(Model(), replace(theta, C=0.5, tares=(0.0,), k=0.8), data, with_rate=True)
    (history,) = data.histories
    assert rate == pytest.approx(history.rates, abs=1e-9)
    assert thrust == pytest.approx(data.thrust[0], abs=1e-9)


def test_large_ticks_of_a_slow_loop_are_no_steps_either():
    """25 Hz, ramps of 12 % of full scale a tick: rates that come 4 ms late are foretold wherever they were read. Those
    2 ms after a tick, of what was before it, were missed by a third of the tick."""
    at, late = 0.04 * np.arange(1500.0), 0.004
    volts = 8.0 * np.clip(2.5 * np.sin(2 * np.pi * at / 5), -1, 1)
    assert 0.11 < np.max(np.abs(np.diff(volts))) / 8 < 0.13

    def held(t):
        return volts[np.maximum(np.searchsorted(at, t, side="right") - 1, 0)]

    t, turning = np.arange(0.003, 59.0, 0.05), np.arange(0.002, 59.0, 0.0497)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", at, volts),
        Channel("thrust", "cell", "thrust", "N", t, 0.5 * held(t) * np.abs(held(t))),
        Channel("rotation_rate", "esc", "rotation_rate", "rev/s", turning, 0.8 * held(turning - late)),
    )
    data, theta = start([history_of(Recording("ramps", "T1", channels, source="ramps.h5"))])
    (_,), (rate,) = raw(Model(), replace(theta, C=0.5, tares=(0.0,), k=0.8, rate_shift=late), data, with_rate=True)
    (history,) = data.histories
    assert rate == pytest.approx(history.rates, abs=1e-3)


def test_large_ticks_that_come_late_are_foretold_in_every_sample():
    """Force that comes 2 ms late: it is late itself, where a late rate was squared samples were 3 % of a tick off."""
    at, late, C = 0.04 * np.arange(1500.0), 0.002, 0.017
    volts = 25.7 * np.clip(2.5 * np.sin(2 * np.pi * at / 9), -1, 1)
    t = np.arange(0.1, 59.0, 0.0131)
    x = volts[np.searchsorted(at, t - late, side="right") - 1]
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", at, volts),
        Channel("thrust", "cell", "thrust", "N", t, C * x * np.abs(x)),
    )
    data, theta = start([history_of(Recording("ramps", "T1", channels, source="ramps.h5"))])
    (told,), _ = raw(Model(), replace(theta, C=C, tares=(0.0,), shift=late), data, with_rate=False)
    assert told == pytest.approx(data.thrust[0], abs=1e-9)


def test_means_of_large_ticks_that_come_late_are_foretold():
    """Force that comes 2 ms late, means over 13 ms, ticks of 7 % of full scale: the rate was late in the means between
    which it was told, and then squared; 1 % of a tick was missed beside each, and a stand of 32 Hz named for it."""
    at, late, window, C = 0.04 * np.arange(1500.0), 0.002, 0.013, 0.017
    volts = 25.7 * np.clip(2.5 * np.sin(2 * np.pi * at / 9), -1, 1)
    knots = np.append(at, at[-1] + 1.0) + late
    total = np.concatenate([[0.0], np.cumsum(C * volts * np.abs(volts) * np.diff(knots))])
    t = np.arange(0.1, 59.0, 0.0131)
    F = (np.interp(t + window / 2, knots, total) - np.interp(t - window / 2, knots, total)) / window
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", at, volts),
        Channel("thrust", "cell", "thrust", "N", t + window / 2, F, acquisition=Acquisition(window=window)),
    )
    data, theta = start([history_of(as_sampled(Recording("ramps", "T1", channels, source="ramps.h5"))[0])])
    assert data.histories[0].converter.window == window
    (told,), _ = raw(Model(), replace(theta, C=C, tares=(0.0,), shift=late), data, with_rate=False)
    jump = float(np.max(np.abs(np.diff(C * volts * np.abs(volts)))))
    assert np.max(np.abs(told - data.thrust[0])) < 1e-3 * jump


def test_ringing_that_outlasts_a_ramp_is_as_loud_as_the_force_that_began_it():
    """Two samples of 39 Hz to an interval; 7 Hz rings on from full speed through zero. A wrong damping is far off."""
    f, z, tick, C = 7.26, 0.0238, 0.011, 0.017
    pole = 2 * np.pi * f * complex(-z, np.sqrt(1 - z**2))
    at = np.arange(0.0, 560.0, tick) + 0.0031
    volts = 34 * (np.abs(((np.maximum(at - 1, 0) / 5 + 1) % 4) - 2) - 1)
    t = np.arange(0.01, 559.0, 0.025747)
    force = C * volts * np.abs(volts)
    left = np.diff(force, prepend=0.0) * (2 * np.pi * f) ** 2 / (2j * pole.imag * pole)
    left = lfilter([1], [1, -np.exp(pole * tick)], left)
    last = np.searchsorted(at, t, side="right") - 1
    reading = force[last] + 2 * np.real(left[last] * np.exp(pole * (t - at[last])))
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", at, volts),
        Channel("thrust", "cell", "thrust", "N", t, reading),
    )
    history = history_of(Recording("ramps", "T1", channels, source="ramps.h5"))
    data, theta = start([history])
    assert np.median(history.count[history.rows]) == 2

    def missed(damping):
        at = replace(theta, C=C, tares=(0.0,), terms=((1.0, f, damping),))
        (told,), _ = raw(Model((StandResonance(),)), at, data, with_rate=False)
        return float(np.sqrt(np.mean((told - data.thrust[0])[50:] ** 2)))

    assert missed(z) < 1e-9
    assert min(missed(0.95 * z), missed(1.05 * z)) > 1e-3


def test_ticks_in_the_middle_of_an_interval_are_foretold():
    """Nine samples before a tick and nine after it have the mean of the line, and the mean of their squares has not:
    where the one was off by nothing, the other was taken for nothing too, or not, as it was rounded."""
    C, tick, many = 0.4, 0.06, 5000
    at = tick * np.arange(many) + 0.5 * tick
    volts = 24.0 * np.abs(np.arange(many) % 500 / 250 - 1) - 12.0
    t = np.arange(0.1, tick * (many - 2), tick / 18) + tick / 36
    x = volts[np.searchsorted(at, t, side="right") - 1]
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", at, volts),
        Channel("thrust", "cell", "thrust", "N", t, C * x * np.abs(x)),
    )
    data, theta = start([history_of(Recording("ramps", "T1", channels, source="ramps.h5"))])
    (told,), _ = raw(Model(), replace(theta, C=C, tares=(0.0,)), data, with_rate=False)
    assert np.mean(data.histories[0].count) > 4
    assert told == pytest.approx(data.thrust[0], abs=1e-9)
