"""`python -m rig.serve.seat FOLDER COLORS [no-report]`: one browser's console, a child of the web server.

Its standard output is the pipe that its screen goes through; whatever else is said goes to standard error, and the
server shows it on its own terminal.
"""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from pathlib import Path

import click

from rig.errors import RigError
from rig.link.live_runs import find_run
from rig.operate.front_ends import console_screen
from rig.operate.run import follow
from rig.screen_options import Look, colors_of
from rig.visible_text import visible_output


def sit(folder: Path, colors: str, *, report: bool) -> int:
    """The exit status of `rig console`."""
    try:
        front = console_screen(Look(colors_of(colors, {}), bell=False), browser=True)
        return follow(find_run(folder), front, report=report)
    except RigError as error:
        click.echo(f"rig: {error}", err=True)
        return 2


if __name__ == "__main__":
    with redirect_stdout(sys.stderr), visible_output():
        status = sit(Path(sys.argv[1]), sys.argv[2], report=sys.argv[3:] != ["no-report"])
    sys.exit(status)
