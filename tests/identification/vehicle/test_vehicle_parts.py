"""Lay-outs, efficiencies, the likelihood and recordings with something missing."""

from dataclasses import replace

import numpy as np
import pytest

from identification.comparators import by_annealing, by_kalman
from identification.estimation.maximum_likelihood import Gaussian, independent, maximise
from identification.recording import Channel, Recording
from identification.thruster.thrust import fit_thrust
from identification.thruster.thrust_data import Unusable
from identification.vehicle.efficiency import (
    Installation,
    Interaction,
    Thruster,
    calibrated,
    efficiency_sentence,
    force_on,
)
from identification.vehicle.entangled import entanglement
from identification.vehicle.inertia import by_derivative, output_error
from identification.vehicle.inertia_by_derivative import inverse_inertia, smoothed
from identification.vehicle.replay import fit_percent
from identification.vehicle.simulation import integrate
from identification.vehicle.steady_drag import identify_drag, steady_velocity, unit_of
from identification.vehicle.trials import Trial, dominant_axis, response_of, steady_runs, trial
from identification.velocity.constant_velocity import approaches, straight_line, velocities
from sim_devices.vehicle import romeo
from sim_devices.vehicle.campaign import FRONT, sine, there_and_back
from tests.identification.thrust_runs import staircase
from tests.identification.vehicle.vehicle_world import installation, recordings_of

EXACT = {f"T{i}": 0.4 for i in range(1, 9)}
NONE = Gaussian((), np.zeros(0), np.zeros((0, 0)))
t = np.arange(0.0, 60.0, 0.5)


def bare(*channels, **more):
    return Recording("r", "vehicle", channels, kind="vehicle", **more)


def command(value=10.0, thruster=None, axis=None):
    return Channel("u", "command", "command_voltage", "V", np.zeros(1), np.array([value]), thruster=thruster, axis=axis)


def test_interactions_follow_direction_and_partner():
    vehicle = installation(EXACT)
    volts = {f"T{i}": np.array([10.0, -10.0, 10.0]) for i in range(1, 9)}
    volts["T3"] = volts["T4"] = np.array([0.0, 0.0, 10.0])
    force = force_on(vehicle, "surge", volts)
    theta = np.array([[0.5, 0.8]])
    newtons = (force.weights(("eta_hull", "eta_pair"), theta) @ force.signal)[0] / (40.0 * np.sqrt(0.5))
    assert newtons.tolist() == pytest.approx([2.0, -2 * 0.5, 2 * 0.8 + 2 * 0.8 * 0.5])
    assert force.nominal()[2] == pytest.approx(4 * 40.0 * np.sqrt(0.5))


def test_directions_and_levels_are_parameters():
    two = Thruster("A", np.array([0.4, 0.3]), {"surge": 1.0})
    table = Thruster("B", np.array([-2.0, 0.0, 4.0]), {"surge": 0.5}, np.array([-1.0, 0.0, 1.0]))
    vehicle = Installation((two, table), np.diag([1e-4, 0.0, 0.0, 0.0, 0.0]))
    force = force_on(vehicle, "surge", {"A": np.array([10.0, -10.0]), "B": np.array([0.5, -1.0])})
    assert force.nominal().tolist() == pytest.approx([41.0, -31.0])
    assert vehicle.names[:2] == ("C+[A]", "C-[A]")
    assert vehicle.known(force.parameters).names == ("C+[A]",)
    assert vehicle.etas == ()


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda: Thruster("A", np.array([1.0]), {"pitch": 1.0}), "pitch"),
        (lambda: Thruster("A", np.zeros(3), {}), "3 coefficients"),
        (lambda: Thruster("A", np.zeros(2), {}, np.array([1.0, 0.0])), "ascend"),
        (lambda: Installation((Thruster("A", np.array([1.0]), {}),), np.zeros((2, 2))), "covariance"),
        (
            lambda: Installation(
                (Thruster("A", np.array([1.0]), {}),), np.zeros((1, 1)), (Interaction("eta", ("A", "X")),)
            ),
            "no thruster 'X'",
        ),
        (lambda: Gaussian(("a", "a"), np.zeros(2), np.eye(2)), "each once"),
        (lambda: maximise(("a",), np.zeros(2), np.ones(2), lambda x: x), "as many starts"),
        (
            lambda: maximise(("a",), np.ones(1), np.ones(1), lambda x: x, Gaussian(("b",), np.ones(1), np.eye(1))),
            "no parameter of the model",
        ),
        (
            lambda: maximise(
                ("a",), np.ones(1), np.ones(1), lambda x: x, Gaussian(("a",), np.ones(1), np.zeros((1, 1)))
            ),
            "above zero",
        ),
    ],
)
def test_what_does_not_fit_is_refused(make, what):
    with pytest.raises(ValueError, match=what):
        make()


