"""A supply that is read in tenths of a volt and falls by a few of them: how it falls, not how it is read."""

import numpy as np
import pytest

from identification.mismatch.estimate.confidence_intervals import intervals
from identification.mismatch.prepare.channels import coarseness, jumps
from identification.mismatch.select.exchange.nearby_start import best_forms
from identification.mismatch.select.forward_selection import Thruster, available
from identification.physics.supply_sag import Discharge, SupplySag
from identification.recording import Acquisition, Channel
from tests.identification.diagnosed_runs import TOP
from tests.identification.mismatch.small import data_of, estimated, history, short

STEP = 0.1
"""V, of a VESC."""


def sagging(fall, step=STEP, noise=0.03, rounded=np.round):
    """A run of 80 s whose supply of 25.2 V falls by `fall` V as it is drawn on, and the supply as it was."""
    made = short()
    command = made.channels[0]
    time = np.arange(0.0, 80.0, 0.02)
    V = np.nan_to_num(command.held_at(time)) / TOP
    drawn = np.cumsum(np.abs(V) ** 3)
    true = 25.2 - fall * drawn / drawn[-1]
    read = true + noise * np.random.default_rng(5).standard_normal(time.size)
    read = rounded(read / step) * step if step else read
    channel = Channel(
        "bus_voltage", "motor", "bus_voltage", "V", time, read, acquisition=Acquisition(quantum=step or None)
    )

    def change(t, _, F):
        return F * (np.interp(t, time, true) / true[0]) ** 2

    return short(change, extra=(channel,)), time, true


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
    assert coarseness(bus, np.array([25.2, 24.4])) == pytest.approx(0.1 / 12**0.5 / 0.8)
    assert coarseness(bus, np.array([25.2, 22.4])) == 0
    assert coarseness(None, np.array([25.2, 25.1])) == 0


def test_a_few_steps_tell_an_effect_less_well_than_what_stands_for_the_channel():
    """Of 1.2 tenths of a volt the readings made an exponent of 1.43 +- 0.006 where 1 was true."""
    recording, time, _ = sagging(0.12, noise=0.0, rounded=np.floor)
    V = np.abs(np.nan_to_num(recording.channels[0].held_at(time)))
    drawn = float(np.mean((V / np.max(V)) ** 3))
    data, found = estimated({SupplySag(): (1.0,)}, [recording])
    (known,) = intervals(found.fit, data, found.weights, (SupplySag(),))[SupplySag()]
    assert found.fit.theta.terms[0][0] > 1.2
    assert known.low < 1.0, "the steps hide more than the thrust's noise does"
    forms = (SupplySag(), Discharge())
    chosen = best_forms(found.fit, forms, data, found.weights, found.noise)
    assert chosen.model.terms == (Discharge(),)
    std = float(chosen.std[chosen.layout.of(Discharge())][0])
    assert abs(chosen.theta.terms[0][0] - 0.12 / 25.2 / drawn) < 2.5 * std
    assert Thruster(data, forms).rarer(*forms)
    fine, found = estimated({SupplySag(): (1.0,)}, [sagging(0.12, 0.001)[0]])
    assert best_forms(found.fit, forms, fine, found.weights, found.noise) is found.fit
    assert not Thruster(fine, forms).rarer(*forms)
