"""Promise 31: the bytes of a run that `capture` kept, through a driver's parser and the recorder again, give the same
streams to the bit."""

from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from drivers.ports.transcript import read_transcript
from rig.campaign.bench import build
from rig.campaign.loading import load_bench
from rig.hdf5 import RecordingFile, load
from rig.link.recorder_messages import ChannelSpec, Rows, StreamSpec
from tests.rig.stages.byte_bench import recorded
from tests.rig.stages.lies.lying_bench import files

DEVICES = ("load_cell", "flow")
LONG = 100 * 10**9
"""ns without a row, as between two runs of a day."""


class Replayed:
    """A wire whose far end says again what a transcript has, at its times, whatever it is asked."""

    def __init__(self, chunks) -> None:
        self._chunks, self._arrived = deque(chunks), None
        self._t = self._chunks[0].t_ns * 1e-9 - 1.0

    def now(self) -> float:
        return self._t

    def wait(self, seconds: float) -> None:
        end = self._t + seconds
        if self._chunks and self._chunks[0].t_ns * 1e-9 <= end:
            chunk = self._chunks.popleft()
            self._t = max(self._t, chunk.t_ns * 1e-9)
            if self._arrived is not None:
                self._arrived(chunk.t_ns, chunk.data)
        else:
            self._t = end

    def connect(self, arrived) -> None:
        self._arrived = arrived

    def write(self, _data: bytes) -> None: ...

    def disconnect(self) -> None:
        self._arrived = None

    @property
    def over(self) -> bool:
        return not self._chunks


@pytest.fixture(scope="module")
def captured(tmp_path_factory):
    """A recording, ns of its t = 0, its bench file and its transcripts."""
    folder = tmp_path_factory.mktemp("captured")
    campaign = files(folder, 1.5)
    text = (folder / "bench.toml").read_text(encoding="utf-8")
    for name in DEVICES:
        text = text.replace(f"[devices.{name}]\n", f'[devices.{name}]\ncapture = "{folder / name}.txt"\n')
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    whole, t0_ns = recorded(campaign, folder / "run")
    return whole, t0_ns, folder


def samples(folder, name):
    """What the driver makes of the bytes."""
    chunks = [chunk for chunk in read_transcript(folder / f"{name}.txt") if chunk.direction == "<"]
    wire = Replayed(chunks)
    config = load_bench(folder / "bench.toml")
    found = config.devices[name]
    plain = replace(found, options=replace(found.options, capture=""))
    bench = build(replace(config, devices={**config.devices, name: plain}), dict.fromkeys((*DEVICES, "bus0"), wire))
    device = bench.instruments[name]
    device.open()
    while not wire.over:
        wire.wait(1.0)
    found = device.drain()
    device.close()
    return device.streams[0], found


@pytest.mark.parametrize("name", DEVICES)
def test_bytes_through_parser_and_recorder_are_the_recording(captured, tmp_path, name):
    whole, t0_ns, folder = captured
    stream, found = samples(folder, name)
    (column,) = [
        channel for channel in whole.channels if (channel.stream, channel.name) == (name, stream.channels[0].name)
    ]
    t_ns = np.array([sample.t_ns for sample in found])
    spec = StreamSpec(name, stream.source, tuple(ChannelSpec(c.name, c.quantity, c.unit) for c in stream.channels))
    file = RecordingFile(tmp_path / "again.h5", {}, (spec,), t0_ns)
    for part in np.array_split(np.arange(len(found)), 7):
        file.add_rows(Rows(0, t_ns[part], np.array([found[i].values for i in part])))
        file.flush()
    file.close("completed", "", 0.0)
    again = load(tmp_path / "again.h5").channels[0]
    first = int(np.searchsorted(again.time, column.time[0]))
    assert column.time.size > 20
    assert again.time[first : first + column.time.size].tobytes() == column.time.tobytes()
    assert again.value[first : first + column.value.size].tobytes() == column.value.tobytes()


def test_a_pause_of_minutes_is_kept(tmp_path):
    spec = StreamSpec("cell", "sim", (ChannelSpec("thrust", "thrust", "N"),))
    file = RecordingFile(tmp_path / "r.h5", {}, (spec,), 0)
    t_ns = np.array([0, 10**7, LONG, LONG + 10**7])
    file.add_rows(Rows(0, t_ns, np.arange(4.0).reshape(4, 1)))
    file.close("completed", "", 101.0)
    assert load(tmp_path / "r.h5").channels[0].time.tolist() == (t_ns * 1e-9).tolist()
