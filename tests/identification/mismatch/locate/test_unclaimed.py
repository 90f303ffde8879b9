"""What the last screening shows too faintly for a name is within reach, and C's interval holds what it makes of it."""

import numpy as np
import pytest

from identification.mismatch.answer.averaged_constant import averaged
from identification.mismatch.answer.report_assembly import values_of
from identification.mismatch.locate.stage import Located
from identification.mismatch.locate.unclaimed import unclaimed
from identification.mismatch.select.forward_selection import Selected, Thruster
from tests.identification.diagnosed_runs import C
from tests.identification.mismatch.small import known_noise, short
from tests.identification.physics.one_term import term

LINEAR, BAND = term("linear_term"), term("dead_band", "shrink")


def asked(slope):
    """The baseline of a run with so much of a linear part, in N/V, screened for that and a dead band alone."""
    data, before = known_noise({}, [short(lambda t, V, F: F + slope * V)])
    last = Thruster(data, (LINEAR, BAND)).judged(before, np.random.default_rng(0))
    selected = Selected(data, (LINEAR, BAND), before, before, (), last)
    return data, before, selected, Located(before, None)


@pytest.fixture(scope="module")
def faint():
    """Some four sigma, which a search among many trials does not claim."""
    return asked(0.05)


def test_what_is_faint_is_fitted_beside_the_model(faint):
    _, before, selected, located = faint
    assert 3.0 < selected.last.plain.max() < 6.0
    found = {each.term: each for each in unclaimed(selected, located)}
    assert LINEAR in found
    assert set(found[LINEAR].fit.model.terms) == {LINEAR}
    cost = np.log(before.fit.residual.size)
    assert found[LINEAR].bic_loss == pytest.approx(found[LINEAR].fit.chi2 - before.fit.chi2 + cost)


def test_the_interval_of_c_reaches_to_what_it_makes_of_it(faint):
    data, before, selected, located = faint
    alone = values_of(before.fit, data)["C"]
    assert not alone.interval[0] < C < alone.interval[1]
    told, said = averaged(alone, before.fit, data, (), unclaimed(selected, located))
    assert told.value == alone.value
    assert told.interval[0] < C < told.interval[1]
    assert "linear term beside what is told" in " ".join(said)


def test_where_nothing_is_seen_nothing_is_in_reach():
    data, before, selected, located = asked(0.0)
    assert selected.last.plain.max() < 3.0
    assert unclaimed(selected, located) == []
    assert averaged(values_of(before.fit, data)["C"], before.fit, data, (), ())[1] == ()
