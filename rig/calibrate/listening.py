"""The load cell of a bench, opened alone, and the recorder that keeps what it reads. The motor is never opened."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from math import ceil, isfinite, nan
from pathlib import Path
from typing import Final, NamedTuple

from drivers.errors import DeviceError as DriverDeviceError
from drivers.errors import LinkError as DriverLinkError
from drivers.protocols import ForceSensor, Sample, Stream
from rig.calibrate.loads_file import LoadsPlan
from rig.campaign.bench import Bench
from rig.control.clocks import Clock
from rig.errors import ConfigError, DeviceError, LinkError
from rig.link.recorder_messages import Attribute, ChannelSpec, EventRow, Open, Outcome, StepRow, StreamSpec
from rig.recording.recorder_link import RecorderLink
from rig.stages.recording_header import Stamp, fresh_stamp, stream_spec

PERIOD_NS: Final = 20_000_000
"""Between two looks at the devices: 50 a second, as a run has them."""
RECORDER_WAIT: Final = 20.0
"""s for the recorder to open or close the file."""
SILENCE: Final = 3.0
"""s without a reading, or 20 of its periods, after which the cell is not there."""
KIND: Final = "calibration"
LOAD_STREAM: Final = "load"
LOAD_CHANNELS: Final = (
    ChannelSpec("force", None, "N", description="of the dead weights by the loads file; rows are changes"),
    ChannelSpec("step", None, "1", integer=True, description="of the loads file, from 0"),
)
SLACK: Final = 20.0
"""Times the shortest duration for which there must be room on the disk: a person hangs the weights."""
BYTES_PER_VALUE: Final = 8


class Place(NamedTuple):
    """Of a channel."""

    device: str
    stream: Stream
    column: int


@dataclass
class Listener:
    """Open from `listening` to its end."""

    bench: Bench
    device: str
    thrust: Place
    thermometer: Place | None
    open_devices: tuple[str, ...]
    recorder: RecorderLink
    clock: Clock
    t0_ns: int
    heard: Callable[[float, float], None] | None = None
    """Called with each reading: s, N."""
    temperature: float = nan
    """degC, the newest."""
    last: float = 0.0
    """s, of the newest reading."""
    reading: float = nan
    """N, the newest."""

    @property
    def now(self) -> float:
        """S since the recording began."""
        return (self.clock.now_ns() - self.t0_ns) * 1e-9

    def turn(self) -> None:
        """One look: what came goes to the recorder and to `heard`. Raises LinkError when cell or recorder is gone."""
        samples = [each for name in self.open_devices for each in self.bench.instruments[name].drain()]
        self.recorder.rows(samples)
        self.recorder.poll(self.clock.now_ns() * 1e-9)
        if self.recorder.failed:
            raise LinkError(f"recorder: {self.recorder.failed}")
        for sample in samples:
            self._take(sample)
        health = self.bench.instruments[self.device].health()
        if not health.alive:
            raise LinkError(f"{self.device}: {health.error or 'its link is gone'}")
        if self.now - self.last > max(SILENCE, 20.0 * self.thrust.stream.period_s):
            raise LinkError(
                f"{self.device}: nothing came for {self.now - self.last:.1f} s; look at its cable and power"
            )
        self.clock.sleep_until_ns(self.clock.now_ns() + PERIOD_NS)

    def say(self, text: str, level: str = "info") -> None:
        """Into the recording's events."""
        self.recorder.event(EventRow(self.now, "warning" if level == "warning" else "info", text))

    def load(self, step: int, force: float) -> None:
        """From now on this hangs."""
        self.recorder.rows([Sample(LOAD_STREAM, self.clock.now_ns(), (force, float(step)))])

    def step(self, index: int, start: float, end: float, phase: str = "hold") -> None:
        self.recorder.step(StepRow(index, phase, 0.0, start, end))

    def _take(self, sample: Sample) -> None:
        time = (sample.t_ns - self.t0_ns) * 1e-9
        if self.thermometer is not None and sample.stream == self.thermometer.stream.name:
            self.temperature = sample.values[self.thermometer.column]
        if sample.stream == self.thrust.stream.name:
            self.last = time
            value = self.reading = sample.values[self.thrust.column]
            if self.heard is not None and isfinite(value):
                self.heard(time, value)


