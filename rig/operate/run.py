"""rig run and stop: start a controller process, attach a front end, and say what came of it."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rig.errors import LinkError, RigError
from rig.link.front_end_messages import Request, Snapshot
from rig.link.live_runs import Run, find_run, live_runs
from rig.link.sockets import connect
from rig.operate.front_ends import AGAIN, Console, FrontEnd, forget_keys, progress_bar
from rig.operate.headless import Headless, check_alive
from rig.operate.last_page import no_report_option, write_page
from rig.screen_options import look_of, screen_options

if TYPE_CHECKING:
    from rig.campaign.config import CampaignConfig

START_TIMEOUT = 120.0
"""s for a controller process to open its socket, imports included: half a minute on a machine that is busy."""
START_NEWS = 5.0
"""s after which, and then again and again, it is said that it still starts."""
END_TIMEOUT = 15.0
"""s for a controller process to close its files and end after `done`."""
STARTS = "the controller process is started at"
"""Begins the first line of its log, so that the log of one that never comes up is not empty."""
SOCKET_NAME = "controller.sock"
LOG_NAME = "controller.log"


@click.command("run")
@click.argument("campaign", type=click.Path(path_type=Path))
@click.option(
    "--headless", is_flag=True, help="A progress bar instead of the console; starts when the preflight passed."
)
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    help="Make the run's own folder in this one (default: `output` of CAMPAIGN).",
)
@click.option("--thruster", "thrusters", multiple=True, help="Only this thruster of the campaign; may be repeated.")
@screen_options
@no_report_option
def run_command(
    campaign: Path,
    headless: bool,
    output: Path | None,
    thrusters: tuple[str, ...],
    colors: str,
    bell: bool,
    report: bool,
) -> int:
    """Run CAMPAIGN on its bench: console, recording, table of the fits.

    THE PROPELLER TURNS once F5 is pressed in the console, or by itself with --headless; F9 or Ctrl+C stops it.

    Exit status 0 completed or left while it goes on, 1 aborted or tripped, 2 nothing was started (one sentence why).
    """
    config = require_runnable(campaign, thrusters, headless=headless)
    if not headless and not sys.stdout.isatty():
        raise RigError("rig run opens the console, which needs a terminal; use --headless where there is none")
    look = look_of(colors, bell)
    folder = campaign_folder(output or config.output, config.name)
    if headless:
        return run_campaign(campaign, folder, thrusters, progress_bar(start=True, look=look), report=report)
    console = Console(look)
    return then_next(run_campaign(campaign, folder, thrusters, console.front(), report=report), console, report=report)


def require_runnable(campaign: Path, thrusters: tuple[str, ...], *, headless: bool) -> CampaignConfig:
    """The campaign, checked as `rig check` does, and that somebody can mount the thrusters. Raises RigError."""
    from rig.operate.check import check_campaign  # a second of scipy that `rig stop` does not need

    config = check_campaign(campaign).campaign
    unknown = [name for name in thrusters if name not in config.thrusters]
    if unknown:
        raise RigError(
            f"{campaign}: --thruster {unknown[0]} is not in the campaign; it has {', '.join(config.thrusters)}"
        )
    require_mountable(config, thrusters or config.thrusters, headless=headless)
    return config


def require_mountable(config: CampaignConfig, thrusters: Sequence[str], *, headless: bool) -> None:
    """Raises RigError where nobody could put the next thruster on the bench."""
    if headless and not config.bench.mount.command and len(thrusters) > 1 and not sys.stdin.isatty():
        raise RigError(
            f"{config.path}: {len(thrusters)} thrusters, and nobody at this terminal to put the next one on the bench; "
            "give the bench a [mount] command or run one thruster at a time with --thruster"
        )


def run_campaign(
    campaign: Path, folder: Path, thrusters: tuple[str, ...], front: FrontEnd, *, report: bool = False
) -> int:
    """Start a controller in `folder` and attend it to its end; the exit status. `report`: with the campaign's page."""
    run, process = start_controller(campaign, folder, thrusters)
    try:
        return follow(run, front, report=report)
    finally:
        process.poll()  # one that has ended leaves nothing behind: more runs may follow in this process


@click.command("stop")
@click.argument("folder", required=False, type=click.Path(path_type=Path))
def stop_command(folder: Path | None) -> int:
    """Stop a run that is going on, the one in FOLDER or the only one on this machine: zero volts now, close the
    recording.

    Exit status 0 stopped, 1 when no measurement confirms it (cut the power), 2 when there is no run.
    """
    peer = connect(Path(find_run(folder).socket), "the controller")
    peer.send(Request("stop", "rig stop"))
    last = Headless(peer).follow(start=False)
    peer.close()
    if last is None or last.stop_confirmed is False:
        click.echo("rig: STOP NOT CONFIRMED by a measurement: look at the propeller, cut the supply", err=True)
        return 1
    click.echo(f"stopped; {last.cause or 'the run had already ended'}")
    return 0


