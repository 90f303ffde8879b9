"""Keys that reach the console in one write, on a real terminal: each does what it would have done by itself."""

from __future__ import annotations

import ast
import signal

import pytest

from tests.rig.console.terminal import on_terminal

CODE = """
import sys
from pathlib import Path
from rig.console import attend
from tests.rig.console.feeds import PlayedFeed, running
feed = PlayedFeed(running())
attend(feed)
Path(sys.argv[1]).write_text(repr([(request.kind, request.text) for request in feed.sent if request.kind != "lease"]))
"""
CTRL_U, BACKSPACE, HOME, LEFT, F9 = b"\x15", b"\x7f", b"\x1b[H", b"\x1b[D", b"\x1b[20~"


def asked(out, *bursts: bytes) -> list[tuple[str, str]]:
    """What the controller is asked, each of `bursts` being one write; the last of all is a pause."""
    with on_terminal(CODE, str(out)) as (process, terminal):
        terminal.until(b"T1 hold")
        for burst in bursts:
            terminal.press(burst)
        terminal.until(b"controller: pause")
        process.send_signal(signal.SIGTERM)
    return ast.literal_eval(out.read_text())


@pytest.mark.parametrize(
    ("typed", "note"),
    [
        (b"kelp", "kelp"),
        (b"weed" + CTRL_U + b"kelb" + BACKSPACE + b"p", "kelp"),
        (b"elp" + HOME + b"k", "kelp"),
        (b"xp" + LEFT + BACKSPACE + b"kel", "kelp"),
        (b"a line \x1b[200~that was pasted\x1b[201~ in" + CTRL_U + b"p r k 5", "p r k 5"),
    ],
    ids=["opened and typed", "emptied and corrected", "to its beginning", "a step back", "letters that are keys"],
)
def test_a_note_in_one_write_is_what_was_typed_and_the_key_behind_it_is_one(tmp_path, typed, note):
    assert asked(tmp_path / "out", b"n" + typed + b"\rp") == [("note", note), ("pause", "")]


def test_the_stop_key_in_the_middle_of_a_burst_goes_first(tmp_path):
    assert asked(tmp_path / "out", b"nkelp" + F9 + b"s\rp") == [("stop", "console"), ("note", "kelps"), ("pause", "")]


def test_a_key_behind_the_one_that_opens_a_page_of_keys_is_none_of_the_page_below(tmp_path):
    assert asked(tmp_path / "out", b"?kkqp") == [("pause", "")]
