"""Forces of dead weights, and their covariance, beside the GUM Tree Calculator."""

import GTC
import numpy as np
import pytest

from identification.calibration.loads import (
    Load,
    Place,
    Weight,
    force_of,
    forces_of,
    gravity_at,
    newtons_per_kilogram,
)
from tests.identification.calibration.weighed_cells import PLACE, SET, loads


def test_a_steel_weight_in_air():
    """OIML D 28, 6: 1 kg of 8000 kg/m^3 in air of 1.2 kg/m^3 loses 150 ppm; its conventional mass knows no density."""
    place = Place(9.8)
    assert newtons_per_kilogram(Weight("a", 1.0, 0.0), place) == pytest.approx(9.8 * (1 - 150e-6), rel=1e-12)
    brass = newtons_per_kilogram(Weight("a", 1.0, 0.0, density=8400.0), place)
    assert brass == pytest.approx(9.8 * (1 - 150e-6), rel=1e-9), "in air of 1.2 kg/m^3 that is what conventional means"
    up_there = newtons_per_kilogram(Weight("a", 1.0, 0.0), Place(9.8, air_density=0.9))
    assert up_there / 9.8 - 1.0 == pytest.approx(-0.9 / 8000.0, rel=1e-3)


def test_direction_and_lever():
    assert force_of(Load(("2", "5"), -1), SET, Place(9.8, lever=3.0)) == pytest.approx(-3.0 * 7.0 * 9.8, rel=2e-4)
    assert force_of(Load(), SET, PLACE) == 0.0
    with pytest.raises(ValueError, match="there is no weight '7' in the set; it has 1, 2, 2"):
        force_of(Load(("7",)), SET, PLACE)


@pytest.mark.parametrize(("latitude", "gravity"), [(0.0, 9.780327), (45.0, 9.806199), (90.0, 9.832186)])
def test_normal_gravity(latitude, gravity):
    """Geodetic Reference System 1980 (Moritz 2000, table)."""
    assert gravity_at(latitude)[0] == pytest.approx(gravity, abs=2e-6)
    assert gravity_at(latitude, 1000.0)[0] == pytest.approx(gravity - 3.086e-3, abs=2e-6)


def by_gtc(course, correlation):
    """The same forces in GTC's arithmetic of uncertain numbers."""
    masses = [GTC.ureal(w.mass, w.std, independent=False) for w in SET.values()]
    for i, a in enumerate(masses):
        for b in masses[i + 1 :]:
            GTC.set_correlation(correlation, a, b)
    g, air = GTC.ureal(PLACE.gravity, PLACE.gravity_std), GTC.ureal(PLACE.air_density, PLACE.air_density_std)
    lever, rho = GTC.ureal(PLACE.lever, PLACE.lever_std), GTC.ureal(7950.0, 70.0)
    per_kg = g * lever * (1 - air / rho) * (1 - 1.2 / 8000.0) / (1 - 1.2 / rho)
    of = dict(zip(SET, masses, strict=True))
    return [load.direction * per_kg * sum((of[name] for name in load.weights), 0.0) for load in course]


@pytest.mark.parametrize("correlation", [0.0, 0.4, 1.0])
def test_covariance_of_stacked_weights_is_that_of_gtc(correlation):
    course = [Load(("2",)), Load(("2", "2*")), Load(("10", "5", "2", "2*", "1")), Load(("5",), -1)]
    ours = forces_of(course, SET, PLACE, correlation)
    theirs = by_gtc(course, correlation)
    assert ours.value == pytest.approx([GTC.value(each) for each in theirs], rel=1e-12)
    cov = [[GTC.get_covariance(a, b) for b in theirs] for a in theirs]
    assert ours.cov == pytest.approx(np.array(cov), rel=1e-6)


def test_correlated_weights_add_up():
    course = [Load(("2", "2*"))]
    apart, together = (forces_of(course, SET, Place(9.8, air_density_std=0.0), r).sources[0].effect for r in (0.0, 1.0))
    assert np.linalg.norm(together) == pytest.approx(np.sqrt(2.0) * np.linalg.norm(apart))


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: Weight("a", -1.0, 0.0), "weight a: mass must be above 0 kg"),
        (lambda: Place(1.6), "gravity must be between 9.7 and 9.9"),
        (lambda: Place(9.8, lever=-1.0), "lever must be above 0"),
        (lambda: Load(("1", "1")), "hangs twice"),
        (lambda: Load(("1",), 2), "direction must be 1 or -1"),
        (lambda: forces_of(loads(), SET, PLACE, 1.5), "correlation of the weights"),
        (lambda: gravity_at(100.0), "latitude"),
    ],
)
def test_what_can_not_be(made, said):
    with pytest.raises(ValueError, match=said):
        made()
