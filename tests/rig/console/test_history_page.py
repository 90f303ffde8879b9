"""The history page: rows newest first, columns by importance, two of them compared, and nothing waits for it."""

from __future__ import annotations

import json
import sqlite3
import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from rig.catalogue.beside_console import CHUNK, answer, constant, rows
from rig.catalogue.entry import Entry
from rig.catalogue.index import NAME
from rig.console.history import CompareDialog, HistoryPanel
from rig.console.view_model.history import (
    Rows,
    compared_text,
    history_text,
    moved,
    row_of,
    shown_columns,
    to_compare,
    toggled,
    widths,
)
from rig.hdf5 import load
from rig.link.front_end_messages import Request
from tests.rig.console.feeds import campaign, running
from tests.rig.console.past import COMPARED, PAST, past_rows
from tests.rig.console.scenes import settle
from tests.rig.console.sitting import sitting
from tests.rig.console.told import speaker
from tests.rig.diagnose.diagnosed_files import bad

END = replace(campaign()[-1], files=("out/autumn-2/T1.h5", "out/autumn-2/T2.h5"))
ROWS = Rows(tuple(row_of(told) for told in past_rows()))


def recording(path: str, began: float, **known) -> Entry:
    return Entry("recordings", path, id=path, thruster="T1", began=began, outcome="completed", **known)


def test_campaigns_stand_above_their_recordings_newest_first_with_the_constant_of_their_fit():
    parameters = {"C": {"value": 0.401932, "std": 0.000233, "unit": "N/V^2"}}
    fit = Entry("fits", "b/fits.json", thruster="T1", recordings=("b/T1.h5",), began=2.0,
                facts={"parameters": parameters, "chi2_p": 0.0, "chi2_per_dof": 153.0})  # fmt: skip
    orphan = Entry("fits", "old.json", thruster="T1", recordings=("gone",), began=0.5,
                   facts={"parameters": parameters, "chi2_p": 0.4, "chi2_per_dof": 1.0})  # fmt: skip
    found = rows(
        [recording("a/T1.h5", 1.0), recording("b/T1.h5", 2.0), recording("b/T1-2.h5", 3.0), recording("x.h5", 2.5)],
        [Entry("campaigns", "b/campaign.jsonl", campaign="b", began=2.0)],
        [fit, orphan],
        [Entry("diagnoses", "d.json", outcome="ambiguous", recordings=("a/T1.h5",))],
    )
    assert [(row["what"], row["path"]) for row in found] == [
        ("campaign", "b/campaign.jsonl"),
        ("recording", "b/T1-2.h5"),
        ("recording", "b/T1.h5"),
        ("recording", "x.h5"),
        ("recording", "a/T1.h5"),
        ("fit", "old.json"),
    ]
    assert (found[2]["C"], found[2]["verdict"]) == ("0.40193 ± 0.00047", "does NOT fit, 153")
    assert (found[4]["C"], found[4]["verdict"]) == ("", "ambiguous")
    assert found[5]["verdict"] == "fits"


def test_a_constant_that_is_not_determined_says_so():
    assert constant({"C": {"value": 0.4, "std": None, "unit": "N/V^2"}}) == "not determined"


def test_columns_go_from_the_end_where_there_is_no_room():
    wide = widths(ROWS.all)
    counts = [shown_columns(wide, width) for width in (20, 76, 116, 300)]
    assert counts[0] == 1
    assert counts == sorted(counts)
    assert counts[-1] == len(wide)
    text = history_text(ROWS, wide, 76, 20, ("autumn-2/T1.h5",)).plain
    assert all(len(line) <= 76 for line in text.split("\n"))
    for part in ("0.40193 ± 0.00047", "does NOT fit", "thruster", "> "):
        assert part in text
    (now,) = [line for line in text.split("\n") if "●" in line]
    assert "T1" in now


def test_the_cursor_stays_in_sight_and_between_the_ends():
    rows_ = moved(ROWS, 10**9, 3)
    assert (rows_.cursor, rows_.top) == (len(ROWS.all) - 1, len(ROWS.all) - 3)
    assert moved(rows_, -(10**9), 3) == replace(ROWS, cursor=0, top=0)
    assert moved(Rows(), 1, 3).cursor == 0


