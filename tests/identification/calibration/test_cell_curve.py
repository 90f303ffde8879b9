"""A curve read forward and back, and what its covariance makes of forces."""

import json

import numpy as np
import pytest

from identification.calibration.curve import Curve, curve_of

COV = tuple(tuple(1e-8 if i == j == 0 else 0.0 for j in range(4)) for i in range(4))


def curve(**changes):
    facts = {"zero": 0.5, "terms": (1.01, 3e-5, -4e-5, 1e-7), "covariance": COV, "low": -200.0, "high": 150.0}
    return Curve(**(facts | {"dof": 40.0} | changes))


@pytest.mark.parametrize("force", [-450.0, -200.0, -13.0, 0.0, 1e-9, 99.0, 150.0, 400.0])
def test_there_and_back(force):
    assert curve().force(curve().reading(force)) == pytest.approx(force, abs=1e-9)


def test_beyond_its_range_it_goes_on_straight():
    found = curve()
    beyond = found.reading(150.0) + 100.0 * found.slope(150.0)
    assert found.reading(250.0) == pytest.approx(beyond)
    assert np.isnan(found.force(float("nan")))


def test_a_gain_that_is_uncertain_is_so_of_each_force():
    forces = np.array([-100.0, 50.0])
    effects = curve(terms=(1.0, 0.0, 0.0, 0.0)).effects(forces)
    assert effects @ effects.T == pytest.approx(1e-8 * np.outer(forces, forces), abs=1e-12)


def test_hysteresis_is_nothing_at_the_ends_and_most_in_the_middle():
    plain, lagging = curve(), curve(lag=0.3)
    added = [np.linalg.norm(lagging.effects(np.array([f]))) ** 2 - np.linalg.norm(plain.effects(np.array([f]))) ** 2
             for f in (0.0, 75.0, 150.0)]  # fmt: skip
    assert added == pytest.approx([0.0, 0.09, 0.0], abs=1e-9)


def test_as_json_and_back():
    for dof in (40.0, float("inf")):
        found = curve(dof=dof, lag=0.1, creep=1e-4)
        assert curve_of(json.loads(json.dumps(found.as_json()))) == found


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"terms": (1.0, 0.0, -4e-3, 0.0)}, "does not rise with the force"),
        ({"covariance": ((1.0,),)}, "four terms"),
        ({"covariance": tuple(tuple(-x for x in row) for row in COV)}, "variances of at least 0"),
        ({"low": 10.0}, "must hold 0 N"),
        ({"dof": 0.0}, "degrees of freedom"),
        ({"zero": float("nan")}, "finite"),
    ],
)
def test_what_is_no_curve(change, said):
    with pytest.raises(ValueError, match=said):
        curve(**change)


@pytest.mark.parametrize("facts", [None, [], {}, {"range": [0, 1]}, curve().as_json() | {"terms": {"gain": 1.0}},
                                   curve().as_json() | {"covariance": 3}])  # fmt: skip
def test_what_is_no_curve_in_a_file(facts):
    with pytest.raises(ValueError, match="calibration's curve"):
        curve_of(facts)
