"""What an operator marked as bad stays in the file, and nothing that reads a recording to fit it takes it."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from identification.steady_state.holds import from_steps
from rig.fit.one_pass import fit_one_pass
from rig.hdf5 import load

STEPS = [
    (0, b"tare", 0.0, 0.0, 2.0),
    (1, b"hold", 4.0, 2.0, 6.0),
    (2, b"hold", 8.0, 6.0, 10.0),
    (1, b"void", 4.0, 2.0, 6.0),
    (3, b"hold", -8.0, 10.0, 14.0),
]
KINDS = [("index", "<i4"), ("phase", "S8"), ("command_voltage", "<f8"), ("t_start", "<f8"), ("t_end", "<f8")]


@pytest.fixture
def marked(tmp_path):
    """C 0.4 N/V^2 at 100 samples/s; while the water was stirred, at 4 V, 3 N too much."""
    path = tmp_path / "marked.h5"
    t = np.arange(1400) / 100
    V = np.select([t < 2, t < 6, t < 10], [0.0, 4.0, 8.0], -8.0)
    stirred = (t >= 2) & (t < 6)
    F = 0.4 * V * np.abs(V) + 3.0 * stirred + 0.01 * np.random.default_rng(1).normal(size=t.size)
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": "thruster-rig-recording", "format_version": 1, "thruster": "T1"})
        file.attrs.update({"recording_id": "a", "kind": "tunnel"})
        for stream, name, quantity, unit, values in (
            ("cell", "F", "thrust", "N", F),
            ("command", "u", "command_voltage", "V", V),
        ):
            file[f"streams/{stream}/time"] = t
            file[f"streams/{stream}/{name}"] = values
            file[f"streams/{stream}/{name}"].attrs.update({"quantity": quantity, "unit": unit})
        file["steps"] = np.array(STEPS, dtype=KINDS)
    return path


def test_thrust_is_missing_there_and_the_step_is_no_hold(marked):
    recording = load(marked)
    thrust, command = recording.first_of("thrust"), recording.first_of("command_voltage")
    stirred = (thrust.time >= 2) & (thrust.time < 6)
    assert np.isnan(thrust.value[stirred]).all()
    assert np.isfinite(thrust.value[~stirred]).all()
    assert np.isfinite(command.value).all()
    assert [w.voltage for w in from_steps(recording)] == [0.0, 8.0, -8.0]
    assert [step.phase for step in recording.steps] == ["tare", "free", "hold", "void", "hold"]
    assert any("2.00 to 6.00 s was marked bad" in event.text for event in recording.events)


def test_the_file_has_every_sample(marked):
    load(marked)
    with h5py.File(marked) as file:
        assert np.isfinite(file["streams/cell/F"][()]).all()


def test_a_fit_in_one_pass_leaves_it_out_too(marked):
    (found,) = fit_one_pass([marked])
    assert found.parameters["C"].value == pytest.approx(0.4, abs=1e-3)


def test_a_fit_in_one_pass_of_a_run_without_holds_leaves_it_out_too(marked):
    with h5py.File(marked, "r+") as file:
        steps = file["steps"][()]
        steps["phase"] = [b"void" if phase == b"void" else b"sine" for phase in steps["phase"]]
        del file["steps"]
        file["steps"] = steps
    (found,) = fit_one_pass([marked])
    assert found.parameters["C"].value == pytest.approx(0.4, abs=1e-3)


def test_a_recording_without_marks_is_as_it_was(marked):
    with h5py.File(marked, "r+") as file:
        steps = file["steps"][()]
        del file["steps"]
        file["steps"] = steps[steps["phase"] != b"void"]
    recording = load(marked)
    assert np.isfinite(recording.first_of("thrust").value).all()
    assert not recording.events
