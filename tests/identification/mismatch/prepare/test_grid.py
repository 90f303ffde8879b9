"""Intervals of a run: where they begin and end."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.prepare.grid import Held, edges_of
from identification.recording import Channel

SPACING = 0.041


@pytest.mark.parametrize("phase", [0.1, 1.6, 2.9, 4.4])
def test_what_is_held_and_what_moves_after_it_share_no_interval(phase):
    """A level of ten seconds, then a ramp in so many ticks of 11 ms that they are no edges."""
    start = 10.0 + phase * SPACING
    ticks = np.arange(2000)
    command = Channel(
        "V",
        "command",
        "command_voltage",
        "V",
        np.append(0.0, start + 0.011 * ticks),
        10.0 - np.append(0, 0.005 * (ticks + 1)),
    )
    time = np.arange(0.0, 32.0, SPACING)
    edges = edges_of(time, Held(command, 32.0), 1000)
    (at,) = np.flatnonzero((edges[:-1] <= start) & (edges[1:] > start))
    assert start - edges[at] < SPACING
    assert edges[at] - edges[at - 2] > 5 * SPACING, "what is held stays in long intervals"


def test_samples_before_a_step_have_intervals_of_their_own_where_the_force_comes_early():
    command = Channel("V", "command", "command_voltage", "V", np.array([0.0, 5.0]), np.array([2.0, 8.0]))
    time = np.arange(0.01, 10.0, 0.02)
    held = Held(command, 10.0)
    usual, early = edges_of(time, held, 1000), edges_of(time, held, 1000, early=0.03)
    assert usual[usual < 5.0][-1] < 4.9, "nothing moves there by itself"
    own = time[(time > 5.0 - 0.03 - 2 * 0.02) & (time < 5.0)]
    assert own.size == 3
    for at in own:
        low, high = early[early < at][-1], early[early > at][0]
        assert (at - low, high - at) == (pytest.approx(0.0015, abs=1e-6), pytest.approx(0.0015, abs=1e-6))
    assert np.array_equal(early[early >= 5.0], usual[usual >= 5.0])
    assert 5.0 in early