def test_two_of_one_thruster_are_compared_the_older_first():
    at = {row.path: place for place, row in enumerate(ROWS.all)}
    newer, older, other = at["autumn-2/T1.h5"], at["spring-1/T1.h5"], at["autumn-2/T2.h5"]
    assert "Space marks" in to_compare(ROWS)
    assert toggled(ROWS) == ROWS  # a campaign
    marked = toggled(replace(ROWS, cursor=newer))
    assert to_compare(replace(marked, cursor=older)) == (ROWS.all[older], ROWS.all[newer])
    assert "of T2 and T1" in to_compare(replace(marked, cursor=other)) or "of T1 and T2" in to_compare(
        replace(marked, cursor=other)
    )
    assert toggled(marked).chosen == frozenset()
    three = toggled(replace(toggled(replace(marked, cursor=older)), cursor=other))
    assert three.chosen == {other}


def test_a_comparison_has_its_sentence_and_figures():
    text = compared_text(COMPARED).plain
    assert text.startswith("≠ CHANGED")
    for part in (COMPARED["sentence"], "0.39862 ± 0.00041 N/V^2", "-3.014 % (95 %: -3.047 to -2.981 %)", "1e-13"):
        assert part in text
    assert compared_text({**COMPARED, "changed": False}).plain.startswith("= NOT CHANGED")


async def opened(desk, command) -> str:
    desk.app.catalogue = command
    await desk.press("8")
    await settle(desk.pilot, lambda: desk.app._reading is None)
    await desk.draw()
    return desk.text(HistoryPanel)


async def test_the_page_opens_shows_how_far_it_is_and_marks_this_run(tmp_path):
    said = ({"at": "128 of 10000 files read"}, {"rows": past_rows()}, {"end": "7 recordings"})
    async with sitting(END) as desk:
        text = await opened(desk, speaker(tmp_path, *said))
        assert desk.app.query_one("#pages").current == "history"
        assert "campaign autumn: completed" in text
        assert "7 recordings" in text
        assert text.count("●") == 2
        await desk.press("down", "space", "end")
        assert "x" in desk.text(HistoryPanel)
        assert desk.app.query_one(HistoryPanel).rows.cursor == len(past_rows()) - 1


async def test_while_something_may_turn_no_file_is_read_and_u_reads_again(tmp_path):
    asked = tmp_path / "asked"
    echo = f"open({str(asked)!r}, 'a').write(sys.stdin.readline())"
    async with sitting(replace(running(), files=("out/autumn-2/T1.h5",))) as desk:
        command = speaker(tmp_path, then=echo)
        await opened(desk, command)
        await desk.press("1", "8")  # not again by itself
        await desk.press("u")
        await settle(desk.pilot, lambda: asked.read_text().count("\n") == 2 and desk.app._reading is None)
        await desk.play(END)
        await desk.press("8")
        await settle(desk.pilot, lambda: asked.read_text().count("\n") == 3 and desk.app._reading is None)
    told = [json.loads(line) for line in asked.read_text().splitlines()]
    assert [each["refresh"] for each in told] == [False, False, True]
    assert {each["folder"] for each in told} == {str(Path("out").resolve())}


async def test_enter_compares_and_escape_ends_what_takes_long(tmp_path):
    async with sitting(END, size=(100, 40)) as desk:
        await opened(desk, speaker(tmp_path, {"rows": past_rows()}, {"end": "7 recordings"}))
        await desk.press("enter")
        assert any("Space marks" in toast for toast in desk.toasts())
        desk.app.catalogue = speaker(tmp_path, {"compared": COMPARED})
        await desk.press("down", "down", "space", "end", "c")
        await settle(desk.pilot, lambda: isinstance(desk.app.screen, CompareDialog))
        shown = desk.app.screen.query_one("#compared")
        await settle(desk.pilot, lambda: COMPARED["sentence"] in str(shown.render()))
        await desk.press("escape")
        desk.app.catalogue = speaker(tmp_path, then="time.sleep(60)")
        await desk.press("enter")
        await settle(desk.pilot, lambda: desk.app._comparing is not None)
        await desk.press("escape")
        await settle(desk.pilot, lambda: desk.app._comparing is None)
        assert desk.kinds() == []


async def test_during_a_run_none_of_its_own_recordings_is_opened(tmp_path):
    files = ("out/autumn-2/T1.h5",)
    async with sitting(replace(running(), files=files)) as desk:
        await opened(desk, speaker(tmp_path, {"rows": past_rows()}, {"end": "7 recordings"}))
        await desk.press("down", "down", "space", "end", "enter")
        assert any("once the campaign has ended" in toast for toast in desk.toasts())
        assert not desk.app.looks_back
        desk.app.catalogue = speaker(tmp_path, {"compared": COMPARED})
        await desk.press("home", "down", "down", "space", "end", "space", "up", "up", "enter")  # spring and March
        await settle(desk.pilot, lambda: isinstance(desk.app.screen, CompareDialog))


