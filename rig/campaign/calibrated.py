"""A load cell read through the curve of its calibration; what its driver says is kept beside it."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

from drivers.errors import DeviceError
from drivers.protocols import Channel, Instrument, LinkHealth, Sample, Stream
from rig.campaign.calibration_file import CalibratedCell

RAW = "_uncalibrated"
"""Added to the name of the channel that keeps what the driver says."""
SILENT = "does not identify itself"
"""Said by a driver whose device has no serial number to compare."""


@dataclass
class Calibrated:
    """`instrument` with the thrust of its first stream that has one corrected by the calibration's curve."""

    instrument: Instrument
    cell: CalibratedCell
    date: str
    certificate: str

    def __post_init__(self) -> None:
        self.name = self.instrument.name
        found = [
            (stream, column)
            for stream in self.instrument.streams
            for column, channel in enumerate(stream.channels)
            if channel.quantity == "thrust"
        ]
        if not found:
            raise ValueError(f"{self.name} measures no thrust: a calibration with dead weights corrects nothing of it")
        self._stream, self._column = found[0]

    @property
    def streams(self) -> tuple[Stream, ...]:
        return tuple(self._read(each) if each.name == self._stream.name else each for each in self.instrument.streams)

    def _read(self, stream: Stream) -> Stream:
        said = stream.channels[self._column]
        curve = self.cell.curve
        facts = json.loads(said.calibration or "{}") | {
            "gain_std": curve.gain_std,
            "curve": curve.as_json(),
            "date": self.date,
            "certificate": self.certificate,
            "calibration_recording": self.cell.recording_id,
        }
        ends = [None if end is None else curve.force(end) for end in (said.range_min, said.range_max)]
        read = replace(said, calibration=json.dumps(facts), range_min=ends[0], range_max=ends[1])
        raw = Channel(
            f"{said.name}{RAW}", None, said.unit, description="as the driver reads it, before the calibration's curve"
        )
        channels = list(stream.channels)
        channels[self._column] = read
        return replace(stream, channels=(*channels, raw))

    def open(self) -> str:
        """Raises DeviceError for another cell than the one that was calibrated, and as the driver does."""
        identity = self.instrument.open()
        known = self.cell.identity
        if known and identity != known and SILENT not in identity:
            self.instrument.close()
            raise DeviceError(
                f"{self.name} is {identity}, but its calibration {self.cell.path.name} is of {known}: put that cell "
                "back, or calibrate this one"
            )
        return identity

    def drain(self) -> list[Sample]:
        return [self._sample(each) if each.stream == self._stream.name else each for each in self.instrument.drain()]

    def _sample(self, sample: Sample) -> Sample:
        values = list(sample.values)
        said = values[self._column]
        values[self._column] = self.cell.curve.force(said)
        return sample._replace(values=(*values, said))

    def health(self) -> LinkHealth:
        return self.instrument.health()

    def close(self) -> None:
        self.instrument.close()
