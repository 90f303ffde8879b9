"""Promise 22: killed at any moment and resumed, a campaign gives what one gives that was left alone.

Fifty kills of a campaign of 100 steps: benchmarks/controller/kill_and_resume.py.
"""

import json
from pathlib import Path

import pytest

from rig.hdf5 import load
from rig.recording.ledger import FILE_NAME, read
from tests.rig.operate.kill_and_resume import campaign
from tests.rig.operate.killed_campaign import PLAN

MEASURING = [step for step in PLAN if step.measures]


@pytest.fixture(scope="module")
def cut(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cut") / "campaign"
    return folder, campaign(folder, 8, 5, 14.0)


def test_every_step_is_measured_once(cut):
    _, came = cut
    assert came.ended == ("killed",) * 8 + ("completed",)
    wanted = {(name, step.index, "hold", step.voltage) for name in ("T1", "T2", "T3") for step in MEASURING}
    assert set(came.results) == wanted
    assert set(came.results.values()) == {1}
    assert came.attempts.count(1) == 3
    assert max(came.attempts) > 1


def test_its_parts_are_fitted_together(cut):
    _, came = cut
    for value, std in came.C.values():
        assert value == pytest.approx(0.4, abs=4 * std)


def test_each_part_says_where_it_goes_on(cut):
    folder, _ = cut
    facts = read(folder)
    kept = [fact for fact in facts if fact["fact"] == "kept"]
    assert kept
    runs = [fact for fact in facts if fact["fact"] == "run_start"]
    ids = {run["recording_id"]: Path(run["recording"]) for run in runs}
    went_on = [load(path) for path in ids.values() if "continues" in load(path).attributes]
    assert went_on
    for recording in (each for each in went_on if any(row.index >= 0 for row in each.steps)):
        before = load(ids[str(recording.attributes["continues"])])
        assert before.thruster == recording.thruster
        assert any("it goes on at step" in event.text for event in recording.events)
        assert min(row.index for row in recording.steps if row.index >= 0) >= max(
            row.index for row in before.steps if row.phase == "hold"
        )


def test_no_line_of_the_ledger_is_torn(cut):
    folder, _ = cut
    for line in (folder / FILE_NAME).read_text().splitlines():
        json.loads(line)
