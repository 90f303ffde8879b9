"""The step of a channel's values: as stated, as they lie on a lattice, or none."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.prepare.chain.quantum import quantum_of
from identification.mismatch.prepare.preparing import history_of
from identification.recording import Acquisition, Channel
from tests.identification.diagnosed_runs import run

T = np.linspace(0.0, 60.0, 601)
READING = 40 * np.sin(0.3 * T) + 0.1 * np.random.default_rng(0).standard_normal(T.size)


def cell(value, **facts):
    return Channel("cell", "cell", "thrust", "N", T, value, acquisition=Acquisition(**facts))


@pytest.mark.parametrize(("step", "offset"), [(0.5, 0.0), (0.37, 1.234), (4.44822, -3.3)])
def test_values_on_a_lattice_have_its_step(step, offset):
    assert quantum_of(cell(step * np.round(READING / step) + offset)) == pytest.approx(step, rel=1e-6)
    written = np.round(step * np.round(READING / step) + offset, 3)
    assert quantum_of(cell(written)) == pytest.approx(step, rel=2e-3)


def test_values_that_are_not_whole_steps_apart_have_none():
    assert quantum_of(cell(READING)) == 0.0
    assert quantum_of(cell(np.where(T < 30, 0.0, 1.0))) == 0.0
    assert quantum_of(cell(np.full(T.size, np.nan))) == 0.0


def test_what_a_recording_states_is_taken():
    assert quantum_of(cell(READING, quantum=0.02)) == 0.02


def test_a_history_knows_the_step_of_its_thrust():
    recording = run()
    assert history_of(recording).quantum == 0.0
    channels = tuple(
        replace(c, value=0.8 * np.round(c.value / 0.8)) if c.quantity == "thrust" else c for c in recording.channels
    )
    assert history_of(replace(recording, channels=channels)).quantum == pytest.approx(0.8)
