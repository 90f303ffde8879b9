"""What is opened, judged and asked for before a propeller may turn, by itself."""

from dataclasses import replace
from datetime import date

import pytest

from rig.campaign.config import CalibrationConfig
from rig.link.front_end_messages import Request
from rig.recording.ledger import read
from rig.stages.arming import FLOW_PATIENCE, FLOW_WINDOW, SETTLE_ROWS, UNSEEN, Flow, preflight
from rig.stages.connecting import Links
from rig.stages.session import Stopped
from tests.rig.stages.played import play
from tests.rig.virtual_bench import virtual
from tests.rig.virtual_devices import flow_meter

SLOWEST = 0.02
"""s, period of the slowest stream of the virtual bench."""


def ask(world, at, kind="start"):
    """So many s from now on, as from a front end."""
    world.clock.at.append((now(world) + at, lambda: world.session.loop.signals.append(Request(kind, "a test"))))


def now(world):
    return world.clock.now_ns() * 1e-9


def test_every_device_is_opened_and_says_who_it_is(tmp_path):
    with virtual(tmp_path) as world:
        Links(world.session).open_all()
        assert [(c.name, c.verdict, c.text) for c in world.session.status.checks] == [
            ("load_cell", "passed", "virtual cell 2"),
            ("motor", "passed", "virtual motor 1"),
        ]
        assert world.session.motor is world.motor
        assert "load_cell: virtual cell 2" in world.texts


def test_a_start_is_heard_and_written_down(tmp_path):
    with virtual(tmp_path) as world:
        began = now(world)
        ask(world, 1.0)
        preflight(world.session)
        assert now(world) >= began + max(SETTLE_ROWS * SLOWEST, 1.0)
        assert (world.session.status.state, world.session.status.outcome) == ("preflight", "running")
        assert world.session.status.started == pytest.approx(world.session.loop.now)
        assert "preflight: watchdog: 0.5 s" in world.texts
        warned = [line for line in world.session.status.log if line.text.startswith("preflight: override")]
        assert [line.level for line in warned] == ["warning"]
        passed = [line for line in world.session.status.log if line.text.startswith("preflight: load_cell rate")]
        assert [line.level for line in passed] == ["info"]

    (fact,) = [fact for fact in read(tmp_path) if fact["fact"] == "start"]
    assert fact["identities"] == {"load_cell": "virtual cell 2", "motor": "virtual motor 1"}


def test_a_failed_check_lets_nothing_start(tmp_path):
    with virtual(tmp_path) as world:
        world.motor.timeout = None
        ask(world, 1.0)
        ask(world, 2.0, "stop")
        with pytest.raises(Stopped):
            preflight(world.session)
        assert "not started: watchdog: " in world.texts
        assert world.session.status.started is None


def test_nobody_starts_and_nobody_looks(tmp_path):
    with virtual(tmp_path) as world:
        began = now(world)
        with pytest.raises(
            Stopped, match="nobody started the campaign, and no front end was there for 60 s"
        ) as stopped:
            preflight(world.session)
        assert stopped.value.outcome == "aborted"
        assert now(world) - began == pytest.approx(UNSEEN + SETTLE_ROWS * SLOWEST, abs=0.2)


def test_somebody_who_looks_may_take_his_time(tmp_path):
    with virtual(tmp_path) as world:
        began = now(world)
        front = world.front()
        world.clock.each = lambda _: front.send(Request("lease"))
        ask(world, 2 * UNSEEN)
        preflight(world.session)
        front.close()
        assert now(world) - began == pytest.approx(2 * UNSEEN, abs=0.2)


def test_water_that_never_comes_is_a_failure_after_its_patience(tmp_path):
    meter, told = flow_meter(0.02), []
    with virtual(tmp_path, inputs=(meter,), flow_speed=0.5) as world:
        front = world.front()

        def look():
            told.append(
                [c.verdict for c in world.session.status.checks if c.name == "flow"][-1]  # the device is called so too
            )

        world.clock.at += [(now(world) + FLOW_PATIENCE + later, look) for later in (-1.0, 1.0)]
        ask(world, FLOW_PATIENCE + 2.0, "stop")
        with pytest.raises(Stopped):
            preflight(world.session)
        front.close()
    assert told == ["waiting", "failed"]


