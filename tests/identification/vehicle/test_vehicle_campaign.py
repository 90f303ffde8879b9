"""Trials that a campaign says little of: no table of steps, no constant-velocity runs, knowledge from elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from identification.comparators.rivals import rivals
from identification.estimation.maximum_likelihood import Gaussian
from identification.recording import Channel, Recording
from identification.thruster.thrust_data import Unusable
from identification.vehicle.campaign import (
    AxisTrials,
    CampaignFacts,
    at_once,
    identify_axis,
    identify_vehicle,
    sort_trials,
    step_of,
)
from identification.vehicle.efficiency import Installation, Interaction, Thruster
from identification.vehicle.replay import replay
from identification.vehicle.report import is_calibration, rows, verdict
from identification.vehicle.simulation import simulate_all
from identification.vehicle.trials import trial
from sim_devices.vehicle import romeo
from sim_devices.vehicle.campaign import BALLAST, DIVE, FRONT, TURN_FRONT, sine, there_and_back
from tests.identification.vehicle.vehicle_world import installation, recordings_of

EXACT = {f"T{i}": 0.4 for i in range(1, 9)}


@pytest.fixture(scope="module")
def made():
    rng = np.random.default_rng(8)
    trials = [
        there_and_back("front", "surge", FRONT, (8.0, 14.0, 20.0)), sine("surge", FRONT, 20.0, "ahead"),
        sine("surge", FRONT, -14.0, "back"), there_and_back("turn", "yaw", TURN_FRONT, (10.0,)),
        sine("heave", DIVE, 12.0, "down", BALLAST[0]), sine("heave", DIVE, -9.0, "up", BALLAST[0]),
    ]  # fmt: skip
    return {r.recording_id: r for r in recordings_of(romeo(eta_hull=1.0, eta_pair=1.0), trials, rng)}


@pytest.fixture(scope="module")
def plain():
    return replace(installation(EXACT), interactions=())


def test_without_a_table_of_steps_the_commands_tell_what_a_recording_is_for(made, plain):
    bare = [replace(one, steps=()) for one in made.values()]
    found = sort_trials(bare, plain)
    assert [r.recording_id for r in found.axes["surge"].steady] == ["front"]
    assert [r.recording_id for r in found.axes["surge"].moving] == ["ahead", "back"]
    assert [r.recording_id for r in found.axes["yaw"].steady] == ["turn"]
    short = replace(bare[0], channels=tuple(c for c in bare[0].channels if c.quantity != "position"))
    assert step_of(short, "surge") == "moving"


def test_what_the_campaign_says_comes_first(made, plain):
    facts = CampaignFacts(axis={"turn": "sway"}, step={"front": "moving"})
    found = sort_trials([made["front"], made["turn"]], plain, facts)
    assert found.axes["surge"].moving
    assert found.axes["sway"].steady


def test_moving_trials_alone_give_everything_at_once(made, plain):
    result = identify_axis(
        AxisTrials(moving=(made["ahead"], made["back"])), plain, "surge", facts=CampaignFacts(current=False)
    )
    assert "no constant-velocity run" in result.drag.reason
    estimate = result.estimate
    for name, truth in (("m", 800.0), ("k", 60.0), ("k2", 420.0)):
        assert abs(estimate[name] - truth) < 4 * estimate.std_of(name)
    (why,) = rivals(result)
    assert "need drag from constant-velocity runs" in why.reason


def test_heave_at_once_has_its_buoyancy(made, plain):
    facts = CampaignFacts(ballast={"down": "light", "up": "light"})
    fit = identify_vehicle([made["down"], made["up"]], plain, facts)
    estimate = fit.axes["heave"].estimate
    assert abs(estimate["buoyancy[light]"] - BALLAST[0]) < 4 * estimate.std_of("buoyancy[light]")
    assert any(row.verdict == "floats" for row in rows(estimate, "heave"))


def test_an_efficiency_on_all_thrusters_needs_a_mass_from_elsewhere(made, plain):
    eta = replace(plain, interactions=(Interaction("eta", ("T1", "T2", "T3", "T4")),))
    mass = {"surge": Gaussian(("m",), np.array([800.0]), np.array([[40.0**2]]))}
    told = CampaignFacts(known=mass, current=False)
    moving = AxisTrials(moving=(made["ahead"], made["back"]))
    found = identify_axis(moving, eta, "surge", facts=told).estimate
    assert abs(found["eta"] - 1.0) < 3 * found.std_of("eta")
    unknown = at_once([trial(made["ahead"], eta, "surge")], eta, current=False)
    assert np.isnan(unknown.estimate.std_of("eta"))


def test_knowledge_that_the_trials_contradict_is_said(made, plain):
    heavy = {"surge": Gaussian(("m",), np.array([1600.0]), np.array([[20.0**2]]))}
    group = AxisTrials((made["front"],), (made["ahead"],))
    result = identify_axis(group, plain, "surge", facts=CampaignFacts(known=heavy, current=False))
    assert "standard deviations from the 1600 ± 20 stated" in " ".join(result.statements)
    drag = {"surge": Gaussian(("k", "k2"), np.array([60.0, 420.0]), np.diag([0.1, 0.1]))}
    told = identify_axis(AxisTrials((made["front"],)), plain, "surge", facts=CampaignFacts(known=drag, current=False))
    assert told.estimate.std_of("k") < 0.3
    assert told.contradictions == ()


def test_a_trial_without_a_force_on_its_axis_tells_nothing(made, plain):
    idle = Installation((Thruster("T5", np.array([0.4]), {"heave": 1.0}),), np.zeros((1, 1)))
    one = trial(made["ahead"], idle, "surge")
    assert "no trial has a force" in at_once([one], idle).reason


def test_replay_of_speeds_and_of_trials_on_different_grids(made, plain):
    truth = Gaussian(("m", "k", "k2"), np.array([800.0, 60.0, 420.0]), np.eye(3))
    coarse, fine = (trial(made["ahead"], plain, "surge", step) for step in (0.5, 0.1))
    a, b = simulate_all([coarse, fine], truth.names, truth.mean[None], ["", ""], [("x0", "v0")] * 2)
    assert np.abs(a.position - b.position).max() < 2e-3
    time = np.arange(0.0, 180.0, 0.2)
    speed = np.interp(time, fine.time, b.velocity[0])
    fast = replace(fine, quantity="speed", time=time, response=speed)
    for fit_start in (True, False):
        (found,) = replay([fast], truth, fit_start=fit_start)
        assert found.validation.rmse < 3e-3
    still = replace(fast, response=0 * speed)
    assert np.isnan(replay([still], truth)[0].validation.fit)


def test_words_of_parameters():
    assert verdict("k", float("nan"), float("nan")) == "not determined"
    assert verdict("eta", 1.3, 0.01).startswith("more than the calibrated thrust")
    assert verdict("eta", 1.0, 0.01) == "not told apart from 1"
    assert verdict("buoyancy[a]", 3.0, 0.1) == "sinks"
    assert verdict("buoyancy[a]", 0.1, 0.1) == "not told apart from neutral"
    assert is_calibration("C+[T1]")
    assert "calibration" in verdict("C[T1]", 0.4, 0.1)


def test_a_shared_command_and_one_that_begins_late(plain):
    t = np.arange(0.0, 60.0, 0.5)
    place = Channel("x", "fix", "position", "m", t, 0.2 * t, axis="surge")
    late = Channel("u", "c", "command_voltage", "V", np.array([20.0]), np.array([10.0]), thruster="T1")
    one = trial(Recording("r", "v", (place, late), kind="vehicle"), plain, "surge")
    assert not isinstance(one, Unusable)
    assert one.force.nominal()[0] == 0
    assert one.force.nominal()[-1] > 0
