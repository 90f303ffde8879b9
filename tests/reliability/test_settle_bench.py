"""`rig settle` over real bytes: a doubt is settled by a sweep on the bench; an aborted run ends with status 1."""

import json

import numpy as np
import pytest

from rig.cli import main
from rig.hdf5 import RecordingFile, load
from rig.link.recorder_messages import ChannelSpec, Rows, StreamSpec
from tests.reliability.live import at_rest, live_bench

C, HALF_WIDTH, NOISE = 0.412, 0.8, 0.5
"""N/V^2, V and N of the bench: with two levels, four shapes of the static curve are alike."""
CAMPAIGN = """
[campaign]
name = "two levels"
bench = "bench.toml"
thrusters = ["T1"]
output = "out"
unattended = true
expected_C = 0.4
prove_watchdog = false
[overrides]
"campaign.prove_watchdog" = "a test of the fit"
[tare]
duration = 1.0
max_std_error = {error}
max_drift = 2.0
attempts = 1
[plan]
kind = "levels"
voltages = [10.0, 20.0]
slew = 24.0
[plan.dwell]
kind = "fixed"
duration = 4.0
"""


def edit(text):
    """The bench with a dead band, a rotor without lag and a louder cell."""
    text = text.replace("T1 = { C = 0.4120 }", f'T1 = {{ C = {C}, rotor = "instant" }}')
    text = text.replace("white = 0.05  ", f"white = {NOISE}")
    return text.replace("[can]\n", f"[effects.dead_band]\nhalf_width = {HALF_WIDTH}\n[can]\n")


def recorded(path):
    """0, 10, 20 and 0 V, reached at once: no sample on the way tells the shape."""
    start, volts = np.array([0.0, 3.0, 7.0, 11.0]), np.array([0.0, 10.0, 20.0, 0.0])
    t = np.arange(0.0, 14.0, 1 / 92.0)
    acting = np.maximum(volts[np.searchsorted(start, t, side="right") - 1] - HALF_WIDTH, 0.0)
    thrust = C * acting**2 + 0.75 + NOISE * np.random.default_rng(3).standard_normal(t.size)
    specs = [("command", "command_voltage", "V"), ("load_cell", "thrust", "N")]
    streams = [StreamSpec(name, "test", (ChannelSpec(q, q, unit),)) for name, q, unit in specs]
    attributes = {"recording_id": "first", "thruster": "T1", "kind": "tunnel", "software": "test"}
    file = RecordingFile(path, attributes, streams, t0_ns=0)
    for k, (time, value) in enumerate([(start, volts), (t, thrust)]):
        file.add_rows(Rows(k, np.rint(time * 1e9).astype(np.int64), value[:, None]))
    file.close("completed", "", 14.0)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    with live_bench(tmp_path_factory.mktemp("settle"), edit) as bench:
        recorded(bench.folder / "first.h5")
        yield bench


def settle(bench, error, budget="10min"):
    campaign, out = bench.folder / "campaign.toml", bench.folder / "answer.json"
    campaign.write_text(CAMPAIGN.format(error=error))
    words = ["settle", bench.folder / "first.h5", "--campaign", campaign, "--budget", budget]
    status = main([str(word) for word in [*words, "--json", out]])
    return status, json.loads(out.read_text())


def seconds_of(path):
    return load(path).duration


def test_a_run_that_is_aborted_ends_it_with_the_propeller_at_rest(bench, capsys):
    status, said = settle(bench, error=1e-6)
    assert status == 1
    assert said["settling"]["reason"] == "aborted"
    assert said["verdict"] == "ambiguous"
    assert "tare" in capsys.readouterr().err
    assert at_rest(bench)
    assert not any(line.get("value") for line in bench.truth() if line["event"] == "command")


def test_the_doubt_is_settled_by_a_sweep_on_the_bench(bench, capsys):
    status, said = settle(bench, error=0.5)
    assert status == 0
    settling = said["settling"]
    assert settling["first"]["verdict"] == "ambiguous"
    assert settling["reason"] == "settled"
    assert [f["effect"] for f in said["findings"]] == ["dead_band"]
    assert abs(said["findings"][0]["parameters"]["half_width"]["value"] - HALF_WIDTH) < 0.1
    assert len(said["recordings"]) == 1 + len(settling["rounds"])
    swept = sum(seconds_of(path) for path in (bench.folder / "out").rglob("*.h5"))
    assert settling["spent"] > settling["on_bench"] > swept > 10.0
    text = capsys.readouterr().out
    assert text.startswith("first: ambiguous")
    assert "round 1: believed" in text
    assert at_rest(bench)
