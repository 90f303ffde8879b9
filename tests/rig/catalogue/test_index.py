"""The index says what the files say, whatever became of them or of it."""

import os
import random
import sqlite3
import subprocess
import sys
import time

import pytest

from rig.catalogue import index
from rig.catalogue.entry import UNREADABLE, WHAT
from rig.catalogue.index import NAME, with_index
from rig.catalogue.refresh import empty, refresh
from rig.catalogue.selection import Filter
from rig.hdf5 import RecordingFile
from rig.link.recorder_messages import ChannelSpec, Rows, StreamSpec
from tests.rig.catalogue.small_files import asked, diagnosis, fit, ledger, recording, twin
from tests.rig.killed_readers import killed_readers


def everything(folder, cache=None):
    return {what: asked(folder, Filter(what), cache) for what in WHAT}


def anew(folder, cache):
    """What a rebuild from nothing says, in an index of its own."""

    def work(connection):
        empty(connection)
        refresh(connection, folder)

    (folder / NAME).rename(folder / "kept")
    try:
        with_index(folder, cache, work, pytest.fail)
        return everything(folder, cache)
    finally:
        (folder / NAME).unlink(missing_ok=True)
        (folder / "kept").rename(folder / NAME)


def change(folder, rng, k):
    """Something comes, changes or goes."""
    path = folder / rng.choice(["", "a", "a/b"]) / f"{rng.randrange(6)}"
    path.parent.mkdir(parents=True, exist_ok=True)
    thruster, ids = rng.choice(["T1", "T2"]), [f"id-{rng.randrange(4)}" for _ in range(2)]
    what = rng.randrange(9)
    if what < 3:
        created = f"2026-0{rng.randrange(1, 9)}-01T00:00:00Z"
        recording(path.with_suffix(".h5"), ids[0], thruster, created, campaign=rng.choice(["", "spring", "autumn"]))
    elif what == 3:
        fit(path.with_suffix(".json"), thruster, ids, C=0.4 + 0.01 * k)
    elif what == 4:
        rng.choice([twin, diagnosis])(path.with_suffix(".json"), thruster, ids)
    elif what == 5:
        path.with_suffix(rng.choice([".h5", ".json"])).write_bytes(rng.randbytes(100))
    elif what == 6:
        ledger(path.parent, [(thruster, ids[0], "completed")])
    else:
        for gone in sorted(path.parent.glob("*.*"))[:2]:
            gone.unlink() if gone.is_file() and gone.name != NAME else None


@pytest.mark.parametrize("seed", range(4))
def test_after_any_changes_it_is_what_a_rebuild_gives(tmp_path, seed):
    rng, folder = random.Random(seed), tmp_path / "data"
    folder.mkdir()
    for k in range(6):
        for _ in range(4):
            change(folder, rng, k)
        kept = everything(folder)
        assert kept == anew(folder, tmp_path / f"cache-{k}")
    assert sum(len(found) for found in kept.values()) > 3


def test_only_what_changed_is_read_again(tmp_path):
    for k in range(5):
        recording(tmp_path / f"{k}.h5", f"id-{k}")

    def work(connection):
        return refresh(connection, tmp_path)

    assert with_index(tmp_path, tmp_path, work, pytest.fail) == (5, 5, 0)
    assert with_index(tmp_path, tmp_path, work, pytest.fail) == (5, 0, 0)
    recording(tmp_path / "3.h5", "id-3", thruster="T9")
    (tmp_path / "4.h5").unlink()
    assert with_index(tmp_path, tmp_path, work, pytest.fail) == (4, 1, 1)


