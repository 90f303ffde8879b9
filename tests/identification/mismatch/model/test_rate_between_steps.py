"""The rate of a rotor on its way between two steps, and behind a dead band, beside its own closed form."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.model import Given, Model
from identification.mismatch.model.parameters import Theta
from identification.physics.command_saturation import CommandSaturation
from identification.physics.dead_band import DeadBand
from identification.physics.motor_lag import MotorLag
from identification.physics.winding_resistance import WindingResistance
from identification.recording import Channel, Recording
from tests.identification.mismatch.small import data_of

PER_DRIVER = 1.8
"""rev/s per volt."""
SPACING = 0.0071
"""s between samples: 141 a second."""
TAU = 0.09
LEVELS = (0.0, 9.0, -10.5, 4.0, 0.3, 10.0)
HOLD = 3.0
"""s."""
LATTICE = 0.04
"""V: a threshold amid two values is further from both than a jump is spread."""


def first_order(n, w, since):
    return w + (n - w) * np.exp(-since / TAU)


def by_torque(n, w, since):
    """n' = (w|w| - n|n|) / (2 TAU w_max), in steps of 20 us."""
    order = np.argsort(since)
    out, at = np.empty(since.size), 0.0
    for k in order:
        while at < since[k]:
            dt = min(2e-5, since[k] - at)
            push = (w * abs(w) - n * abs(n)) / (2 * TAU * max(map(abs, LEVELS)))
            half = n + 0.5 * dt * push
            n += dt * (w * abs(w) - half * abs(half)) / (2 * TAU * max(map(abs, LEVELS)))
            at += dt
        out[k] = n
    return out


def stepped(way):
    start = HOLD * np.arange(len(LEVELS))
    t = np.arange(0.0041, HOLD * len(LEVELS), SPACING)
    which = np.searchsorted(start, t, side="right") - 1
    n = np.zeros(t.size)
    begin = LEVELS[0]
    for i, level in enumerate(LEVELS):
        mine = which == i
        found = way(begin, level, np.append(t[mine] - start[i], HOLD))
        n[mine], begin = found[:-1], found[-1]
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, np.array(LEVELS)),
        Channel("thrust", "cell", "thrust", "N", t, 0.2 * n * np.abs(n)),
        Channel("rotation_rate", "drive", "rotation_rate", "rev/s", t, PER_DRIVER * n),
    )
    return data_of([Recording("stepped", "T1", channels)])[0]


@pytest.mark.parametrize(("form", "way"), [("first_order", first_order), ("quadratic", by_torque)])
def test_rows_of_the_rate_are_means_at_its_samples(form, way):
    """A straight line through means was off by 0.07 rev/s, ten times the noise of a good tachometer."""
    data = stepped(way)
    h = data.histories[0]
    lag = MotorLag(form)
    for model, theta in (
        (Model((lag,)), Theta(0.2, ((TAU,),), (0.0,), k=PER_DRIVER)),
        (Model((), (Given(lag, (TAU,), data.scale),)), Theta(0.2, (), (0.0,), k=PER_DRIVER)),
    ):
        _, told = raw(model, theta, data, with_rate=True)
        assert np.max(np.abs(told[0] - h.rates)) < 1e-3


def test_what_the_band_swallows_bends_nothing():
    """Of 0.3 V nothing reaches the rotor beside a dead band of 0.4 V, nor does the way there count."""
    data = stepped(first_order)
    given = tuple(Given(t, v, data.scale) for t, v in ((DeadBand("jump"), (0.4,)), (MotorLag("first_order"), (TAU,))))
    _, told = raw(Model((), given), Theta(0.2, (), (0.0,), k=PER_DRIVER), data, with_rate=True)
    at = data.histories[0].rate_sampled[data.histories[0].rate_rows]
    low = (at > 4 * HOLD + 1.5) & (at < 5 * HOLD)
    assert low.any()
    assert np.max(np.abs(told[0][low])) < 1e-4


def beyond(command, half_width, band):
    """What acts of it."""
    acting = command if band.form == "jump" else command - np.sign(command) * half_width
    return np.where(np.abs(command) > half_width, acting, 0.0)


def ticking(half_width, band):
    """A sine of 9 V, written twenty times a second, on a rotor that begins to turn behind a dead band. Intervals keep
    step with samples of the thrust, so that a tick falls within one."""
    start = np.arange(0.0, 240.0, 0.049)
    command = LATTICE * np.round(9.0 / LATTICE * np.sin(2 * np.pi * start / 60.0))

    def turning(t):
        return beyond(command[np.searchsorted(start, t, side="right") - 1], half_width, band)

    t, force = np.arange(0.094, 239.0, 0.098), np.arange(0.0113, 239.9, 0.0302)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, command),
        Channel("thrust", "cell", "thrust", "N", force, 0.2 * turning(force) * np.abs(turning(force))),
        Channel("rotation_rate", "drive", "rotation_rate", "rev/s", t, PER_DRIVER * turning(t)),
    )
    return data_of([Recording("ticking", "T1", channels)])[0]


