"""What a terminal would obey is shown: at the one place through which all output goes, and wherever texts come in."""

import io
import sys
import unicodedata

import pytest
from rich.console import Console
from rich.table import Table

from rig.cli import main
from rig.console.view_model.tables import checks_table
from rig.link.framing import HEADER, decode, encode
from rig.link.front_end_messages import Check, LogLine, Snapshot
from rig.report.page import Page, Section, Sentences, html
from rig.visible_text import VisibleStream, console, unfiltered, visible, visible_output

SPITE = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202egnp\r\x00\udc80"
BIDI = ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")


def test_every_control_and_direction_is_written_out():
    for code in range(sys.maxunicode + 1):
        letter = chr(code)
        obeyed = unicodedata.category(letter) in ("Cc", "Cs", "Zl", "Zp") or unicodedata.bidirectional(letter) in BIDI
        if letter in "\n\t":
            assert visible(letter) == letter
        elif obeyed:
            assert visible(letter).isprintable(), hex(code)
            assert visible(letter).startswith("\\u"), hex(code)


@pytest.mark.parametrize("text", ["C = 1.5 N/V²", "Wörter, слова, 文字, a\u00a0b", "a\nb\tc", "👩\u200d🔧"])
def test_what_people_write_stays(text):
    assert visible(text) == text


def test_both_outputs_of_a_command_are_visible(capsys):
    with visible_output():
        sys.stdout.write(f"{SPITE}\n")
        sys.stderr.writelines([SPITE])
        assert not hasattr(sys.stdout, "buffer")
        assert unfiltered(sys.stderr) is not sys.stderr
    out, err = capsys.readouterr()
    for text in (out.rstrip("\n"), err):
        assert text.isprintable()
        assert "\\u001b]0;owned\\u0007" in text


def test_an_error_that_quotes_a_file_shows_it(tmp_path, capsys):
    path = tmp_path / "bench\x1b]0;owned\x07.toml"
    assert main(["check", str(path)]) == 2
    assert "\\u001b]0;owned\\u0007.toml" in capsys.readouterr().err


def test_rich_keeps_its_own_colours_and_shows_the_texts():
    out = io.StringIO()
    screen = console(file=VisibleStream(out), force_terminal=True, width=200, color_system="standard")
    table = Table("name")
    table.add_row(f"[bold]{SPITE}[/nothing]")
    screen.print(table)
    screen.print(SPITE, style="red", highlight=False)
    text = out.getvalue()
    assert "\x1b[31m" in text, "its own"
    assert "\x1b]" not in text
    assert not set("\x07\x9b\u202e\x00") & set(text)
    assert "[bold]" in text, "no markup"
    assert text.count("\\u001b]0;owned") == 2


def test_a_snapshot_is_visible_to_every_front_end():
    line = LogLine(1.0, "warning", f"load_cell said {SPITE[:-1]}")
    check = Check("cell", "failed", "\u202e\x7f")
    snapshot = Snapshot(
        1, "demo", "hold", "T1", 0.0, 1.0, (), (check,), (), (line,), 1, ((0.0, 1.0, 2.0),), None, ("a\x1b.h5",)
    )
    frame = encode(snapshot)
    shown = decode(HEADER.unpack_from(frame)[1], frame[HEADER.size :])
    assert isinstance(shown, Snapshot)
    assert shown.log[0].text.isprintable()
    assert shown.log[0].text.startswith("load_cell said \\u001b]0;owned")
    assert shown.checks[0].text == "\\u202e\\u007f"
    assert shown.files == ("a\\u001b.h5",)
    assert shown.trace == snapshot.trace


def test_what_a_device_says_is_no_markup_in_the_preflight_list():
    out = io.StringIO()
    Console(file=out, width=100).print(checks_table((Check("cell", "failed", "answered [/nothing] [link=x]y"),)))
    assert "answered [/nothing] [link=x]y" in out.getvalue()


def test_a_page_has_no_control_character():
    page = Page(SPITE[:-1], SPITE[:-1], (Section("x", (Sentences((SPITE[:-1],)),)),))
    assert html(page).replace("\n", "").replace("\t", "").isprintable()
