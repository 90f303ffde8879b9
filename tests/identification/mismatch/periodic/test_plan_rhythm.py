"""Lines that the plan makes itself: steps at equal times, and what a model leaves after each of them."""

import numpy as np
import pytest

from identification.mismatch.periodic import stage
from identification.mismatch.periodic.plan_rhythm import of_the_plan, within
from tests.identification.diagnosed_runs import TOP
from tests.identification.mismatch.small import estimated, history, short

HOLD = 3.0
SECONDS = 120.0


def after_steps(extra=0.0):
    """A twelfth of a newton for 40 ms after every step, whichever way it went, and a hum beside it."""

    def change(t, _V, F):
        since = (t - 0.0071) % HOLD
        return F + 20.0 * np.exp(-since / 0.08) + extra * np.sin(2 * np.pi * 7.123 * t)

    return change


def test_equal_holds_have_a_rhythm():
    bands = of_the_plan(history(short(seconds=SECONDS)))
    assert [0.5 * (low + high) for low, high in bands[:3]] == pytest.approx([1 / HOLD, 2 / HOLD, 3 / HOLD], rel=0.02)
    assert within(2 / HOLD, bands)
    assert not within(0.5 / HOLD, bands)


def test_holds_of_any_length_have_none():
    uneven = short(seconds=SECONDS)
    times = np.cumsum(np.random.default_rng(0).uniform(1.0, 5.0, 40))
    command = uneven.first_of("command_voltage")
    levels = TOP * np.sign(np.sin(np.arange(40.0) + 0.5)) * (1 + np.arange(40.0) % 5) / 5
    channels = tuple(
        type(c)(c.name, c.stream, c.quantity, c.unit, times, levels) if c is command else c for c in uneven.channels
    )
    assert of_the_plan(history(type(uneven)("uneven", "T1", channels))) == ()


def test_what_is_left_after_every_step_is_no_comb_of_lines():
    data, estimate = estimated({}, [short(change=after_steps(), rate=50.0, seconds=SECONDS)])
    assert stage.run(estimate.fit, data, data.histories).lines == ()


def test_a_true_line_is_found_beside_it():
    data, estimate = estimated({}, [short(change=after_steps(1.0), rate=50.0, seconds=SECONDS)])
    (line,) = stage.run(estimate.fit, data, data.histories).lines
    assert line.frequency == pytest.approx(7.123, abs=0.002)
