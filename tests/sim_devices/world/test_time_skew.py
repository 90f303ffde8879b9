"""A late force, where the world's steps are uneven as in virtual time: that of the step the instant falls into."""

import pytest

from sim_devices.world.effects.stand import TimeSkew
from sim_devices.world.state import State

EVEN = [0.002 * i for i in range(1, 60)]
UNEVEN = [0.0013 * i + 0.0004 * (i % 3) for i in range(1, 90)]


@pytest.mark.parametrize("ends", [EVEN, UNEVEN])
def test_a_step_of_the_force_comes_after_the_delay(ends):
    skew, state, before, late = TimeSkew(0.03), State(), 0.0, []
    began = ends[10]
    for state.t in ends:
        late.append(skew.apply(1.0 if state.t > began else 0.0, state, state.t - before))
        before = state.t
    came = ends[late.index(1.0)]
    assert late == sorted(late), "it stays"
    assert began + 0.03 - 0.0005 <= came <= began + 0.03 + 0.0025, "no earlier, and within the step that it falls into"
