"""How well a planned run of a vehicle tells a model from its rival."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.diagnosis import PlanStep
from identification.mismatch.next_experiment.discrimination import power
from identification.mismatch.select.stepwise import RivalTerm
from identification.mismatch.vehicle.experiment import decides, foreseen
from identification.mismatch.vehicle.runs import Prepared, prepare
from identification.mismatch.vehicle.screening import applicable
from identification.mismatch.vehicle.search import State, Vehicle, search
from identification.physics.vehicle.dead_band import DeadBand
from tests.concealed.vehicles import case, recordings, setup, surge_trials

HOLDS = tuple(PlanStep(volts, 20.0) for volts in (8.0, -8.0, 16.0, -16.0))


@pytest.fixture(scope="module")
def banded() -> tuple[Vehicle, State]:
    """A vehicle whose thrusters have a dead band, and the model found of one run."""
    rng = np.random.default_rng([3, 1])
    one = case(rng, "dead_band", 0.5)
    data = prepare(recordings(one, rng, surge_trials()[:1]), setup(one, rng).installation, "surge", setup(one, rng))
    assert isinstance(data, Prepared)
    vehicle = Vehicle(data, applicable(data)[0])
    return vehicle, search(vehicle, np.random.default_rng(0))[1]


def test_between_a_model_and_itself_nothing_decides(banded: tuple[Vehicle, State]) -> None:
    vehicle, state = banded
    same = RivalTerm(state.terms[0], state.fit, 0.0, 0.0)
    assert decides(HOLDS, state, same, vehicle.data) == 0.0


def test_a_run_where_they_differ_decides_unless_the_wrong_one_can_follow(banded: tuple[Vehicle, State]) -> None:
    """At one level, with nothing known of thrust and drag, a dead band is a weaker thruster."""
    vehicle, state = banded
    assert [term.id for term in state.terms] == ["dead_band"]
    bare = vehicle.without(state, state.terms[0])
    assert decides(HOLDS, state, RivalTerm(DeadBand(), bare, 0.0, 0.0), vehicle.data) > 0.95
    loose = replace(bare, jacobian=1e-6 * bare.jacobian)
    one = (PlanStep(12.0, 20.0),)
    true, tight, open_ended = (foreseen(one, fit, state.noise, vehicle.data) for fit in (state.fit, bare, loose))
    assert power(true, tight, 4.0) > 0.9
    assert power(true, open_ended, 4.0) < 0.5


def test_what_is_open_of_a_run_is_what_the_fit_leaves_and_its_own_start(banded: tuple[Vehicle, State]) -> None:
    vehicle, state = banded
    view = foreseen(HOLDS, state.fit, state.noise, vehicle.data)
    starts = state.fit.layout.starts
    assert np.allclose(np.sqrt(np.diag(view.cov))[:starts], state.fit.std[:starts], rtol=0.05)
    scale = vehicle.data.scale
    assert np.allclose(np.diag(view.cov)[starts:], [scale.speed**2, scale.length**2])
