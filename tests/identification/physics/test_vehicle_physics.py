"""Terms of a vehicle: neutral where absent, seen at every trial, slopes by differences, numbers by other methods."""

from __future__ import annotations

from dataclasses import replace
from math import exp, sqrt, tanh

import numpy as np
import pytest

from identification.mismatch.vehicle.model import VehicleModel, begin, layout_of, predict
from identification.mismatch.vehicle.motion import changes, left_over, linearised, moved, observed
from identification.mismatch.vehicle.runs import Prepared, prepare
from identification.mismatch.vehicle.setup import Stated, VehicleSetup
from identification.physics.vehicle.catalogue import CATALOGUE
from identification.physics.vehicle.term import Body, Scale, VehicleTerm
from identification.recording import Channel, Recording
from identification.vehicle.efficiency import Installation, Interaction, Thruster

SCALE = Scale("surge", 20.0, 300.0, 1.5, 40.0, 200.0, 0.1, 500.0, True, 0.4)
LARGE = replace(SCALE, axis="heave", volts=48.0, force=3.0, speed=0.2, ballasts=("a", "b"))
AXES = {"buoyancy_offset": "heave"}


def demo(axis: str = "surge", turned: float = 1.0) -> Prepared:
    """Two runs of a vehicle of two thrusters: levels of both signs, two headings."""
    runs = []
    for j, heading in enumerate((0.0, turned)):
        t = np.arange(0.0, 120.0, 0.2)
        level = np.array([2.0, 10.0, -6.0, 14.0, 0.0, -12.0])[np.minimum((t / 20).astype(int), 5)]
        channels = [
            Channel(name, "command", "command_voltage", "V", t, share * level, thruster=name, axis=axis)
            for name, share in (("A", 1.0), ("B", 0.5))
        ]
        channels.append(Channel("speed", "log", "speed", "m/s", t, 0.7 * np.sin(t / 9), axis=axis))
        channels.append(Channel("psi", "gyro", "heading", "rad", t, heading + 0 * t))
        runs.append(Recording(f"run-{j}", "boat", tuple(channels), kind="vehicle"))
    interactions = (Interaction("eta_hull", ("A",), -1), Interaction("eta_pair", ("A", "B"), 0, {"A": "B", "B": "A"}))
    lay_out = Installation(
        (Thruster("A", np.array([0.4]), {axis: 1.0}), Thruster("B", np.array([0.3]), {axis: 0.7})),
        np.zeros((2, 2)),
        interactions,
    )
    found = prepare(runs, lay_out, axis, VehicleSetup(mass={"": Stated(100.0)}))
    assert isinstance(found, Prepared)
    return found


def responses(term: VehicleTerm, values: tuple[float, ...], data: Prepared) -> np.ndarray:
    layout = layout_of(VehicleModel((term,)), data)
    theta = begin(layout, data)
    theta[0], theta[layout.of(term)], theta[layout.starts :] = 40.0, values, 0.0
    return np.concatenate([predict(layout, theta, data, j, None, slopes=False).response for j in range(len(data.runs))])


@pytest.mark.parametrize("term", CATALOGUE, ids=lambda t: f"{t.id}-{t.form}")
def test_a_term_is_absent_at_its_neutral_value_and_seen_at_every_trial(term: VehicleTerm) -> None:
    data = demo(AXES.get(term.id, "surge"), 0.0 if term.form == "along" else 1.0)
    assert not term.needs(data.scale)
    parameters = term.parameters(data.scale)
    plain = responses(term, tuple(p.neutral or 0.0 for p in parameters), data)
    bare = replace(CATALOGUE[0])
    assert plain == pytest.approx(responses(bare, (0.0,), data), abs=1e-9)
    for values in term.trials(data.scale):
        assert all(p.low <= v <= p.high for p, v in zip(parameters, values, strict=True))
        below_every_level = term.form == "jump" and values[0] < 1.5
        assert below_every_level or np.abs(responses(term, values, data) - plain).max() > 1e-6


@pytest.mark.parametrize("term", CATALOGUE, ids=lambda t: f"{t.id}-{t.form}")
def test_a_term_speaks_in_sentences_and_bounds_have_no_bench_in_them(term: VehicleTerm) -> None:
    for scale in (SCALE, LARGE):
        parameters = term.parameters(scale)
        assert all(p.low < p.high and p.neutral is not None for p in parameters)
        assert all(p.low <= p.neutral <= p.high for p in parameters)
        told = term.statement(tuple(0.3 * p.high + 0.7 * p.low for p in parameters), scale)
        assert told.endswith(".")
        assert ":" in told
    assert term.physics
    assert term.covariates


