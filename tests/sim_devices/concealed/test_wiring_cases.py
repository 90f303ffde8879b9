"""Runs in one of which something is wired otherwise: the fault is in that run alone, and is what it is called."""

import json

import numpy as np
import pytest

from sim_devices.concealed.cases.wiring import FIELD, KINDS, NOTHING
from sim_devices.concealed.draw import case
from sim_devices.concealed.sealing.on_disc import KINDS as ASKABLE
from sim_devices.concealed.sealing.on_disc import conceal
from sim_devices.concealed.sealing.records import rows


def drawn(kind, seed=3):
    return case(np.random.default_rng(seed), wiring=kind)


def columns(found):
    return {c.quantity: c.value for c in found.columns if not c.thruster}


def test_each_case_has_two_or_three_runs_with_effects_of_field_size():
    cases = [drawn(NOTHING, seed) for seed in range(40)]
    assert {len(c.runs) for c in cases} == {2, 3}
    assert all(2 <= len(c.effects) <= 5 and {e.effect for e in c.effects} <= set(FIELD) for c in cases)
    assert all(c.fault is None and all(run.drive == 1.0 for run in c.runs) for c in cases)
    dead = [e.amount for c in cases for e in c.effects if e.effect == "dead_band"]
    assert 0.02 <= min(dead) < 0.035 < 0.06 < max(dead) <= 0.10


@pytest.mark.parametrize("kind", KINDS)
def test_the_fault_is_in_one_run_and_the_others_are_as_they_would_be(kind):
    made, sound = drawn(kind), drawn(NOTHING)
    assert len(made.runs) == len(sound.runs)
    for i, (here, there) in enumerate(zip(rows(made), rows(sound), strict=True)):
        now, was = columns(here), columns(there)
        same = all(np.array_equal(now[q], was[q]) for q in was)
        assert same == (i != made.fault["run"])


def test_what_is_in_that_run_is_what_it_is_called():
    was = columns(rows(drawn(NOTHING))[drawn(KINDS[0]).fault["run"]])

    def now(kind):
        made = drawn(kind)
        return made.fault, columns(rows(made)[made.fault["run"]])

    _, found = now("current_for_command")
    assert np.array_equal(found["command_voltage"], was["current"])
    assert np.array_equal(found["current"], was["command_voltage"])
    _, found = now("bus_for_command")
    assert np.array_equal(found["bus_voltage"], was["command_voltage"])
    for kind in ("current_rescaled", "thrust_unit", "thrust_reversed", "rate_unit"):
        told, found = now(kind)
        np.testing.assert_allclose(found[told["channel"]], told["factor"] * was[told["channel"]])
    told, found = now("driver_changed")
    assert np.array_equal(found["command_voltage"], was["command_voltage"])
    assert np.ptp(found["rotation_rate"]) == pytest.approx(told["factor"] * np.ptp(was["rotation_rate"]), rel=0.12)
    told, found = now("thrust_strange")
    assert np.corrcoef(found["thrust"], was["thrust"])[0, 1] ** 2 < 0.45
    assert np.std(found["thrust"]) == pytest.approx(np.std(was["thrust"]), rel=0.3)


def test_it_can_be_asked_for_on_disc_and_the_seal_says_it(tmp_path):
    assert ASKABLE["wiring"] == [NOTHING, *KINDS]
    conceal({"token": "t", "seed": [1, 2], "wiring": "thrust_unit"}, tmp_path)
    seal = json.loads((tmp_path / "sealed" / "t.json").read_text())
    assert seal["fault"]["kind"] == "thrust_unit"
    assert seal["asked"]["wiring"] == "thrust_unit"
    assert len(seal["recordings"]) == len(list((tmp_path / "open" / "t").glob("[0-9].npz")))
    assert not (tmp_path / "open" / "t" / "drive.npz").exists()


def test_a_kind_that_is_not_known_is_refused():
    with pytest.raises(ValueError, match="wiring must be one of"):
        drawn("loose")
