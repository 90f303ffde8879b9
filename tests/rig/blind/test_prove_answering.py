"""The diagnosing processes of the blind proof: what they cannot see, and what comes of one that fails."""

import json
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from identification.mismatch.compare.simulation import Prediction
from rig.blind import answering
from rig.blind.answering import answered
from rig.blind.design import design
from rig.blind.store import Store
from rig.blind.workers import Child, Ended, Overdue
from tests.rig.blind_scores import CATALOGUE, WORLD, answer


def test_the_diagnosing_process_cannot_open_a_seal(tmp_path):
    for name in ("open", "sealed", "answers"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x.json").write_text("{}", encoding="utf-8")
    code = (
        "import sys; from pathlib import Path; from rig.blind.answering import Sealed, blindfold\n"
        "root = Path(sys.argv[1]); blindfold(root, root / 'open', root / 'answers')\n"
        "(root / 'open/x.json').read_text(); (root / 'answers/y.json').write_text('')\n"
        "list((root / 'open').iterdir())\n"
        "seen = []\n"
        "for act in ((root / 'sealed/x.json').read_text, lambda: list((root / 'sealed').iterdir()),\n"
        "            (root / 'open/../sealed/x.json').read_text, lambda: open(bytes(root / 'sealed/x.json')),\n"
        "            (root / 'answers/x.json').read_text, lambda: list((root / 'answers').iterdir()),\n"
        "            lambda: (root / 'open/z.json').write_text('')):\n"
        "    try: act()\n"
        "    except Sealed: seen.append(1)\n"
        "assert len(seen) == 7, seen\n"
        "assert not [m for m in sys.modules if m.startswith('sim_devices')]\n"
    )
    child = Child([sys.executable, "-c", code, str(tmp_path)], tmp_path / "log")
    with pytest.raises(Ended, match="exit status 0"):
        child.ask({}, 60.0)


def test_a_diagnosis_that_crashes_has_an_answer(tmp_path):
    said, arrays = answered(tmp_path)  # no recording at all
    assert said["error"] == "refused: no recording was given"
    assert arrays == {}


def test_predictions_of_an_earlier_answer_do_not_stay_beside_a_new_one(tmp_path, monkeypatch):
    (job,) = design(WORLD, CATALOGUE, 1, ["plain/heating/0"])
    store, line = Store(tmp_path), {"token": job.token, "tag": "whole", "without": [], "code": "abc"}
    arrays = {"model": np.ones(3), "baseline": np.zeros(3)}
    monkeypatch.setattr(answering, "answered", lambda *_: (answer("explained"), arrays))
    answering.work(store.opened, store.answers, line)
    assert store.predictions(job, job.orders[0])["model"].tolist() == [1.0, 1.0, 1.0]
    arrays.clear()
    answering.work(store.opened, store.answers, line)
    assert store.predictions(job, job.orders[0]) is None
    assert [path.name for path in (store.answers / job.token).iterdir()] == ["whole.json"]


def test_a_prediction_that_runs_away_is_none(tmp_path, monkeypatch):
    """It would make every quantile of the errors no number, and the JSON of the proof impossible."""
    columns = [{"stream": "drive", "name": "u", "quantity": "command_voltage", "unit": "V", "thruster": ""}]
    about = np.array(json.dumps({"recording_id": "a", "thruster": "T1", "columns": columns, "steps": []}))
    t = np.arange(3.0)
    np.savez(tmp_path / "drive.npz", about=about, time0=t, value0=t, at=t)
    found = SimpleNamespace(twin="a twin", baseline={"C": SimpleNamespace(value=0.4)})
    for thrust, predicted in (([0.0, 1.0, 2.0], ["model", "baseline"]), ([0.0, np.inf, 2.0], [])):
        monkeypatch.setattr(answering, "simulate", lambda *_, thrust=thrust: Prediction(t, np.array(thrust), None))
        why, arrays = answering.predictions(found, tmp_path / "drive.npz")
        assert list(arrays) == predicted
        assert (why is None) == bool(predicted)


def test_a_child_that_is_late_is_killed_and_started_again(tmp_path):
    code = "import sys\nfor line in sys.stdin:\n    print('ok' if 'x' in line else input(), flush=True)"
    child = Child([sys.executable, "-c", code], tmp_path / "log")
    child.ask({"x": 1}, 30.0)
    with pytest.raises(Overdue):
        child.ask({}, 0.2)
    child.ask({"x": 1}, 30.0)
    child.close()