@pytest.mark.parametrize("term", CATALOGUE, ids=lambda t: f"{t.id}-{t.form}")
def test_slopes_are_those_of_differences(term: VehicleTerm) -> None:
    data = demo(AXES.get(term.id, "surge"), 0.0 if term.form == "along" else 1.0)
    layout = layout_of(VehicleModel((term,)), data)
    theta = begin(layout, data)
    values = term.trials(data.scale)[-1]
    theta[0] = 40.0
    theta[layout.of(term)] = values
    found = predict(layout, theta, data, 1, None, slopes=True)
    for i in range(layout.size):
        d = np.zeros(layout.size)
        d[i] = 1e-4 * max(abs(theta[i]), 1e-2)
        up, down = (predict(layout, theta + s * d, data, 1, None, slopes=False).response for s in (1, -1))
        slope = (up - down) / (2 * d[i])
        assert np.abs(found.slopes[:, i] - slope).max() <= 2e-3 * np.abs(slope).max() + 1e-6


def test_the_midpoint_rule_follows_the_exact_start_from_rest() -> None:
    """m v' = F - k2 v^2: v = sqrt(F/k2) tanh(t sqrt(F k2)/m)."""
    body, h = Body(100.0, quadratic=40.0), 0.1
    motion = moved(body, np.full(100, 40.0), h, 0.0, 0.0, 0.0, None)
    exact = [tanh(t * sqrt(1600) / 100) for t in h * np.arange(101)]
    assert motion.v == pytest.approx(exact, abs=1e-4)


def test_linear_drag_and_a_line_that_pulls_are_a_damped_spring() -> None:
    """m x'' + k x' + s x = F settles at F/s; its equation of motion is met at every step."""
    body, push = Body(10.0, linear=8.0, line_pull=2.0), np.full(2000, 6.0)
    motion = moved(body, push, 0.05, 0.0, 0.0, 0.0, None)
    assert motion.x[-1] == pytest.approx(3.0, abs=1e-3)
    assert np.abs(left_over(body, push, motion, 0.05, 0.0)).max() < 1e-6
    slopes = linearised(body, motion, 0.05, 0.0)
    v, x = changes(slopes, np.ones((2000, 1)))
    assert x[-1, 0] == pytest.approx(0.5, abs=1e-3)
    assert v[0, 1] == 1.0
    assert x[0, 2] == 1.0


def test_a_drag_that_grows_with_the_line() -> None:
    body = Body(1.0, quadratic=1.0, line_drag=1.0)
    motion = moved(body, np.full(4000, 1.0), 0.05, 0.0, 0.0, 0.0, None)
    far = motion.x[-1]
    assert motion.v[-1] == pytest.approx(1 / sqrt(1 + far), rel=0.02)


def test_motor_lag_is_the_mean_of_the_exact_answer_to_a_step() -> None:
    data = demo()
    moment = data.runs[0].moment
    term = next(t for t in CATALOGUE if t.id == "motor_lag")
    volts = np.zeros((1, 4, 2))
    volts[:, 1:] = 1.0
    found = term.on_volts(volts, moment, (0.5,)).ravel()
    dt = moment.step / 2
    exact = [1 + 0.5 / dt * (exp(-(i + 1) * dt / 0.5) - exp(-i * dt / 0.5)) for i in range(6)]
    assert found[2:] == pytest.approx(exact)


def test_positions_are_read_off_a_cubic() -> None:
    data = demo()
    run = replace(data.runs[0], quantity="position", time=np.array([0.05, 0.31]))
    grid = run.moment.step * np.arange(run.steps + 1)
    assert observed(run, 2 * grid, grid**2) == pytest.approx(run.time**2)


@pytest.mark.parametrize(
    ("term", "scale", "says"),
    [
        ("installation_efficiency", replace(SCALE, mass=None), "without the mass"),
        ("installation_efficiency", replace(SCALE, thrust_known=False), "without the thrusters' models"),
        ("added_mass", replace(SCALE, mass=None), "without a stated mass"),
        ("buoyancy_offset", SCALE, "does not act in surge"),
        ("tether_drag", replace(SCALE, axis="yaw"), "not pulled in yaw"),
        ("current", replace(SCALE, axis="heave"), "not felt in heave"),
        ("current", replace(SCALE, heading_spread=float("nan")), "one heading"),
    ],
)
def test_what_cannot_be_told_is_said(term: str, scale: Scale, says: str) -> None:
    assert says in next(t for t in CATALOGUE if t.id == term).needs(scale)
