"""`rig init [FOLDER]`: the files of a first campaign, which come with the package, and what to type next.

`bench.toml` and `world.toml` are those of `benches/simulated`: in the repository links to them, in a wheel the files.
"""

from __future__ import annotations

import shlex
import shutil
import sys
from importlib.resources import files
from pathlib import Path
from typing import Final

import click

from rig.errors import ConfigError

NAMES: Final = ("bench.toml", "world.toml", "campaign.toml")


@click.command("init")
@click.argument("folder", type=click.Path(path_type=Path), default=".")
def init_command(folder: Path) -> None:
    """Make FOLDER (default: this one) with a bench, its simulated world and a campaign, all to be edited.

    Nothing is overwritten.
    """
    begin(folder)
    click.echo(f"{folder}: {', '.join(NAMES)}\nnext:")
    for command, purpose in next_commands(folder):
        click.echo(f"  {command}    # {purpose}")


def begin(folder: Path) -> None:
    """Write the files. Raises ConfigError, and then none is written, if one of them is there."""
    there = [name for name in NAMES if (folder / name).exists()]
    if there:
        raise ConfigError(f"{folder / there[0]} exists; rig init overwrites nothing: give another folder")
    source = files("rig.first_steps") / "files"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in NAMES:
            with (folder / name).open("x", encoding="utf-8") as file:
                file.write((source / name).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{folder}: the files can't be written there: {error.strerror}") from error


def next_commands(folder: Path) -> tuple[tuple[str, str], ...]:
    """The three commands that lead to a first recording, each with what it does."""
    world, campaign = (_word(folder / name) for name in ("world.toml", "campaign.toml"))
    return (
        (f"{_python()} -m sim_devices {world} &", "a simulated bench; go on when it has printed `ready`"),
        (f"rig check {campaign}", "steps, duration, peak voltage and thrust; opens nothing"),
        (f"rig run {campaign}", "the console: F5 starts, F9 stops; with --headless it starts by itself"),
    )


def _word(path: Path) -> str:
    """A path as a shell takes it."""
    return shlex.quote(str(path))


def _python() -> str:
    """The word for this interpreter: its path, unless `python` is it."""
    found = shutil.which("python")
    same = found is not None and Path(found).parent == Path(sys.executable).parent
    return "python" if same else _word(Path(sys.executable))
