"""What clips: told by current and rate, by a tare and by silence; rivals where nothing tells."""

import re
from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.estimate import fit_without
from identification.mismatch.name.naming import checks
from identification.mismatch.select.exchange.rivals import swaps
from identification.mismatch.select.limits.clipping import beyond, contradiction
from identification.physics.cavitation import Cavitation
from identification.physics.command_saturation import CommandSaturation
from identification.physics.load_cell_saturation import LoadCellSaturation
from identification.physics.winding_resistance import WindingResistance
from identification.recording import Acquisition, Channel
from tests.identification.diagnosed_runs import NOISE, C, run
from tests.identification.mismatch.pipeline.whole_diagnoses import diagnosed
from tests.identification.mismatch.small import known_noise, rng

LIMIT = 66.0
"""N, at 11.5 V of 12."""
DRIVE, CELL = CommandSaturation("hard"), LoadCellSaturation("before_noise")


def clipping(what, *, tare=0.0, beside=(), limit=LIMIT):
    """Readings that end at `limit` N, with all noise on top: of a drive, or of a cell before its amplifier.

    Current goes as the square of the voltage, the rate in proportion, with noise of one and of half a per cent.
    """

    def cell(_t, _V, F):
        return np.clip(F + tare, -limit, limit) - tare

    def drive(_t, _V, F):
        return np.clip(F, -limit, limit)

    made = run(cell if what == "cell" else drive, seconds=120.0, rate=20.0, tare=tare)
    command, thrust = made.channels
    V = command.value[np.maximum(np.searchsorted(command.time, thrust.time, side="right") - 1, 0)]
    V = V if what == "cell" else np.clip(V, -np.sqrt(limit / C), np.sqrt(limit / C))
    noise = rng(5).standard_normal((2, V.size))
    known = {
        "current": Channel("current", "meter", "current", "A", thrust.time, 0.07 * V**2 + 0.2 + 0.1 * noise[0]),
        "rotation_rate": Channel("rate", "tacho", "rotation_rate", "rev/s", thrust.time, 3 * V + 0.2 * noise[1]),
    }
    return replace(made, channels=(command, thrust, *(known[q] for q in beside)))


def fitted(term, values, recording):
    data, estimate = known_noise({term: values}, [recording], NOISE)
    return estimate, data


@pytest.mark.parametrize("quantity", ["current", "rotation_rate"])
@pytest.mark.parametrize("what", ["drive", "cell"])
@pytest.mark.parametrize("term", [DRIVE, CELL])
def test_what_else_does_beyond_a_limit_is_measured(quantity, what, term):
    start = (9.6,) if term is DRIVE else (46.0,)
    estimate, data = fitted(term, start, clipping(what, beside=(quantity,), limit=46.0))
    (told,) = beyond(estimate.fit, term, data)
    assert told.quantity == quantity
    assert told.share == pytest.approx(1.0 if what == "cell" else told.allowed, abs=max(4 * told.std, 0.05))
    assert 0.2 < told.allowed < 0.6, "the level below the limit is 8 V"
    said = contradiction(estimate.fit, term, estimate.noise, data)
    assert bool(said) is ((term is DRIVE) is (what == "cell"))
    if said:
        assert quantity.replace("_", " ") in said
        assert said in {check.failed for check in checks(estimate, term, data, 1)}


def test_a_rate_that_bends_by_itself_does_not_stop_with_the_thrust():
    """A third of the voltage is lost in the winding: over the command the rate bends, and seemed to stop at the cell's
    limit. Over the rate that the model has it goes on."""
    loss, limit = 0.05, 26.0

    def back_emf(V):
        return 2.0 * V / (1.0 + np.sqrt(1.0 + 4.0 * loss * np.abs(V)))

    def cell(_t, V, _F):
        return np.clip(C * back_emf(V) * np.abs(back_emf(V)), -limit, limit)

    made = run(cell, seconds=120.0, rate=20.0)
    command, thrust = made.channels
    V = command.value[np.maximum(np.searchsorted(command.time, thrust.time, side="right") - 1, 0)]
    turning = 3 * back_emf(V) + 0.02 * rng(5).standard_normal(V.size)
    rate = Channel("rate", "tacho", "rotation_rate", "rev/s", thrust.time, turning)
    winding = WindingResistance()
    values = {winding: (loss,), CELL: (limit,)}
    data, estimate = known_noise(values, [replace(made, channels=(command, thrust, rate))], NOISE)
    (told,) = beyond(estimate.fit, CELL, data)
    assert told.share == pytest.approx(1.0, abs=max(4 * told.std, 0.05))
    assert contradiction(estimate.fit, CELL, estimate.noise, data) == ""


def in_steps(recording, step):
    """Its current as a controller tells it, whose noise is far less than a step."""
    command, thrust, current = recording.channels
    read = np.round(current.value / step) * step
    return replace(
        recording, channels=(command, thrust, replace(current, value=read, acquisition=Acquisition(quantum=step)))
    )


