"""What the runs of one diagnosis are referred to is one for all of them."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.prepare.scales import of_one_rate, scale_of
from identification.physics.heating import FORMS as HEATING
from identification.physics.term import KELVIN, TermContext
from identification.physics.thruster_interaction import ThrusterInteraction
from identification.run_history.remembered import RememberedRun
from tests.identification.physics.runs_on_intervals import history


def weaker(made, share):
    """The same run, but for a current, a neighbour and a supply that are smaller and a motor that begins warm."""
    others = dict(made.others)
    others["current"] = share * np.abs(made.driver)
    others["neighbour_thrust"] = share * made.others["neighbour_thrust"]
    others["bus_voltage"] = share * made.others["bus_voltage"]
    others["motor_temperature"] = made.others["motor_temperature"] + (0.0 if share == 1 else 12.0)
    return replace(made, others=others)


@pytest.fixture
def pair():
    return tuple(RememberedRun(weaker(history(), share)) for share in (1.0, 0.5))


def acted(term, run, scale, theta):
    x = run.history.driver
    return term.apply(x.copy(), TermContext(run, scale, 0.5, 0.0, x), theta)


def test_the_largest_of_all_runs_and_the_coldest_beginning_are_the_references(pair) -> None:
    scale = scale_of(pair, 0.5)
    strong = pair[0].history.others
    assert scale.bus == np.max(strong["bus_voltage"])
    assert scale.current == np.max(strong["current"])
    assert scale.neighbour == np.max(strong["neighbour_thrust"])
    assert scale.cold == strong["motor_temperature"][0] + KELVIN


def test_a_run_with_half_the_jet_loses_its_root_and_one_with_half_the_current_a_quarter_of_the_heat(pair) -> None:
    scale = scale_of(pair, 0.5)
    jet = [acted(ThrusterInteraction(), run, scale, (0.1,)) - run.history.driver for run in pair]
    assert np.allclose(jet[1], np.sqrt(0.5) * jet[0])
    small = 1e-5
    lost = [acted(HEATING[0], run, scale, (small, 30.0)) - run.history.driver for run in pair]
    assert np.allclose(lost[1], 0.25 * lost[0], rtol=1e-3, atol=1e-9)


def test_a_motor_that_begins_warm_is_not_taken_for_a_cold_one(pair) -> None:
    scale, (cold, warm) = scale_of(pair, 0.5), pair
    measured = next(form for form in HEATING if form.form == "measured_winding")
    full = np.flatnonzero(np.abs(cold.history.driver) == cold.history.size)[-1]
    lost = [float(run.history.driver[full] - acted(measured, run, scale, (1e-4,))[full]) for run in (cold, warm)]
    rise = cold.history.others["motor_temperature"][full] + KELVIN - scale.cold
    assert lost[1] / lost[0] == pytest.approx(1 + 12.0 / rise, rel=0.01)


def test_runs_share_one_rate_per_driver_that_of_a_twin_where_there_is_one() -> None:
    made = history()
    runs = (made, replace(made, rate_per_driver=3.0))
    assert [h.rate_per_driver for h in of_one_rate(runs)] == [2.5, 2.5]
    assert [h.rate_per_driver for h in of_one_rate(runs, 4.0)] == [4.0, 4.0]
    unturned = replace(made, rate=None)
    assert of_one_rate((unturned,)) == (unturned,)


def test_what_a_rotor_draws_while_it_is_set_going_is_no_reference(pair) -> None:
    made = pair[0].history
    others = dict(made.others)
    others["current"] = np.where(np.arange(made.dt.size) == np.argmin(made.dt), 9.0, 1.0) * np.abs(made.driver)
    assert scale_of([RememberedRun(replace(made, others=others))], 0.5).current == np.max(np.abs(made.driver))
