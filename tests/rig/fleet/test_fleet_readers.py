"""The child that reads a recording is killed from outside: that is no row, and the file is asked again."""

import pytest

from rig.diagnose.fleet.row import question_of as diagnoses
from rig.errors import UnreadError
from rig.fit.row import question_of as fits
from rig.fleet.one import one
from tests.rig.fleet.small_recordings import write
from tests.rig.killed_readers import killed_readers

FITS = fits("C V|V|", "command_voltage", "wls")


def row_or_reason(path, asked):
    try:
        return one(str(path), asked)
    except UnreadError as error:
        return str(error)


@pytest.mark.parametrize("asked", [FITS, diagnoses(0)], ids=["fit", "diagnosis"])
def test_whichever_child_is_killed_no_row_says_that_the_file_is_damaged(tmp_path, monkeypatch, asked):
    """A batch of headers is read again file by file, and the row is as ever; of any other child there is no row."""
    path, found = write(tmp_path / "a.h5", 7), []
    with monkeypatch.context() as patched:
        begun = killed_readers(patched, most=0)
        sound = row_or_reason(path, asked)
    assert sound["error"] is None
    for number in begun:
        with monkeypatch.context() as patched:
            killed_readers(patched, first=number, most=1)
            found.append(row_or_reason(path, asked))
    reasons = [each for each in found if each != sound]
    assert reasons
    assert all(each.startswith(f"{path} was not read: its process was ended from outside (SIG") for each in reasons)
