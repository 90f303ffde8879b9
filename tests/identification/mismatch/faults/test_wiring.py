"""Runs beside one another: what is wired otherwise is named, put right or left out, and physics is no wiring."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.faults import wiring
from identification.mismatch.faults.channel_faults import Fault
from identification.mismatch.faults.comparison_of_runs import exchanged
from identification.mismatch.pipeline import diagnose
from identification.recording import Floats, Recording
from tests.identification.mismatch.faults.wired_runs import edited, only, values, wired_run


def strange(value: Floats) -> Floats:
    """As large as it was, and of something else."""
    rng = np.random.default_rng(3)
    walk = np.convolve(rng.normal(size=value.size + 39), np.ones(40) / np.sqrt(40), "valid")
    return float(np.mean(value)) + float(np.std(value)) * walk


def put(a: str, b: str) -> Callable[[Recording], Recording]:
    def change(recording: Recording) -> Recording:
        found = exchanged(recording, a, b)
        assert found is not None
        return found

    return change


WRONG: dict[str, tuple[str, set[str], Callable[[Recording], Recording]]] = {
    "voltage and current": ("swapped", {"command_voltage", "current"}, put("command_voltage", "current")),
    "supply and command": ("swapped", {"command_voltage", "bus_voltage"}, put("command_voltage", "bus_voltage")),
    "thrust and current": ("swapped", {"thrust", "current"}, put("thrust", "current")),
    "current at 0.35": ("rescaled", {"current"}, lambda r: edited(r, "current", lambda v: 0.35 * v)),
    "thrust in lbf": ("rescaled", {"thrust"}, lambda r: edited(r, "thrust", lambda v: v / 4.4482216)),
    "rate in rad/s": ("rescaled", {"rotation_rate"}, lambda r: edited(r, "rotation_rate", lambda v: 2 * np.pi * v)),
    "driver at 0.75": ("driver", {"command_voltage"}, lambda r: edited(r, "command_voltage", lambda v: v / 0.75)),
    "thrust of something else": ("strange", {"thrust"}, lambda r: edited(r, "thrust", strange)),
}


def told(found: wiring.Wired) -> list[tuple[str, str, set[str]]]:
    return [(f.recording_id, f.kind, {f.channel, f.other} - {""}) for f in found.faults]


@pytest.mark.parametrize("what", WRONG)
@pytest.mark.parametrize("at", [0, 2])
def test_of_three_runs_the_one_that_is_wired_otherwise_is_named(what: str, at: int) -> None:
    kind, channels, change = WRONG[what]
    runs = [wired_run(seed, top) for seed, top in ((1, 12.0), (2, 9.0), (3, 11.0))]
    wrong = [change(r) if i == at else r for i, r in enumerate(runs)]
    found = wiring.run(wrong, ())
    assert told(found) == [(f"id-{at + 1}", kind, channels)]
    (fault,) = found.faults
    assert f"run{at + 1}.csv" in fault.statement
    assert "check" in fault.statement
    assert 0.0 < fault.p_value < 1e-3
    if kind == "swapped" or "in" in what.split():
        assert [r.recording_id for r in found.recordings] == [r.recording_id for r in runs]
        for quantity in channels:
            np.testing.assert_allclose(values(found.recordings[at], quantity), values(runs[at], quantity), rtol=1e-6)
        assert "put right" in fault.done
    elif channels == {"current"}:
        assert found.recordings[at].first_of("current") is None
        assert "left out" in fault.done
    else:
        assert f"id-{at + 1}" not in {r.recording_id for r in found.recordings}


PHYSICS: dict[str, Callable[[int], Recording]] = {
    "the same": lambda seed: wired_run(seed),
    "half the range": lambda seed: wired_run(seed, 6.0),
    "weaker thrust by a fifth": lambda seed: wired_run(seed, gain=0.8),
    "a lower supply": lambda seed: wired_run(seed, drive=0.8, bus=19.2),
    "a short one": lambda seed: wired_run(seed, seconds=45.0),
    "command and thrust alone": lambda seed: only(wired_run(seed, drive=0.8), "command_voltage", "thrust"),
    "without a command": lambda seed: only(wired_run(seed), "rotation_rate", "thrust", "current"),
}


@pytest.mark.parametrize("what", PHYSICS)
def test_what_physics_does_from_run_to_run_is_no_wiring(what: str) -> None:
    for seed in range(4):
        runs = [wired_run(10 + seed), PHYSICS[what](20 + seed)]
        found = wiring.run(runs, ())
        assert found.faults == ()
        assert found.recordings == tuple(runs)


def test_of_two_runs_a_unit_tells_which_and_a_factor_does_not() -> None:
    first, second = wired_run(1), wired_run(2)
    (pounds,) = wiring.run([edited(first, "thrust", lambda v: v / 4.4482216), second], ()).faults
    assert (pounds.recording_id, pounds.parameters["factor"].value) == ("id-1", pytest.approx(1 / 4.4482216))
    assert "in lbf, told as N" in pounds.statement
    assert "nobody knows" not in pounds.statement
    (factor,) = wiring.run([edited(first, "current", lambda v: 0.35 * v), second], ()).faults
    assert factor.recording_id == "id-2", "the later one is named where nothing tells"
    assert "or in run1.csv: of two runs nobody knows" in factor.statement


def test_of_two_runs_one_in_kilonewtons_is_as_likely_as_the_other_in_millinewtons() -> None:
    first, second = wired_run(1), wired_run(2)
    (fault,) = wiring.run([first, edited(second, "thrust", lambda v: v / 1000)], ()).faults
    assert (fault.recording_id, fault.parameters["factor"].value) == ("id-2", pytest.approx(0.001))
    assert "it is in kN, told as N" in fault.statement
    assert "or in run1.csv: of two runs nobody knows" in fault.statement
    third = wired_run(3)
    (sure,) = wiring.run([first, edited(second, "thrust", lambda v: v / 1000), third], ()).faults
    assert "it is in kN, told as N" in sure.statement
    assert "nobody knows" not in sure.statement


@pytest.mark.parametrize("at", [0, 1])
def test_of_two_runs_the_laws_tell_in_which_two_channels_are_exchanged(at: int) -> None:
    runs = [wired_run(1), wired_run(2, 10.0)]
    runs[at] = put("command_voltage", "current")(runs[at])
    assert told(wiring.run(runs, ())) == [(f"id-{at + 1}", "swapped", {"command_voltage", "current"})]


def test_a_supply_that_sags_in_the_place_of_a_current_is_no_sign() -> None:
    runs = [wired_run(seed, sag=0.02, forward=True) for seed in (1, 2, 3)]
    runs[1] = put("current", "bus_voltage")(runs[1])
    assert told(wiring.run(runs, ())) == [("id-2", "swapped", {"current", "bus_voltage"})]


def test_without_a_third_channel_nobody_says_which_of_the_two_it_is() -> None:
    first, second = (only(wired_run(seed), "command_voltage", "thrust") for seed in (1, 2))
    (fault,) = wiring.run([first, edited(second, "thrust", strange)], ()).faults
    assert (fault.kind, {fault.channel, fault.other}) == ("strange", {"thrust", "command_voltage"})
    assert "no third channel tells" in fault.statement


def test_a_run_by_itself_shows_a_channel_that_follows_nothing() -> None:
    (exchange,) = wiring.run([put("command_voltage", "bus_voltage")(wired_run(1))], ()).faults
    assert {exchange.channel, exchange.other} == {"command_voltage", "bus_voltage"}
    alone = wiring.run([edited(wired_run(1), "thrust", strange)], ())
    assert told(alone) == [("id-1", "strange", {"thrust"})]
    assert len(alone.recordings) == 1, "it is all there is"
    assert "all there is" in alone.faults[0].done


def test_what_is_held_out_is_compared_too() -> None:
    first, second = wired_run(1), wired_run(2)
    found = wiring.run([first], [put("command_voltage", "current")(second)])
    np.testing.assert_array_equal(values(found.holdout[0], "command_voltage"), values(second, "command_voltage"))
    left_out = wiring.run([first], [edited(second, "command_voltage", lambda v: 1.4 * v)])
    assert (left_out.recordings, left_out.holdout) == ((first,), ())
    assert "run2.csv was left out" in left_out.faults[0].done


def test_a_fault_that_a_run_shows_by_itself_is_left_to_the_stage_that_finds_it() -> None:
    reversed_thrust = edited(wired_run(2), "thrust", lambda v: -v)
    assert wiring.run([wired_run(1), reversed_thrust], ()).faults == ()


def test_the_answer_begins_with_the_wiring_and_goes_on_with_physics() -> None:
    first, second = wired_run(1, seconds=90.0), wired_run(2, seconds=90.0)
    found = diagnose([first, put("command_voltage", "current")(second)])
    assert isinstance(found, Diagnosis)
    assert found.findings[0].effect == "channel_fault"
    assert set(found.findings[0].channels) == {"command_voltage", "current"}
    assert found.findings[0].recording == "id-2"
    assert {"dead_band", "asymmetry"} <= {f.effect for f in found.findings}
    assert any("was put right for the model" in note for note in found.notes)


def test_a_fault_says_what_is_done_once() -> None:
    fault = Fault("id-1", "current", "driver", "", 0.0)
    assert not fault.repairable
    assert replace(fault, kind="swapped").repairable
