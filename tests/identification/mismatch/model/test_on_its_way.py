"""The force of a rotor on its way, over intervals between steps that are seconds apart, against sums over samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.model import Given, Model
from identification.mismatch.model.on_its_way import on_its_way
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import predict
from identification.physics.asymmetry import Asymmetry
from identification.physics.inflow_dynamics import InflowDynamics
from identification.physics.motor_lag import MotorLag
from identification.physics.stand_resonance import StandResonance
from identification.physics.winding_resistance import WindingResistance
from identification.recording import Channel, Recording
from identification.run_history.rotor_lag import Rotor, lagged
from tests.identification.mismatch.small import data_of

C, TAU, RATIO, SHARE, INFLOW, LOSS = 0.6, 0.05, 0.8, 0.15, 0.9, 0.006
LAG, WATER, SIDES, WINDING = MotorLag("first_order"), InflowDynamics(), Asymmetry(), WindingResistance()
START = np.arange(0.0, 60.0, 3.003)
VOLTS = 20.0 * np.random.default_rng(5).uniform(-1, 1, START.size)
STEP = 1 / 500.0
FINE = 8
TIMES = 0.0007 + STEP * np.arange(int(60.0 / STEP))


@pytest.fixture(scope="module")
def stepped():
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", START, VOLTS),
        Channel("thrust", "cell", "thrust", "N", TIMES, C * VOLTS[held(TIMES)] * np.abs(VOLTS[held(TIMES)])),
    )
    data, _ = data_of([Recording("stepped", "T1", channels)])
    return data


def held(at):
    return np.maximum(np.searchsorted(START, at, side="right") - 1, 0)


def rates(volts, rotor):
    """(n, FINE) of a rotor that follows `volts` (T,), at the samples and between: exact from step to step."""
    ends = [volts[0]]
    for step, dt in zip(volts[:-1], np.diff(START), strict=True):
        ends.append(float(lagged(np.array([step]), np.array([ends[-1]]), np.array([dt]), rotor)[0]))
    at = (TIMES[:, np.newaxis] + STEP / FINE * np.arange(FINE)).ravel()
    index = held(at)
    since = np.maximum(at - START[index], 0.0)
    return lagged(volts[index], np.array(ends)[index], since, rotor)


def force(x, *, sides=False, water=False):
    """(n,) N at the samples, of rates at them and between."""
    F = C * x * np.abs(x)
    if sides:
        F = np.where(x < 0, RATIO * F, F)
    if water:
        u, follows = np.zeros(x.size), np.exp(-STEP / FINE / INFLOW)
        for i in range(1, x.size):
            u[i] = x[i] + (u[i - 1] - x[i]) * follows
        F = F + C * np.abs(x) * SHARE * (x - u)
    return F[::FINE]


def off(data, model, theta, F):
    """(N, N): root mean square of what is told, and of the force of the mean rate, in rows of 3 samples and more."""
    h, rows = data.histories[0], data.rows[0]
    samples = h.thrust_samples
    mean = samples.means(F[np.searchsorted(TIMES, samples.time - 1e-9)])[rows]
    told, _ = raw(model, theta, data, with_rate=False)
    rough, _ = predict(model, theta, data.runs[0], data.scale)
    many = (h.count[rows] >= 3) & (h.middle[rows] > START[1])
    near, far = ((each - mean)[many] for each in (told[0], rough[rows]))
    return float(np.sqrt(np.mean(near**2))), float(np.sqrt(np.mean(far**2)))


@pytest.mark.parametrize(
    ("terms", "values", "how"),
    [
        ((LAG,), ((TAU,),), {}),
        ((LAG, SIDES), ((TAU,), (RATIO,)), {"sides": True}),
        ((LAG, WATER), ((TAU,), (SHARE, INFLOW)), {"water": True}),
        ((LAG, SIDES, WATER), ((TAU,), (RATIO,), (SHARE, INFLOW)), {"sides": True, "water": True}),
    ],
)
def test_rows_are_means_over_their_samples(stepped, terms, values, how):
    """At 0.05 % of noise the force of the mean rate made a fifth more of it: a second run in which nothing had changed
    was "something left, after steps" (p < 1e-19)."""
    F = force(rates(VOLTS, Rotor(0.0, 1 / TAU)), **how)
    near, far = off(stepped, Model(terms), Theta(C, values, (0.0,)), F)
    assert near < 0.15 * far
    assert near < 0.008


def test_a_rotor_that_water_brakes_and_one_behind_a_winding(stepped):
    rotor = Rotor(1 / (2 * TAU * stepped.scale.driver), 0.0)
    near, far = off(stepped, Model((MotorLag("quadratic"),)), Theta(C, ((TAU,),), (0.0,)), force(rates(VOLTS, rotor)))
    assert near < 0.15 * far
    behind = 2 * VOLTS / (1 + np.sqrt(1 + 4 * LOSS * np.abs(VOLTS)))
    F = force(rates(behind, Rotor(0.0, 1 / TAU)))
    near, far = off(stepped, Model((WINDING, LAG)), Theta(C, ((LOSS,), (TAU,)), (0.0,)), F)
    assert near < 0.15 * far


def test_a_lag_that_a_twin_gives_does_the_same(stepped):
    theta = Theta(C, ((TAU,), (RATIO,)), (0.0,))
    found, _ = raw(Model((LAG, SIDES)), theta, stepped, with_rate=False)
    given = tuple(Given(term, each, stepped.scale) for term, each in ((LAG, (TAU,)), (SIDES, (RATIO,))))
    told, _ = raw(Model((), given), replace(theta, terms=()), stepped, with_rate=False)
    assert told[0] == pytest.approx(found[0], abs=1e-12)


def test_nothing_is_added_where_no_rotor_lags(stepped):
    run, scale = stepped.runs[0], stepped.scale
    for terms, values in (((), ()), ((SIDES,), ((RATIO,),)), ((StandResonance(),), ((0.5, 12.0, 0.1),))):
        model, theta = Model(terms), Theta(C, values, (0.0,))
        _, x = predict(model, theta, run, scale)
        assert np.all(on_its_way(model, theta, run, x, scale, 0.0) == 0.0)
