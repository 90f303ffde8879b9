"""Files asked in processes: nothing is lost, nothing is computed twice, whatever dies."""

from collections import Counter
from contextlib import contextmanager
from pathlib import Path

import pytest

from rig.errors import RecordingError
from rig.fleet.columns import COMMON
from rig.fleet.files import meant
from rig.fleet.local import Local
from rig.fleet.parquet import write_stale
from rig.fleet.question import Question
from rig.fleet.store import NAME, UNDATED, StoreError, opened
from rig.fleet.work import carry_out


@contextmanager
def no_progress(_count):
    yield lambda _name: None


def files(root: Path, names: str) -> list[str]:
    root.mkdir(exist_ok=True)
    for name in names:
        (root / f"{name}.h5").write_text(name)
    return meant([str(root)])


def question(tmp_path, name, version="1", **options):
    log = tmp_path / "log"
    log.touch()
    return Question("things", f"tests.rig.fleet.answers:{name}", {"log": str(log), **options}, version)


def answer(tmp_path, asked, urls, jobs=2, limit=60.0):
    with opened(tmp_path / "store") as store:
        found = carry_out(asked, urls, store, Local(jobs, limit, store.root), no_progress)
        return found, store.rows_of("things")


def log_of(tmp_path):
    return Counter((tmp_path / "log").read_text().split())


def test_what_is_known_is_not_asked_again(tmp_path):
    asked, urls = question(tmp_path, "plain"), files(tmp_path / "in", "abcdef")
    first, rows = answer(tmp_path, asked, urls)
    again, same = answer(tmp_path, asked, urls)
    assert (first.made, first.known, again.made, again.known) == (6, 0, 0, 6)
    assert rows == same
    assert sorted(row["thruster"] for row in rows) == [f"T-{name}" for name in "abcdef"]
    assert set(log_of(tmp_path).values()) == {1}


def test_a_key_is_of_recording_options_and_version(tmp_path):
    asked, urls = question(tmp_path, "plain"), files(tmp_path / "in", "ab")
    answer(tmp_path, asked, urls)
    (tmp_path / "in").rename(tmp_path / "moved")  # the same bytes elsewhere
    urls = meant([str(tmp_path / "moved")])
    assert answer(tmp_path, asked, urls)[0].made == 0
    (tmp_path / "moved" / "a.h5").write_text("other bytes")
    assert answer(tmp_path, asked, urls)[0].made == 1
    other, rows = answer(tmp_path, question(tmp_path, "plain", more=1), urls)
    assert (other.made, len(rows)) == (2, 5)
    later, rows = answer(tmp_path, question(tmp_path, "plain", version="2"), urls)
    assert (later.made, len(rows)) == (2, 5)  # in place of the older answers
    assert sum(row["software"].endswith("sources 2") for row in rows) == 2


def test_the_same_bytes_twice_are_one_recording(tmp_path):
    urls = files(tmp_path / "in", "ab")
    (tmp_path / "in" / "copy.h5").write_text("a")
    found, rows = answer(tmp_path, question(tmp_path, "plain"), [*urls, str(tmp_path / "in" / "copy.h5"), urls[0]])
    assert (found.made, found.same, len(rows)) == (2, 2, 2)


def test_a_process_that_is_killed_costs_nothing(tmp_path):
    """Of twelve files one kills its process the first time, another always: eleven rows, each once; one sentence."""
    urls = files(tmp_path / "in", "abcdefghijkl")
    asked = question(tmp_path, "dies", at=["c.h5"], times=1)
    found, rows = answer(tmp_path, asked, urls)
    assert (found.made, len(rows), found.failed) == (12, 12, ())
    assert log_of(tmp_path) == {f"{name}.h5": 2 if name == "c" else 1 for name in "abcdefghijkl"}
    asked = question(tmp_path, "dies", at=["c.h5"], times=99)
    found, rows = answer(tmp_path, asked, urls)
    (failed,) = found.failed
    assert found.made == 11
    assert len(rows) == 12 + 11
    assert failed.why.startswith(f"{urls[2]}: the process that was at it ended, twice (exit status -9")


