"""A vehicle's terms by name: rivals beside them, values that are possible, one parameter in all parts of the runs."""

from __future__ import annotations

import pytest

from identification.mismatch.name.named_term import Check
from identification.mismatch.vehicle.naming import checks, name
from identification.mismatch.vehicle.search import Vehicle
from identification.physics.vehicle.added_mass import AddedMass
from identification.physics.vehicle.dead_band import DeadBand
from identification.physics.vehicle.installation_efficiency import InstallationEfficiency
from identification.physics.vehicle.linear_drag import LinearDrag
from identification.physics.vehicle.quadratic_drag import QuadraticDrag
from identification.physics.vehicle.term import VehicleTerm
from tests.identification.mismatch.vehicle.boats import (
    HOLD,
    LEVELS,
    MASS,
    Force,
    banded,
    boat,
    orders,
    part,
    prepared,
    state,
    thrust,
)

BAND, JUMP, STRAIGHT, SHARE, WATER = DeadBand(), DeadBand("jump"), LinearDrag(), InstallationEfficiency(), AddedMass()
HALVES = "in the first and the second half of the runs"
SIDES = "ahead and astern"
SECOND = "in every second run"


def asked(term: VehicleTerm, *pushes: Force) -> dict[str, Check]:
    """What a term that was fitted is asked, by the kind, or by the parts."""
    data = prepared([boat(i, push, levels) for i, (push, levels) in enumerate(zip(pushes, orders(9), strict=False))])
    found = state(data, {term: tuple(v for v in term.trials(data.scale)[1])})
    return {c.asked.removeprefix("the same "): c for c in checks(found, data, term)}


def test_what_is_the_same_everywhere_passes_all_that_it_is_asked() -> None:
    found = asked(BAND, banded(1.0), banded(1.0))
    assert list(found) == ["its values are possible", HALVES, SIDES, SECOND]
    assert [c.failed for c in found.values()] == [""] * 4
    assert not any(c.silent for c in found.values())


def test_one_run_has_no_second() -> None:
    assert SECOND not in asked(BAND, banded(1.0))


@pytest.mark.parametrize("term", [BAND, STRAIGHT])
def test_a_parameter_that_differs_from_run_to_run_is_told(term: VehicleTerm) -> None:
    pushes: dict[VehicleTerm, tuple[Force, Force]] = {
        BAND: (banded(0.5), banded(2.0)),
        STRAIGHT: (thrust, lambda t, V, v: thrust(t, V, v) - 20.0 * v),
    }
    found = asked(term, *pushes[term])
    assert SECOND in found[SECOND].failed
    assert 0.3 < found[SECOND].apart < 4.0, "a share of itself"


def test_a_parameter_that_changes_half_way_is_told() -> None:
    end = HOLD * len(LEVELS) / 2

    def worn(t: float, volts: float, v: float) -> float:
        return banded(0.3 if t < end else 2.0)(t, volts, v)

    assert HALVES in asked(BAND, worn)[HALVES].failed


def test_a_drag_that_is_there_astern_only_is_told() -> None:
    found = asked(STRAIGHT, lambda t, V, v: thrust(t, V, v) - (40.0 * v if v < 0 else 0.0))
    assert SIDES in found[SIDES].failed


def test_values_at_the_end_of_what_is_possible_fail() -> None:
    found = asked(BAND, banded(9.5))
    assert found["its values are possible"].failed


def test_a_term_beside_far_worse_ones_has_no_rival() -> None:
    """Two forms of a dead band are one effect; a drag beside it explains far less."""
    data = prepared([boat(0, banded(1.0))])
    vehicle = Vehicle(data, (BAND, JUMP, STRAIGHT, QuadraticDrag()))
    last, (found,) = name(state(data, {BAND: (0.5,)}), vehicle)
    assert last.terms == (BAND,)
    assert found.term == BAND
    assert found.theta[0] == pytest.approx(1.0, abs=4 * found.std[0])
    assert found.rivals == ()
    assert found.probability == 1.0
    assert found.failed_checks == ()
    bare = state(data).fit.chi2
    assert found.chi2_gain == pytest.approx(bare - last.fit.chi2, rel=1e-3)
    assert found.searched == sum(len(t.trials(data.scale)) for t in vehicle.terms)


def test_what_changes_the_same_ratio_is_a_rival() -> None:
    """A fifth less thrust, or a quarter more mass: with any drag the motion is one."""
    data = prepared([boat(0, lambda t, V, v: 0.8 * thrust(t, V, v))])
    _, (found,) = name(state(data, {SHARE: (0.9,)}), Vehicle(data, (SHARE, WATER, BAND)))
    assert [r.term for r in found.rivals] == [WATER]
    assert found.rivals[0].fit.values[WATER][0] == pytest.approx(0.25 * MASS, rel=0.05)
    assert abs(found.rivals[0].bic_loss) < 0.1
    assert found.probability == pytest.approx(0.5, abs=0.02)


def test_a_form_that_does_better_takes_the_place_first() -> None:
    data = prepared([boat(0, banded(1.5))])
    vehicle = Vehicle(data, (BAND, JUMP))
    wrong = state(data, {JUMP: (2.0,)})
    last, (found,) = name(wrong, vehicle)
    assert last.terms == (BAND,)
    assert found.theta[0] == pytest.approx(1.5, abs=4 * found.std[0])
    assert last.fit.chi2 < wrong.fit.chi2


def test_a_term_that_follows_noise_does_not_pay() -> None:
    data = part(prepared([boat(0)]), 0)
    _, (found,) = name(state(data, {STRAIGHT: (5.0,)}), Vehicle(data, (STRAIGHT,)))
    assert found.only_unpaid
    assert found.bic_gain < 0
