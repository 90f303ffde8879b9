"""A sample that is the mean over a window, against the mean of a fine course of the same model."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.fitting import raw
from identification.mismatch.prepare.chain.acquisition import as_sampled
from identification.physics.motor_lag import MotorLag
from identification.recording import Acquisition, Recording
from identification.run_history.converter import Converter
from tests.identification.diagnosed_runs import C
from tests.identification.mismatch.small import data_of, placed, short

LAG = MotorLag("first_order")


def averaged(window):
    """A cell that averages over `window` s and stamps the end of it, noise-free, with a lag of 80 ms."""
    made = short(noise=0.0, tare=0.0)
    command, thrust = made.channels
    fine = np.arange(0.0, thrust.time[-1], 2e-4)
    held = command.value[np.maximum(np.searchsorted(command.time, fine, side="right") - 1, 0)]
    held[fine < command.time[0]] = 0.0
    x = np.zeros(fine.size)
    keep = np.exp(-2e-4 / 0.08)
    for i in range(1, fine.size):
        x[i] = keep * x[i - 1] + (1 - keep) * held[i]
    total = np.concatenate([[0.0], np.cumsum(C * x * np.abs(x)) * 2e-4])

    def at(t):
        return np.interp(t, np.append(fine, fine[-1] + 2e-4), total)

    value = (at(thrust.time) - at(thrust.time - window)) / window
    cell = replace(thrust, value=value, acquisition=Acquisition(window=window))
    return Recording(made.recording_id, "T1", (command, cell), source="averaged.h5")


@pytest.mark.parametrize("window", [0.05, 0.12])
def test_the_mean_over_the_window_is_predicted(window):
    seen, _ = as_sampled(averaged(window))
    data, theta = data_of([seen])
    assert data.histories[0].converter.window == window
    model, theta = placed({LAG: (0.08,)}, replace(theta, C=C, tares=(0.0,)))
    (told,), _ = raw(model, theta, data, with_rate=False)
    error = np.sqrt(np.mean((told - data.thrust[0]) ** 2))
    moment = replace(data, histories=(replace(data.histories[0], converter=Converter()),))
    (instant,), _ = raw(model, theta, moment, with_rate=False)
    assert error < 0.05
    assert error < 0.5 * np.sqrt(np.mean((instant - data.thrust[0]) ** 2))