@pytest.mark.parametrize(("step", "least"), [(2.0, 0.1), (0.1, 0.005)])
def test_a_current_that_is_read_in_steps_is_as_sure_as_they_are(step, least):
    """3.2 A stood for 3.28 in steps of 0.1: "the current stops rising, the drive clips", and a cell that did had no
    name."""
    estimate, data = fitted(CELL, (46.0,), in_steps(clipping("cell", beside=("current",), limit=46.0), step))
    (told,) = beyond(estimate.fit, CELL, data)
    assert told.std > least
    assert told.share == pytest.approx(1.0, abs=3 * told.std)
    assert contradiction(estimate.fit, CELL, estimate.noise, data) == ""
    estimate, data = fitted(CELL, (46.0,), in_steps(clipping("drive", beside=("current",), limit=46.0), 0.1))
    assert "current stops rising" in contradiction(estimate.fit, CELL, estimate.noise, data)


def test_nothing_is_said_where_nothing_was_recorded_or_nothing_clips():
    estimate, data = fitted(DRIVE, (11.0,), clipping("drive"))
    assert beyond(estimate.fit, DRIVE, data) == ()
    assert contradiction(estimate.fit, DRIVE, estimate.noise, data) == ""
    recorded = clipping("drive", beside=("current",), limit=46.0)
    estimate, data = fitted(Cavitation("linear"), (0.05, 9.0), recorded)
    assert beyond(estimate.fit, Cavitation("linear"), data) == ()
    far, data = fitted(DRIVE, (12.0,), clipping("cell", beside=("current",), limit=500.0))
    assert beyond(far.fit, DRIVE, data) == (), "no row is beyond"


def test_noise_of_the_force_ends_with_the_cell_and_that_of_the_amplifier_goes_on():
    made = clipping("drive", limit=46.0)
    command, thrust = made.channels
    loud = 0.05 * np.abs(thrust.value) * rng(3).standard_normal(thrust.value.size)
    for value, doubted in ((thrust.value + loud, True), (thrust.value, False)):
        data, estimate = known_noise({CELL: (46.0,)}, [replace(made, channels=(command, replace(thrust, value=value)))])
        noise = replace(estimate.noise, proportional=0.05**2)
        assert bool(contradiction(estimate.fit, CELL, noise, data)) is doubted


def test_the_same_limit_in_another_form_is_tried_where_it_is_and_goes_before_one_that_noise_contradicts():
    """A cell that stops half a newton below the largest force: trials at other limits look like nothing of it."""
    hard = LoadCellSaturation("hard")
    data, estimate = known_noise({hard: (71.0,)}, [clipping("cell", limit=71.5)], NOISE)
    assert "noise goes on" in contradiction(estimate.fit, hard, estimate.noise, data)
    found = swaps(estimate, hard, fit_without(estimate, hard, data), data, (hard, CELL))
    (rival,) = [each for each in found if each.term == CELL]
    assert rival.fit.values[CELL][0] == pytest.approx(71.5, abs=0.1)
    assert rival.bic_loss < 4


@pytest.mark.parametrize("what", ["drive", "cell"])
def test_drive_and_cell_are_rivals_where_nothing_tells_them_apart(what):
    found = diagnosed(clipping(what))
    assert found.verdict == "ambiguous"
    (one,) = found.findings
    assert {"command_saturation", "load_cell_saturation"} <= {one.effect, *(r.effect for r in one.rivals)}


@pytest.mark.parametrize("beside", [("current",), ("rotation_rate",)])
@pytest.mark.parametrize(("what", "effect"), [("drive", "command_saturation"), ("cell", "load_cell_saturation")])
def test_current_or_rate_tell_which_of_them_clips(what, effect, beside):
    found = diagnosed(clipping(what, beside=beside))
    (one,) = found.findings
    assert one.effect == effect
    assert not {"command_saturation", "load_cell_saturation"} & {r.effect for r in one.rivals}
    assert (one.parameters["limit"].value) == pytest.approx(LIMIT if what == "cell" else np.sqrt(LIMIT / C), rel=0.005)


def test_a_tare_tells_too_for_a_cell_clips_at_one_reading_either_way():
    for what, effect in (("drive", "command_saturation"), ("cell", "load_cell_saturation")):
        (one,) = diagnosed(clipping(what, tare=3.0)).findings
        assert one.effect == effect
        assert not {"command_saturation", "load_cell_saturation"} & {r.effect for r in one.rivals}


def test_readings_whose_zero_was_set_behind_what_clips_end_at_two_values():
    """Seen as one limit either way there were a drift, a jump of the zero and an even bend beside it."""
    made = clipping("cell", beside=("rotation_rate",), limit=46.0)
    command, thrust, rate = made.channels
    found = diagnosed(replace(made, channels=(command, replace(thrust, value=thrust.value + 2.0), rate)))
    (one,) = found.findings
    assert found.unexplained is None
    assert (one.effect, one.form) == ("load_cell_saturation", "off_centre_before_noise")
    assert one.parameters["limit"].value == pytest.approx(46.0, abs=0.1)
    assert one.parameters["middle"].value == pytest.approx(2.0, abs=0.1)
    ends = re.search(r"readings end at (-[\d.]+) and ([\d.]+) N", one.statement)
    assert ends is not None
    assert [float(end) for end in ends.groups()] == pytest.approx([-44.0, 48.0], abs=0.2)
