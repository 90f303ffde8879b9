"""What must be green before a propeller may turn."""

from datetime import date
from pathlib import Path

import pytest

from drivers.protocols import Channel, Sample, Stream, Watchdog
from rig.campaign.config import CalibrationConfig, LimitConfig
from rig.control.readings import Readings
from rig.link.front_end_messages import Reading
from rig.stages.preflight import (
    calibration_checks,
    device_checks,
    flow_check,
    limit_checks,
    rate_check,
    rest_check,
    stop_input_check,
    watchdog_check,
)
from tests.rig.virtual_bench import bench_config

CELL = Stream("cell", "virtual", (Channel("thrust", "thrust", "N"), Channel("stable", None, "1")), 0.01)


def reading(quantity: str, value: float | None, **more) -> Reading:
    return Reading(f"x.{quantity}", quantity, "1", value, 0.0, **more)


def test_devices():
    checks = device_checks({"a": "model 1"}, {"b": "no cable"}, ("a", "b", "c"))
    assert [(c.verdict, c.text) for c in checks] == [
        ("passed", "model 1"),
        ("failed", "no cable"),
        ("waiting", "opening"),
    ]


@pytest.mark.parametrize(
    ("rate", "verdict"),
    [(None, "failed"), (100.0, "passed"), (80.0, "passed"), (70.0, "warning"), (140.0, "warning"), (49.0, "failed"),
     (10.0, "failed"), (301.0, "failed")],
)  # fmt: skip
def test_rate(rate, verdict):
    assert rate_check(CELL, rate).verdict == verdict


@pytest.mark.parametrize(("timeout", "verdict"), [(None, "failed"), (1.01, "failed"), (1.0, "passed")])
def test_watchdog(timeout, verdict):
    check = watchdog_check(Watchdog(timeout, "commands", "coast", resumes_by_itself=True), 1.0, proving=True)
    assert check.verdict == verdict


@pytest.mark.parametrize(("timeout", "verdict"), [(None, "failed"), (1.01, "failed"), (1.0, "warning")])
def test_a_watchdog_that_is_not_proved_is_said_so(timeout, verdict):
    check = watchdog_check(Watchdog(timeout, "commands", "coast", resumes_by_itself=True), 1.0, proving=False)
    assert check.verdict == verdict
    assert verdict == "failed" or "not proved" in check.text


@pytest.mark.parametrize(("rate", "verdict"), [(0.0, "passed"), (-0.5, "passed"), (0.6, "failed"), (None, "failed")])
def test_rest(rate, verdict):
    assert rest_check([reading("rotation_rate", rate)], bench_config(Path())).verdict == verdict


def test_rest_that_is_not_measured_is_said():
    assert rest_check([reading("thrust", 0.0)], bench_config(Path())).verdict == "warning"


@pytest.mark.parametrize(("value", "verdict"), [(0.0, "passed"), (1.0, "failed"), (None, "failed")])
def test_emergency_stop(value, verdict):
    assert stop_input_check([reading("emergency_stop", value)]).verdict == verdict


def test_no_emergency_stop_is_said():
    assert stop_input_check([]).verdict == "warning"


@pytest.mark.parametrize(
    ("wanted", "measured", "verdict"),
    [
        (0.5, [0.4, 0.6], "passed"),
        (0.5, [0.56], "warning"),
        (0.5, [0.63], "failed"),
        (0.5, [-0.5], "failed"),
        (0.0, [0.04], "passed"),
        (0.0, [-0.1], "warning"),
        (0.0, [0.2], "failed"),
        (0.5, [], "warning"),
    ],
)
def test_flow(wanted, measured, verdict):
    check = flow_check(wanted, measured)
    assert check is not None
    assert check.verdict == verdict
    assert f"{wanted:g} m/s" in check.text


def test_still_water_without_a_flow_meter_needs_no_line():
    assert flow_check(0.0, []) is None


def test_limits():
    readings = [
        reading("thrust", 3.0, low=0.0, high=5.0),
        reading("current", 9.0, high=5.0, state="limit"),
        reading("voltage", None, low=1.0, state="none"),
        reading("flow_speed", 1.0),
    ]
    checks = limit_checks(readings)
    assert [check.verdict for check in checks] == ["passed", "failed", "failed"]
    assert checks[1].text == "9 1, at most 5 1 allowed: limit"
    assert checks[2].text == "nothing came, at least 1 1 allowed: none"


def test_readings_are_judged_as_the_guard_does():
    readings = Readings({"cell": CELL}, (LimitConfig("cell.thrust", max=5.0),))
    (before,) = readings.view(1.0)
    assert (before.value, before.state) == (None, "none")
    for t, value in ((1.00, 1.0), (1.01, 2.0), (1.02, 6.0)):
        readings.update([Sample("cell", round(t * 1e9), (value, 1.0))])
    assert readings.view(1.03)[0].state == "limit"
    assert readings.rate("cell") == pytest.approx(100.0)
    readings.update([Sample("cell", round(1.03e9), (4.0, 1.0))])
    assert readings.view(1.03)[0].state == "ok"
    assert readings.view(2.0)[0].state == "stale"
    assert readings.fresh("cell.thrust", 1.1) == 4.0
    assert readings.fresh("cell.thrust", 2.0) is None
    readings.update([Sample("cell", round(2.0e9), (float("nan"), 1.0))])
    assert (readings.view(2.0)[0].value, readings.view(2.0)[0].state) == (None, "none")
    assert readings.fresh("cell.thrust", 2.0) is None


def test_how_long_a_value_stood_still():
    readings = Readings({"cell": CELL}, ())
    readings.watch_sameness(["cell.thrust"])
    for t, value in ((0.0, 1.0), (0.3, 1.0), (0.5, 2.0), (0.6, 2.0)):
        readings.update([Sample("cell", round(t * 1e9), (value, 1.0))])
    newest = readings.newest("cell.thrust")
    assert newest is not None
    assert (round(newest.same, 3), newest.longest) == (0.1, 0.5)


@pytest.mark.parametrize(
    ("today", "until", "verdict", "end"),
    [
        (date(2027, 3, 1), date(2027, 3, 1), "passed", "valid until 2027-03-01"),
        (date(2027, 3, 2), date(2027, 3, 1), "warning", "valid until 2027-03-01: over"),
        (date(2026, 3, 1), date(2027, 3, 1), "warning", "valid until 2027-03-01: a day to come"),
        (date(2040, 1, 1), None, "passed", "of 2026-03-02"),
    ],
)
def test_a_calibration_that_is_over_warns(today, until, verdict, end):
    (check,) = calibration_checks({"cell": CalibrationConfig(date(2026, 3, 2), until)}, today)
    assert (check.name, check.verdict) == ("cell calibration", verdict)
    assert check.text.endswith(end)
