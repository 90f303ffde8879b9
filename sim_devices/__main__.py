"""`python -m sim_devices WORLD.toml` starts a bench; `python -m sim_devices mount CONTROL THRUSTER` works its crane.

What a command needs is imported when the command is called: a bench, and a thruster on it, shall not wait for scipy.
"""

from __future__ import annotations

import json
import os
import select
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import TYPE_CHECKING, NoReturn, TextIO

import click

from sim_devices.bench.process import running
from sim_devices.bench.truth_table import SUSPICIOUS, compare, table
from sim_devices.tables import WorldError
from sim_devices.wires.ports import ask

if TYPE_CHECKING:
    from sim_devices.bench.bench import Bench

FILE = click.Path(path_type=Path)
HELP = ("-h", "--help")
FITS = "fits.json"
"""What `rig run` leaves in a campaign's folder."""


class BenchByDefault(click.Group):
    """A first word that is no command is the world file of `run`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in self.commands and args[0] not in HELP:
            args = ["run", *args]
        return super().parse_args(ctx, args)


@click.group(cls=BenchByDefault, context_settings={"help_option_names": list(HELP)})
def main() -> None:
    """A simulated thruster bench on the ports of this machine.

    `python -m sim_devices WORLD.toml` starts it: a first word that is no command is the world of `run`.
    """


@main.command(short_help="Start the bench of WORLD.toml; it lives until Ctrl+C.")
@click.argument("world", type=FILE)
@click.option("--links", type=FILE, help="Folder for the links to the ports (default: from the world file).")
@click.option("--truth", type=FILE, help="Truth log, JSON lines (default: from the world file).")
@click.option("--seed", type=click.IntRange(min=0), help="Seed of all noise (default: from the world file).")
@click.option("--campaign", type=FILE, help="Run this campaign on the bench with `rig run`, compare its fits, and end.")
@click.option("--output", type=FILE, default=Path("recordings"), help="Where --campaign records (default: recordings).")
@click.option("--until-eof", is_flag=True, help="End when standard input ends too: with the process that holds it.")
def run(
    world: Path,
    links: Path | None,
    truth: Path | None,
    seed: int | None,
    campaign: Path | None,
    output: Path,
    *,
    until_eof: bool,
) -> None:
    """Start the bench of WORLD (TOML), print its ports and `ready`, live until SIGTERM or Ctrl+C."""
    from sim_devices.bench.bench import start

    if campaign is not None:
        raise SystemExit(calibrate(world, links, seed, campaign, output))
    stop = stop_requests(until_eof=until_eof)
    try:
        bench = start(world, links, truth, seed)
    except WorldError as error:
        fail(str(error))
    live(bench, stop)


def calibrate(world: Path, links: Path | None, seed: int | None, campaign: Path, output: Path) -> int:
    """The bench in a process of its own, `rig run` on it, then each fit beside the truth, and what `rig diagnose` says
    that the model leaves out of each recording. 0 when all fits agree.

    The console opens where there is a terminal, the progress bar elsewhere.
    """
    from rig.cli import main as rig
    from sim_devices.bench.settings import load

    before = set(output.glob(f"*/{FITS}"))
    words = ["run", str(campaign), "--output", str(output), *([] if sys.stdout.isatty() else ["--headless"])]
    try:
        folder = links or load(world).links
        with running(world, folder, seed) as bench:
            status = rig(words)
            header = bench.truth("header")[0]
    except (WorldError, RuntimeError) as error:
        fail(str(error))
    made = sorted(set(output.glob(f"*/{FITS}")) - before)
    constants = {thruster: C * header["command_gain"] ** 2 for thruster, C in header["C"].items()}  # of V commanded
    rows = [row for fits in made for row in compare(fits, constants)]
    click.echo(table(rows))
    for recording in (each for fits in made for each in sorted(fits.parent.glob("*.h5"))):
        click.echo()
        status = rig(["diagnose", str(recording)]) or status
    return status or int(not rows or any(abs(row.z) > SUSPICIOUS for row in rows))


@main.command(short_help="Simulate a vehicle: its whole campaign, as recordings.")
@click.argument("settings", type=FILE)
@click.argument("out", type=FILE)
@click.option("--seed", type=click.IntRange(min=0), help="Seed of all noise (default: from the file).")
def vehicle(settings: Path, out: Path, seed: int | None) -> None:
    """Simulate the vehicle of SETTINGS (TOML): recordings of tunnel, trials and trials to check on, into folder OUT."""
    import numpy as np

    from rig.cli import main as rig
    from sim_devices.vehicle.documents import held_out, recorded, trials, truth, tunnel
    from sim_devices.vehicle.settings import load as load_vehicle

    try:
        described = load_vehicle(settings)
    except WorldError as error:
        fail(str(error))
    if out.exists():
        fail(f"{out} exists; recordings are never overwritten: give a new folder")
    hull, scalars = described.hull, described.scalars
    rng = np.random.default_rng(scalars.seed if seed is None else seed)
    groups = {
        "tunnel": tunnel(hull, scalars, rng),
        "trials": recorded(hull, trials(), rng),
        "check": recorded(hull, held_out(), rng),
    }
    status = 0
    with TemporaryDirectory() as temporary:
        for group, documents in groups.items():
            (out / group).mkdir(parents=True)
            for name, document in documents.items():
                log = Path(temporary) / f"{name}.json"
                log.write_text(json.dumps(document), encoding="utf-8")
                status = status or rig(["import", str(log), "--output", str(out / group / f"{name}.h5")])
    (out / "truth.json").write_text(json.dumps(truth(hull), indent=1) + "\n", encoding="utf-8")
    raise SystemExit(status)


@main.command("concealable", short_help="What `conceal` can be asked for, as JSON.")
def concealable() -> None:
    """What `conceal` can be asked for, as JSON: effects, their forms, lies about channels, kinds of noise, benches."""
    from sim_devices.concealed.sealing.on_disc import KINDS
    from sim_devices.recorded.on_disc import KINDS as RECORDED_KINDS

    click.echo(json.dumps({**KINDS, **RECORDED_KINDS}, indent=1))


@main.command("conceal", short_help="Recordings with concealed effects, the truth apart.")
@click.argument("spec", type=click.File(encoding="utf-8"))
@click.argument("out", type=FILE)
def conceal_cases(spec: TextIO, out: Path) -> None:
    """Recordings in which effects are concealed, and apart from them the sealed truth, into folder OUT.

    SPEC holds one JSON object a line, - is standard input; the token of each is printed when its case is complete. A
    case with a `bench` is recorded on it by the rig's own control loop, drivers and file, in virtual time.
    """
    from rig.cli import record_in_virtual_time
    from sim_devices.concealed.sealing.on_disc import conceal
    from sim_devices.recorded.on_disc import conceal as conceal_recorded

    try:
        for line in filter(str.strip, iter(spec.readline, "")):
            asked = json.loads(line)
            if "bench" in asked:
                conceal_recorded(asked, out, record_in_virtual_time)
            else:
                conceal(asked, out)
            click.echo(asked["token"])
    except (WorldError, ValueError) as error:
        fail(str(error))


@main.command("compare", short_help="A vehicle's truth beside `rig vehicle --json`.")
@click.argument("true", type=FILE)
@click.argument("answer", type=FILE)
def compare_vehicle(true: Path, answer: Path) -> None:
    """The vehicle in TRUE (truth.json) beside ANSWER, what `rig vehicle --json` wrote of its recordings."""
    from sim_devices.vehicle.truth_table import compare as compare_answer
    from sim_devices.vehicle.truth_table import table as vehicle_table

    try:
        click.echo(vehicle_table(compare_answer(true, answer)))
    except WorldError as error:
        fail(str(error))


def stop_requests(*, until_eof: bool) -> Callable[[], bool]:
    """From now on SIGTERM, SIGINT and SIGHUP only make the returned function say True, with `until_eof` the end of
    standard input too: no signal says that a parent was killed."""
    asked: list[int] = []

    def ask_to_stop(number: int, _frame: FrameType | None) -> None:
        asked.append(number)

    for each in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(each, ask_to_stop)
    return lambda: bool(asked) or (until_eof and _ended(sys.stdin.fileno()))


def _ended(descriptor: int) -> bool:
    """Whether nothing more comes; what came is thrown away."""
    return bool(select.select([descriptor], [], [], 0.0)[0]) and not os.read(descriptor, 4096)


def live(bench: Bench, stop: Callable[[], bool]) -> None:
    """Print the ports and `ready`, then run until `stop()`; the links are removed however it ends."""
    try:
        click.echo("\n".join([*bench.listing(), "ready"]))
        sys.stdout.flush()
        bench.run(stop)
    finally:
        bench.close()


@main.command(short_help="Put another thruster on the bench.")
@click.argument("control", type=FILE)
@click.argument("thruster")
def mount(control: Path, thruster: str) -> None:
    """Put THRUSTER on the bench behind the CONTROL port; exit status 2 when that is refused."""
    send(control, f"mount {thruster}")


@main.command(short_help="Script a fault, clear it, set the flow, ask for the status.")
@click.argument("control", type=FILE)
@click.argument("words", nargs=-1, required=True)
def tell(control: Path, words: tuple[str, ...]) -> None:
    """Send any command to the CONTROL port: fault, clear, flow, status."""
    send(control, " ".join(words))


def send(control: Path, line: str) -> None:
    """Print the bench's answer; an error ends with exit status 2."""
    try:
        answer = ask(control, line)
    except OSError as error:
        fail(f"{control}: no bench answers ({error}); start one with `python -m sim_devices WORLD.toml`")
    if answer.startswith("error "):
        fail(answer.removeprefix("error "))
    click.echo(answer.removeprefix("ok "))


def fail(sentence: str) -> NoReturn:
    """Say why, and end with exit status 2."""
    click.echo(sentence, err=True)
    raise SystemExit(2)


if __name__ == "__main__":
    main()