def test_flow_is_the_mean_of_its_last_seconds(tmp_path):
    meter = flow_meter(0.1)
    with virtual(tmp_path, inputs=(meter,)) as world:
        Links(world.session).open_all()
        readings, flow = world.session.loop.readings, Flow(0.5, patient_until=1e9)
        world.session.turn_for(1.0)
        first = world.session.loop.now
        flow.checks(readings, first)
        meter.value = 0.5
        world.session.turn_for(FLOW_WINDOW - 0.1)
        (check,) = flow.checks(readings, first + FLOW_WINDOW - 0.1)
        assert check.text.startswith("0.3 m/s measured"), "both are within the window"
        (check,) = flow.checks(readings, first + FLOW_WINDOW + 0.1)
        assert (check.verdict, check.text[:8]) == ("passed", "0.5 m/s ")
        assert Flow(None, 0.0).checks(readings, 0.0) == []


@pytest.mark.parametrize(("refuses", "rows"), [("", SETTLE_ROWS), ("load_cell: no cable", 0)])
def test_rates_are_judged_after_some_rows_of_devices_that_are_all_there(tmp_path, refuses, rows):
    with virtual(tmp_path) as world:
        world.cell.refuses = refuses
        waited, turn_for = [], world.session.turn_for
        world.session.turn_for = lambda seconds: (waited.append(seconds), turn_for(seconds))
        ask(world, 1.0, "stop")
        with pytest.raises(Stopped):
            preflight(world.session)
        assert sum(waited) == pytest.approx(rows * SLOWEST)


def test_a_device_that_comes_later_is_taken(tmp_path):
    with virtual(tmp_path) as world:
        world.cell.refuses = "load_cell: no cable"
        world.clock.at.append((now(world) + 1.0, lambda: setattr(world.cell, "refuses", "")))
        ask(world, 10.0)
        preflight(world.session)
        assert "load_cell is back: virtual cell 2" in world.texts


def test_a_calibration_that_is_over_warns_and_lets_it_start(tmp_path):
    over = CalibrationConfig(date(2020, 1, 1), date(2021, 1, 1))
    with virtual(tmp_path) as world:
        config = replace(world.session.campaign.bench, calibration={"load_cell": over})
        world.session.campaign = replace(world.session.campaign, bench=config)
        ask(world, 1.0)
        preflight(world.session)
        (line,) = [line for line in world.session.status.log if "load_cell calibration" in line.text]
        assert line.level == "warning"
        assert "valid until 2021-01-01: over" in line.text


def test_what_the_preflight_found_stands_in_every_recording(tmp_path):
    with virtual(tmp_path, thrusters=("T1", "T2")) as world:
        play(world)
        assert sum(event.text.startswith("preflight: watchdog: 0.5 s") for event in world.recorder.events) == 2


def test_flow_that_is_no_longer_measured_is_forgotten(tmp_path):
    meter = flow_meter(0.5)
    with virtual(tmp_path, inputs=(meter,)) as world:
        Links(world.session).open_all()
        readings, flow = world.session.loop.readings, Flow(0.5, patient_until=0.0)
        world.session.turn_for(1.0)
        (check,) = flow.checks(readings, world.session.loop.now)
        assert check.verdict == "passed"
        (check,) = flow.checks(readings, world.session.loop.now + 10 * FLOW_WINDOW)
        assert check.verdict == "warning", "nothing is measured"


@pytest.mark.parametrize(
    ("before", "told"),
    [((), "start"), (({"fact": "run"},), "start"), (({"fact": "start", "identities": {}}, {"fact": "run"}), "resume")],
)
def test_a_campaign_that_had_begun_is_resumed(tmp_path, before, told):
    with virtual(tmp_path, before=before) as world:
        ask(world, 1.0)
        preflight(world.session)
    assert [fact["fact"] for fact in read(tmp_path)][-1] == told