def test_a_partner_that_is_not_stated_means_no_interaction():
    found = Interaction("eta", ("A", "B"), 0, {"A": "B"})
    volts = {"A": np.ones(1), "B": np.ones(1), "C": np.ones(1)}
    assert [bool(found.active(name, volts)[0]) for name in "ABC"] == [True, False, False]


def test_calibrations_of_one_cell_share_its_gain():
    fits = [
        fit_thrust([staircase(thruster=name, calibration={"gain_std": 0.01}, rng=np.random.default_rng(i))])
        for i, name in enumerate(("T1", "T2"))
    ]
    known = calibrated(fits)
    assert known.names == ("C[T1]", "C[T2]")
    assert known.cov[0, 1] == pytest.approx(0.01**2 * known.mean[0] * known.mean[1])
    both = calibrated([fit_thrust([staircase(calibration={"gain_std": 0.01})], "C+/C-")])
    assert both.names == ("C+[T3]", "C-[T3]")


def test_sentences_of_efficiency():
    assert "not determined" in efficiency_sentence("eta", 0.5, float("nan"))
    assert "not told apart from 1" in efficiency_sentence("eta", 0.99, 0.02)
    assert "more thrust than" in efficiency_sentence("eta", 1.2, 0.02)
    assert unit_of("thrust[A@1]", "surge") == "N"
    assert unit_of("C[T1]", "yaw") == "N/V^2"


def test_prior_and_measurement_are_weighed_by_their_covariances():
    known = independent(Gaussian(("a",), np.array([2.0]), np.array([[0.25]])), NONE)
    found = maximise(("a",), np.array([1.0]), np.array([1.0]), lambda x: (3.0 - x) / 0.5, known)
    assert found.estimate["a"] == pytest.approx(2.5)
    assert found.estimate.std_of("a") == pytest.approx(0.5 / np.sqrt(2))
    assert found.chi2 == pytest.approx(2.0)
    assert found.dof == 1
    assert found.converged
    assert found.with_noise(np.array([[4.0]]))[0, 0] == pytest.approx(0.25**2 * 4 + 0.25**2)


def test_unseen_combinations_and_close_correlations_are_named():
    x = np.linspace(1, 2, 20)
    unseen = maximise(("k", "eta_a"), np.array([2.0, 1.0]), np.ones(2), lambda p: 3 * x - (p[:, :1] / p[:, 1:]) * x)
    said = entanglement("surge", unseen, ("k", "eta_a"))
    assert "cannot tell the combination" in said[0]
    assert said[1].startswith("surge: drag and eta_a only scale together; determined are k/eta_a = 3")
    close = maximise(
        ("k", "k2"), np.zeros(2), np.ones(2), lambda p: 3 * x - p[:, :1] * x - p[:, 1:] * (x + 0.01 * x**2)
    )
    assert "hardly told apart" in entanglement("surge", close, ("k", "k2"))[0]
    alone = maximise(("k", "x"), np.ones(2), np.ones(2), lambda p: x - p[:, :1] * x)
    assert len(entanglement("surge", alone, ("k", "x"))) == 1


