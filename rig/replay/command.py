"""`rig replay FILE`."""

from __future__ import annotations

from pathlib import Path

import click

from rig.errors import ConfigError


@click.command("replay")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--speed",
    type=click.FloatRange(0.0, 1000.0),
    help="Times as fast as it was; 0 is as fast as it goes (default: 0 for a capture).",
)
@click.option(
    "--rows",
    type=click.Path(path_type=Path),
    help="Write the rows of a capture, exact to the bit (for a test).",
)
def replay_command(file: Path, speed: float | None, rows: Path | None) -> int:
    """Play a capture FILE through the driver of its device, in the time of its bytes: nothing is opened.

    Exit status 0; 2 for what cannot be played (one sentence why).
    """
    from rig.captures.playing import exact
    from rig.replay.captured import replayed, told

    played = replayed(file, speed or 0.0)
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