def test_a_result_has_time_campaign_and_bench_of_its_recordings(tmp_path):
    fit(tmp_path / "f.json", recordings=("id-1", "id-2"))
    (early,) = asked(tmp_path, Filter("fits"))
    assert early.began == pytest.approx((tmp_path / "f.json").stat().st_mtime)
    recording(tmp_path / "1.h5", "id-1", created="2026-03-01T00:00:00Z", campaign="spring", facility="tank")
    recording(tmp_path / "2.h5", "id-2", created="2026-03-02T00:00:00Z", campaign="spring", facility="tank")
    (found,) = asked(tmp_path, Filter("fits"))
    assert (found.began, found.campaign, found.bench) == (1772409600.0, "spring", "tank")
    (tmp_path / "1.h5").unlink()
    (tmp_path / "2.h5").unlink()
    assert asked(tmp_path, Filter("fits")) == [early]


@pytest.mark.parametrize(
    "content", [b"", b"nonsense" * 1000, b"SQLite format 3\0" + b"\xff" * 5000, "foreign", "torn", "later"]
)
def test_a_damaged_or_foreign_index_is_made_anew_and_that_is_said(tmp_path, content):
    for k in range(3):
        recording(tmp_path / f"{k}.h5", f"id-{k}")
    before = asked(tmp_path)
    place, said = tmp_path / NAME, []
    if content == "foreign":
        place.unlink()
        with sqlite3.connect(place) as connection:
            connection.execute("CREATE TABLE bookmarks (url)")
        connection.close()
    elif content == "later":
        with sqlite3.connect(place) as connection:
            connection.execute("PRAGMA user_version = 1000")
        connection.close()
    elif content == "torn":
        data = bytearray(place.read_bytes())
        data[4096:] = os.urandom(len(data) - 4096)
        place.write_bytes(data)
    else:
        place.write_bytes(content)
    assert asked(tmp_path, said=said) == before
    assert len(said) == (0 if content == b"" else 1)
    assert all("made anew" in text and "\n" not in text for text in said)
    place.unlink()
    assert asked(tmp_path) == before


def test_an_index_with_wrong_bytes_is_no_reason_to_fail(tmp_path):
    """Pages that are spoilt are seen; a letter of a text that became another is not, until its file changes."""
    for k in range(5):
        recording(tmp_path / f"{k}.h5", f"id-{k}")
    fit(tmp_path / "f.json")
    before, place = everything(tmp_path), tmp_path / NAME
    whole, rng, said = place.read_bytes(), random.Random(5), []
    for _ in range(25):
        spoilt = bytearray(whole)
        for _ in range(rng.choice([1, 30, 1000])):
            spoilt[rng.randrange(len(spoilt))] = rng.randrange(256)
        place.write_bytes(spoilt)
        asked(tmp_path, said=said)
        assert everything(tmp_path).keys() == before.keys()
    assert len(said) > 10
    place.unlink()
    assert everything(tmp_path) == before


def test_where_the_folder_can_not_be_written_the_index_is_in_the_cache(tmp_path, monkeypatch):
    data, cache, said = tmp_path / "data", tmp_path / "cache", []
    recording(data / "1.h5")
    monkeypatch.setattr(index.os, "access", lambda *_: False)
    assert len(asked(data, cache=cache, said=said)) == 1
    assert [path.name for path in data.iterdir()] == ["1.h5"]
    assert len(list(cache.rglob("*.sqlite"))) == 1
    assert not said
    blocked = tmp_path / "file"
    blocked.write_text("")
    assert len(asked(data, cache=blocked, said=said)) == 1
    assert "nothing is kept" in said[-1]


def test_three_processes_at_once(tmp_path):
    for k in range(60):
        recording(tmp_path / f"{k}.h5", f"id-{k}")
    (tmp_path / NAME).write_bytes(b"nonsense" * 1000)
    code = "import sys; from rig.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "list", str(tmp_path), "--rebuild"]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(3)]
    told = [process.communicate() for process in both]
    assert [process.returncode for process in both] == [0, 0, 0], told
    assert [len(out.splitlines()) for out, _ in told] == [61, 61, 61], told
    assert len(asked(tmp_path)) == 60


