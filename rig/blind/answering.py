"""The process that diagnoses: `python -m rig.blind.answering OPEN ANSWERS`. It sees recordings, never a truth.

One JSON line in, {"token", "tag", "without", "code"}, one line out when the answer is there: ANSWERS/<token>/<tag>.json
and beside it <tag>.npz, what the model that was found and the baseline predict for the other run. From its start on it
refuses to open any file of the store that is not a recording or an answer of its own.
"""

from __future__ import annotations

import json
import sys
import traceback
from collections.abc import Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from identification.mismatch.diagnose import diagnose
from identification.mismatch.diagnosis import Diagnosis, diagnosis_json
from identification.mismatch.preparing import Refusal
from identification.mismatch.simulating import Drive, Prediction, held, others_of, simulate
from identification.recording import Floats, Recording
from rig.blind.reading import recording, recordings, times


class Sealed(PermissionError):
    """A file of the store was to be opened that is not for the eyes of the diagnosis."""


def blindfold(store: Path, allowed: Sequence[Path]) -> None:
    """From now on this process cannot open what lies in `store` outside the `allowed` folders. Cannot be taken off."""
    inside, open_to = store.resolve(), [path.resolve() for path in allowed]

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if event in ("open", "os.listdir", "os.scandir") and isinstance(arguments[0], str):
            path = Path(arguments[0]).resolve()
            if path.is_relative_to(inside) and not any(path.is_relative_to(folder) for folder in open_to):
                raise Sealed(f"{path} is sealed: the diagnosis opens recordings only")

    sys.addaudithook(watch)


def answered(folder: Path, without: Sequence[str] = ()) -> tuple[dict[str, Any], dict[str, Floats]]:
    """The answer for the case in `folder`, with the seconds it took, and predictions of the other run.

    Whatever is raised becomes the answer's `error`: a crash is a failure of the diagnosis, not of the proof.
    """
    given = recordings(folder)
    start = perf_counter()
    try:
        found = diagnose(given, without=tuple(without))
    except Exception as error:  # noqa: BLE001  # a crash of any kind is an answer, and counts against it
        told = f"{type(error).__name__}: {error}"
        return {"seconds": perf_counter() - start, "error": told, "trace": traceback.format_exc()}, {}
    seconds = perf_counter() - start
    if isinstance(found, Refusal):
        return {"seconds": seconds, "error": f"refused: {found.reason}"}, {}
    drive = folder / "drive.npz"
    lacking, predicted = predictions(found, recording(drive), times(drive)) if drive.exists() else (None, {})
    answer = {"seconds": seconds, "error": None, "diagnosis": diagnosis_json(found), "not_predicted": lacking}
    return answer, predicted


def predictions(found: Diagnosis, driven: Recording, at: Floats) -> tuple[str | None, dict[str, Floats]]:
    """Thrust (n,) N of the model found and of its baseline in another run, without a tare; or why there is none."""
    command = driven.first_of("command_voltage")
    assert command is not None
    assert found.twin is not None
    others = others_of(driven)
    others.setdefault("flow_speed", (np.array([0.0]), np.array([0.0])))
    drive = Drive(command.time, command.value, others=others)
    try:
        model = simulate(found.twin, drive, at)
    except Exception as error:  # noqa: BLE001  # so is one of the twin
        return f"{type(error).__name__}: {error}", {}
    if not isinstance(model, Prediction):
        return model.reason, {}
    volts = held(drive, at)
    baseline: Floats = found.baseline["C"].value * volts * np.abs(volts)
    return None, {"model": model.thrust, "baseline": baseline}


def work(opened: Path, answers: Path, line: Mapping[str, Any]) -> None:
    """Answer one order."""
    answer, arrays = answered(opened / line["token"], line["without"])
    out = answers / line["token"]
    out.mkdir(parents=True, exist_ok=True)
    if arrays:
        model, baseline = (arrays[name].astype(np.float32) for name in ("model", "baseline"))
        np.savez_compressed(out / f"{line['tag']}.npz", model=model, baseline=baseline)
    part = out / f"{line['tag']}.json.part"
    part.write_text(json.dumps({**answer, "code": line["code"]}, indent=1) + "\n", encoding="utf-8")
    part.replace(out / f"{line['tag']}.json")


def main(arguments: Sequence[str]) -> None:
    """Until the input ends."""
    opened, answers = map(Path, arguments)
    blindfold(opened.parent, (opened, answers))
    for text in iter(sys.stdin.readline, ""):
        work(opened, answers, json.loads(text))
        sys.stdout.write("answered\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
