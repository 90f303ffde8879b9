"""`rig simulate --twin TWIN PLAN -o FILE`: the run that a twin predicts, as a recording."""

from __future__ import annotations

import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rig.errors import ConfigError, RecordingError, RigError, TwinError

if TYPE_CHECKING:
    from identification.mismatch.compare.simulation import Drive, Prediction
    from identification.recording import Floats, Step
    from identification.twin import Twin
    from rig.campaign.plan import Step as PlannedStep
    from rig.link.recorder_messages import StreamSpec

TICK = 0.02
"""s between commands of a ramp or a sine, as `bench.loop_rate` has it by default."""
TAIL = 1.0
"""s recorded after the last command."""
MOST = 10_000_000
"""Samples of one simulation."""
UNITS = {
    "flow_speed": "m/s",
    "bus_voltage": "V",
    "current": "A",
    "torque": "N.m",
    "motor_temperature": "degC",
    "water_temperature": "degC",
    "rotation_rate": "rev/s",
}
"""Of what is replayed beside the command."""


@dataclass(frozen=True, eq=False)
class Asked:
    """What is to be simulated."""

    drive: Drive
    steps: tuple[Step, ...]
    start: float
    """s of the first sample."""
    end: float
    """s"""
    name: str
    """The plan's file."""


def asked(plan: Path, twin: Twin, flow: float | None) -> Asked:
    """A campaign (TOML) or a recording whose command is replayed. Raises a RigError."""
    if plan.suffix.lower() == ".toml":
        return _of_campaign(plan, twin, flow)
    return _of_recording(plan, twin, flow)


def _of_campaign(path: Path, twin: Twin, flow: float | None) -> Asked:
    import numpy as np

    from identification.mismatch.compare.simulation import Drive
    from rig.campaign.loading import load_campaign

    if twin.driver_quantity == "rotation_rate":
        raise TwinError(
            f"the twin is driven by rotation_rate, the plan {path} commands volts; replay a recording with a rotation "
            "rate"
        )
    campaign = load_campaign(path)
    rows, steps, end = timed(tuple(campaign.plan), 1 / campaign.bench.loop_rate)
    time, value = (np.array(column, dtype=np.float64) for column in zip(*rows, strict=True))
    speed = flow if flow is not None else campaign.flow_speed or 0.0
    others = {"flow_speed": (np.array([0.0]), np.array([speed]))}
    return Asked(Drive(time, value, stepwise=True, others=others), steps, 0.0, end + TAIL, path.name)


def timed(plan: Sequence[PlannedStep], tick: float = TICK) -> tuple[list[tuple[float, float]], tuple[Step, ...], float]:
    """Rows (s, V) of the command, the steps with their times, and the end in s. Each step takes its expected time."""
    from identification.recording import Step

    rows: list[tuple[float, float]] = [(0.0, 0.0)]
    steps, at = [], 0.0
    for step in plan:
        rows += [(at + t, v) for t, v in _commands(step, tick)]
        steps.append(Step(step.index, step.phase, step.voltage, at, at + step.expected))
        at += step.expected
    kept = [row for row, before in zip(rows[1:], rows, strict=False) if row[1] != before[1]]
    return [rows[0], *kept], tuple(steps), at


def _commands(step: PlannedStep, tick: float) -> Iterator[tuple[float, float]]:
    """(s since the start of the step, V)."""
    from math import ceil, pi, sin

    seconds = step.expected
    if step.phase == "ramp" and seconds > 0:
        for i in range(1, ceil(seconds / tick)):
            yield i * tick, step.from_voltage + (step.voltage - step.from_voltage) * i * tick / seconds
        yield seconds, step.voltage
    elif step.phase == "sine":
        for i in range(ceil(seconds / tick)):
            yield i * tick, step.voltage + step.amplitude * sin(2 * pi * step.frequency * i * tick)
    else:
        yield 0.0, step.voltage


def _of_recording(path: Path, twin: Twin, flow: float | None) -> Asked:
    import numpy as np

    from identification.mismatch.compare.simulation import Drive, others_of
    from rig.hdf5 import load

    recording = load(path)
    driver = recording.first_of(twin.driver_quantity)
    if driver is None or not np.any(np.isfinite(driver.value)):
        raise RecordingError(f"{path} has no {twin.driver_quantity}, which drives the twin; replay one that has it")
    good = np.isfinite(driver.value)
    others = others_of(recording)
    if flow is not None or "flow_speed" not in others:
        others["flow_speed"] = (np.array([0.0]), np.array([flow or 0.0]))
    stepwise = twin.driver_quantity == "command_voltage"
    drive = Drive(driver.time[good], driver.value[good], stepwise=stepwise, others=others)
    thrust = recording.first_of("thrust")
    clock = thrust.time if thrust is not None and thrust.time.size else driver.time[good]
    return Asked(drive, recording.steps, float(clock[0]), float(clock[-1]), path.name)


def simulated(twin: Twin, wanted: Asked, rate: float | None, seed: int | None) -> Prediction:
    """At `rate` samples/s, by default the twin's own. Raises TwinError where the plan lacks what the twin needs."""
    import numpy as np

    from identification.mismatch.compare.simulation import simulate
    from identification.mismatch.prepare.preparing import Refusal

    interval = 1 / rate if rate else twin.interval
    count = int(min((wanted.end - wanted.start) / interval, MOST)) + 1
    if count > MOST:
        raise TwinError(f"{wanted.name}: more than {MOST:,} samples at {1 / interval:g} samples/s; give a lower --rate")
    times = wanted.start + np.arange(count, dtype=np.float64) * interval
    rng = None if seed is None else np.random.default_rng(seed)
    found = simulate(twin, wanted.drive, times, rng)
    if isinstance(found, Refusal):
        raise TwinError(f"{wanted.name}: {found.reason}")
    return found


