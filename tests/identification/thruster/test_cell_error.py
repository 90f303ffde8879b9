"""The curve of a calibrated cell in a fit: the calibration's part of C's interval, and of C+ against C-."""

import numpy as np
import pytest

from identification.calibration.curve import Curve
from identification.recording import Channel, Recording
from identification.thruster.thrust import ThrustFit, fit_thrust
from identification.thruster.thrust_data import Unusable, curve_behind
from tests.identification.thrust_runs import staircase


def calibration(cov, dof=float("inf"), **changes):
    found = Curve(0.0, (1.0, 0.0, 0.0, 0.0), tuple(map(tuple, np.diag(cov))), -250.0, 250.0, dof, **changes)
    return {"gain_std": found.gain_std, "curve": found.as_json()}


def fitted(facts, model="C V|V|", **changes):
    found = fit_thrust([staircase(calibration=facts, **changes)], model)
    assert isinstance(found, ThrustFit)
    return found


def test_a_gain_alone_is_what_gain_std_was():
    by_curve, by_number = fitted(calibration((1e-6, 0, 0, 0))), fitted({"gain_std": 1e-3})
    C, known = by_curve.parameters["C"], by_number.parameters["C"]
    assert C.value == known.value
    assert C.std_statistical == known.std_statistical
    assert C.std_calibration == pytest.approx(known.std_calibration, rel=2e-3)
    assert (C.low, C.high) == pytest.approx((known.low, known.high), rel=1e-6)


def test_an_even_bend_moves_the_two_directions_apart():
    """Known by its propagation in numpy: the same staircase bent by one standard deviation, fitted again."""
    std, facts = 2e-5, calibration((0.0, 4e-10, 0, 0))
    found = fitted(facts, "C+/C-")
    bent = fit_thrust([staircase(calibration=facts, mend=lambda t, V, F: F + std * (F - 1.5) ** 2)], "C+/C-")
    for name in ("C_plus", "C_minus"):
        moved = bent.parameters[name].value - found.parameters[name].value
        assert found.parameters[name].std_calibration == pytest.approx(abs(moved), rel=0.03)
    cov = found.cov_calibration
    assert cov[0, 1] < 0.0, "what raises one lowers the other"
    assert np.all(np.linalg.eigvalsh(found.cov) > 0.0)
    assert fitted(facts).parameters["C"].std_calibration < 0.1 * found.parameters["C_plus"].std_calibration


def test_hysteresis_and_creep_count_as_what_is_not_known_of_the_run():
    plain, more = (fitted(calibration((1e-8, 0, 0, 0), **c)) for c in ({}, {"lag": 0.1, "creep": 1e-3}))
    C, wide = plain.parameters["C"], more.parameters["C"]
    assert wide.std_calibration > np.hypot(C.std_calibration, 0.99e-3 / np.sqrt(3.0) * C.value)


def test_few_degrees_of_freedom_of_the_calibration_widen_the_interval():
    many, few = (fitted(calibration((1e-4, 0, 0, 0), dof)).parameters["C"] for dof in (float("inf"), 4.0))
    assert few.std == many.std
    assert few.high - few.low > 1.3 * (many.high - many.low)
    assert few.dof_statistical == pytest.approx(many.dof_statistical, rel=1e-6)


def test_two_runs_under_one_calibration_share_its_error():
    shared = calibration((1e-6, 0, 0, 0))
    runs = [
        staircase(calibration=shared, recording_id=name, rng=np.random.default_rng(i)) for i, name in enumerate("ab")
    ]
    other = staircase(calibration={"gain_std": 1e-3}, recording_id="b", rng=np.random.default_rng(1))
    together, apart = (fit_thrust(each).parameters["C"] for each in (runs, [runs[0], other]))
    assert together.std_calibration == pytest.approx(1e-3 * together.value, rel=0.01)
    assert apart.std_calibration == pytest.approx(1e-3 * together.value / np.sqrt(2.0), rel=0.05)


def test_a_curve_that_is_none_leaves_gain_std():
    none = np.zeros(1)
    thrust = Channel("f", "cell", "thrust", "N", none, none, calibration={"curve": {"range": 3}, "gain_std": 0.1})
    assert curve_behind(thrust) is None


def test_a_calibration_is_no_run():
    run = staircase()
    found = fit_thrust([Recording("a", "", run.channels, run.steps, kind="calibration")])
    assert isinstance(found, Unusable)
    assert "calibration of a load cell with dead weights" in found.reason