def test_a_recording_that_grows_is_listed_as_that(tmp_path):
    stream = StreamSpec("cell", "sim", (ChannelSpec("thrust", "thrust", "N"),))
    file = RecordingFile(tmp_path / "r.h5", {"recording_id": "id", "thruster": "T1"}, (stream,), 0)
    durations = []
    for k in range(3):
        file.add_rows(Rows(0, (np_range(k) * 1e9).astype("i8"), np_range(k)[:, None]))
        file.flush()
        (found,) = asked(tmp_path)
        durations.append(found.duration)
        assert found.outcome == "running"
        assert "still being written" in found.reason
    assert durations == [99.0, 199.0, 299.0]
    long_ago = time.time() - 3600
    os.utime(tmp_path / "r.h5", (long_ago, long_ago))
    assert [each.outcome for each in asked(tmp_path)] == ["unclosed"]
    assert len(asked(tmp_path, Filter(outcome="unclosed"))) == 1
    assert not asked(tmp_path, Filter(outcome="running"))
    file.close("completed", "", 300.0)
    assert [(each.outcome, each.reason) for each in asked(tmp_path)] == [("completed", "")]


def np_range(k):
    import numpy as np

    return np.arange(100.0 * k, 100.0 * (k + 1))


def test_what_is_no_recording_has_the_reason_and_hinders_nothing(tmp_path):
    recording(tmp_path / "good.h5")
    (tmp_path / "text.h5").write_text("no HDF5")
    (tmp_path / "cut.h5").write_bytes((tmp_path / "good.h5").read_bytes()[:1500])
    os.mkfifo(tmp_path / "pipe.h5")
    (tmp_path / "gone.h5").symlink_to("nowhere")
    (tmp_path / "folder.h5").mkdir()
    (tmp_path / "other.json").write_text('{"format": "thruster-rig-design"}')
    (tmp_path / "torn.json").write_text('{"format": "thruster-rig-fit", "version": 1, "fits": [')
    (tmp_path / "odd.json").write_text('{"format": "thruster-rig-twin", "thruster": 7}')
    ledger(tmp_path / "c")
    with (tmp_path / "c" / "campaign.jsonl").open("a") as file:
        file.write("not JSON\n")
    found = {each.path: each for each in asked(tmp_path)}
    assert found.pop("good.h5").outcome == "completed"
    assert set(found) == {"text.h5", "cut.h5", "pipe.h5", "gone.h5"}
    assert all(each.outcome == UNREADABLE and each.reason for each in found.values())
    assert "is not an HDF5 file" in found["text.h5"].reason
    for what in ("fits", "twins", "campaigns"):
        (one,) = asked(tmp_path, Filter(what))
        assert one.outcome == UNREADABLE
        assert one.reason


def test_a_file_whose_reader_was_killed_is_read_again(tmp_path, monkeypatch):
    recording(tmp_path / "good.h5")
    with monkeypatch.context() as patched:
        killed_readers(patched)
        (one,) = asked(tmp_path)
        assert one.outcome == UNREADABLE
        assert "ended from outside" in one.reason
    assert [each.outcome for each in asked(tmp_path)] == ["completed"]


def test_names_that_are_no_unicode_and_texts_that_are_no_text(tmp_path):
    recording(tmp_path / "a.h5", thruster="T1\x1b]0;title\x07\u202e\n")
    (tmp_path / "a.h5").rename(tmp_path / os.fsdecode(b"\xff\x1b[31m.h5"))
    fit(tmp_path / "f.json", thruster="\ud800 \x00")
    (one,) = asked(tmp_path)
    assert os.fsencode(one.path) == b"\xff\x1b[31m.h5"
    assert one.thruster == "T1\x1b]0;title\x07\u202e\n"
    assert asked(tmp_path) == [one]
    assert [each.thruster for each in asked(tmp_path, Filter("fits"))] == ["\\ud800 \x00"]