async def test_what_fails_is_one_sentence(tmp_path):
    async with sitting(END) as desk:
        assert "not read: no folder" in await opened(desk, speaker(tmp_path, {"fault": "no folder"}))
        desk.app.catalogue = speaker(tmp_path, then="sys.exit('boom')")
        await desk.press("u")
        await settle(desk.pilot, lambda: "boom" in desk.text(HistoryPanel))


@pytest.mark.parametrize("page", ["read", "compare"])
async def test_the_stop_key_goes_out_at_once_while_the_catalogue_is_read_or_compared(tmp_path, page):
    floods = (
        f"r = {json.dumps({'rows': past_rows() * 30})!r}\nfor _ in range(300): print(r, flush=True)\ntime.sleep(60)"
    )
    async with sitting(running(), size=(120, 40)) as desk:
        desk.app.catalogue = speaker(tmp_path, then=floods)
        await desk.press("8")
        await settle(desk.pilot, lambda: len(desk.app.query_one(HistoryPanel).rows.all) > 400)
        if page == "compare":
            await desk.press("down", "down", "space", "end", "enter")
            await settle(desk.pilot, lambda: isinstance(desk.app.screen, CompareDialog))
        for key in ("ctrl+c", "f9"):
            before = len(desk.kinds())
            desk.app.simulate_key(key)
            assert desk.kinds()[before:] == ["stop"]  # no turn of the event loop
            assert desk.feed.sent[-1] == Request("stop", "console")


def said_of(asked: dict) -> list[dict]:
    said: list[dict] = []
    answer(asked, said.append)
    return said


def test_the_process_reads_a_folder_and_without_refresh_its_index_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "out"
    folder.mkdir()
    fit = {"format": "thruster-rig-fit", "version": 1, "fits": [
        {"thruster": "T1", "model": "C V|V|", "recordings": ["gone"], "rmse": 0.1, "chi2_per_dof": 9.0, "chi2_p": 1e-9,
         "parameters": {"C": {"value": 0.4, "std": 0.001, "unit": "N/V^2"}}}]}  # fmt: skip
    bad.recording(folder / "T1.h5")
    fit["fits"][0]["recordings"] = [load(folder / "T1.h5").recording_id]
    (folder / "fits.json").write_text(json.dumps(fit))
    ask = {"folder": str(folder), "refresh": False}
    assert "has no index yet" in said_of(ask)[0]["fault"]
    assert not (folder / NAME).exists()
    read = said_of({**ask, "refresh": True})
    assert read[1] == {"at": "2 of 2 files read"}
    (row,) = read[2]["rows"]
    assert (row["path"], row["C"], row["verdict"]) == ("T1.h5", "0.4000 ± 0.0020", "does NOT fit, 9")
    (folder / "fits.json").unlink()
    assert said_of(ask)[0]["rows"] == read[2]["rows"]
    assert "as the index had them" in said_of(ask)[-1]["end"]
    assert "no folder" in said_of({"folder": str(tmp_path / "none"), "refresh": True})[0]["fault"]


def test_ten_thousand_come_in_pieces(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    said_of({"folder": str(tmp_path), "refresh": True})
    with closing(sqlite3.connect(tmp_path / NAME)) as index:
        for k in range(10_000):
            index.execute("INSERT INTO files VALUES (?, 1, 1)", (f"{k}.h5".encode(),))
            index.execute(
                "INSERT INTO entries (path, what, id, thruster, kind, campaign, began, outcome, operator, bench, said, "
                "reason, facts) VALUES (?, 'recordings', ?, 'T1', '', '', ?, 'completed', '', '', '', '', '{}')",
                (f"{k}.h5".encode(), str(k), float(k)),
            )
        index.commit()
    said = said_of({"folder": str(tmp_path), "refresh": False})
    sizes = [len(each["rows"]) for each in said if "rows" in each]
    assert sum(sizes) == 10_000
    assert max(sizes) == CHUNK
    assert said[0]["rows"][0]["path"] == "9999.h5"


def test_what_is_compared_must_be_of_one_thruster(tmp_path):
    told = [{"what": "fit", "path": "none.json", "thruster": name, "began": None} for name in ("T1", "T2")]
    assert "not all of one and the same" in said_of({"folder": str(tmp_path), "compare": told})[0]["fault"]


def test_past_is_what_the_process_says():
    assert set(past_rows()[0]) == set(rows([recording("a.h5", 1.0)], [], [], [])[0])
    assert len(PAST) > 5
    assert sys.executable
