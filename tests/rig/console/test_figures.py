"""The pure parts: folding snapshots, the running fit, axes, words, parting."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rig.console.dialogs import what_leaving_is
from rig.console.parting import begin, settled
from rig.console.session import exit_status
from rig.console.view_model import wording
from rig.console.view_model.actions import device_gone
from rig.console.view_model.alarms import alarm
from rig.console.view_model.axes import reach, thin, ticks
from rig.console.view_model.keys import key_line
from rig.console.view_model.running_fit import in_words, running_fit, v_abs_v
from rig.console.view_model.tables import misfits, results_table
from rig.console.view_model.view import TRACE_KEPT, View, absorb
from rig.link.front_end_messages import Check, Reading
from tests.rig.console.feeds import C, campaign, points, running, snapshot


def test_the_trace_grows_with_a_run_and_starts_anew_with_the_next():
    view = absorb(View(), running(trace=((0.0, 1.0, 2.0), (1.0, 1.0, 2.0))), 10.0)
    view = absorb(view, running(trace=((1.0, 1.0, 2.0), (2.0, 1.0, 2.0))), 10.1)
    assert [row[0] for row in view.trace] == [0.0, 1.0, 2.0]
    view = absorb(view, running(trace=((TRACE_KEPT + 1.5, 1.0, 2.0),)), 10.2)
    assert [row[0] for row in view.trace] == [2.0, TRACE_KEPT + 1.5]
    view = absorb(view, running(thruster="T3", trace=()), 10.3)
    assert view.trace == ()


def test_points_are_kept_per_thruster():
    view = View()
    for k, snap in enumerate(campaign()):
        view = absorb(view, snap, float(k))
    assert list(view.points) == ["T1", "T3"]
    assert [len(held) for held in view.points.values()] == [14, 14]


@pytest.mark.parametrize(
    ("connected", "silence", "condition"),
    [(True, 0.1, "live"), (True, 0.6, "stale"), (False, 0.0, "disconnected")],
)
def test_condition(connected, silence, condition):
    view = absorb(View(), running(), 10.0)
    assert replace(view, connected=connected, now=10.0 + silence).condition == condition
    assert View().condition == "waiting"


def test_running_fit_against_polyfit():
    held = tuple(replace(p, std_error=0.2 + 0.05 * k) for k, p in enumerate(points("T1", 14)))
    fit = running_fit(held)
    assert fit is not None
    x, y = [v_abs_v(p) for p in held], [p.thrust for p in held]
    (slope, rest), cov = np.polyfit(x, y, 1, w=[1 / p.std_error for p in held], cov="unscaled")
    assert pytest.approx(slope, rel=1e-7) == fit.C  # errors that are known are taken as of a million degrees of freedom
    assert fit.tare == pytest.approx(rest, abs=1e-6)
    assert fit.C_std >= math.sqrt(cov[0, 0]) * (1 - 1e-6)
    assert abs(fit.C - C["T1"]) < 4 * fit.C_std


def test_no_fit_is_said():
    assert running_fit(()) is None
    assert running_fit(points("T1", 1) * 3) is None
    assert in_words(None) == "no fit yet: two levels are needed"
    two = running_fit(points("T1", 2))
    assert two is not None
    assert "spread not known yet" in in_words(two)


def test_points_without_a_standard_error_are_left_out_and_counted():
    held = (*points("T1", 5), replace(points("T1", 6)[5], std_error=math.nan))
    fit = running_fit(held)
    assert fit is not None
    assert (fit.used, fit.left_out) == (5, 1)


def test_thinning_keeps_the_extremes_and_drops_nan():
    rows = [(float(t), 0.0) for t in range(1000)]
    rows[500], rows[501], rows[502] = (500.0, 7.0), (501.0, -7.0), (502.0, math.nan)
    time, value = thin(rows, 20)
    assert len(time) <= 42
    assert max(value) == 7.0
    assert min(value) == -7.0
    assert thin([], 5) == ([], [])


@pytest.mark.parametrize(("low", "high", "most"), [(-161.0, 161.0, 4), (0.0, 0.003, 5), (7.0, 7.5, 3), (-1e5, 1e5, 6)])
def test_ticks_are_round_few_and_inside(low, high, most):
    places, labels = ticks(low, high, most)
    assert 1 <= len(places) <= most + 1
    assert all(low <= place <= high for place in places)
    assert [float(label) for label in labels] == pytest.approx(places)


def test_an_axis_has_some_span():
    low, high = reach([3.0, 3.0], least=1.0)
    assert high - low == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (1.234, "N", "1.23"),
        (None, "N", "—"),
        (math.nan, "V", "—"),
        (48211.0, "1", "48211"),
        (0.25, "1", "0.250"),
        (101873.2, "Pa", "101873"),
    ],
)
def test_numbers(value, unit, text):
    assert wording.number(value, unit) == text


@pytest.mark.parametrize(
    ("low", "high", "text"), [(-3.0, 3.0, "-3 … 3"), (None, 40.0, "≤ 40"), (1.0, None, "≥ 1"), (None, None, "")]
)
def test_limits(low, high, text):
    assert wording.limits(Reading("a.b", "", "N", 1.0, 0.0, low, high)) == text


@pytest.mark.parametrize(("seconds", "text"), [(0, "0:00"), (61, "1:01"), (3723, "1:02:03"), (math.inf, "-:--")])
def test_clock(seconds, text):
    assert wording.clock(seconds) == text


@pytest.mark.parametrize(("seconds", "text"), [(None, "never"), (0.024, "0.02 s"), (14.31, "14.3 s"), (300.0, "5 min")])
def test_age(seconds, text):
    assert wording.age(seconds) == text


def test_who_may_leave():
    assert what_leaving_is(None) == "stop"
    assert what_leaving_is(running(attended=True, clients=1)) == "stop"
    assert what_leaving_is(running(attended=True, clients=2)) == "detach"
    assert what_leaving_is(running(attended=False)) == "detach"


def test_leaving_by_stop_waits_for_a_confirmed_rest():
    view = absorb(View(), running(), 10.0)
    parting = begin("stop", view, 10.0)
    assert not settled(parting, absorb(view, running("stopping"), 20.0))
    assert not settled(parting, absorb(view, running("done", stop_confirmed=False), 20.0))
    assert settled(parting, absorb(view, running("done", stop_confirmed=True), 20.0))


def test_exit_status():
    assert exit_status(absorb(View(), campaign()[-1], 0.0), detached=False) == 0
    assert exit_status(absorb(View(), running(), 0.0), detached=True) == 0
    assert exit_status(absorb(View(), running(), 0.0), detached=False) == 1
    assert exit_status(absorb(View(), running("done", outcome="tripped"), 0.0), detached=False) == 1
    assert exit_status(View(), detached=False) == 1


def test_the_end_before_any_start_is_no_result():
    assert absorb(View(), snapshot("done", outcome="aborted"), 0.0).points == {}


@pytest.mark.parametrize(
    ("state", "offered"), [("hold", True), ("sine", True), ("free", True), ("tare", False), ("ramp", False)]
)
def test_skip_is_offered_where_it_means_something(state, offered):
    line = key_line(absorb(View(), running(state), 0.0)).plain
    assert " p pause" in line
    assert (" k skip" in line) == offered


def test_points_that_a_square_law_does_not_fit_are_flagged_when_the_sweep_is_over():
    held = tuple(replace(p, std_error=0.2) for p in points("T1", 14))
    weak = tuple(replace(p, thrust=0.7 * p.thrust if p.voltage < 0 else p.thrust) for p in held)
    good, bad = running_fit(held), running_fit(weak)
    assert good is not None
    assert good.misfit is None
    assert bad is not None
    assert bad.misfit is not None
    assert bad.misfit > 100
    over = absorb(View(), running("done", outcome="completed", stop_confirmed=True, points=weak), 10.0)
    told = alarm(replace(over, connected=True, now=10.0))
    assert told.severity == "warning"
    assert "COMPLETED." in told.text
    assert "T1: C V|V| does NOT fit" in told.text
    assert "next: rig diagnose" in told.text
    assert [line.plain for line in misfits({"T1": weak, "T2": held})] == [
        f"T1: C V|V| does NOT fit (chi²/dof {bad.misfit:.3g}). Next: g, or rig diagnose."
    ]
    fine = absorb(View(), running("done", outcome="completed", stop_confirmed=True, points=held), 10.0)
    assert alarm(replace(fine, connected=True, now=10.0)).severity == "info"


def test_a_device_that_is_gone_is_offered_to_be_tried_again():
    here = snapshot("preflight")
    device = here.readings[0].channel.partition(".")[0]
    red = replace(here, checks=(*here.checks, Check(device, "failed", "it was pulled")))
    assert device_gone(here) == ""
    assert device_gone(red) == device
    assert f" r retry {device}" in key_line(absorb(View(), red, 0.0)).plain
    assert " retry" not in key_line(absorb(View(), here, 0.0)).plain


def test_two_holds_have_a_constant_and_no_scatter():
    row = results_table({"T1": points("T1", 2)}).columns
    cells = [next(iter(column.cells)) for column in row]
    assert float(cells[1]) == pytest.approx(C["T1"], rel=0.1)
    assert cells[2:4] == ["—", "—"]
    assert cells[6] == "2"


def test_holds_of_few_degrees_of_freedom_do_not_cry_misfit():
    """Taken as exact, their errors would say of 16 of these 300 sound thrusters that C V|V| does not fit."""
    rng, dof, said = np.random.default_rng(4), 6, 0
    for _ in range(300):
        held = tuple(
            replace(
                p,
                thrust=0.4 * v_abs_v(p) + 0.2 * rng.standard_normal(),
                std_error=0.2 * math.sqrt(rng.chisquare(dof) / dof),
                dof=float(dof),
            )
            for p in points("T1", 14)
        )
        fit = running_fit(held)
        assert fit is not None
        said += fit.misfit is not None
    assert said <= 3
