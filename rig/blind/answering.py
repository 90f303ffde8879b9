"""The process that diagnoses: `python -m rig.blind.answering OPEN ANSWERS`. It sees recordings, never a truth.

One JSON line in, {"token", "tag", "without", "code"}, one line out when the answer is there: ANSWERS/<token>/<tag>.json
and beside it <tag>.npz, what the model that was found and the baseline predict for the other run. Where the thruster
was recorded a second time the first recording is diagnosed, and the second against its twin, with the first at hand:
that is the answer, with the first beside it. From its start on it refuses to read any file of the store but recordings.
"""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.compare.simulation import Drive, Prediction, held, others_of, simulate
from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.preparing import Refusal
from identification.recording import Floats, Recording
from rig.blind.reading import AGAIN, recording, recordings, times

LOOKS = ("open", "os.listdir", "os.scandir")
"""Audit events with a path."""


class Sealed(PermissionError):
    """A file of the store was to be opened that is not for the eyes of the diagnosis."""


def blindfold(store: Path, opened: Path, answers: Path) -> None:
    """From now on this process reads of what lies in `store` the folder `opened` alone, and writes into `answers`.

    Answers are not read: names of files beside them say what was taken out of the catalogue. Cannot be taken off.
    """
    inside, readable, writable = (path.resolve() for path in (store, opened, answers))

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if event in LOOKS and isinstance(arguments[0], str | bytes):
            path = Path(os.fsdecode(arguments[0])).resolve()
            allowed = writable if event == "open" and arguments[2] & (os.O_WRONLY | os.O_RDWR) else readable
            if path.is_relative_to(inside) and not path.is_relative_to(allowed):
                raise Sealed(f"{path} is sealed: the diagnosis opens recordings only")

    sys.addaudithook(watch)


def answered(folder: Path, without: Sequence[str] = ()) -> tuple[dict[str, Any], dict[str, Floats]]:
    """The answer for the case in `folder`, with the seconds it took, and predictions of the other run.

    Whatever is raised becomes the answer's `error`: a crash is a failure of the diagnosis, not of the proof.
    """
    given, again = recordings(folder), recordings(folder / AGAIN)
    start = perf_counter()
    try:
        first = found = diagnose(given, without=tuple(without))
        if again and not isinstance(first, Refusal):
            found = diagnose(again, baseline=first.twin, without=tuple(without), before=given)
    except Exception as error:  # noqa: BLE001  # a crash of any kind is an answer, and counts against it
        told = f"{type(error).__name__}: {error}"
        return {"seconds": perf_counter() - start, "error": told, "trace": traceback.format_exc()}, {}
    seconds = perf_counter() - start
    if isinstance(found, Refusal):
        return {"seconds": seconds, "error": f"refused: {found.reason}"}, {}
    lacking, predicted = predictions(found, (folder / AGAIN if again else folder) / "drive.npz")
    answer = {"seconds": seconds, "error": None, "diagnosis": diagnosis_json(found), "not_predicted": lacking}
    if again and not isinstance(first, Refusal):
        answer["first"] = diagnosis_json(first)
    return answer, predicted


def predictions(found: Diagnosis, file: Path) -> tuple[str | None, dict[str, Floats]]:
    """Thrust (n,) N of the model found and of its baseline in the run of `file`, without a tare; or why there is none.

    Nothing at all where there is no such run.
    """
    if not file.exists():
        return None, {}
    try:
        return None, _predicted(found, recording(file), times(file))
    except Exception as error:  # noqa: BLE001  # so is one of the twin
        return f"{type(error).__name__}: {error}", {}


def _predicted(found: Diagnosis, driven: Recording, at: Floats) -> dict[str, Floats]:
    """Raises ValueError for what the twin cannot predict, or where its prediction runs away."""
    command = driven.first_of("command_voltage")
    assert command is not None
    assert found.twin is not None
    others = others_of(driven)
    others.setdefault("flow_speed", (np.array([0.0]), np.array([0.0])))
    drive = Drive(command.time, command.value, others=others)
    model = simulate(found.twin, drive, at)
    if not isinstance(model, Prediction):
        raise ValueError(model.reason)
    if not np.all(np.isfinite(model.thrust)):
        raise ValueError("the prediction is no finite thrust")
    volts = held(drive, at)
    baseline: Floats = found.baseline["C"].value * volts * np.abs(volts)
    return {"model": model.thrust, "baseline": baseline}


def work(opened: Path, answers: Path, line: Mapping[str, Any]) -> None:
    """Answer one order."""
    answer, arrays = answered(opened / line["token"], line["without"])
    out = answers / line["token"]
    out.mkdir(parents=True, exist_ok=True)
    _predict(out / f"{line['tag']}.npz", arrays)
    part = out / f"{line['tag']}.json.part"
    part.write_text(json.dumps({**answer, "code": line["code"]}, indent=1) + "\n", encoding="utf-8")
    part.replace(out / f"{line['tag']}.json")


def _predict(file: Path, arrays: Mapping[str, Floats]) -> None:
    """Whole or not at all; what another version of the diagnosis predicted does not stay beside this answer."""
    file.unlink(missing_ok=True)
    if arrays:
        model, baseline = (arrays[name].astype(np.float32) for name in ("model", "baseline"))
        part = file.with_suffix(".part.npz")
        np.savez_compressed(part, model=model, baseline=baseline)
        part.replace(file)


def main(arguments: Sequence[str]) -> None:
    """Until the input ends."""
    opened, answers = map(Path, arguments)
    blindfold(opened.parent, opened, answers)
    for text in iter(sys.stdin.readline, ""):
        work(opened, answers, json.loads(text))
        sys.stdout.write("answered\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
