"""Where the fit of a threshold begins, on ramps of which the noise has taken what is wrong for the rate's own."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.select.screening import refined
from identification.physics.dead_band import DeadBand
from identification.recording import Channel, Recording
from tests.identification.mismatch.small import estimated

C, HALF_WIDTH, TICK, SECONDS = 0.1, 2.4, 0.02, 200.0


def slow_ramps():
    """Up to 27 V and back; the rate is read to a hundredth, and stands still below 2.4 V."""
    start = np.arange(0.0, SECONDS, TICK)
    volts = 27.0 * np.sin(2 * np.pi * start / 50.0)
    t = np.arange(0.003, SECONDS, 0.02)
    V = volts[np.searchsorted(start, t, side="right") - 1]
    n = V * (np.abs(V) > HALF_WIDTH)
    rng = np.random.default_rng(2)
    return Recording(
        "ramps",
        "T1",
        (
            Channel("command_voltage", "command", "command_voltage", "V", start, volts),
            Channel("thrust", "cell", "thrust", "N", t, C * n * np.abs(n) + rng.normal(0, 0.3, t.size)),
            Channel("rotation_rate", "drive", "rotation_rate", "rev/s", t, 1.02 * n + rng.normal(0, 0.01, t.size)),
        ),
    )


@pytest.mark.parametrize("begun", [2.1, 2.52, 3.0])
def test_it_begins_where_the_rows_part(begun):
    """Trials of five per cent lie on either side of a valley of one; the best of them was 0.58 V, and the whole dead
    band was told as a winding, a coupling and a smaller one."""
    data, estimate = estimated({}, [slow_ramps()])
    assert estimate.rate_noise is not None
    (found,) = refined(estimate.fit, data, estimate.weights, DeadBand("jump"), (begun,))
    assert found == pytest.approx(HALF_WIDTH, abs=0.02)
