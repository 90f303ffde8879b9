"""What lines and a saved model add to an answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.flexible_terms.flexible import Flexible
from identification.mismatch.answer.against_twin import changed_constant, given_values, twin_of, with_twin
from identification.mismatch.answer.periodic_findings import (
    line_finding,
    line_place,
    line_values,
    told_lines,
    twin_line,
    with_lines,
)
from identification.mismatch.answer.report_assembly import values_of
from identification.mismatch.compare.saved_model_baseline import given
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.model import extended
from identification.mismatch.periodic.periodic_disturbances import Line
from identification.mismatch.periodic.rotor_angle import Part
from identification.mismatch.value import Value, Where
from identification.twin import Twin, TwinTerm, names_of
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.answer.answered import BAND, UNEVEN, draft, finding
from tests.identification.mismatch.small import known_noise, short

TOLD = Value(0.4, 0.0, "N/V^2")
"""C of which no rival or other form says more than the fit."""


def line(frequency=20.0, amplitude=1.0, *, ratio=None, gain=100.0, rival=None, unit="rev"):
    kind = "fixed" if ratio is None else "rotation"
    std = None if ratio is None else 0.001
    return Line(
        kind,
        frequency,
        0.01,
        ratio,
        std,
        amplitude,
        0.05,
        0.3,
        0.1,
        1e-9,
        gain,
        f"A line at {frequency:g} Hz.",
        rival=rival,
        parts=(Part(0, 0.0, 9.0, 1.0, 0.0),),
        unit=unit,
        band=(frequency - 0.1, frequency + 0.1),
        power=0.5,
    )


def test_a_line_is_a_finding_with_its_numbers_and_its_rival():
    found = line_finding(line(ratio=3.0))
    assert found.effect == "periodic_disturbance"
    assert found.parameters["periods_per_turn"] == Value(3.0, 0.001, "1")
    assert found.parameters["frequency"] == Value(20.0, 0.01, "Hz")
    assert found.probability == 1.0
    other = line_finding(line(gain=100.0, rival=line(ratio=3.0, gain=99.0)))
    (rival,) = other.rivals
    assert (rival.form, rival.bic_loss) == ("rotation", pytest.approx(1.0))
    assert other.probability == pytest.approx(1 / (1 + np.exp(-0.5)))
    far = line_finding(line(gain=1000.0, rival=line(ratio=3.0, gain=10.0)))
    assert far.rivals == ()


def test_of_volt_seconds_the_unit_is_told_and_of_a_slipping_phase_none():
    values = line_values(twin_line(replace(line(ratio=0.4, unit="V s"), phase=None, phase_std=None)))
    assert values["periods_per_volt_second"].unit == "1/(V s)"
    assert "phase" not in values


def test_a_place_of_a_line_is_its_share_of_the_residual():
    place = line_place(line(), 2.0)
    assert place.where == Where("frequency", 19.9, 20.1, "Hz")
    assert place.share == pytest.approx(0.5 / 4.0)
    assert place.statement == "12 % of the residual lies at frequency 19.9 to 20.1 Hz: a line of one frequency."
    assert line_place(line(), 0.0).share == 1.0
    assert "goes with the rotor" in line_place(line(ratio=3.0), 2.0).statement
    assert "at one speed" in line_place(line(rival=line(ratio=3.0)), 2.0).statement


def twin(*lines, **changes):
    _, estimate = known_noise({BAND: (1.0,)}, [short(volts=dead_band(1.2))])
    data, _ = known_noise({BAND: (1.0,)}, [short(volts=dead_band(1.2))])
    found = twin_of(estimate, data, [short(volts=dead_band(1.2))], None)
    return replace(found, lines=tuple(map(twin_line, lines)), origin="the twin T", **changes)


def test_lines_are_a_place_a_finding_a_parameter_and_a_part_of_the_twin():
    told = with_lines(draft(twin=twin()), (line(), line(31.0)), 2.0, None)
    assert [f.parameters["frequency"].value for f in told.findings] == [20.0, 31.0]
    assert len(told.mismatch) == 2
    assert told.model_terms == ("periodic_disturbance", "periodic_disturbance")
    assert told.model["periodic_disturbance.frequency"].value == 20.0
    assert told.model["periodic_disturbance#2.frequency"].value == 31.0
    assert [x.frequency for x in told.twin.lines] == [20.0, 31.0]


@pytest.mark.parametrize(
    ("now", "news"),
    [
        (line(20.02), False),
        (line(20.9), True),
        (line(20.02, amplitude=2.0), True),
        (line(20.02, ratio=3.0), True),
    ],
    ids=["same", "elsewhere", "louder", "another kind"],
)
def test_against_a_twin_only_what_changed_is_news(now, news):
    before = twin(line())
    assert told_lines((now,), before) == ((now,) if news else ())
    told = with_lines(draft(twin=twin()), (now,), 2.0, before)
    assert len(told.findings) == int(news)
    assert told.baseline["periodic_disturbance.frequency"].value == 20.0


def test_a_line_that_grew_says_from_what_and_one_that_went_is_noted():
    before = twin(line(), line(31.0))
    told = with_lines(draft(twin=twin()), (line(20.02, amplitude=2.0),), 2.0, before)
    assert told.findings[0].statement == "A line at 20.02 Hz, where the twin T has 1 N."
    assert told.notes == ("the twin T has a line at 31 Hz, not found here.",)
    assert [x.frequency for x in told.twin.lines] == [20.02, 31.0]


def test_turns_of_another_kind_are_another_line():
    assert told_lines((line(ratio=3.0),), twin(line(ratio=3.0))) == ()
    assert len(told_lines((line(ratio=3.0, unit="V s"),), twin(line(ratio=3.0)))) == 1
    assert len(told_lines((line(ratio=3.2),), twin(line(ratio=3.0)))) == 1


def test_a_twin_holds_the_fit(fitted):
    runs, data, estimate = fitted
    found = twin_of(estimate, data, runs, None)
    assert isinstance(found, Twin)
    now = estimate.fit
    assert (found.C, found.thruster, found.driver_quantity) == (now.theta.C, "T1", "command_voltage")
    assert [t.values for t in found.terms] == list(now.theta.terms)
    assert found.names == ("C", "dead_band.half_width", "asymmetry.ratio")
    at = now.layout
    places = [0, at.of(BAND).start, at.of(UNEVEN).start]
    assert np.array(found.covariance) == pytest.approx(now.cov[np.ix_(places, places)])
    assert [s.tare for s in found.sources] == pytest.approx(now.theta.tares)
    assert found.interval == pytest.approx(0.125)
    assert found.rate_per_driver is None
    values = given_values(found)
    assert values["dead_band.half_width"].std == pytest.approx(now.std[places[1]])


def test_a_constant_that_moved_is_a_finding_with_its_sigmas(fitted):
    runs, data, estimate = fitted
    before = replace(twin_of(estimate, data, runs, None), origin="the twin T")
    assert changed_constant(before, estimate, data, "the twin T", TOLD) is None
    moved = replace(before, C=0.9 * before.C)
    found = changed_constant(moved, estimate, data, "the twin T", TOLD)
    both = np.hypot(estimate.fit.std[0], np.sqrt(before.covariance[0][0]))
    z = 0.1 * before.C / both
    assert f"{z:.0f} sigma" in found.statement
    assert "+11 %" in found.statement
    assert found.parameters["before"].value == pytest.approx(0.9 * before.C)
    now = estimate.fit
    unknown = replace(now, free=np.zeros_like(now.free), jacobian=np.empty((now.residual.size, 0)))
    assert changed_constant(moved, replace(estimate, fit=unknown), data, "", TOLD) is None, "an error that nobody knows"


@pytest.mark.parametrize(("ends", "told_so"), [((0.9, 1.001), False), ((0.999, 1.1), True)])
def test_a_constant_that_may_be_the_same_for_what_nothing_claims_has_not_changed(fitted, ends, told_so):
    """Its interval held the twin's, and it was told as changed by five sigma of its own error."""
    runs, data, estimate = fitted
    before = replace(twin_of(estimate, data, runs, None), origin="the twin T")
    was = replace(before, C=0.95 * before.C)
    told = Value(before.C, 0.05 * before.C, "N/V^2", ends=tuple(end * before.C for end in ends))
    assert (changed_constant(was, estimate, data, "the twin T", told) is not None) == told_so


