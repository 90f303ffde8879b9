"""Whether what a second run shows beyond a twin is new, was there before, or could not have been seen then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.flexible_terms.flexible import Flexible
from identification.mismatch.answer.against_twin import twin_of
from identification.mismatch.compare.earlier_recordings import Later, put_to_earlier
from identification.mismatch.compare.saved_model_baseline import starting
from identification.mismatch.estimate.estimate import refresh
from identification.mismatch.model.model import extended
from identification.physics.asymmetry import Asymmetry
from identification.physics.command_saturation import CommandSaturation
from identification.physics.dead_band import DeadBand
from identification.physics.heating import MeasuredHeating
from identification.recording import Channel
from tests.identification.diagnosed_runs import TOP, dead_band
from tests.identification.mismatch.small import data_of, known_noise, short

BAND, UNEVEN = DeadBand(), Asymmetry()
LIMIT = CommandSaturation()


def uneven(_time, _volts, force):
    return np.where(force < 0, 0.85, 1.0) * force


def clipped(at):
    return lambda volts: np.clip(volts, -at, at)


def asked(first, second, term, begin):
    """Of a term found in `second` against the twin of `first`, in which the asymmetry was named."""
    data, estimate = known_noise({UNEVEN: (0.9,)}, [first])
    twin = twin_of(estimate, data, [first], None)
    data, theta, model = starting(twin)(*data_of([second]))
    found = refresh(*extended(model, theta, term, begin), data, None, None)
    told, notes = put_to_earlier(twin, [first], Later([second], data, found), [term])
    assert notes == ()
    return told[term]


def test_an_effect_that_came_on_top_is_new():
    told = asked(short(change=uneven), short(change=uneven, volts=dead_band(0.6), seed=1), BAND, (0.5,))
    assert told.since == "changed"
    assert told.loss > 100.0


def test_what_its_own_recordings_want_as_well_is_not_new():
    first = short(change=uneven, volts=dead_band(0.6))
    told = asked(first, short(change=uneven, volts=dead_band(0.6), seed=1), BAND, (0.5,))
    assert told.since == "there before"
    assert told.loss < -100.0


def test_a_value_that_was_known_badly_is_not_added_to():
    """The twin says 0.5 V of a dead band that is, and was, at 0.6 V."""
    first = short(change=uneven, volts=dead_band(0.6))
    data, estimate = known_noise({UNEVEN: (0.9,), BAND: (0.5,)}, [first])
    twin = twin_of(estimate, data, [first], None)
    off = [t if t.effect != "dead_band" else replace(t, parameters={"half_width": 0.5}) for t in twin.terms]
    twin = replace(twin, terms=tuple(off))
    second = short(change=uneven, volts=dead_band(0.6), seed=1)
    data, theta, model = starting(twin)(*data_of([second]))
    found = refresh(*extended(model, theta, BAND, (0.1,)), data, None, None)
    told, _ = put_to_earlier(twin, [first], Later([second], data, found), [BAND])
    assert told[BAND].since == "there before"


def below(recording, highest):
    """The same with its levels at rest where they are higher: it says nothing of what happens there."""
    command, thrust = recording.channels
    level = np.where(np.abs(command.value) > highest, 0.0, command.value)
    now = level[np.maximum(np.searchsorted(command.time, thrust.time, side="right") - 1, 0)]
    value = np.where(now == 0.0, thrust.value[0], thrust.value)
    noise = 0.3 * np.random.default_rng(9).standard_normal(value.size)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", command.time, level),
        Channel("thrust", "cell", "thrust", "N", thrust.time, np.where(now == 0.0, 1.5 + noise, value)),
    )
    return type(recording)(recording.recording_id, recording.thruster, channels, source=recording.source)


@pytest.mark.parametrize(("highest", "since"), [(8.0, "not shown before"), (TOP, "changed")])
def test_a_limit_above_all_earlier_levels_may_be_old(highest, since):
    first = below(short(change=uneven), highest)
    told = asked(first, short(change=uneven, volts=clipped(9.0), seed=1), LIMIT, (9.5,))
    assert told.since == since


def test_nobody_is_asked_without_recordings_or_terms():
    first = short(change=uneven)
    data, estimate = known_noise({UNEVEN: (0.9,)}, [first])
    twin = twin_of(estimate, data, [first], None)
    later = Later([first], data, estimate)
    assert put_to_earlier(twin, [], later, [UNEVEN]) == ({}, ())
    assert put_to_earlier(twin, [first], later, [BAND]) == ({}, ()), "a term that is not in the model"
    other = short(thruster="T2")
    told, notes = put_to_earlier(twin, [first, other], later, [UNEVEN])
    assert told == {}
    assert "several thrusters" in notes[0]


SHAPE = Flexible("command_voltage", "V", (-6.0, -3.0, 0.0, 3.0, 6.0), (2,), ("force",), 1)
"""Of what a dead band takes, well enough."""


def test_a_shape_without_a_name_may_have_been_there_before_and_may_be_new():
    second = short(change=uneven, volts=dead_band(0.9), seed=1)
    begin = (0.1, 0.1, -0.1, -0.1)
    was = asked(short(change=uneven, volts=dead_band(0.9)), second, SHAPE, begin)
    assert (was.since, was.loss < -50.0) == ("there before", True)
    new = asked(short(change=uneven), second, SHAPE, begin)
    assert (new.since, new.loss > 50.0) == ("changed", True)


def test_what_looks_at_a_channel_that_was_not_recorded_then_is_not_asked():
    first, second = short(), short(seed=1)
    data, estimate = known_noise({UNEVEN: (0.99,)}, [first])
    twin = twin_of(estimate, data, [first], None)
    command, thrust = second.channels
    warm = Channel("motor_temperature", "drive", "motor_temperature", "K", thrust.time, 300.0 + 0.1 * thrust.time)
    second = replace(second, channels=(command, thrust, warm))
    term = MeasuredHeating("measured_winding")
    data, theta, model = starting(twin)(*data_of([second]))
    found = refresh(*extended(model, theta, term, (1e-4,)), data, None, None)
    told, notes = put_to_earlier(twin, [first], Later([second], data, found), [term])
    assert told == {}
    assert notes == ("Whether heating is new was not asked: behind the twin no motor_temperature was recorded.",)
