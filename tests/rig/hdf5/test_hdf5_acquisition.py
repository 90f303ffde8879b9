"""How values were acquired: written beside the channel, and read again."""

import h5py
import pytest

from identification.recording import Acquisition
from rig.hdf5 import RecordingFile, load
from rig.link.recorder_messages import ChannelSpec, StreamSpec

HOW = {"delay": 0.0047, "delay_std": 0.0005, "window": 0.01, "quantum": 0.001, "filter": "RC, 50 Hz", "low_pass": 0.003}
CLOCK = {"period": 0.01, "clock_drift_std": 1e-4}


@pytest.fixture
def acquisition(tmp_path):
    """What comes back of a channel and a stream of which so much is said; `more`: written by another program."""

    def of(channel, stream, more=()):
        spec = StreamSpec("cell", "sim", (ChannelSpec("thrust", "thrust", "N", **channel),), **stream)
        path = tmp_path / "a.h5"
        RecordingFile(path, {"recording_id": "a", "thruster": "T1"}, (spec,), 0).close("completed", "", 1.0)
        with h5py.File(path, "a") as file:
            file["streams/cell/thrust"].attrs.update(dict(more))
        (found,) = load(path).channels
        return found.acquisition

    return of


def test_what_is_said_comes_back(acquisition):
    assert acquisition(HOW, CLOCK) == Acquisition(**HOW, **CLOCK)


def test_nothing_is_said_of_what_is_not_known(acquisition):
    assert acquisition({}, {}) == Acquisition()


def test_what_cannot_be_true_says_nothing(acquisition):
    assert acquisition({"delay": -1.0, "window": float("nan")}, {}) == Acquisition()


def test_a_clock_of_no_period_is_none(acquisition):
    assert acquisition({}, {"period": 0.0, "clock_drift_std": 1e-4}).period is None


def test_one_digit_was_called_resolution_at_first(acquisition):
    assert acquisition({}, {}, {"resolution": 0.02}) == Acquisition(quantum=0.02)
