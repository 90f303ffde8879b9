"""Files by URL: listed, fetched whole, known by what is in them."""

import gc
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner

from rig.errors import RecordingError
from rig.fit.command import fit_command
from rig.fleet.elsewhere import fetched, named_by, sha256_of_url, stamp_of_url
from rig.fleet.files import meant, sha256_of
from tests.rig.fleet.small_recordings import folder


@pytest.fixture
def archive(tmp_path):
    root = folder(tmp_path / "line", 3)
    with zipfile.ZipFile(tmp_path / "line.zip", "w") as file:
        for path in sorted(root.glob("*.h5")):
            file.write(path, path.name)
    return tmp_path / "line.zip"


def test_files_in_an_archive_are_fitted_and_known_by_their_bytes(archive, tmp_path):
    url, store = f"zip://*.h5::file://{archive}", tmp_path / "store"
    told = CliRunner().invoke(fit_command, [url, "--jobs", "2", "--store", str(store)], catch_exceptions=False)
    assert (told.exit_code, "3 files, 3 computed" in told.output) == (0, True), told.output
    beside = [str(tmp_path / "line"), "--jobs", "1", "--store", str(store)]
    assert "0 computed, 3 known" in CliRunner().invoke(fit_command, beside, catch_exceptions=False).output


def test_a_url_is_a_file_a_pattern_or_a_folder(archive, tmp_path):
    inside = [f"zip://{k}.h5::file://{archive}" for k in range(3)]
    assert meant([f"zip://*.h5::file://{archive}"]) == inside
    assert meant([inside[1]]) == [inside[1]]
    assert [url.rsplit("/", 1)[1] for url in named_by(f"file://{tmp_path}/line", ".h5")] == ["0.h5", "1.h5", "2.h5"]
    assert sha256_of_url(inside[2]) == sha256_of(tmp_path / "line" / "2.h5")
    with fetched(inside[0]) as path:
        assert path.read_bytes() == (tmp_path / "line" / "0.h5").read_bytes()
    assert not path.exists()


def test_a_stamp_changes_with_the_file(tmp_path):
    path = folder(tmp_path / "line", 1) / "0.h5"
    before = stamp_of_url(f"file://{path}")
    path.write_bytes(path.read_bytes() + b" ")
    assert before
    assert stamp_of_url(f"file://{path}") != before


@pytest.mark.parametrize(
    "url", ["zip://none.h5::file://{}", "zip://*.csv::file://{}", "nowhere://a/*.h5", "file:///no/*.h5"]
)
def test_what_is_not_there_is_one_sentence(url, archive):
    with pytest.raises(RecordingError, match=r"^[^\n]+$"):
        [stamp_of_url(each) for each in meant([url.format(archive)])]


def test_an_archive_is_closed_while_the_error_is_still_held(archive):
    """Held by somebody who tells it, its frames hold the file system: only closing it lets go of the file."""
    gc.disable()
    try:
        with pytest.raises(RecordingError) as told:
            meant([f"zip://*.csv::file://{archive}"])
        with pytest.raises(OSError, match=r"none\.h5") as read:
            sha256_of_url(f"zip://none.h5::file://{archive}")
        held = [link for link in Path("/proc/self/fd").iterdir() if link.exists() and link.samefile(archive)]
    finally:
        gc.enable()
    assert not held, (told, read)
