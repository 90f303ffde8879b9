"""Answers for a reader name files; ids are for programs."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rig.diagnose.recording_names import file_names, told_by_name, with_names
from rig.hdf5 import RecordingFile
from rig.link.recorder_messages import ChannelSpec, StreamSpec

NAMES = {"a71e5e93-42f2-57c4": "T1.h5", "f55ca233-b91b-51ba": "T2.h5"}


@dataclass(frozen=True, eq=False)
class Inner:
    says: str
    curve: np.ndarray = field(default_factory=lambda: np.ones(3))


@dataclass(frozen=True, eq=False)
class Outer:
    model: dict[str, float]
    parts: tuple[Inner, ...]
    bare: Inner
    count: int = 3


def test_every_text_and_key_of_an_answer_is_told_by_name():
    answer = Outer(
        {"tare[a71e5e93-42f2-57c4]": 1.0, "C": 2.0},
        (Inner("f55ca233-b91b-51ba: current has no sign"), Inner("nothing")),
        Inner("plain"),
    )
    told = told_by_name(answer, NAMES)
    assert list(told.model) == ["tare[T1.h5]", "C"]
    assert [part.says for part in told.parts] == ["T2.h5: current has no sign", "nothing"]
    assert told.parts[1] is answer.parts[1]
    assert told.bare is answer.bare
    assert told.parts[0].curve is answer.parts[0].curve


def test_text_without_ids_stays():
    assert with_names("nothing here", NAMES) == "nothing here"


def written(path: Path, identity: str) -> Path:
    path.parent.mkdir(exist_ok=True)
    spec = StreamSpec("cell", "test", (ChannelSpec("thrust", "thrust", "N"),))
    RecordingFile(path, {"recording_id": identity, "thruster": "T1"}, [spec], t0_ns=0).close("completed", "", 0.0)
    return path


def test_files_of_one_name_are_told_by_their_folders(tmp_path):
    files = [written(tmp_path / "may" / "T1.h5", "one"), written(tmp_path / "june" / "T1.h5", "two")]
    files.append(written(tmp_path / "june" / "T2.h5", "three"))
    assert file_names(files) == {"one": "may/T1.h5", "two": "june/T1.h5", "three": "T2.h5"}
