"""rig simulate: a saved model predicts commands and campaigns."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from rig.errors import TwinError
from rig.hdf5 import load
from rig.twin.reading import read_twin
from rig.twin.simulate import Asked, simulated, timed
from tests.rig.diagnose.diagnosed_files import ROOT, run, with_line


def test_a_replayed_command_is_predicted_and_adequate_against_the_twin(dead, folder):
    path, _, twin, _ = dead
    out = folder / "replayed.h5"
    result = run("simulate", path, "--twin", twin, "-o", out, "--noise", 7)
    assert result.exit_code == 0, result.output
    simulated, real = load(out), load(path)
    assert simulated.kind == "tunnel"
    assert "Simulated, not measured" in str(simulated.attributes["notes"])
    difference = real.first_of("thrust").value - np.interp(
        real.first_of("thrust").time, simulated.first_of("thrust").time, simulated.first_of("thrust").value
    )
    assert np.median(np.abs(difference)) < 0.5
    again = run("simulate", path, "--twin", twin, "-o", out)
    assert again.exit_code == 2
    assert "never overwritten" in again.output
    assert json.loads(run("diagnose", out, "--twin", twin, "--json", "-").output)["verdict"] == "adequate"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        *((f"{command} --seed -1", "-1 is not in the range x>=0") for command in ("diagnose", "compare", "settle")),
        ("simulate --noise -1", "-1 is not in the range x>=0"),
        ("simulate --rate inf", "--rate must be a finite number"),
        ("simulate --rate nan", "--rate must be a finite number"),
        ("simulate --flow-speed nan", "--flow-speed must be a finite number"),
    ],
)
def test_a_number_that_cannot_be_used_is_refused(words, says, tmp_path):
    """Each was a traceback; a flow that is no number made thrust that is none."""
    command, *option = words.split()
    files = {"compare": ["a.h5", "b.h5"], "simulate": ["a.h5", "--twin", "t.json", "-o", "c.h5"]}.get(command, ["a.h5"])
    result = run(command, *files, *option)
    assert result.exit_code == 2
    assert says in result.output


def test_more_samples_than_a_recording_can_hold_are_refused():
    wanted = Asked(None, (), 0.0, 3600.0, "an hour")
    with pytest.raises(TwinError, match="an hour: more than 10,000,000 samples at 1e\\+12 samples/s"):
        simulated(SimpleNamespace(interval=0.05), wanted, 1e12, None)


def test_a_campaign_is_predicted_with_its_steps(dead, folder):
    out = folder / "campaign.h5"
    result = run("simulate", ROOT / "campaigns" / "staircase.toml", "--twin", dead[2], "-o", out)
    assert result.exit_code == 0, result.output
    found = load(out)
    holds = [s for s in found.steps if s.phase == "hold"]
    assert holds
    twin, thrust = read_twin(dead[2]), found.first_of("thrust")
    top = max(holds, key=lambda s: s.command_voltage)
    _, values = thrust.window(top.t_end - 1.0, top.t_end)
    assert values.mean() == pytest.approx(twin.C * top.command_voltage**2, rel=0.25)


def test_ramps_and_sines_of_a_plan_become_rows():
    from rig.campaign.plan import Step

    plan = [Step(0, "ramp", 2.0, 1.0, 1.0), Step(1, "sine", 0.0, 2.0, 2.0, amplitude=3.0, frequency=0.5)]
    rows, steps, end = timed(plan, 0.1)
    assert end == pytest.approx(3.0)
    assert [s.t_start for s in steps] == [0.0, 1.0]
    assert max(v for _, v in rows) == pytest.approx(3.0)


def test_a_prediction_has_the_line_and_says_what_is_known_of_its_phase(dead, tmp_path):
    path = with_line(tmp_path, dead)
    assert read_twin(path).lines[0].frequency == 7.3
    bare = run("simulate", dead[0], "--twin", dead[2], "-o", tmp_path / "bare.h5")
    told = run("simulate", dead[0], "--twin", path, "-o", tmp_path / "line.h5")
    assert bare.exit_code == told.exit_code == 0, told.output
    assert "A line of 0.3 N at 7.3 Hz is in it (phase of the first recording's clock)." in " ".join(told.output.split())
    with_, without = (load(tmp_path / name).first_of("thrust") for name in ("line.h5", "bare.h5"))
    wave = 0.3 * np.sin(2 * np.pi * 7.3 * with_.time + 1.0)
    assert with_.value - without.value == pytest.approx(wave, abs=1e-3)
    unknown = run("simulate", dead[0], "--twin", with_line(tmp_path, dead, phase=None), "-o", tmp_path / "slipped.h5")
    assert "its phase is not known: 0 here" in " ".join(unknown.output.split())


def test_a_line_that_is_no_line_is_one_sentence(dead, tmp_path):
    for line, words in (
        ({"kind": "both"}, "lines[0].kind must be fixed or rotation"),
        ({"kind": "rotation"}, "lines[0].ratio must be an object"),
        ({"turns": "laps"}, "lines[0].turns must be rev or V s"),
    ):
        with pytest.raises(TwinError) as error:
            read_twin(with_line(tmp_path, dead, **line))
        assert words in str(error.value)
