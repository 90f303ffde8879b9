"""`rig console`: a front end on a run that is going on, in this terminal or in browsers."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

import click

from rig.errors import RigError
from rig.link.live_runs import find_run
from rig.operate.front_ends import console_screen, progress_bar
from rig.operate.last_page import no_report_option
from rig.operate.run import follow
from rig.screen_options import look_of, screen_options

HOST: Final = "127.0.0.1"
PORT: Final = 8000


@click.command("console")
@click.argument("folder", required=False, type=click.Path(path_type=Path))
@click.option("--headless", is_flag=True, help="Follow with a progress bar instead.")
@click.option(
    "--serve",
    is_flag=True,
    help="Show it in a browser instead: prints a link that is good for one. Needs the extra thruster-rig[serve].",
)
@click.option(
    "--host", help=f"With --serve: the address to listen at (default: {HOST}, which only this machine reaches)."
)
@click.option(
    "--port", type=click.IntRange(0, 65535), help=f"With --serve: the port (default: {PORT}; 0: any free one)."
)
@screen_options
@no_report_option
def console_command(
    folder: Path | None,
    headless: bool,
    serve: bool,
    host: str | None,
    port: int | None,
    colors: str,
    bell: bool,
    report: bool,
) -> int:
    """Attach to a run that is going on: the one in FOLDER, or the only one on this machine."""
    if serve and headless:
        raise RigError("--serve shows the console, --headless a progress bar: give one of them")
    if not serve and (host is not None or port is not None):
        raise RigError(f"{'--port' if host is None else '--host'} is where --serve listens: give --serve too")
    if serve:
        from rig.serve.serving import serve_console

        at = (HOST if host is None else host, PORT if port is None else port)
        return serve_console(folder, *at, "full" if colors == "auto" else colors, report=report)
    if not headless and not sys.stdout.isatty():
        raise RigError("rig console needs a terminal; use --headless or --serve where there is none")
    look = look_of(colors, bell)
    front = progress_bar(start=False, look=look) if headless else console_screen(look)
    return follow(find_run(folder), front, report=report)
