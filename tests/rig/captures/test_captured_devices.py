"""Every capture in tests/captures through its driver: the rows are those beside it, to the bit.

A capture becomes a test by being put there with its description and its rows (docs/howto/capture.md).
"""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from rig.captures.description import read
from rig.captures.playing import chunks_of, exact, play
from rig.cli import main

CAPTURES = sorted((Path(__file__).parents[2] / "captures").glob("*.txt"))


@pytest.mark.parametrize("capture", CAPTURES, ids=lambda path: path.stem)
def test_a_capture_gives_its_rows(capture):
    played = play(chunks_of(capture), read(capture), lambda _: None)
    assert exact(played.rows) == capture.with_suffix(".rows").read_text(encoding="ascii")
    assert played.differences == ()
    assert played.health.bad == 0


def test_there_is_one_of_lines_and_one_of_questions():
    kinds = {read(capture).kind for capture in CAPTURES}
    assert {"mt_sics", "modbus_cell"} <= kinds
    assert all(read(capture).anonymised for capture in CAPTURES)


def test_a_byte_that_differs_is_seen():
    capture = CAPTURES[0].with_name("load_cell.txt")
    chunks = chunks_of(capture)
    place = next(n for n, chunk in enumerate(chunks) if chunk.data.startswith(b"S ") and b"." in chunk.data)
    at = chunks[place].data.index(b".") + 1
    digit = b"7" if chunks[place].data[at : at + 1] != b"7" else b"8"
    chunks[place] = chunks[place]._replace(data=chunks[place].data[:at] + digit + chunks[place].data[at + 1 :])
    rows = exact(play(chunks, read(capture), lambda _: None).rows)
    assert rows != capture.with_suffix(".rows").read_text(encoding="ascii")


def test_at_the_speed_that_is_asked_for(capsys):
    """1.5 s of bytes: at 10 times their speed they take 0.15 s at least."""
    begun = time.monotonic()
    assert main(["replay", str(CAPTURES[0]), "--speed", "10"]) == 0
    assert time.monotonic() - begun > 0.1
    assert "rows" in capsys.readouterr().out