@pytest.mark.parametrize("band", [DeadBand("jump"), DeadBand("shrink")])
def test_a_rotor_that_begins_to_turn_at_a_tick_is_read_before_it_or_after(band):
    """A slope said half of the jump, twenty sigma of a good tachometer, and a lag of 0.4 ms was told to repair that."""
    data = ticking(15.5 * LATTICE, band)
    model, theta = Model((band,)), Theta(0.2, ((15.5 * LATTICE,),), (0.0,), k=PER_DRIVER)
    _, told = raw(model, theta, data, with_rate=True)
    assert np.max(np.abs(told[0] - data.histories[0].rates)) < 1e-3


def ramping(half_width, taken, band, limit=np.inf):
    """Fast ramps up and down in ticks of 12 ms on a rotor that lags behind a dead band and a drive that clips at
    `limit`, whose intervals hold several samples and several ticks; `taken`: by the winding, 1/V."""
    start = np.arange(0.0, 400.0, 0.0119)
    command = LATTICE * np.round(9.0 / LATTICE * (2 * np.abs((start / 12.0 + 0.5) % 2 - 1) - 1))
    acting = beyond(np.clip(command, -limit, limit), half_width, band)
    driving = np.sign(acting) * (np.sqrt(1 + 4 * taken * np.abs(acting)) - 1) / (2 * taken) if taken else acting
    n = np.zeros(start.size)
    for i in range(1, start.size):
        n[i] = first_order(n[i - 1], driving[i - 1], start[i] - start[i - 1])
    t = np.arange(0.0041, 399.0, 0.0199)
    last = np.searchsorted(start, t, side="right") - 1
    seen = first_order(n[last], driving[last], t - start[last])
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, command),
        Channel("thrust", "cell", "thrust", "N", t, 0.2 * seen * np.abs(seen)),
        Channel("rotation_rate", "drive", "rotation_rate", "rev/s", t, PER_DRIVER * seen),
    )
    return data_of([Recording("ramping", "T1", channels)])[0]


@pytest.mark.parametrize("taken", [0.0, 0.03])
@pytest.mark.parametrize("band", [DeadBand("jump"), DeadBand("jump").sharp(), DeadBand("shrink")])
def test_a_rotor_that_lags_behind_a_band_begins_to_turn_at_a_tick(band, taken):
    """A threshold was passed by a part of an interval: 0.05 rev/s off, here, and 0.18 in a case of the proof, fifteen
    sigma; and one that is known acted on what the winding had left of the command. A band that shrinks the command too
    was passed by a slope: 0.9 rev/s off in another case, and a lag of 0.2 ms was told for it."""
    data = ramping(15.5 * LATTICE, taken, band)
    known = [(band, (15.5 * LATTICE,)), (MotorLag("first_order"), (TAU,))]
    known += [(WindingResistance(), (taken,))] if taken else []
    model = Model((), tuple(Given(term, values, data.scale) for term, values in known))
    thrust, rate = raw(model, Theta(0.2, (), (0.0,), k=PER_DRIVER), data, with_rate=True)
    assert np.max(np.abs(rate[0] - data.histories[0].rates)) < (4e-3 if taken else 1e-3)
    assert np.max(np.abs(thrust[0] - data.thrust[0])) < 2e-3


@pytest.mark.parametrize("width", [0.0, 15.5 * LATTICE])
def test_a_drive_clips_ticks_one_by_one_and_a_band_behind_it_lets_them_pass_so(width):
    """A band was none of the first terms beside a drive that clips, and ticks crossed it by a slope again."""
    band, limit = DeadBand("shrink"), 7.013
    data = ramping(width, 0.03, band, limit)
    known = [(CommandSaturation("hard"), (limit,)), (MotorLag("first_order"), (TAU,)), (WindingResistance(), (0.03,))]
    known += [(band, (width,))] if width else []
    model = Model((), tuple(Given(term, values, data.scale) for term, values in known))
    thrust, rate = raw(model, Theta(0.2, (), (0.0,), k=PER_DRIVER), data, with_rate=True)
    assert np.max(np.abs(rate[0] - data.histories[0].rates)) < 1e-3
    assert np.max(np.abs(thrust[0] - data.thrust[0])) < 1e-3
