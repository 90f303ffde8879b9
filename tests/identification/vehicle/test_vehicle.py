"""Both steps on the simulated vehicle, and what each says when it cannot know."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from identification.estimation.maximum_likelihood import Gaussian
from identification.thruster.thrust_data import Unusable
from identification.vehicle.campaign import AxisTrials, CampaignFacts, identify_axis, identify_vehicle, sort_trials
from identification.vehicle.inertia import by_derivative, output_error
from identification.vehicle.replay import validate
from identification.vehicle.steady_drag import fit_runs, identify_drag, passed_on
from identification.vehicle.trials import Trial, steady_runs, trial
from sim_devices.vehicle import romeo, run_trials
from sim_devices.vehicle.campaign import (
    ALL,
    DIVE,
    FRONT,
    REAR,
    SIDEWAYS,
    heave_steady,
    scaled,
    sine,
    sines,
    surge_steady,
    there_and_back,
)  # fmt: skip
from sim_devices.vehicle.trials import Hold
from sim_devices.vehicle.trials import Trial as SimTrial
from tests.identification.vehicle.vehicle_world import (
    compared,
    distance,
    drawn,
    identify,
    installation,
    recording_of,
    recordings_of,
    truth_of,
)  # fmt: skip

EXACT = {f"T{i}": 0.4 for i in range(1, 9)}
LEVELS = (8.0, 14.0, 20.0)


@pytest.fixture(scope="module")
def ten():
    rng = np.random.default_rng(31)
    return [identify(*drawn(rng, number), rng, axes=("surge",)) for number in range(10)]


@pytest.mark.timeout(400)
def test_ten_blind_vehicles_are_within_what_is_stated(ten):
    total, dof, zs = 0.0, 0, []
    for found in ten:
        own = found.own("surge")
        truth = truth_of(found.hull, "surge", own.names)
        total += distance(own, truth)
        dof += len(own.names)
        zs.append((own.mean - truth) / np.sqrt(np.diag(own.cov)))
    assert dof == 50
    assert 0.005 < chi2.sf(total, dof) < 0.995
    for column in np.array(zs).T:  # of one parameter, ten independent vehicles
        assert kstest(column, "norm").pvalue > 0.005
        assert 0.005 < chi2.sf(float(column @ column), 10) < 0.995


def test_currents_of_blind_vehicles(ten):
    total, dof = 0.0, 0
    for found in ten:
        flow = found.drag["surge"].estimate.select(("current_north", "current_east"))
        total += distance(flow, truth_of(found.hull, "surge", flow.names))
        dof += 2
    assert 0.005 < chi2.sf(total, dof) < 0.995


def test_identified_vehicle_simulates_a_trial_it_has_not_seen(ten):
    found = ten[1]
    rng = np.random.default_rng(7)
    _, vehicle = drawn(np.random.default_rng(0), 0)
    one = trial(recordings_of(found.hull, [sine("surge", REAR, 16.0)], rng)[0], vehicle, "surge")
    (seen,) = validate([one], found.inertia["surge"].estimate)
    assert seen.rmse < 0.085  # the fixes are 0.07 m off by themselves
    assert seen.fit > 99
    assert "off by" in seen.statement
    (rough,) = validate([one], found.inertia["surge"].estimate, fit_start=False)
    assert rough.rmse > seen.rmse


@pytest.mark.timeout(400)
def test_one_blind_vehicle_on_every_axis():
    rng = np.random.default_rng(12)
    found = identify(*drawn(rng, 1), rng)
    for axis in ("surge", "sway", "heave", "yaw"):
        own = found.own(axis)
        assert chi2.sf(distance(own, truth_of(found.hull, axis, own.names)), len(own.names)) > 0.0005
        assert found.inertia[axis].estimate.std_of("m") < 0.03 * found.inertia[axis].estimate["m"]
    weights = [name for name in found.drag["heave"].estimate.names if name.startswith("buoyancy")]
    assert len(weights) == 5
    assert "buoyancy[heave-3]" in found.inertia["heave"].estimate.names
    assert found.inertia["surge"].statements[0].startswith("surge: m = ")


def steady(hull, trials, seed=0):
    return recordings_of(hull, trials, np.random.default_rng(seed))


def test_drag_and_efficiency_are_not_told_apart_when_all_runs_use_the_same_thrusters():
    runs = steady(romeo(eta_hull=0.6, eta_pair=1.0), [there_and_back("all", "surge", ALL, LEVELS)])
    fit = identify_drag(runs, installation(EXACT), "surge", current=False)
    assert np.isnan(fit.estimate.std_of("k"))
    said = " ".join(fit.statements)
    assert "cannot tell the combination" in said
    assert "k/eta_pair = " in said
    assert "add runs whose thrusters are free of" in said
    assert "k is not determined" in said
    assert "eta_pair: not determined" in said


def test_one_group_alone_with_its_interaction_gives_the_ratio():
    vehicle = installation(EXACT)
    hull = romeo(eta_hull=0.6)
    ahead = [SimTrial("r", "surge", [Hold(scaled(REAR, v), 60.0, 40.0) for v in (8, 11, 14, 17, 20)])]
    fit = identify_drag(steady(hull, ahead), vehicle, "surge", current=False)
    (text,) = [s for s in fit.statements if "k/eta_hull" in s]
    ratio = float(text.split("k/eta_hull = ")[1].split(" ")[0])
    assert ratio == pytest.approx(60 / 0.6, rel=0.05)
    result = identify_axis(
        AxisTrials(tuple(steady(hull, ahead)), tuple(steady(hull, sines("surge")))), vehicle, "surge",
    )  # fmt: skip
    assert isinstance(result.inertia, Unusable)


def test_an_error_of_the_calibration_is_the_same_error_in_every_run():
    """Drag and inertia scale with C; their covariance must say so however many runs there are."""
    hull, gain = romeo(), 0.05
    fit = identify_drag(steady(hull, surge_steady()), installation(EXACT, own=0.0005, gain=gain), "surge")
    k, k2 = (fit.estimate.std_of(n) / fit.estimate[n] for n in ("k", "k2"))
    assert k == pytest.approx(gain, rel=0.1)
    assert k2 == pytest.approx(gain, rel=0.1)
    assert fit.estimate.std_of("eta_hull") < 0.002  # a ratio of forces: the gain cancels
    both = fit.estimate.select(("k", "k2")).cov
    assert both[0, 1] / np.sqrt(both[0, 0] * both[1, 1]) > 0.95


def test_current_seen_in_runs_both_ways_only_spoils_nothing():
    hull = romeo(current=(0.15, 0.0))
    line = [there_and_back("a", "surge", FRONT, LEVELS), there_and_back("b", "surge", FRONT, LEVELS, np.pi)]
    vehicle = installation(EXACT)
    fit = identify_drag(steady(hull, line), vehicle, "surge")
    assert fit.estimate["current_north"] == pytest.approx(0.15, abs=5 * fit.estimate.std_of("current_north"))
    assert fit.estimate.std_of("current_north") < 0.001
    assert fit.estimate.std_of("current_east") > 0.3  # never driven along it
    without = identify_drag(steady(hull, line), vehicle, "surge", current=False)
    assert without.underfit.underfitted
    assert without.excess_std > 0.05
    assert any("scatter between runs" in s for s in without.statements)


def test_scatter_between_runs_widens_what_is_stated():
    vehicle = installation(EXACT)
    smooth = identify_drag(steady(romeo(), surge_steady()), vehicle, "surge")
    rough = identify_drag(steady(romeo(wander=4.0), surge_steady()), vehicle, "surge")
    assert smooth.excess_std == 0
    assert rough.excess_std > 0
    assert rough.estimate.std_of("eta_hull") > 3 * smooth.estimate.std_of("eta_hull")
    assert abs(rough.estimate["eta_hull"] - 0.7) < 4 * rough.estimate.std_of("eta_hull")


def test_heave_with_five_weights_and_a_sixth_in_step_two():
    rng = np.random.default_rng(3)
    hull, vehicle = romeo(), installation(EXACT)
    moving = recordings_of(hull, [sine("heave", DIVE, v, f"new-{v:g}", ballast=12.0) for v in (12.0, -12.0)], rng)
    found = identify_vehicle(
        [*recordings_of(hull, heave_steady(), rng), *moving],
        vehicle,
        CampaignFacts(ballast={"new-12": "sixth", "new--12": "sixth"}),
    )
    estimate = found.axes["heave"].inertia.estimate
    assert estimate["buoyancy[sixth]"] == pytest.approx(12.0, abs=4 * estimate.std_of("buoyancy[sixth]"))
    assert estimate["m"] == pytest.approx(1100.0, abs=4 * estimate.std_of("m"))
    assert any("buoyancy[sixth]" in s for s in found.sentences())


def test_runs_still_gathering_way_are_cut_or_named():
    hull, vehicle = romeo(), installation(EXACT)
    early = [SimTrial("e", "surge", [Hold(scaled(FRONT, v), 40.0) for v in (10.0, -10.0, 20.0, -20.0)])]
    runs = steady_runs(steady(hull, early), vehicle, "surge")
    fit = fit_runs(runs, vehicle, "surge", current=False)
    assert fit.estimate["k2"] == pytest.approx(420.0, rel=0.05)
    short = [SimTrial("s", "surge", [Hold(scaled(FRONT, v), 5.0) for v in (10.0, -10.0, 20.0, -20.0)])]
    smooth = replace(hull, noise={"position": 1e-5, "depth": 1e-5, "heading": 1e-5})
    bent = fit_runs(steady_runs(steady(smooth, short), vehicle, "surge"), vehicle, "surge", current=False)
    assert any("had not reached a constant velocity" in s for s in bent.statements)


def test_refusals_are_sentences():
    vehicle = installation(EXACT)
    one = steady(romeo(), [there_and_back("f", "surge", FRONT, (10.0,))])
    assert "at least two" in identify_drag([], vehicle, "surge").reason
    assert isinstance(output_error([]), Unusable)
    alone = identify_axis(AxisTrials(tuple(one)), vehicle, "surge")
    assert "no sine-force trial was given" in alone.inertia.reason
    none = identify_axis(AxisTrials(), vehicle, "surge")
    assert "at least two" in none.drag.reason
    assert len(none.statements) == 2
    heave = identify_axis(
        AxisTrials(tuple(one), tuple(steady(romeo(), [sine("heave", DIVE, 10.0)]))), vehicle, "surge",
    )  # fmt: skip
    assert "no position, depth, heading or speed" in heave.inertia.reason


def test_sorting_by_what_was_commanded():
    rng = np.random.default_rng(0)
    trials = [
        there_and_back("a", "surge", ALL, (10.0,)), there_and_back("b", "sway", SIDEWAYS, (10.0,)),
        sine("heave", DIVE, 10.0),
    ]  # fmt: skip
    recordings = recordings_of(romeo(), trials, rng)
    idle = replace(recordings[0], recording_id="idle", channels=recordings[0].channels[-2:])
    found = sort_trials([*recordings, idle], installation(EXACT))
    assert {axis: (len(t.steady), len(t.moving)) for axis, t in found.axes.items()} == {
        "surge": (1, 0), "sway": (1, 0), "heave": (0, 1),
    }  # fmt: skip
    assert found.unused == ("idle",)
    fit = identify_vehicle([idle], installation(EXACT))
    assert list(fit.sentences()) == ["recording idle was not used: no thruster of the lay-out was commanded in it"]


@pytest.mark.timeout(300)
def test_every_way_to_the_inertia_agrees():
    found = list(compared(np.random.default_rng(4)))
    best = found[0][1]
    for name, fit, truth, _ in found:
        assert fit.method == name
        assert abs(fit.estimate["m"] - truth) < 3.5 * fit.estimate.std_of("m")
        assert fit.estimate.std_of("m") > 0.95 * best.estimate.std_of("m")
        assert max(v.rmse for v in fit.validation) < 0.08
        assert any("m = " in s for s in fit.statements)


def test_plain_derivative_needs_two_windows_and_a_force_that_pushes():
    vehicle = installation(EXACT)
    (recording,) = recordings_of(romeo(), [sine("surge", FRONT, 20.0)], np.random.default_rng(0))
    one = trial(recording, vehicle, "surge")
    known = Gaussian(("k", "k2"), np.array([60.0, 420.0]), np.diag([1.0, 25.0]))
    short = replace(one, time=one.time[:30], response=one.response[:30])
    assert "at least" in by_derivative([short], known).reason
    back = replace(one, response=-one.response)
    assert "does not follow the force" in by_derivative([back], known).reason


def test_speed_and_yaw_rate_trials_are_fitted_too():
    hull, vehicle = romeo(), installation(EXACT)
    rng = np.random.default_rng(2)
    (record,) = run_trials(hull, [sine("surge", FRONT, 20.0)], rng)
    recording = recording_of(record)
    time = record.truth["time"][::4]
    speed = record.truth["velocity"][::4] + 0.01 * rng.standard_normal(time.size)
    place = next(c for c in recording.channels if c.quantity == "position")
    measured = replace(place, name="speed", quantity="speed", unit="m/s", time=time, value=speed)
    seen = replace(recording, channels=(*[c for c in recording.channels if c is not place], measured))
    known = Gaussian(("k", "k2"), np.array([60.0, 420.0]), np.diag([0.3**2, 2.0**2]))
    one = trial(seen, vehicle, "surge")
    assert isinstance(one, Trial)
    assert one.quantity == "speed"
    for fit in (output_error([one], known), by_derivative([one], known)):
        assert fit.estimate["m"] == pytest.approx(800.0, abs=4 * fit.estimate.std_of("m") + 4)
    assert steady_runs([seen], vehicle, "surge") == ()


def test_what_surge_found_is_passed_on_without_its_drag():
    fit = identify_drag(steady(romeo(), surge_steady()), installation(EXACT), "surge")
    told = passed_on(fit)
    assert {"eta_hull", "eta_pair", "C[T1]", "current_north"} <= set(told.names)
    assert "k" not in told.names