def test_simulation_against_the_closed_form_of_quadratic_drag():
    """m v' = F - k2 v^2 from rest: v = sqrt(F/k2) tanh(t sqrt(F k2)/m)."""
    one = np.ones(2)
    push = np.vstack([np.full(300, 100.0), np.full(300, -100.0)])
    xi, x = integrate(push, 0.1, 0 * one, 0 * one, 400 * one, 800 * one, np.array([0.0, 0.2]))
    v = 0.5 * np.tanh(np.arange(301) * 0.1 * np.sqrt(100 * 400) / 800)
    assert np.abs(xi[0] - v).max() < 1e-6
    assert np.abs(xi[1] + v).max() < 1e-6
    assert x[0, -1] + x[1, -1] == pytest.approx(0.2 * 30)
    single, _ = integrate(np.ones((1, 1)), 0.1, np.zeros(1), np.zeros(1), np.zeros(1), np.ones(1), np.zeros(1))
    assert single[0, -1] == pytest.approx(0.1)
    away, _ = integrate(np.ones((1, 400)), 0.5, np.ones(1), np.zeros(1), -np.ones(1), np.ones(1), np.zeros(1))
    assert np.all(np.isfinite(away))
    assert np.isnan(fit_percent(np.ones(3), np.ones(3)))


def test_recordings_with_something_missing():
    vehicle = installation(EXACT)
    place = Channel("x", "fix", "position", "m", t, 0.2 * t, axis="surge")
    assert "command_voltage" in trial(bare(place), vehicle, "surge").reason
    assert "no position" in trial(bare(command(thruster="T1")), vehicle, "surge").reason
    few = Channel("x", "fix", "position", "m", t[:5], t[:5], axis="surge")
    assert "5 measurements" in trial(bare(few, command(thruster="T1")), vehicle, "surge").reason
    assert dominant_axis(bare(place), vehicle) is None
    assert dominant_axis(bare(place, command(thruster="elsewhere")), vehicle) is None
    assert dominant_axis(bare(place, command(0.0, thruster="T1")), vehicle) is None
    assert steady_runs([bare(place)], vehicle, "surge") == ()
    assert steady_runs([bare(command(thruster="T1"))], vehicle, "surge") == ()
    rate = Channel("r", "gyro", "speed", "rad/s", t, t, axis="yaw")
    assert response_of(bare(rate), "yaw") is rate
    one = trial(bare(place, command(axis="surge")), vehicle, "surge")
    assert one.force.nominal()[0] == pytest.approx(4 * 40 * np.sqrt(0.5))
    assert np.isnan(one.heading)


def test_a_depth_without_an_axis_and_holds_without_a_table():
    rng = np.random.default_rng(1)
    vehicle = installation(EXACT)
    (recording,) = recordings_of(romeo(), [there_and_back("f", "surge", FRONT, (10.0, 15.0, 20.0))], rng)
    found = steady_runs([replace(recording, steps=())], vehicle, "surge")
    assert len(found) == 6
    force = 2 * 40 * np.sqrt(0.5) * np.array([1.0, -0.7])
    expected = steady_velocity(force, np.array([60.0]), np.array([420.0]))
    assert [run.velocity for run in found[:2]] == pytest.approx(expected, rel=0.02)
    depth = Channel("d", "meter", "depth", "m", t, t)
    assert response_of(bare(depth), "heave") is depth


def test_the_end_of_an_approach_is_seen_in_all_runs_together():
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 30.0, 0.1)
    v = np.array([0.1, 0.2, 0.3, 0.4] * 6)
    forces = 100 * v
    lines = [straight_line(t, x * t + 0.01 * np.exp(-t / 9) + 0.005 * rng.standard_normal(t.size)) for x in v]
    found = approaches(lines, forces)
    assert 4 < found.max() < 15
    got = velocities(lines, forces, [None] * v.size)
    z = (np.array([g for g, _ in got]) - v) / np.array([s for _, s in got])
    assert np.abs(z.mean()) < 3 / np.sqrt(v.size)
    plain = np.array([line.slope for line in lines]) - v
    assert np.abs(plain.mean()) > 3 * plain.std() / np.sqrt(v.size)
    still = [straight_line(t, x * t + 0.005 * rng.standard_normal(t.size)) for x in v]
    assert not approaches(still, forces).any()
    assert not approaches(still[:2], forces[:2]).any()
    assert not approaches(still, 0 * forces).any()
    assert velocities([], np.zeros(0), []) == ()