def write_simulation(path: Path, twin: Twin, wanted: Asked, found: Prediction, notes: str, identity: str) -> None:
    """A recording of kind tunnel whose notes say that it is simulated. Raises RecordingError when `path` is there."""
    import numpy as np

    from rig.hdf5 import RecordingFile
    from rig.link.recorder_messages import EventRow, Rows, StepRow

    if path.exists():
        raise RecordingError(f"{path} exists; a recording is never overwritten: give another name")
    columns = list(_columns(twin, wanted, found))
    part = path.with_name(path.name + ".part")
    part.unlink(missing_ok=True)
    attributes = {
        "recording_id": str(uuid.uuid5(uuid.NAMESPACE_OID, identity)),
        "thruster": twin.thruster,
        "kind": "tunnel",
        "software": "thruster-rig, rig simulate",
        "notes": notes,
    }
    file = RecordingFile(part, attributes, [spec for spec, _, _ in columns], t0_ns=0)
    for index, (_, time, values) in enumerate(columns):
        file.add_rows(Rows(index, np.rint(time * 1e9).astype(np.int64), np.column_stack(values)))
    for step in wanted.steps:
        file.add_step(StepRow(step.index, step.phase, step.command_voltage, step.t_start, step.t_end))
    file.add_event(EventRow(wanted.start, "info", notes))
    file.close("completed", "simulated", wanted.end)
    part.rename(path)


def _columns(twin: Twin, wanted: Asked, found: Prediction) -> Iterator[tuple[StreamSpec, Floats, tuple[Floats, ...]]]:
    from rig.link.recorder_messages import ChannelSpec, StreamSpec

    def one(stream: str, quantity: str, unit: str) -> StreamSpec:
        return StreamSpec(stream, "twin", (ChannelSpec(quantity, quantity, unit),))

    drive = wanted.drive
    unit = "rev/s" if twin.driver_quantity == "rotation_rate" else "V"
    yield one("command", twin.driver_quantity, unit), drive.time, (drive.value,)
    yield one("load_cell", "thrust", "N"), found.time, (found.thrust,)
    if found.rate is not None:
        yield one("motor", "rotation_rate", "rev/s"), found.time, (found.rate,)
    for quantity, (time, value) in drive.others.items():
        known = quantity in UNITS and quantity != twin.driver_quantity
        if known and (quantity != "rotation_rate" or found.rate is None):
            yield one(quantity, quantity, UNITS[quantity]), time, (value,)


def _require_numbers(rate: float | None, flow: float | None) -> None:
    """Raises ConfigError; click lets NaN through every range."""
    for option, value in (("--rate", rate), ("--flow-speed", flow)):
        if value is not None and not isfinite(value):
            raise ConfigError(f"{option} must be a finite number, but is {value:g}")


PATH = click.Path(path_type=Path)


@click.command("simulate")
@click.argument("plan", type=PATH)
@click.option(
    "--twin", "twin_path", required=True, type=PATH, help="The twin that predicts: JSON of `rig diagnose --save-twin`."
)
@click.option("-o", "--output", required=True, type=PATH, help="The recording to write.")
@click.option("--noise", "seed", type=click.IntRange(min=0), help="Add the twin's noise, drawn from this seed.")
@click.option("--rate", type=click.FloatRange(0, min_open=True), help="Samples/s (default: as the twin's recordings).")
@click.option("--flow-speed", "flow", type=float, help="Tunnel flow in m/s (default: the plan's, else none).")
def simulate_command(
    plan: Path, twin_path: Path, output: Path, seed: int | None, rate: float | None, flow: float | None
) -> None:
    """Predict the run of PLAN, a campaign (TOML) or a recording whose command is replayed; write it as a recording.

    A hold until steady takes the time half way between its bounds.
    """
    import hashlib

    from rig.twin.reading import read_twin

    try:
        _require_numbers(rate, flow)
        twin = read_twin(twin_path)
        wanted = asked(plan, twin, flow)
        found = simulated(twin, wanted, rate, seed)
        from identification.mismatch.compare.simulation import wave_notes

        noise = "without noise" if seed is None else f"with noise of seed {seed}"
        notes = f"Simulated, not measured: {plan.name} on {twin.origin}, {noise}, without a tare."
        notes = " ".join([notes, *wave_notes(twin)])
        digests = [hashlib.sha256(path.read_bytes()).hexdigest() for path in (twin_path, plan)]
        write_simulation(output, twin, wanted, found, notes, f"{digests} {seed} {rate} {flow}")
    except (RigError, OSError) as error:
        click.echo(f"rig simulate: {error}", err=True)
        raise SystemExit(2) from error
    beyond = float(abs(wanted.drive.value).max()) / (twin.highest_driver or 1.0)
    click.echo(f"{output}: {found.time.size} samples in {wanted.end - wanted.start:.0f} s. {notes}")
    if beyond > 1.001:
        click.echo(
            f"The plan goes to {beyond:.3g} times the highest level that the twin was fitted with: extrapolated."
        )
