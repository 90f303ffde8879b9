"""The screen's operator: keys while a real calibration goes on over real bytes, in virtual time."""

import json

import pytest

from rig.calibrate.loads_file import load_plan
from rig.calibrate.operator import StoppedError
from rig.calibrate.wizard import Wizard
from rig.hdf5.load import load
from tests.rig.calibrate.weighing_bench import bench_of, files, weighed

RECORDING, RESULT = "load_cell-calibration-2026-11-26.h5", "load_cell-calibration-2026-11-26.json"


class Person(Wizard):
    """Presses a key whenever one is asked for; `hangs` other than asked in the steps that it names, the first time."""

    def __init__(self, plan, bench, keys=(), hangs=None):
        super().__init__("rig calibrate", plan)
        self.bench, self.keys, self.hangs = bench, list(keys), dict(hangs or {})
        self.seen = []

    def look(self, session):
        super().look(session)
        now = self.shown
        asked = now.asks or now.doubt
        if not asked or not self.answers.empty():
            return
        self.seen.append(now)
        if now.doubt:
            key = self.keys.pop(0)
        else:
            key = (
                next((k for at, k in self.keys if at == now.at + 1), "go")
                if self.keys and isinstance(self.keys[0], tuple)
                else "go"
            )
            self.keys = [k for k in self.keys if not (isinstance(k, tuple) and k == (now.at + 1, key))]
            if key == "go" or key.startswith("hung"):
                self.bench.world.state.hung = self.hangs.pop(now.at + 1, now.steps[now.at].force)
        self.answers.put(key)


def calibrated(tmp_path, keys=(), hangs=None):
    virtual = bench_of()
    _, plan = files(tmp_path)
    person = Person(load_plan(plan), virtual, keys, hangs)
    status, _ = weighed(tmp_path, virtual, person)
    return status, person


def test_enter_at_each_step_calibrates(tmp_path):
    status, person = calibrated(tmp_path)
    assert status == 0
    assert len(person.seen) == 17
    first, last = person.seen[0], person.seen[-1]
    assert (first.asks, first.steps[0].state, first.steps[1].state) == ("take all weights off", "now", "waiting")
    assert [step.state for step in last.steps[:16]] == ["read"] * 16
    assert all(abs(step.off) < 1.0 for step in last.steps[:16])
    assert any("gain" in line for line in person.result)
    person.ended(failed=False)
    assert person.shown.steps[16].state == "read"
    assert json.loads((tmp_path / RESULT).read_text())["gain"]["value"] == pytest.approx(1.0, abs=5e-3)


def test_what_the_reading_says_is_taken_for_what_hung(tmp_path):
    """10 kg hang in the step of 17: the screen says which, `o` believes it, and nothing is hung again."""
    status, person = calibrated(tmp_path, keys=["probable"], hangs={5: 98.04})
    assert status == 0
    doubted = next(now for now in person.seen if now.doubt)
    assert (doubted.probable, doubted.steps[4].state) == ("10kg", "doubted")
    assert person.shown.steps[4].load == "10kg"
    assert json.loads((tmp_path / RESULT).read_text())["gain"]["value"] == pytest.approx(1.0, abs=5e-3)
    texts = [event.text for event in load(tmp_path / RECORDING).events]
    assert any("it was 10kg, not 10kg + 5kg + 2kg (the operator)" in text for text in texts)


def test_a_step_that_is_kept_ends_without_a_calibration(tmp_path):
    status, person = calibrated(tmp_path, keys=["keep"], hangs={5: 98.04})
    assert status == 1
    assert person.shown.steps[4].state == "kept"
    assert any(line.startswith("WRONG") for line in person.result)
    assert not (tmp_path / RESULT).exists()


def test_other_weights_a_step_left_out_and_one_read_again(tmp_path):
    keys = [(4, "hung 5kg + 2kg"), (6, "back 2"), (7, "skip")]
    status, person = calibrated(tmp_path, keys=keys, hangs={4: 68.64})
    assert status == 0
    assert person.shown.steps[3].load == "5kg + 2kg"
    assert person.shown.steps[6].state == "left out"
    steps = [(step.index, step.phase) for step in load(tmp_path / RECORDING).steps]
    assert sorted(phase for index, phase in steps if index == 1) == ["free", "hold", "void"], (
        "what was read first is void"
    )
    assert 6 not in [index for index, _ in steps]


def test_the_end_key_ends_it_and_the_recording_says_so(tmp_path):
    with pytest.raises(StoppedError, match="stopped by the operator"):
        calibrated(tmp_path, keys=[(5, "stop")])
    assert load(tmp_path / RECORDING).outcome == "aborted"
    assert not (tmp_path / RESULT).exists()


def test_keys_of_before_answer_no_later_question(tmp_path):
    """Somebody leans on Enter while the cell is read: the next load is asked for all the same."""
    virtual = bench_of()
    _, plan = files(tmp_path)
    person = Person(load_plan(plan), virtual)
    look = person.look

    def leaning(session):
        if session.phase in ("settle", "read"):
            person.answers.put("go")
        look(session)

    person.look = leaning
    status, _ = weighed(tmp_path, virtual, person)
    assert (status, len(person.seen)) == (0, 17)