@pytest.mark.parametrize(("ends", "told_so"), [((0.999, 1.1), False), ((0.9, 1.001), True)])
def test_a_constant_that_the_twins_own_recordings_left_open_has_not_changed(fitted, ends, told_so):
    """The first run had told its C with what a recirculation of 3 sigma makes of it; of its twin that was lost, and
    nothing changed was told as 0.67 %, 5 sigma."""
    runs, data, estimate = fitted
    before = replace(twin_of(estimate, data, runs, None), origin="the twin T")
    was = replace(before, C=0.95 * before.C)
    was = replace(was, constant_interval=tuple(end * was.C for end in ends))
    assert (changed_constant(was, estimate, data, "the twin T", TOLD) is not None) == told_so


CURVE = Flexible("command_voltage", "V", (-9.0, -6.0, -3.0, 0.0, 3.0, 6.0, 9.0), (3,), ("force",), 1)


def test_a_constant_of_which_a_free_shape_is_a_part_has_not_moved(fitted):
    runs, data, estimate = fitted
    before = replace(twin_of(estimate, data, runs, None), origin="the twin T")
    bent = tuple(-0.2 * before.C * v * abs(v) for v in CURVE.knots if v != 0.0)
    model, theta = extended(estimate.fit.model, replace(estimate.fit.theta, C=1.2 * before.C), CURVE, bent)
    beside = replace(estimate, fit=fit(model, theta, data, estimate.weights, most_steps=0))
    assert changed_constant(before, beside, data, "the twin T", TOLD) is None
    moved = replace(before, C=0.9 * before.C)
    assert "+11 %" in changed_constant(moved, beside, data, "the twin T", TOLD).statement


