"""Which of several runs is the one that differs, and whether that is known: no sentence and no repair is asked here."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identification.mismatch.faults.between_runs import differing
from identification.mismatch.faults.comparison_of_runs import exchanged
from identification.recording import Recording
from tests.identification.mismatch.faults.wired_runs import edited, only, wired_run


def runs(*tops: float) -> list[Recording]:
    return [wired_run(seed, top) for seed, top in enumerate(tops, 1)]


def weaker(recording: Recording) -> Recording:
    """A current that is told at 0.4 of its size."""
    return edited(recording, "current", lambda v: 0.4 * v)


def swapped(recording: Recording) -> Recording:
    found = exchanged(recording, "command_voltage", "current")
    assert found is not None
    return found


def test_runs_that_agree_do_not_differ() -> None:
    assert differing(runs(12.0, 9.0, 11.0)) == ()
    assert differing([]) == ()


def test_of_three_runs_the_majority_is_right_and_the_factor_is_measured() -> None:
    first, second, third = runs(12.0, 9.0, 11.0)
    (one,) = differing([first, weaker(second), third])
    assert one.recording.recording_id == "id-2"
    assert one.beside is not None
    assert one.beside.recording_id in {"id-1", "id-3"}
    assert (one.runs, one.known) == (3, True)
    assert (one.changed.kind, one.changed.channel) == ("rescaled", "current")
    assert one.changed.factor == pytest.approx(0.4, rel=0.03)


def test_two_of_four_may_differ_each_in_its_own_way_and_stand_in_the_order_of_the_runs() -> None:
    first, second, third, fourth = runs(12.0, 9.0, 11.0, 10.0)
    fifth = wired_run(9, 12.0)
    found = differing([swapped(first), second, third, weaker(fourth), fifth])
    assert [(one.recording.recording_id, one.changed.kind) for one in found] == [
        ("id-1", "swapped"),
        ("id-4", "rescaled"),
    ]


@pytest.mark.parametrize("at", [0, 1])
def test_of_two_runs_a_factor_does_not_tell_which_and_the_later_is_named(at: int) -> None:
    both = runs(12.0, 11.0)
    both[at] = weaker(both[at])
    (one,) = differing(both)
    assert (one.recording.recording_id, one.known) == ("id-2", False)
    assert one.changed.factor == pytest.approx(0.4 if at else 2.5, rel=0.03)


@pytest.mark.parametrize("at", [0, 1])
def test_of_two_runs_the_laws_of_its_own_channels_tell_an_exchange(at: int) -> None:
    both = runs(12.0, 11.0)
    both[at] = swapped(both[at])
    (one,) = differing(both)
    assert (one.recording.recording_id, one.known) == (f"id-{at + 1}", True)


def test_a_run_by_itself_is_judged_by_its_own_channels() -> None:
    found = exchanged(wired_run(1), "command_voltage", "bus_voltage")
    assert found is not None
    (one,) = differing([found])
    assert (one.beside, one.runs, one.known) == (None, 1, True)
    assert {one.changed.channel, one.changed.other} == {"command_voltage", "bus_voltage"}


def test_vehicles_and_runs_without_two_channels_are_compared_with_nothing() -> None:
    first, second = runs(12.0, 11.0)
    assert differing([first, replace(weaker(second), kind="vehicle")]) == ()
    assert differing([first, only(weaker(second), "current")]) == ()