@contextlib.contextmanager
def listening(
    bench: Bench, plan: LoadsPlan, path: Path, recorder: RecorderLink, clock: Clock, stamp: Stamp | None = None
) -> Iterator[Listener]:
    """The cell is open and the recording exists; both are closed at the end, the recording as what it came to.

    Raises ConfigError for a thermometer that is none, LinkError or DeviceError for a cell that does not open.
    """
    device = bench.config.force
    thermometer = _thermometer(bench, plan) if plan.about.thermometer else None
    devices = tuple(dict.fromkeys([device, *([thermometer.device] if thermometer else [])]))
    outcome: Outcome = "aborted"
    cause = "the calibration did not come to its end"
    with contextlib.ExitStack() as undo:
        undo.callback(bench.close)
        for name in devices:
            bench.open_device(name)
        if plan.about.tare:
            _tare(bench)
        thrust = thrust_of(bench)
        listener = Listener(bench, device, thrust, thermometer, devices, recorder, clock, clock.now_ns())
        recorder.open(_opening(listener, plan, path, stamp or fresh_stamp()), clock.now_ns() * 1e-9)
        _wait(listener, lambda: recorder.ready, "the recorder to open its file")
        try:
            yield listener
            outcome, cause = "completed", ""
        finally:
            recorder.close_file(outcome, cause)
            with contextlib.suppress(LinkError):  # what ended it is said already
                _wait(listener, lambda: recorder.closed is not None, "the recorder to close its file")


def _tare(bench: Bench) -> None:
    """Raises DeviceError for a cell that can't, or does not want to, LinkError for one that is gone."""
    cell = bench.instruments[bench.config.force]
    if not isinstance(cell, ForceSensor):
        raise DeviceError(f"{cell.name} can't be zeroed inside: take `tare` out of the loads file")
    try:
        cell.tare()
    except DriverLinkError as error:
        raise LinkError(str(error)) from error
    except DriverDeviceError as error:
        raise DeviceError(str(error)) from error


def _wait(listener: Listener, done: Callable[[], bool], what: str) -> None:
    recorder, end = listener.recorder, listener.now + RECORDER_WAIT
    while not done():
        recorder.poll(listener.clock.now_ns() * 1e-9)
        if recorder.failed:
            raise LinkError(f"recorder: {recorder.failed}")
        if listener.now > end:
            raise LinkError(f"waited {RECORDER_WAIT:g} s for {what}; it did not happen")
        listener.clock.sleep_until_ns(listener.clock.now_ns() + PERIOD_NS)
    listener.last = listener.now


def thrust_of(bench: Bench) -> Place:
    """The thrust of the force device, which `load_bench` has found there."""
    name = bench.config.force
    return next(
        Place(name, stream, column)
        for stream in bench.instruments[name].streams
        for column, channel in enumerate(stream.channels)
        if channel.quantity == "thrust"
    )


def _thermometer(bench: Bench, plan: LoadsPlan) -> Place:
    known = {
        f"{stream.name}.{channel.name}": Place(name, stream, column)
        for name, stream in bench.streams()
        for column, channel in enumerate(stream.channels)
        if channel.unit == "degC" and name != bench.config.motor
    }
    if plan.about.thermometer not in known:
        raise ConfigError(
            f"{plan.path}: calibration.thermometer is {plan.about.thermometer!r}, but must be a channel in degC of a "
            f"device that turns no propeller; this bench has {', '.join(known) or 'none'}"
        )
    return known[plan.about.thermometer]


def _opening(listener: Listener, plan: LoadsPlan, path: Path, stamp: Stamp) -> Open:
    bench = listener.bench
    streams = [
        stream_spec(stream, bench.identities[name], name == listener.device)
        for name in listener.open_devices
        for stream in bench.instruments[name].streams
    ]
    longest = SLACK * plan.shortest
    rows = sum(
        ceil(longest / each.period_s) * (len(each.channels) + 1)
        for name in listener.open_devices
        for each in bench.instruments[name].streams
    )
    attributes: dict[str, Attribute] = {
        "recording_id": stamp.recording_id,
        "created": stamp.created,
        "kind": KIND,
        "operator": plan.about.operator,
        "facility": bench.config.facility,
        "software": f"thruster-rig {version('thruster-rig')}",
        "bench_toml": bench.config.text,
        "loads_toml": plan.text,
    }
    load = StreamSpec(LOAD_STREAM, "rig", LOAD_CHANNELS)
    return Open(str(path), listener.t0_ns, (*streams, load), attributes, BYTES_PER_VALUE * rows)
