"""`rig console --serve`: a web server on a run, which gives each browser a console process."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import click

from rig.errors import RigError
from rig.link.front_end_messages import Request
from rig.link.live_runs import Run, find_run
from rig.link.processes import alive
from rig.link.sockets import connect

MISSING = "--serve needs textual-serve, which is not installed here: pip install 'thruster-rig[serve]'"
SIGNALLED = 128


def serve_console(folder: Path | None, host: str, port: int, colors: str, *, report: bool) -> int:
    """Serve the run in `folder`, or the only one, until it is over; 0, or 128 and the signal that ended the server.

    Raises RigError: the extra is not installed, there is no such run, or it can't be listened at that address.
    """
    if find_spec("textual_serve") is None:
        raise RigError(MISSING)
    from rig.serve.address import listen, warning
    from rig.serve.server import Served, serve

    run = find_run(folder)
    with listen(host, port) as listener:
        address, bound = listener.getsockname()[:2]
        if means := warning(host, address, bound):
            click.echo(f"rig: {means}", err=True)
        keyboard = sys.stdin.fileno() if sys.stdin.isatty() else None
        click.echo(_welcome(run, more=keyboard is not None))
        served = Served(_seat(run, colors, report=report), f"rig console {run.campaign}", lambda: _ask_to_stop(run),
                        lambda: alive(run.pid, run.started), click.echo)  # fmt: skip
        number = serve(served, listener, keyboard)
    if number:
        return SIGNALLED + number
    click.echo(f"the run in {run.folder} is over, and no browser looks on any more")
    return 0


def _welcome(run: Run, *, more: bool) -> str:
    another = " Enter prints another one." if more else ""
    return (
        f"The console of {run.folder} in a browser: it looks on until l is pressed there.\n"
        f"Ctrl+C here stops the motor. The link is good for one browser.{another}"
    )


def _seat(run: Run, colors: str, *, report: bool) -> list[str]:
    """Starts one browser's console."""
    words = [sys.executable, "-m", "rig.serve.seat", run.folder, colors]
    return words if report else [*words, "no-report"]


def _ask_to_stop(run: Run) -> None:
    """0 V now; does not wait for the rest. Raises LinkError when nobody is there to hear it."""
    peer = connect(Path(run.socket), "the controller")
    try:
        peer.send(Request("stop", "rig console --serve"))
    finally:
        peer.close()
