"""After a campaign: its page, written by a process of its own, once nothing turns and nothing is recorded any more."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import click

from rig.link.front_end_messages import Snapshot

LONGEST = 180.0
"""s that the page may take; then it is left, with the command that makes it."""

no_report_option = click.option(
    "--report/--no-report",
    default=True,
    show_default=True,
    help="At the end, write report.html into the campaign's folder.",
)


def write_page(last: Snapshot, folder: Path, *, gone: bool) -> None:
    """Tells where the page is, or why there is none. `gone`: the controller has ended. Raises nothing."""
    why = unsafe(last, gone=gone)
    if not why:
        click.echo("writing the report; Ctrl+C leaves it out")
        why = _written(folder)
    if why:
        click.echo(f"rig: no report: {why}; `rig report {folder}` writes it", err=True)
    else:
        click.echo(f"report: {folder / 'report.html'}")


def unsafe(last: Snapshot, *, gone: bool) -> str:
    """Why the machine is still the motor's; empty when it is not."""
    if not gone:
        return "the controller is still there"
    if last.state != "done":
        return "the controller ended without telling that the propeller rests"
    if last.stop_confirmed is False:
        return "the propeller was not seen to stop"
    return ""


def _written(folder: Path) -> str:
    """Why it was not; empty when it was."""
    words = [sys.executable, "-m", "rig.campaign_report.at_end", str(folder)]
    try:
        made = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired:
        return f"it takes longer than {LONGEST:g} s"
    except KeyboardInterrupt:
        return "it was ended by Ctrl+C"
    except OSError as error:
        return f"its process can't be started ({error.strerror})"
    if made.returncode == 0:
        return ""
    said = made.stderr.decode(errors="replace").strip().splitlines()
    return said[-1] if said else f"its process ended with status {made.returncode}"
