"""`diagnose_vehicle`: concealed effects named, clean vehicles adequate, what cannot be used refused in a sentence."""

from __future__ import annotations

import json
from dataclasses import replace
from math import isfinite

import numpy as np
import pytest

from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.preparing import Refusal
from identification.mismatch.vehicle.diagnose import diagnose_vehicle
from identification.mismatch.vehicle.setup import Stated, VehicleSetup, straight_ahead
from identification.recording import Channel, Recording
from identification.vehicle.efficiency import Installation, Thruster
from rig.diagnose.text import diagnosis_text
from sim_devices.vehicle import Trial
from tests.concealed.vehicles import DIVE, Case, case, levels_of, recordings, setup, surge_trials


def made(name: str, trials: list[Trial], seed: int = 5) -> tuple[Case, list[Recording], VehicleSetup]:
    rng = np.random.default_rng(seed)
    one = case(rng, name)
    return one, recordings(one, rng, trials), setup(one, rng)


def diagnosed(runs: list[Recording], known: VehicleSetup, holdout: list[Recording] | None = None) -> Diagnosis:
    found = diagnose_vehicle(runs, holdout or [], setup=known)
    assert isinstance(found, Diagnosis), found
    return found


def test_an_efficiency_is_named_and_predicts_a_run_that_was_not_fitted() -> None:
    _, runs, known = made("installation_efficiency", surge_trials()[:3])
    found = diagnosed(runs[:2], known, runs[2:])
    assert found.verdict == "explained"
    assert [(f.effect, f.form) for f in found.findings] == [("installation_efficiency", "propeller_hull")]
    eta = found.findings[0].parameters["eta_hull"]
    assert abs(eta.value - 0.75) < 3 * eta.std < 0.03
    assert found.heldout.after < 0.2 * found.heldout.before
    assert found.heldout.after < 1.2 * found.heldout.noise
    assert "all" in found.heldout.what
    assert found.mismatch[0].channel == "position"
    assert any("no mass is stated" in note for note in found.notes)


def test_buoyancy_is_named_in_a_single_dive_that_blocks_judge() -> None:
    one, runs, known = made("buoyancy_offset", [levels_of("dive", "heave", DIVE)])
    found = diagnosed(runs, known)
    assert found.verdict == "explained"
    (finding,) = found.findings
    force = finding.parameters["force"]
    assert abs(force.value - one.hull.buoyancy) < 4 * force.std
    assert found.response == "depth"
    assert "every fourth block of time" in found.heldout.what
    document = json.loads(json.dumps(diagnosis_json(found), allow_nan=False))
    assert document["response"] == {"quantity": "depth", "unit": "m", "force_unit": "N"}
    assert "RMSE per sample / m " in diagnosis_text(found)


def test_a_clean_vehicle_is_adequate() -> None:
    _, runs, known = made("", surge_trials()[:2])
    found = diagnosed(runs, known)
    assert found.verdict == "adequate"
    assert found.findings == found.mismatch == ()
    assert found.heldout.after == pytest.approx(found.heldout.before)
    assert found.whiteness_p > 1e-3


def test_added_mass_and_an_efficiency_of_all_thrusters_are_rivals() -> None:
    _, runs, known = made("added_mass", surge_trials()[2:])
    found = diagnosed(runs, known)
    assert found.verdict == "ambiguous"
    named = {f.effect for f in found.findings} | {r.effect for f in found.findings for r in f.rivals}
    assert {"added_mass", "installation_efficiency"} <= named
    assert found.next_experiment is not None
    assert "moor the vehicle" in found.next_experiment.why
    assert isfinite(found.next_experiment.expected_power)
    assert any("given the other" in note for note in found.notes)


def boat(seed: int) -> Recording:
    """m = 100 kg, k2 = 40 N/(m/s)^2; 8 V ahead gives 20 N less than C V|V|, which no effect has."""
    rng, h = np.random.default_rng(seed), 0.02
    t = np.arange(0.0, 96.0, h)
    level = rng.permutation([3.0, 8.0, 12.0, -8.0, -12.0, 8.0, -3.0, 10.0])[(t / 12).astype(int)]
    v = np.zeros(t.size)
    for i in range(t.size - 1):
        push = 0.4 * level[i] * abs(level[i]) - (20.0 if level[i] == 8 else 0.0)
        v[i + 1] = v[i] + h * (push - 40 * abs(v[i]) * v[i]) / 100
    speed = v[::10] + 0.01 * rng.standard_normal(t[::10].size)
    channels = (
        Channel("command", "command", "command_voltage", "V", t[::10], level[::10], thruster="T1", axis="surge"),
        Channel("speed", "log", "speed", "m/s", t[::10], speed, axis="surge"),
    )
    return Recording(f"boat-{seed}", "boat", channels, kind="vehicle")


