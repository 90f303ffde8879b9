"""`rig jog BENCH VOLTS`: hold a small voltage by hand, under the full guard, and say which way it pushes."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from pathlib import Path

import click

from rig.campaign.config import BenchConfig
from rig.campaign.loading import load_bench
from rig.errors import ConfigError, RigError
from rig.jog.one_hold import LONGEST, NAME, SHARE, require_small, thruster_of, write
from rig.link.front_end_messages import Snapshot
from rig.link.sockets import connect
from rig.operate.check import check_campaign
from rig.operate.front_ends import FrontEnd, Left, progress_bar
from rig.operate.headless import check_alive
from rig.operate.run import END_TIMEOUT, LOG_NAME, campaign_folder, start_controller


@click.command("jog", context_settings={"ignore_unknown_options": True})
@click.argument("bench", type=click.Path(path_type=Path))
@click.argument("volts", type=float)
@click.option(
    "--for",
    "seconds",
    type=click.FloatRange(1.5, LONGEST),
    help="Hold so many seconds, without a key; it starts by itself when the preflight has passed.",
)
@click.option("--limit", type=float, help=f"Most V commanded by hand (default: {SHARE:.0%} of bench.max_voltage).")
@click.option(
    "--without-proof",
    "unproved",
    metavar="REASON",
    help="Leave the proof of the watchdog out, for this reason (a motor without a rotation rate).",
)
@click.option("--thruster", default="", help="The thruster on the bench; needed where the bench mounts by a command.")
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    default=Path("recordings"),
    show_default=True,
    help="Make the run's own folder in this one.",
)
def jog_command(
    bench: Path,
    volts: float,
    seconds: float | None,
    limit: float | None,
    unproved: str | None,
    thruster: str,
    output: Path,
) -> int:
    """Hold VOLTS on BENCH by hand, and say which way force and rotation go.

    THE PROPELLER TURNS while SPACE is held (first at the voltage at which the watchdog is proved); 0 V when it is let
    go, when the terminal is lost, on any trip. q ends. With --for it turns by itself, for so many seconds.

    Exit status 0 held and at rest, 1 it ended otherwise, 2 nothing was started (one sentence why).
    """
    config = load_bench(bench)
    require_small(config, volts, limit)
    name = thruster_of(config, thruster)
    if seconds is None and not sys.stdin.isatty():
        raise ConfigError("rig jog holds while a key is held, which needs a terminal; --for S holds without one")
    folder = campaign_folder(output, NAME)
    campaign = write(folder, config, name, volts, LONGEST if seconds is None else seconds, unproved)
    check_campaign(campaign)
    click.echo(_announced(config, volts, seconds, proved=unproved is None))
    front = _by_hand if seconds is None else progress_bar(start=True)
    last = _attend(campaign, folder, front)
    return _conclude(last, volts, config, by_hand=seconds is None)


def _announced(bench: BenchConfig, volts: float, seconds: float | None, *, proved: bool) -> str:
    how = "while SPACE is held" if seconds is None else f"for {seconds:g} s"
    proof = f"; before that the motor's own watchdog is proved at {bench.proof_voltage:g} V (bench.proof_voltage)"
    return f"{volts:+g} V on {bench.name} {how}{proof if proved else '; its watchdog is NOT proved before'}"


def _by_hand(peer: object, _again: str) -> Left:
    from rig.jog.hold_to_run import HoldToRun
    from rig.link.sockets import Peer

    assert isinstance(peer, Peer)
    return Left(HoldToRun(peer, sys.stdin.fileno()).follow())


def _attend(campaign: Path, folder: Path, front: FrontEnd) -> Snapshot:
    run, process = start_controller(campaign, folder, ())
    try:
        peer = connect(Path(run.socket), "the controller")
        try:
            left = front(peer, "")
        finally:
            peer.close()
    finally:
        with contextlib.suppress(subprocess.TimeoutExpired):  # told by the snapshot, which then is no last one
            process.wait(END_TIMEOUT)
    return check_alive(left.last)


def _conclude(last: Snapshot, volts: float, bench: BenchConfig, *, by_hand: bool) -> int:
    """The direction from the recording, also of a run that was stopped or tripped; how it ended."""
    from rig.hdf5.load import load  # h5py and numpy: only now
    from rig.jog.direction import LEAST, direction_of, sentences

    held = 0.0
    for file in last.files[-1:]:
        try:
            found = direction_of(load(file), volts)
        except RigError as error:
            click.echo(f"rig: {error}", err=True)
            continue
        held = found.held
        click.echo("\n".join(sentences(found, bench.force)))
        click.echo(f"recorded in {file}")
    if last.outcome == "tripped" or (last.outcome != "completed" and not (by_hand and held >= LEAST)):
        cause = last.cause or f"the controller is gone; see {LOG_NAME} in the folder of the run"
        click.echo(f"rig: the jog ended {last.outcome or 'aborted'}: {cause}", err=True)
    if last.stop_confirmed is False:
        click.echo("rig: STOP NOT CONFIRMED by a measurement: look at the propeller, cut the supply", err=True)
        return 1
    return 0 if last.outcome == "completed" or (by_hand and last.outcome == "aborted" and held >= LEAST) else 1
