"""The simulated vehicle against closed forms, and what its records look like."""

from math import pi, sqrt

import numpy as np
import pytest

from sim_devices.vehicle import Body, Hull, Mounted, Trial, romeo, run_trials
from sim_devices.vehicle.campaign import ALL, BALLAST, FRONT, REAR, heave_steady, scaled, sine, surge_steady
from sim_devices.vehicle.trials import Hold, Sine

UNITS = {"command_voltage": "V", "position": "m", "depth": "m", "heading": "rad"}


def quiet(**more):
    return Hull(
        "one", {"surge": Body(800.0, 0.0, 400.0), "heave": Body(500.0, 100.0, 0.0)},
        {"T": Mounted(0.4, {"surge": 1.0, "heave": 1.0})},
        noise={"position": 0.0, "depth": 0.0, "heading": 0.0}, **more,
    )  # fmt: skip


def test_quadratic_drag_from_rest_is_a_hyperbolic_tangent():
    (record,) = run_trials(quiet(), [Trial("a", "surge", [Hold({"T": 15.0}, 30.0)])], np.random.default_rng(0))
    F = 0.4 * 15**2
    expected = sqrt(F / 400) * np.tanh(record.truth["time"] * sqrt(F * 400) / 800)
    assert np.abs(record.truth["velocity"] - expected).max() < 1e-5
    assert record.truth["position"][-1] == pytest.approx(2 * np.log(np.cosh(30 * sqrt(F * 400) / 800)), abs=1e-4)


def test_buoyancy_and_ballast_push_down():
    (record,) = run_trials(
        quiet(buoyancy=-10.0), [Trial("a", "heave", [Hold({}, 60.0)], ballast=30.0)], np.random.default_rng(0)
    )
    assert record.truth["velocity"][-1] == pytest.approx(0.2, abs=1e-4)


def test_current_carries_the_vehicle_and_turns_with_the_heading():
    hull = quiet(current=(0.3, 0.0))
    trials = [Trial(str(h), "surge", [Hold({}, 400.0)], h) for h in (0.0, pi / 2, pi)]
    ends = [r.truth["velocity"][-1] for r in run_trials(hull, trials, np.random.default_rng(0))]
    assert ends == pytest.approx([0.3, 0.0, -0.3], abs=0.01)


def test_installed_thrust():
    hull = romeo(eta_hull=0.5, eta_pair=0.8)
    one = 0.4 * 100 * sqrt(0.5)
    assert hull.force("surge", scaled(FRONT, 10.0)) == pytest.approx(2 * one)
    assert hull.force("surge", scaled(FRONT, -10.0)) == pytest.approx(-2 * one * 0.5)
    assert hull.force("surge", scaled(REAR, 10.0)) == pytest.approx(2 * one * 0.5)
    assert hull.force("surge", scaled(ALL, 10.0)) == pytest.approx(2 * one * 0.8 * 1.5)
    assert hull.force("yaw", {"T1": 10.0, "T2": -10.0}) == pytest.approx(40 * 0.6 * 1.5)
    assert hull.force("heave", {"T5": 10.0}) == pytest.approx(40.0)


def test_records_are_named_as_the_format_names_them():
    rng = np.random.default_rng(1)
    records = run_trials(romeo(wander=1.0), [surge_steady()[0], heave_steady()[0], sine("yaw", ALL, 10.0)], rng)
    for record in records:
        for channel in record.channels:
            assert channel.unit == UNITS[channel.quantity]
            assert channel.time.shape == channel.value.shape
            assert (channel.thruster is not None) == (channel.quantity == "command_voltage")
    position = next(c for c in records[0].channels if c.quantity == "position")
    depth = next(c for c in records[1].channels if c.quantity == "depth")
    assert 1 / np.diff(position.time).mean() == pytest.approx(3.0)
    assert 1 / np.diff(depth.time).mean() == pytest.approx(10.0)
    assert position.axis == "surge"
    assert [s.phase for s in records[0].steps[:2]] == ["ramp", "hold"]
    assert [s.phase for s in records[2].steps] == ["sine"]
    assert not [c for c in records[2].channels if c.quantity == "position"]
    assert len(heave_steady()) == len(BALLAST) == 5


def test_sine_is_of_the_force():
    part = Sine({"T": 10.0}, 0.5, 1.0, 20.0, 40.0)
    (record,) = run_trials(quiet(), [Trial("s", "surge", [part])], np.random.default_rng(0))
    command = record.channels[0]
    force = 0.4 * command.value * np.abs(command.value)
    assert force == pytest.approx(40 * (0.5 + np.sin(2 * pi * command.time / 20)))


def test_same_seed_same_record():
    first, again = (
        run_trials(romeo(), surge_steady()[:1], np.random.default_rng(5))[0].channels[-1].value for _ in range(2)
    )
    assert np.array_equal(first, again)


@pytest.mark.parametrize("body", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 0.0, 0.0)])
def test_bodies_that_cannot_be(body):
    with pytest.raises(ValueError, match="Body"):
        Body(*body)


def test_trials_that_cannot_be():
    with pytest.raises(ValueError, match="needs one of"):
        Trial("x", "roll", [Hold({}, 1.0)])
