"""A supply that moves while a level is held, before a dead band that ticks pass one by one, beside its closed form."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.physics.dead_band import DeadBand
from identification.physics.supply_sag import SupplySag
from identification.recording import Channel, Recording
from tests.identification.mismatch.small import data_of

LEVELS = np.array([0.0, 6.0, 10.0, -10.0, -6.0, 8.0, 0.0])
HOLD = 10.0
"""s."""
BAND = 0.4
"""V."""
FULL = 24.0
"""V."""
GIVES_WAY = 0.5
"""s: within a level."""


def supplied(t):
    """V: of a battery that comes half a second after its load."""
    start = HOLD * np.arange(LEVELS.size)
    which = np.searchsorted(start, t, side="right") - 1
    loaded = FULL - 0.02 * LEVELS**2
    before = np.concatenate([[FULL], loaded[:-1]])
    return loaded[which] + (before - loaded)[which] * np.exp(-(t - start[which]) / GIVES_WAY)


@pytest.mark.parametrize("form", ["shrink", "jump"])
def test_a_level_has_the_supply_of_its_own_time(form):
    """It had that of its first moment: 2.3 % of the rate was told for 1.4 %, and a knee was named for a sag."""
    t = np.arange(0.013, HOLD * LEVELS.size, 0.037)
    start = HOLD * np.arange(LEVELS.size)
    fed = LEVELS[np.searchsorted(start, t, side="right") - 1] * supplied(t) / FULL
    n = np.where(np.abs(fed) > BAND, fed - (np.sign(fed) * BAND if form == "shrink" else 0.0), 0.0)
    seen = np.arange(0.0, HOLD * LEVELS.size, 0.02)
    recording = Recording(
        "sagging",
        "T1",
        (
            Channel("command_voltage", "command", "command_voltage", "V", start, LEVELS),
            Channel("thrust", "cell", "thrust", "N", t, 0.2 * n * np.abs(n)),
            Channel("rotation_rate", "drive", "rotation_rate", "rev/s", t, n),
            Channel("bus_voltage", "drive", "bus_voltage", "V", seen, supplied(seen)),
        ),
    )
    data, _ = data_of([recording])
    model = Model((SupplySag(), DeadBand(form)))
    theta = Theta(0.2, ((1.0,), (BAND,)), (0.0,), k=1.0)
    thrust, rate = raw(model, theta, data, with_rate=True)
    clear = data.histories[0].since_step > 0.1
    rows = data.histories[0].rate_rows
    assert np.max(np.abs(rate[0] - data.histories[0].rates)[clear[rows]]) < 0.01
    assert np.max(np.abs(thrust[0] - data.thrust[0])[clear[data.rows[0]]]) < 0.03
