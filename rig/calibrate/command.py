"""`rig calibrate`: a load cell from dead weights, step by step at the bench, or from a table of what was read."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile

import click

from drivers.ports.wire import Wire
from identification.calibration.answer import CellCalibration, calibrated
from identification.calibration.wrong_weight import sentence
from rig.calibrate.listening import listening, thrust_of
from rig.calibrate.loads_file import LoadsPlan, load_plan
from rig.calibrate.operator import Command, Operator, Terminal
from rig.calibrate.result import as_json, name_in_bench, write_result
from rig.calibrate.session import Session, replaced, steps_of
from rig.calibrate.text import told
from rig.calibrate.wizard import Screen, Wizard
from rig.campaign.bench import Bench, build
from rig.campaign.loading import load_bench
from rig.control.clocks import Clock, MonotonicClock
from rig.errors import ConfigError, RecordingError
from rig.fit.load_cell import GRAVITY, calibrate_table
from rig.recording.recorder_link import RecorderLink
from rig.screen_options import look_of, screen_options
from rig.stages.recording_header import fresh_stamp


@click.command("calibrate")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--loads", type=click.Path(path_type=Path), help="Plan of the weights (TOML), for a bench file.")
@click.option("--plain", is_flag=True, help="Ask line by line, without a screen; so it is where there is no terminal.")
@click.option("--yes", is_flag=True, help="Nobody is asked: the [hang] command of the plan puts the weights on.")
@click.option("--keep-bench", is_flag=True, help="Write the calibration, but do not name it in the bench file.")
@click.option("--gravity", type=float, default=GRAVITY, show_default=True, metavar="M/S^2", help="Of a table's place.")
@click.option(
    "--weights-std",
    type=float,
    default=0.0,
    show_default=True,
    metavar="SHARE",
    help="Of a table: relative standard uncertainty that all weights share.",
)
@screen_options
def calibrate_command(
    file: Path,
    loads: Path | None,
    plain: bool,
    yes: bool,
    keep_bench: bool,
    gravity: float,
    weights_std: float,
    colors: str,
    bell: bool,
) -> int:
    """Calibrate a load cell with dead weights.

    FILE is a bench file (.toml), with --loads: the weights are asked for one after another and the cell is read. The
    recording, and the calibration with its covariance, are written beside the bench file, which then names it. The
    motor is not opened. Or FILE is a table (CSV) of the columns mass_kg or force_N, and reading, in the order in which
    they were put on and taken off: lines for the bench file are printed.

    Exit status 1 when one step does not go with the others: then no calibration is written.
    """
    if file.suffix != ".toml":
        if loads is not None:
            raise ConfigError(f"{file}: --loads goes with a bench file (.toml); a table (CSV) holds its own loads")
        return calibrate_table(file, gravity, weights_std)
    if loads is None:
        raise ConfigError(f"{file}: give the plan of the weights with --loads; docs/howto/calibrate.md has one to copy")
    plan = load_plan(loads)
    clock, look = MonotonicClock(), look_of(colors, bell)
    if not (plain or yes) and sys.stdin.isatty() and sys.stdout.isatty():
        wizard = Wizard(f"rig calibrate  {file}", plan)
        work = partial(_calibrated, Asked(file, plan, wizard, keep_bench), clock)
        return Screen(wizard, work).run(look.colors, bell=look.bell)
    return _calibrated(Asked(file, plan, _operator(plan, file, yes, clock), keep_bench), clock)


def _calibrated(asked: Asked, clock: Clock) -> int:
    with TemporaryFile() as log:
        recorder = RecorderLink.start(log)
        try:
            return calibrate_bench(asked, recorder, clock)
        finally:
            recorder.shut_down()


def _operator(plan: LoadsPlan, bench: Path, yes: bool, clock: Clock) -> Operator:
    if not yes:
        return Terminal(sys.stdin.fileno())
    if not plan.hang.command:
        raise ConfigError(f"{plan.path}: --yes needs a [hang] command in the loads file: who else hangs the weights?")
    return Command(plan.hang, bench.parent.resolve(), lambda: clock.now_ns() * 1e-9)


@dataclass(frozen=True)
class Asked:
    """What is to be done on which bench, and who hangs the weights."""

    bench: Path
    plan: LoadsPlan
    operator: Operator
    keep_bench: bool = False
    wires: Mapping[str, Wire] | None = None
    """In the place of the ports."""
    day: date | None = None
    """Of the calibration; None: today, UTC."""


def calibrate_bench(asked: Asked, recorder: RecorderLink, clock: Clock) -> int:
    """The whole of it; the exit status. Raises RigError."""
    config = load_bench(asked.bench)
    device, plan = config.force, asked.plan
    bench = build(replace(config, curves={}), asked.wires)  # an older curve is no part of what is read
    day = asked.day or datetime.now(UTC).date()
    stem = _stem(asked.bench.parent, device, day)
    recording, result = stem.with_suffix(".h5"), stem.with_suffix(".json")
    stamp = fresh_stamp()
    with listening(bench, plan, recording, recorder, clock, stamp) as listener:
        session = Session(plan, listener, asked.operator)
        taken = session.run()
    kept = {"file": recording.name, "recording_id": stamp.recording_id, "sha256": _sha256(recorder)}
    found = answer_of(plan, session, _quantum(bench))
    asked.operator.tell("\n".join(told(found, len(taken))))
    if wrong := found.wrong:
        lines = [sentence(replaced(each, taken[each.step].index), taken[each.step].load) for each in wrong]
        asked.operator.tell("\n".join(f"WRONG          {line}" for line in lines))
        asked.operator.tell(f"no calibration was written; the readings are in {recording}")
        return 1
    content = as_json(found, plan, taken, (device, bench.identities[device]), kept, day)
    _written(result, content)
    asked.operator.tell(f"calibration    {result}, recording {recording.name}")
    if not asked.keep_bench:
        name_in_bench(asked.bench, device, content, result.name)
        asked.operator.tell(
            f"bench file     {asked.bench}: [calibration.{device}] names it, good until {content['valid_until']}"
        )
    return 0


def answer_of(plan: LoadsPlan, session: Session, quantum: float) -> CellCalibration:
    """Raises RecordingError where the steps tell no gain."""
    loads = [step.load for step in session.taken]
    try:
        return calibrated(
            steps_of(session.taken, session.unread), loads, plan.weights, plan.place,
            correlation=plan.correlation, quantum=quantum, stability=plan.about.stability,
        )  # fmt: skip
    except ValueError as error:
        raise RecordingError(f"no calibration comes of these {len(loads)} steps: {error}") from error


def _stem(folder: Path, device: str, day: date) -> Path:
    """Where there is nothing yet: neither a recording nor a calibration is overwritten."""
    slug = re.sub(r"[^A-Za-z0-9_-]+", "-", device)
    number = 1
    while True:
        stem = folder / (f"{slug}-calibration-{day.isoformat()}" + (f"-{number}" if number > 1 else ""))
        if not any(stem.with_suffix(ending).exists() for ending in (".h5", ".json")):
            return stem
        number += 1


def _quantum(bench: Bench) -> float:
    """N, step of the readings; 0 where the driver does not know it."""
    thrust = thrust_of(bench)
    return thrust.stream.channels[thrust.column].quantum or 0.0


def _sha256(recorder: RecorderLink) -> str:
    return recorder.closed.sha256 if recorder.closed is not None else ""


def _written(path: Path, content: Mapping[str, object]) -> None:
    try:
        with contextlib.ExitStack() as undo:
            undo.callback(path.unlink, missing_ok=True)
            write_result(path, content)
            undo.pop_all()
    except OSError as error:
        raise ConfigError(f"{path}: the calibration can't be written: {error.strerror}") from None
