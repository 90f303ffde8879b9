"""The command line itself: its groups, what it suggests, and what the Tab key offers."""

from __future__ import annotations

import os
import subprocess
import sys

import click
import pytest

from rig.cli import COMMANDS, COMPLETING, GROUPS, main, rig

HEAVY = ("numpy", "scipy", "h5py", "textual", "can", "pydantic")
CALL = "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); from rig.cli import main; "


def called(code: str, **environment: str) -> tuple[str, set[str]]:
    """What is printed, and the modules that were imported by then."""
    words = [sys.executable, "-c", CALL + code]
    done = subprocess.run(words, capture_output=True, text=True, env={**os.environ, **environment})
    return done.stdout, set(done.stderr.split())


def completed(words: str, position: int) -> tuple[list[str], set[str]]:
    """What a shell is offered for the word at `position`."""
    asked = {COMPLETING: "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(position)}
    said, modules = called("main()", **asked)
    return [line.removeprefix("plain,") for line in said.splitlines() if line], modules


def test_help_is_grouped_by_what_a_person_wants_to_do() -> None:
    said, modules = called("main(['--help'])")
    assert not modules & set(HEAVY)
    places = [said.index(f"\n{heading}:\n") for heading in GROUPS.values()]
    assert places == sorted(places)
    sections = dict(zip(GROUPS, [said[a:b] for a, b in zip(places, [*places[1:], None], strict=True)], strict=True))
    for name, entry in COMMANDS.items():
        assert f"\n  {name} " in sections[entry.group]


def test_a_misspelt_command_is_answered_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["chekc", "campaign.toml"]) == 2
    assert "there is no command 'chekc'; did you mean check?" in capsys.readouterr().err
    assert main(["qqq"]) == 2
    assert "known are init, devices, check, edit, run" in capsys.readouterr().err


def test_the_tab_key_offers_commands_without_waiting_for_them() -> None:
    offered, modules = completed("rig re", 1)
    assert offered == ["resume", "report", "replay", "recover"]
    assert not modules & set(HEAVY)


def test_the_tab_key_offers_options_and_their_values() -> None:
    assert completed("rig export --t", 2)[0] == ["--to"]
    assert completed("rig export --to m", 3)[0] == ["mat", "mcap", "mss"]


def test_the_tab_key_after_what_is_no_command_is_silent() -> None:
    assert completed("rig chekc --", 2)[0] in ([], ["--version", "--help"])


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_and_option_says_what_it_does_in_sentences(name: str) -> None:
    command = rig.get_command(click.Context(rig), name)
    assert command is not None
    assert command.help
    assert COMMANDS[name].help.endswith((".", "?"))
    for option in command.params:
        if isinstance(option, click.Option) and not option.hidden:
            said = option.help or ""
            assert said[:1].isupper() or said[:1].isdigit(), f"{name} {option.opts[0]}: {said!r}"
            assert said.endswith((".", ")", "]", "?")), f"{name} {option.opts[0]}: {said!r}"


def test_help_says_where_to_begin() -> None:
    assert "A first campaign: rig init." in called("main(['--help'])")[0]
    assert "THE PROPELLER TURNS" in called("main(['run', '-h'])")[0]


def test_help_of_the_simulated_bench_says_that_a_world_is_enough() -> None:
    words = [sys.executable, "-m", "sim_devices", "-h"]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert "python -m sim_devices WORLD.toml" in said
    assert "..." not in said.partition("Commands:")[2]
