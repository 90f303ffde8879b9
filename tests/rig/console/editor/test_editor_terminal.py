"""`rig edit` on a real terminal: keys that come in one write are all typed and saved, and it ends in order."""

import pytest

from rig.cli import main
from tests.rig.console.editor.editor_desk import CAMPAIGN, WRONG
from tests.rig.console.terminal import on_terminal

CODE = "import sys; from rig.cli import main; sys.exit(main(['edit', sys.argv[1], '--colors', 'full']))"
UP, DOWN, CTRL_S, CTRL_U, CTRL_Q, CTRL_Z = b"\x1b[A", b"\x1b[B", b"\x13", b"\x15", b"\x11", b"\x1a"


@pytest.fixture
def path(tmp_path):
    (tmp_path / "bench.toml").write_text((WRONG / "right_bench.toml").read_text(encoding="utf-8"), encoding="utf-8")
    path = tmp_path / "campaign.toml"
    path.write_text(CAMPAIGN, encoding="utf-8")
    return path


def typed(path, *bursts: bytes) -> tuple[str, int]:
    """The file after `bursts`, each one write, and the exit status."""
    with on_terminal(CODE, str(path)) as (process, terminal):
        terminal.until(b"holds")
        for burst in bursts:
            terminal.press(burst)
    return path.read_text(encoding="utf-8"), process.returncode


@pytest.mark.parametrize(
    "bursts",
    [
        (DOWN, CTRL_U, b"12.5", CTRL_S, CTRL_Q),
        (DOWN + CTRL_U, b"12.5", CTRL_S + CTRL_Q),
        (DOWN + CTRL_U + b"12.5" + CTRL_S + CTRL_Q,),
        (DOWN + b"\x1b[200~12.5\x1b[201~" + CTRL_S + CTRL_Q,),
        (DOWN + CTRL_U + b"99" + CTRL_U + b"12.5\t\t" + UP + UP + CTRL_S + CTRL_Q,),
        (DOWN + b"3" + DOWN + b"9" + CTRL_Z + CTRL_Z + UP + CTRL_U + b"12.5" + CTRL_S + CTRL_Q,),
    ],
    ids=["one by one", "emptied first", "all at once", "pasted", "over fields", "with undo"],
)
def test_what_is_typed_in_bursts_is_saved(path, bursts):
    text, status = typed(path, *bursts)
    assert text == CAMPAIGN.replace("16.0", "12.5")
    assert status == 0


def test_seven_fields_in_one_write(path):
    text, status = typed(path, DOWN + b"8.25\t8\t2.25\t \t2\t4\t5.25\t" + CTRL_S + CTRL_Q)
    assert status == 0
    for line in ("max = 8.25 ", "levels = 8 ", "min = 2.25", 'sides = "forward"', "repeats = 2", "zero_every = 4"):
        assert line in text
    assert "slew = 5.25                # V/s" in text


def test_what_is_not_there_is_one_sentence_and_no_screen(tmp_path, capsys):
    assert main(["edit", str(tmp_path / "no.toml")]) == 2
    assert "there is no such campaign file; give the path of one, or make one: rig init" in capsys.readouterr().err
    broken = tmp_path / "broken.toml"
    broken.write_text("[plan\n", encoding="utf-8")
    assert main(["edit", str(broken)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert main(["check", str(broken)]) == 2
    assert said == capsys.readouterr().err