def test_against_a_twin_its_terms_are_in_the_model_and_the_same_effect_comes_on_top(fitted):
    runs, data, estimate = fitted
    before = replace(twin(), origin="the twin T")
    plain = draft(
        findings=(finding(), finding("asymmetry")), model={**values_of(estimate.fit, data)}, model_terms=("dead_band",)
    )
    told = with_twin(plain, estimate, data, runs, before)
    assert told.baseline_model == "the twin T (C V|V| with dead_band)"
    assert told.findings[0].statement.startswith("On top of what the twin T has: ")
    assert told.findings[1].statement == "Dead band."
    assert told.model_terms == ("dead_band", "dead_band")
    assert told.model["dead_band.half_width"] == told.baseline["dead_band.half_width"]
    assert told.model["dead_band#2.half_width"].value == estimate.fit.values[BAND][0]
    alone = with_twin(draft(), estimate, data, runs, None)
    assert (alone.findings, alone.baseline_model) == ((), "C V|V|")
    assert alone.twin is not None


def test_a_change_is_of_the_form_that_is_found_where_the_twin_has_two(fitted):
    runs, data, estimate = fitted
    own = twin().terms[0]
    terms = (TwinTerm("dead_band", "jump", {"half_width": 0.5}, own.scale), own)
    before = replace(twin(), terms=terms, names=names_of(terms), covariance=((0.0,) * 3,) * 3)
    changed = replace(estimate.fit, model=replace(estimate.fit.model, given=given(before)))
    found = replace(finding(), form="shrink", before={})
    told = with_twin(draft(findings=(found,)), replace(estimate, fit=changed), data, runs, before)
    assert told.findings[0].before["half_width"].value == own.values[0] != 0.5
    assert "The twin T has it with half width" in told.findings[0].statement