def campaign_folder(output: Path, name: str) -> Path:
    """A new folder for one campaign: `<output>/<name>-<local date and time>`."""
    slug = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "campaign"
    folder = output / f"{slug}-{datetime.now().astimezone():%Y%m%d-%H%M%S}"
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise RigError(f"{folder}: the campaign's folder can't be made: {error.strerror}") from error
    return folder.resolve()


def start_controller(campaign: Path, folder: Path, thrusters: Sequence[str]) -> tuple[Run, subprocess.Popen[bytes]]:
    """Start the controller process in a session of its own; returns once it listens. It outlives us if it may."""
    with (folder / LOG_NAME).open("ab") as log:
        log.write(f"{STARTS} {datetime.now().astimezone():%Y-%m-%d %H:%M:%S}\n".encode())
        log.flush()
        process = subprocess.Popen(
            [sys.executable, "-m", "rig.stages.controller", str(campaign.resolve()), str(folder), *thrusters],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
    try:
        return listening(process, folder), process
    except BaseException:  # Ctrl+C while it starts: nobody would ever attach to it
        process.terminate()
        raise


def listening(process: subprocess.Popen[bytes], folder: Path, news: float = START_NEWS) -> Run:
    """The run, once its controller has announced it; a machine that is slow is told about every `news` s."""
    begun = time.monotonic()
    told = 0
    while (taken := time.monotonic() - begun) < START_TIMEOUT:
        if taken > (told + 1) * news:
            told += 1
            click.echo(
                f"rig: the controller (process {process.pid}) still starts, {taken:.0f} s so far: the machine is slow "
                f"or busy; it is waited for {START_TIMEOUT:g} s, Ctrl+C ends it",
                err=True,
            )
        run = next((run for run in live_runs() if run.pid == process.pid), None)
        if run is not None:
            return run
        try:
            process.wait(0.05)
        except subprocess.TimeoutExpired:
            continue
        raise LinkError(f"the controller ended at once: {_last_words(folder)}")
    raise LinkError(
        f"the controller did not open its socket within {START_TIMEOUT:g} s and was ended; its last words: "
        f"{_last_words(folder)}"
    )


def follow(run: Run, front: FrontEnd, *, report: bool = False) -> int:
    """Attach a front end until it ends or detaches; then the table, where the files are, and the exit status.

    `report`: then also the campaign's page, which changes nothing of that status.
    """
    peer = connect(Path(run.socket), "the controller")
    again = f"{AGAIN}{run.folder}"
    try:
        left = front(peer, again)
    finally:
        peer.close()
    if left.signal:
        return 128 + left.signal
    if left.detached:
        click.echo(f"the run goes on in {run.folder}; attach again with: {again}")
        return 0
    gone = _await_end(run.pid)
    last = check_alive(left.last)
    status = _conclude(last, Path(run.folder))
    if report:
        write_page(last, Path(run.folder), gone=gone)
    return status


def then_next(status: int, console: Console, *, report: bool) -> int:
    """After a campaign, the sweep that its diagnosis proposed and the operator asked for, and so on; the last status.

    Each is a campaign like any other: checked, with a controller of its own, and a preflight that waits for F5.
    """
    while (following := console.asked) is not None:
        console.asked = None
        click.echo(f"next: {following.campaign}")
        config = require_runnable(following.campaign, (), headless=False)
        forget_keys()
        folder = campaign_folder(following.campaign.parent.parent, config.name)
        status = run_campaign(following.campaign, folder, (), console.front(following.recordings), report=report)
        for other in following.others if console.asked is None else ():
            click.echo(f"of the same sweep, at another flow speed: rig run {other}")
    return status


def _conclude(last: Snapshot, folder: Path) -> int:
    from rig.operate.summary import print_summary  # scipy and h5py: only now, and not for `rig stop`

    print_summary([Path(file) for file in last.files], folder)
    outcome = last.outcome if last.state == "done" else "aborted"
    if outcome == "completed":
        return 0
    cause = last.cause or f"the controller is gone; see {folder / LOG_NAME}"
    click.echo(f"rig: the campaign ended {outcome}: {cause}", err=True)
    if last.stop_confirmed is False:
        click.echo("rig: STOP NOT CONFIRMED by a measurement: look at the propeller, cut the supply", err=True)
    if last.files:
        click.echo(f"to go on at the first step that is not measured: rig resume {shlex.quote(str(folder))}", err=True)
    return 1


def _await_end(pid: int) -> bool:
    """Whether the process has ended in time."""
    deadline = time.monotonic() + END_TIMEOUT
    while there := _exists(pid):
        if time.monotonic() >= deadline:
            break
        time.sleep(0.05)
    return not there


def _exists(pid: int) -> bool:
    """Is the process there and not a zombie of ours?"""
    try:
        done, _ = os.waitpid(pid, os.WNOHANG)
    except ChildProcessError:
        done = 0
    return not done and any(run.pid == pid for run in live_runs())


def _last_words(folder: Path) -> str:
    lines = (folder / LOG_NAME).read_text(encoding="utf-8", errors="replace").strip().splitlines()
    return lines[-1].removeprefix("rig: ") if lines and not lines[-1].startswith(STARTS) else "it said nothing"