def test_one_run_and_runs_without_noise():
    line = straight_line(t, 0.3 * t + 0.01 * np.random.default_rng(0).standard_normal(t.size))
    ((v, std),) = velocities([line], np.ones(1), [None])
    assert v == pytest.approx(0.3, abs=5 * std)
    exact = straight_line(t, 0.3 * t)
    ((v, std),) = velocities([exact], np.ones(1), [0.07])
    assert v == pytest.approx(0.3)
    assert std >= 0


def test_comparators_refuse_nothing_to_work_on():
    assert isinstance(by_kalman([], NONE), Unusable)
    assert isinstance(by_annealing([], NONE, {"m": (1.0, 2.0)}, np.random.default_rng(0)), Unusable)
    assert isinstance(by_derivative([], NONE), Unusable)


def test_a_trial_that_stands_still_gives_no_inertia_by_derivative():
    vehicle = installation(EXACT)
    (recording,) = recordings_of(romeo(), [sine("surge", FRONT, 20.0)], np.random.default_rng(0))
    one = trial(recording, vehicle, "surge", step=0.5)
    assert isinstance(one, Trial)
    idle = replace(one, force=replace(one.force, signal=0 * one.force.signal))
    q, _ = inverse_inertia(smoothed(idle), (), np.zeros(0), {})
    assert np.isnan(q)
    fast = replace(one, quantity="speed")
    assert output_error([fast], NONE, {"m": 800.0, "k": 50.0, "k2": 300.0}).estimate.names[0] == "m"
    assert isinstance(by_kalman([fast], Gaussian(("k",), np.ones(1), np.eye(1))).estimate["m"], float)


def test_annealing_of_drag_and_inertia_together():
    vehicle = installation(EXACT)
    (recording,) = recordings_of(romeo(), [sine("surge", FRONT, 20.0)], np.random.default_rng(0))
    one = trial(recording, vehicle, "surge", step=0.5)
    bounds = {"m": (200.0, 3000.0), "k2": (100.0, 2000.0)}
    known = Gaussian(("k",), np.array([60.0]), np.array([[1.0]]))
    for quantity, response in (("position", one.response), ("speed", np.gradient(one.response, one.time))):
        seen = replace(one, quantity=quantity, response=response)
        found = by_annealing([seen], known, bounds, np.random.default_rng(1), rounds=8)
        assert found.method == "simulated annealing"
        assert found.estimate["k2"] == pytest.approx(420.0, rel=0.2)
    assert "bounds" in by_annealing([one], known, {}, np.random.default_rng(0)).reason


def test_negative_drag_is_called_impossible():
    vehicle = installation(EXACT)
    (recording,) = recordings_of(romeo(), [sine("surge", FRONT, 20.0)], np.random.default_rng(0))
    known = Gaussian(("k", "k2"), np.array([-60.0, 900.0]), np.diag([0.01, 0.01]))
    fit = output_error([trial(recording, vehicle, "surge", step=0.5)], known)
    assert any("k is negative" in s for s in fit.statements)


def test_wrong_drag_leaves_a_residual_that_is_not_white():
    vehicle = installation(EXACT)
    (recording,) = recordings_of(romeo(), [sine("surge", FRONT, 20.0)], np.random.default_rng(0))
    wrong = Gaussian(("k", "k2"), np.array([900.0, 420.0]), np.diag([1e-8, 1e-8]))
    assert any("not white" in s for s in output_error([trial(recording, vehicle, "surge", step=0.5)], wrong).statements)


def test_excess_is_left_out_when_no_scatter_of_runs_explains_it():
    """Two runs and as many parameters: nothing to judge, nothing to add."""
    rng = np.random.default_rng(0)
    runs = recordings_of(romeo(), [there_and_back("f", "surge", FRONT, (10.0,))], rng)
    fit = identify_drag(runs, installation(EXACT), "surge", current=False)
    assert fit.excess_std == 0