def test_a_reader_that_is_killed_costs_nothing_and_says_nothing_of_its_file(tmp_path):
    """Once: asked again at once. Twice: told by name, no row, and asked again by the next command."""
    urls = files(tmp_path / "in", "abcd")
    found, rows = answer(tmp_path, question(tmp_path, "reader_dies", at=["c.h5"], times=1), urls)
    assert (found.made, len(rows), found.failed, found.errors) == (4, 4, (), {})
    assert log_of(tmp_path) == {f"{name}.h5": 2 if name == "c" else 1 for name in "abcd"}
    (tmp_path / "log").unlink()
    asked = question(tmp_path, "reader_dies", at=["c.h5"], times=2)
    found, rows = answer(tmp_path, asked, urls)
    (failed,) = found.failed
    assert (found.made, len(rows), found.errors) == (3, 4 + 3, {})
    assert failed.why.startswith(f"{urls[2]} was not read: its process was ended from outside (SIGKILL")
    again, rows = answer(tmp_path, asked, urls)
    assert (again.made, again.known, again.failed, len(rows)) == (1, 3, (), 8)


def test_a_file_that_takes_too_long_is_told_and_asked_again_the_next_time(tmp_path):
    urls = files(tmp_path / "in", "abc")
    asked = question(tmp_path, "waits", at=["b.h5"])
    found, rows = answer(tmp_path, asked, urls, limit=5.0)
    assert [each.why for each in found.failed] == [f"{urls[1]}: took more than 5 s (--limit) and was ended"]
    assert len(rows) == 2
    again, _ = answer(tmp_path, asked, urls[:1], limit=5.0)
    assert (again.made, again.known) == (0, 1)


def test_what_was_refused_has_a_row_and_so_has_a_fault_of_ours(tmp_path):
    urls = files(tmp_path / "in", "ab")
    found, rows = answer(tmp_path, question(tmp_path, "refuses"), urls)
    said = {Path(row["url"]).stem: row["error"] for row in rows}
    assert said["a"] == f"{urls[0]} is of no use"
    assert said["b"] == f"{urls[1]}: this program is at fault: ZeroDivisionError: of no number"
    assert sorted(found.errors.values()) == sorted(said.values())
    again, _ = answer(tmp_path, question(tmp_path, "refuses"), urls)
    assert (again.known, again.errors) == (2, found.errors)


def test_what_came_before_an_interruption_is_kept(tmp_path):
    urls, asked = files(tmp_path / "in", "abcdef"), question(tmp_path, "plain")

    @contextmanager
    def interrupted(_count):
        seen = []

        def told(name):
            seen.append(name)
            if len(seen) == 3:
                raise KeyboardInterrupt

        yield told

    with opened(tmp_path / "store") as store:
        with pytest.raises(KeyboardInterrupt):
            carry_out(asked, urls, store, Local(1, 60.0, store.root), interrupted)
        assert len(store.rows_of("things")) == 3
        found = carry_out(asked, urls, store, Local(1, 60.0, store.root), no_progress)
    assert (found.known, found.made) == (3, 3)


def test_a_row_makes_its_day_stale_until_its_parquet_is_written(tmp_path):
    urls = files(tmp_path / "in", "ab")
    with opened(tmp_path / "store") as store:
        carry_out(question(tmp_path, "plain"), urls, store, Local(1, 60.0, store.root), no_progress)
        assert write_stale(store, "things", COMMON) == ["2026-11-26"]
        assert write_stale(store, "things", COMMON) == []
        (tmp_path / "in" / "a.h5").write_text("later")
        carry_out(question(tmp_path, "refuses"), urls, store, Local(1, 60.0, store.root), no_progress)
        assert store.stale_days("things") == [UNDATED]


def test_one_command_at_a_time_works_in_a_store(tmp_path):
    with (
        opened(tmp_path / "store"),
        pytest.raises(StoreError, match="another command works in"),
        opened(tmp_path / "store"),
    ):
        raise AssertionError


def test_a_store_that_is_none_is_refused(tmp_path):
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / NAME).write_bytes(b"no database" * 1000)
    with pytest.raises(StoreError, match="move it away, and its rows are computed again"), opened(tmp_path / "store"):
        raise AssertionError


def test_files_are_named_by_folders_and_patterns(tmp_path):
    files(tmp_path / "day1", "ba")
    files(tmp_path / "day2", "c")
    assert [Path(url).stem for url in meant([str(tmp_path / "day*" / "*.h5")])] == ["a", "b", "c"]
    assert [Path(url).stem for url in meant([str(tmp_path / "**" / "[bc].h5"), str(tmp_path / "day1")])] == [
        "b",
        "c",
        "a",
    ]
    (tmp_path / "empty").mkdir()
    for wrong, why in (
        ("empty", "is a folder without files"),
        ("day1/*.csv", "no file is called"),
        ("x.h5", "is not there"),
    ):
        with pytest.raises(RecordingError, match=why):
            meant([str(tmp_path / wrong)])
