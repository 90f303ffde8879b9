"""A recording with gaps, counts, clocks of their own and words that files stumble over."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig.hdf5 import RecordingFile
from rig.link.recorder_messages import ChannelSpec, EventRow, Rows, StepRow, StreamSpec
from tests.interop.conftest import third_party

__all__ = ["third_party"]

STREAMS = (
    StreamSpec(
        "load_cell",
        "mt_sics",
        (
            ChannelSpec(
                "thrust", "thrust", "N", noise_std=0.02, calibration='{"role": "primary"}', description="forward"
            ),
            ChannelSpec("raw", None, "1", integer=True),
        ),
        device_id="WMS 123",
    ),
    StreamSpec("2nd flow", "nortek", (ChannelSpec("flow_speed", "flow_speed", "m/s"),)),
    StreamSpec("command", "rig", (ChannelSpec("command_voltage", "command_voltage", "V"),)),
)
EVENT = 'tare 1.25 N, "steady" ± 0.1\nsecond line'


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    rng = np.random.default_rng(1)
    path = tmp_path / "T1.h5"
    facts = {
        "recording_id": "an-id",
        "thruster": "T1",
        "created": "2026-11-24T19:29:07.478776+00:00",
        "bench_toml": "[bench]\n",
        "water_density": 998.2,
    }
    file = RecordingFile(path, facts, STREAMS, t0_ns=0)
    for stream, n, rate, columns in ((0, 101, 92.0, 2), (1, 7, 4.0, 1), (2, 3, 0.5, 1)):
        values = rng.normal(size=(n, columns))
        if stream == 0:
            values[:, 1] = np.arange(n) - 50
            values[3, 0] = values[5, 1] = np.nan
        t_ns = np.rint((np.arange(n) + rng.uniform(0, 0.4, n)) / rate * 1e9).astype(np.int64)
        file.add_rows(Rows(stream, t_ns, values))
    file.add_step(StepRow(-1, "free", 0.0, 0.0, 0.25))
    file.add_step(StepRow(0, "hold", 5.0, 0.25, 1.0))
    file.add_event(EventRow(-0.5, "info", EVENT))
    file.add_event(EventRow(0.5, "trip", "load_cell.thrust: 301 N"))
    file.close("tripped", "load_cell.thrust: 301 N", 1.1)
    return path