def test_what_is_in_no_catalogue_is_located_and_its_force_predicts_other_runs() -> None:
    installation = Installation((Thruster("T1", np.array([0.4]), {"surge": 1.0}),), np.zeros((1, 1)))
    known = VehicleSetup(installation, {"surge": Stated(100.0, 1.0)}, current=False)
    found = diagnosed([boat(seed) for seed in range(3)], known)
    assert found.verdict == "unexplained"
    assert found.unexplained is not None
    assert found.unexplained.where.quantity == "command_voltage"
    assert found.unexplained.where.low <= 8.0 <= found.unexplained.where.high
    at, force, _ = np.array(found.unexplained.shape).T
    assert force[np.argmin(np.abs(at - 8.0))] == min(force)
    assert found.model_terms == ("free_force",)
    assert found.findings == ()
    assert any("takes its place" in text for text in found.unexplained.resembles)
    assert "each run in turn" in found.heldout.what
    assert found.heldout.after < 0.5 * found.heldout.before


def test_without_thrusters_and_mass_everything_is_per_kg() -> None:
    t = np.arange(0.0, 100.0, 0.5)
    level = np.array([0.4, -0.8, 1.0, -0.5])[np.minimum((t / 25).astype(int), 3)]
    rng = np.random.default_rng(2)
    channels = (
        Channel("command", "command", "command_voltage", "V", t, level, axis="surge"),
        Channel("speed", "log", "speed", "m/s", t, np.sign(level) + 0.05 * rng.standard_normal(t.size), axis="surge"),
    )
    found = diagnose([Recording("one", "boat", channels, kind="vehicle")])
    assert isinstance(found, Diagnosis)
    assert found.baseline_model.startswith("v' =")
    assert found.baseline["C[thrusters]"].unit == "N/V^2 per kg"
    assert any("per kg of inertia" in note for note in found.notes)


def simple(**changed: object) -> Recording:
    t = np.arange(0.0, 60.0, 0.5)
    level = np.where(t < 30, 5.0, -5.0)
    channels = (
        Channel("command", "command", "command_voltage", "V", t, level, thruster="T1", axis="surge"),
        Channel("speed", "log", "speed", "m/s", t, np.sin(t), axis="surge"),
    )
    return replace(Recording("one", "boat", channels, kind="vehicle"), **changed)


def channel(index: int, value: np.ndarray, **changed: object) -> tuple[Channel, ...]:
    channels = list(simple().channels)
    channels[index] = replace(channels[index], value=value, **changed)
    return tuple(channels)


STILL = np.zeros(120)
REFUSED = {
    "no recording": ([], "no recording was given"),
    "twice": ([simple(), simple()], "given twice"),
    "two vehicles": ([simple(), simple(recording_id="two", thruster="raft")], "several vehicles (boat, raft)"),
    "a tunnel among them": ([simple(), simple(recording_id="two", kind="tunnel")], "is a tunnel recording"),
    "no motion": ([simple(channels=simple().channels[:1])], "no position, depth, heading or speed"),
    "still": ([simple(channels=channel(1, STILL))], "did not move"),
    "nan motion": ([simple(channels=channel(1, STILL + np.nan))], "0 finite samples"),
    "nan command": ([simple(channels=channel(0, np.append(STILL[1:] + 5, np.nan)))], "missing from 59.5 s on"),
    "no command": ([simple(channels=simple().channels[1:])], "do not tell along which axis"),
    "constant command": ([simple(channels=channel(0, STILL + 5))], "the command is constant"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_used_is_refused_in_a_sentence(name: str) -> None:
    runs, says = REFUSED[name]
    found = diagnose_vehicle(runs)
    assert isinstance(found, Refusal)
    assert says in found.reason
    assert "\n" not in found.reason


def test_several_axes_are_diagnosed_one_at_a_time() -> None:
    heave = [
        replace(c, axis="heave", quantity="depth" if c.quantity == "speed" else c.quantity) for c in simple().channels
    ]
    found = diagnose_vehicle([simple(), simple(recording_id="two", channels=tuple(heave))])
    assert isinstance(found, Refusal)
    assert "several axes (surge in 1; heave in 1)" in found.reason


def test_thrusters_push_where_their_commands_say() -> None:
    found = straight_ahead([simple()])
    assert not isinstance(found, Refusal)
    assert found.thrusters[0].arms == {"surge": 1.0}
