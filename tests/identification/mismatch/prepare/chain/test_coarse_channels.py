"""A supply that is read in tenths of a volt and falls by a few of them: how it falls, not how it is read."""

import numpy as np
import pytest

from identification.mismatch.prepare.channels import is_coarse, jumps
from identification.mismatch.select.forward_selection import available
from identification.recording import Acquisition, Channel
from tests.identification.diagnosed_runs import TOP
from tests.identification.mismatch.small import data_of, history, short

STEP = 0.1
"""V, of a VESC."""


def sagging(fall, step=STEP, noise=0.03):
    """A run of 80 s whose supply of 25.2 V falls by `fall` V as it is drawn on, and the supply as it was."""
    made = short()
    command = made.channels[0]
    time = np.arange(0.0, 80.0, 0.02)
    V = np.nan_to_num(command.held_at(time)) / TOP
    drawn = np.cumsum(np.abs(V) ** 3)
    true = 25.2 - fall * drawn / drawn[-1]
    read = true + noise * np.random.default_rng(5).standard_normal(time.size)
    read = np.round(read / step) * step if step else read
    channel = Channel(
        "bus_voltage", "motor", "bus_voltage", "V", time, read, acquisition=Acquisition(quantum=step or None)
    )
    return short(extra=(channel,)), time, true


@pytest.mark.parametrize("fall", [0.3, 0.8])
def test_the_staircase_of_the_readings_is_not_the_supplys(fall):
    recording, time, true = sagging(fall)
    h = history(recording)
    error = h.others["bus_voltage"] - np.interp(h.middle, time, true)
    assert np.std(error) < 0.06 * fall, "of one step the readings are off by 29 %"


def test_a_value_between_two_steps_jumps_to_neither():
    """Most neighbours are alike, so their usual distance is nothing."""
    read = np.array([0.0, 0.0, 0.0, 0.1, 0.1, 0.1, 0.0, 0.0, 0.7, 0.7, 0.7])
    assert np.flatnonzero(jumps(read)).tolist() == [2, 5, 7]
    assert np.flatnonzero(jumps(read, 0.1)).tolist() == [7]


def test_what_stands_for_a_channel_stands_beside_one_of_few_steps():
    coarse, fine, unsaid = (sagging(0.8, step)[0] for step in (STEP, 0.001, 0.0))
    for recording, forms in (
        (coarse, {"", "buffered", "discharge", "loaded"}),
        (fine, {"", "buffered"}),
        (unsaid, {"", "buffered"}),
    ):
        data, _ = data_of([recording])
        assert {term.form for term in available(data) if term.id == "supply_sag"} == forms
    bus = coarse.first_of("bus_voltage")
    assert is_coarse(bus, np.array([25.2, 24.4]))
    assert not is_coarse(bus, np.array([25.2, 22.4]))
    assert not is_coarse(None, np.array([25.2, 25.1]))
