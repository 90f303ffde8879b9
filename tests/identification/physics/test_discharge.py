"""A supply that falls by the current drawn, behind a switching drive: the proxy against its equation in small steps."""

import numpy as np
import pytest

from identification.physics.supply_sag import Discharge
from identification.physics.term import TermContext
from identification.run_history.remembered import RememberedRun
from tests.identification.diagnosed_runs import TOP, C
from tests.identification.mismatch.small import data_of, short

FALL = 0.3
"""Large, so that what a first order would leave out shows: 5 % of the voltage."""


def test_the_voltage_falls_by_the_current_that_its_own_fall_lessens():
    recording = short(noise=0.0)
    data, _ = data_of([recording])
    (h,), scale = data.histories, data.scale
    dt, ratio = 1e-3, 1.0
    time = np.arange(h.edges[0], h.edges[-1], dt)
    V = np.abs(np.nan_to_num(recording.channels[0].held_at(time))) / scale.driver
    course = np.empty(time.size)
    for i, v in enumerate(V.tolist()):
        ratio -= FALL * v**3 * ratio**2 * dt / scale.duration
        course[i] = ratio
    told = Discharge().apply(h.driver, TermContext(RememberedRun(h), scale, C, 0.0, h.driver, None), (FALL,))
    driven = np.abs(h.driver) > 0.1 * TOP
    assert told[driven] / h.driver[driven] == pytest.approx(np.interp(h.middle, time, course)[driven], abs=2e-3)
    assert course[-1] < 0.95
