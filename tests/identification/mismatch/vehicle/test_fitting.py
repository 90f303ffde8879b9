"""Least squares of a vehicle against scipy's, on a motion that scipy integrates; what is fixed, bounded or not seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from identification.mismatch.noise.covariance import Noise
from identification.mismatch.vehicle.fitting import at_bound, fit, noise_of, weights
from identification.mismatch.vehicle.model import VehicleModel, begin, layout_of
from identification.mismatch.vehicle.runs import Prepared, prepare
from identification.mismatch.vehicle.setup import ANY_AXIS, Stated, VehicleSetup
from identification.physics.vehicle.added_mass import AddedMass
from identification.physics.vehicle.dead_band import DeadBand
from identification.physics.vehicle.installation_efficiency import InstallationEfficiency
from identification.physics.vehicle.linear_drag import LinearDrag
from identification.vehicle.efficiency import Installation, Thruster
from tests.identification.mismatch.vehicle.boats import (
    DRAG,
    LEVELS,
    MASS,
    NOISE,
    C,
    banded,
    boat,
    fitted,
    prepared,
    speed_at,
    thrust,
)

BAND = DeadBand()


@pytest.fixture(scope="module")
def data() -> Prepared:
    return prepared([boat()])


def test_values_and_errors_are_those_of_scipy(data: Prepared) -> None:
    """Drag and the speed at the start; the motion of scipy has no steps of a grid."""
    found = fitted(data)
    (run,) = data.runs

    def residual(theta):
        return (run.response - speed_at(run.time, LEVELS, v0=theta[1], drag=theta[0])) / NOISE

    known = least_squares(residual, [30.0, 0.0], x_scale=[10.0, 0.1])
    cov = np.linalg.inv(known.jac.T @ known.jac)
    k2, v0 = 0, found.layout.starts
    std = np.sqrt(np.diag(cov))
    assert np.all(np.abs(found.theta[[k2, v0]] - known.x) < 0.02 * std)
    assert found.std[[k2, v0]] == pytest.approx(std, rel=0.02)
    assert found.cov[k2, v0] == pytest.approx(cov[0, 1], rel=0.1, abs=0.02 * std[0] * std[1])
    assert found.chi2 == pytest.approx(2 * known.cost, rel=1e-3)
    assert abs(found.theta[k2] - DRAG) < 4 * std[0]


def test_slopes_are_what_small_changes_of_the_parameters_do() -> None:
    data = prepared([boat(push=banded(1.0))])
    found = fitted(data, {BAND: (0.5,)})
    white = weights(Noise(NOISE**2, 0.0), data)
    for i in range(found.layout.starts + 1):
        step = 1e-4 * max(abs(found.theta[i]), 1.0)
        ends = []
        for sign in (-1, 1):
            theta = found.theta.copy()
            theta[i] += sign * step
            held = fit(found.layout, theta, data, white, fixed=np.ones(theta.size))
            ends.append(held.residual)
        slope = (ends[0] - ends[1]) / (2 * step)
        size = np.abs(slope).max()
        assert found.jacobian[:, i] == pytest.approx(slope, abs=2e-3 * size), i


def test_what_is_fixed_keeps_its_value_and_has_no_error(data: Prepared) -> None:
    layout = layout_of(VehicleModel(), data)
    theta = begin(layout, data)
    theta[0] = 55.0
    fixed = np.zeros(layout.size)
    fixed[0] = 1.0
    found = fit(layout, theta, data, weights(Noise(NOISE**2, 0.0), data), fixed=fixed)
    assert found.theta[0] == 55.0
    assert found.std[0] == 0.0
    assert not found.free[0]
    assert found.std[layout.starts] > 0


def test_a_value_that_is_pushed_on_at_its_bound_is_not_free() -> None:
    """Thrusters that give half more than their models promise: an efficiency beyond 1 is not possible."""
    data = prepared([boat(push=lambda t, V, v: 1.5 * thrust(t, V, v))], Stated(MASS))
    found = fitted(data, {InstallationEfficiency(): (0.97,)})
    eta = found.layout.of(InstallationEfficiency()).start
    assert found.theta[eta] == 1.0
    assert found.std[eta] == 0.0
    assert not found.free[eta]
    inside = fitted(prepared([boat(push=lambda t, V, v: 0.8 * thrust(t, V, v))]), {InstallationEfficiency(): (0.97,)})
    assert inside.free[eta]
    assert inside.theta[eta] == pytest.approx(0.8, abs=4 * inside.std[eta])


def test_a_term_that_ends_at_what_is_possible_says_so() -> None:
    """Thrusters that give nothing at all below 8 V, of 12: more of a dead band than any has."""
    wide = prepared([boat(push=banded(9.5))])
    assert at_bound(fitted(wide, {BAND: (1.0,)}), BAND)
    assert not at_bound(fitted(prepared([boat(push=banded(1.0))]), {BAND: (0.5,)}), BAND)


def test_of_two_of_which_the_sum_alone_is_seen_neither_has_an_error() -> None:
    """Two thrusters that are always commanded alike: NaN, and not a number of any size."""
    both = tuple(Thruster(name, np.array([C / 2]), {"surge": 1.0}) for name in ("T1", "T2"))
    one = boat()
    command, speed = one.channels
    channels = (command, replace(command, name="second", thruster="T2"), speed)
    installation = Installation(both, np.diag([100.0, 100.0]))
    setup = VehicleSetup(installation, {ANY_AXIS: Stated(MASS)}, current=False)
    data = prepare([replace(one, channels=channels)], installation, "surge", setup)
    assert isinstance(data, Prepared)
    found = fitted(data)
    names = [p.name for p in found.layout.base]
    assert names == ["k2", "C[T1]", "C[T2]"]
    assert np.isnan(found.std[1:3]).all()
    assert np.isfinite(found.std[[0, 3]]).all()
    assert found.theta[1] + found.theta[2] == pytest.approx(2.0, rel=0.05)


def test_what_is_known_of_the_mass_is_a_row_of_the_problem() -> None:
    """A stated mass of 5 % holds it beside motion that says little: with C free too all could be scaled."""
    data = prepared([boat()], Stated(1.1 * MASS, 0.05 * MASS))
    found = fitted(data)
    names = [p.name for p in found.layout.base]
    m = found.theta[names.index("m")]
    assert found.residual.size == data.runs[0].time.size + 1
    assert found.residual[-1] == pytest.approx((1.1 * MASS - m) / (0.05 * MASS))
    assert m == pytest.approx(MASS, abs=5 * found.std[names.index("m")])
    added = fitted(prepared([boat()], Stated(0.7 * MASS)), {AddedMass(): (1.0,)})
    carried = added.values[AddedMass()]
    assert carried[0] == pytest.approx(0.3 * MASS, rel=0.1)


def test_rows_that_are_left_out_are_not_fitted(data: Prepared) -> None:
    """Of a run whose second half was spoilt, the first half alone gives the drag."""
    spoilt = boat()
    command, speed = spoilt.channels
    late = speed.time > 32.0
    bad = prepared([replace(spoilt, channels=(command, replace(speed, value=speed.value + 3.0 * late)))])
    keep = [bad.runs[0].time <= 32.0]
    layout = layout_of(VehicleModel(), bad)
    white = weights(Noise(NOISE**2, 0.0), bad, keep)
    found = fit(layout, begin(layout, bad), bad, white, keep=keep)
    assert found.residual.size == np.count_nonzero(keep[0])
    assert abs(found.theta[0] - DRAG) < 4 * found.std[0]
    assert len(found.predicted[0]) == bad.runs[0].time.size


def test_noise_is_what_was_put_in_and_holds_nothing_that_may_still_be_added(data: Prepared) -> None:
    assert np.sqrt(noise_of(fitted(data), data).white) == pytest.approx(NOISE, rel=0.1)
    dragged = prepared([boat(push=lambda t, V, v: thrust(t, V, v) - 12.0 * v)])
    bare = fitted(dragged)
    (run,) = dragged.runs
    truth = fitted(dragged, {LinearDrag(): (12.0,)})
    change = (truth.predicted[0] - bare.predicted[0])[:, None]
    alone, beside = noise_of(bare, dragged), noise_of(bare, dragged, [change])
    assert sum(alone.slow) > 5 * sum(beside.slow)
    assert np.sqrt(beside.white + sum(beside.slow)) == pytest.approx(NOISE, rel=0.25)
    assert change.shape == (run.time.size, 1)
