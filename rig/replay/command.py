"""`rig replay FILE`: a capture through its driver, or a recording into the console."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

import click

from rig.errors import ConfigError
from rig.screen_options import screen_options

RECORDING: Final = (".h5", ".hdf5")


@click.command("replay")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--speed",
    type=click.FloatRange(0.0, 1000.0),
    help="Times as fast as it was (default: 1 for a recording; for a capture 0, as fast as it goes).",
)
@click.option("--rows", type=click.Path(path_type=Path), help="Write the rows of a capture, exact to the bit.")
@click.option("--headless", is_flag=True, help="A recording as lines instead of the console.")
@screen_options
def replay_command(file: Path, speed: float | None, rows: Path | None, headless: bool, colors: str, bell: bool) -> int:
    """Play FILE again: a recording (.h5) into the console as if it ran; a capture through the driver of its device.

    Nothing is opened and no motor is driven. In the console the stop key goes to the end.

    Exit status 0; 2 for what cannot be played (one sentence why).
    """
    if file.suffix in RECORDING:
        if rows is not None:
            raise ConfigError(f"--rows is for captures; rig export writes the rows of {file}")
        return _recording(file, 1.0 if speed is None else speed, colors, bell, headless=headless)
    return _capture(file, speed or 0.0, rows)


def _recording(file: Path, speed: float, colors: str, bell: bool, *, headless: bool) -> int:
    from rig.hdf5.load import load  # h5py, and Textual below: only for a recording
    from rig.operate.front_ends import console_screen, progress_bar
    from rig.replay.player import playing
    from rig.replay.recorded import Frames
    from rig.screen_options import look_of

    if speed == 0.0:
        raise ConfigError("--speed 0 is for captures: a console is shown at a speed above 0, such as 10")
    if not headless and not sys.stdout.isatty():
        raise ConfigError("rig replay of a recording opens the console, which needs a terminal; use --headless there")
    look = look_of(colors, bell)
    front = progress_bar(start=False, look=look) if headless else console_screen(look, looks_on=True)
    with playing(Frames(load(file), str(file)), speed) as peer:
        front(peer, f"rig console {file.parent}")
    return 0


def _capture(file: Path, speed: float, rows: Path | None) -> int:
    from rig.captures.playing import exact
    from rig.replay.captured import replayed, told

    played = replayed(file, speed)
    for line in told(played):
        click.echo(line)
    if rows is not None:
        try:
            with rows.open("x", encoding="ascii") as out:
                out.write(exact(played.rows))
        except FileExistsError:
            raise ConfigError(f"{rows} exists and is not overwritten: give --rows another name") from None
        except OSError as error:
            raise ConfigError(f"{rows} can't be written: {error.strerror}") from error
        click.echo(f"{rows}: {len(played.rows)} rows")
    return 0
