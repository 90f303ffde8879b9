"""The recordings behind a twin, found by name and hash, and what they say of a finding."""

from __future__ import annotations

import json
import shutil

import pytest

from rig.diagnose.behind_twin import behind, missing
from rig.errors import RecordingError
from rig.twin.reading import read_twin
from tests.rig.diagnose.diagnosed_files import bad, dead_band, run


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A recording without a dead band, its twin beside it, and one that has got a dead band since."""
    folder = tmp_path_factory.mktemp("behind")
    first, twin, second = folder / "first.h5", folder / "it.twin.json", folder / "second.h5"
    bad.recording(first)
    bad.recording(second, seed=5, change=dead_band)
    result = run("diagnose", first, "--save-twin", twin)
    assert result.exit_code == 0, result.output
    return first, twin, second


def test_they_are_found_by_name_in_the_folders_and_by_hash_as_given(sound, tmp_path):
    first, path, second = sound
    twin = read_twin(path)
    assert twin.sources[0].file == "first.h5"
    assert [r.recording_id for r in behind(twin, [tmp_path, first.parent])] == [twin.sources[0].recording_id]
    renamed = shutil.copy(first, tmp_path / "renamed.h5")
    assert behind(twin, [tmp_path]) == []
    assert len(behind(twin, [tmp_path], [renamed])) == 1
    shutil.copy(second, tmp_path / "first.h5")
    assert behind(twin, [tmp_path]) == [], "another recording of that name"
    assert "first.h5, behind the twin," in missing(twin)


def test_a_file_that_is_none_of_them_is_refused(sound, tmp_path):
    _, path, second = sound
    with pytest.raises(RecordingError, match="none of the recordings behind the twin"):
        behind(read_twin(path), [], [second])
    with pytest.raises(RecordingError, match="can't be read"):
        behind(read_twin(path), [], [tmp_path / "nothing.h5"])
    assert "there is no --twin" in run("diagnose", second, "--before", second).output


def test_a_finding_says_whether_it_is_new(sound, tmp_path):
    first, path, second = sound
    found = json.loads(run("diagnose", second, "--twin", path, "--json", "-").output)
    assert {f["effect"]: f["since"] for f in found["findings"]}["dead_band"] == "changed"
    far, alone = shutil.copy(second, tmp_path / "second.h5"), shutil.copy(path, tmp_path / "it.twin.json")
    unasked = json.loads(run("diagnose", far, "--twin", alone, "--json", "-").output)
    assert {f["effect"]: f["since"] for f in unasked["findings"]}["dead_band"] is None
    assert any("give it with --before" in note for note in unasked["notes"])
    assert first.exists()
