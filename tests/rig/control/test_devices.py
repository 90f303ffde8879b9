"""What front ends are told of the devices, from the controller in virtual time."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import pytest

from rig.campaign.config import CalibrationConfig
from rig.control.devices import REFRESH, Devices
from rig.link.framing import HEADER, decode, encode
from tests.rig.stages.played import outcome, play
from tests.rig.virtual_bench import virtual

NEVER: date = date.max


def test_a_run_tells_identity_rates_frames_and_the_measured_watchdog(tmp_path):
    with virtual(tmp_path, prove_watchdog=True) as world:
        seen = [snapshot for snapshot in play(world) if snapshot.devices]
        assert outcome(world) == ("completed", "")
        first = {device.name: device for device in seen[0].devices}
        last = {device.name: device for device in seen[-1].devices}
        assert list(last) == list(world.session.bench.instruments)
        assert first["motor"].watchdog_measured is None
        assert last["motor"].watchdog_measured == world.session.status.watchdog_measured
        assert 0.0 < last["motor"].watchdog_measured < 5.0
        assert last["motor"].watchdog.startswith(f"{world.motor.watchdog.timeout_s:g} s, then ")
        assert last["load_cell"].watchdog == ""
        assert last["load_cell"].identity == world.session.bench.identities["load_cell"]
        (stream,) = last["load_cell"].streams
        assert stream.rate == pytest.approx(stream.nominal, rel=0.2)
        assert stream.age is not None
        assert stream.age < 1.0


def test_a_device_that_is_not_open_is_asked_nothing(tmp_path):
    with virtual(tmp_path) as world:
        session = world.session
        told = Devices(session.bench, session.loop.readings).view(0.0, lambda: NEVER, None)
        assert [(device.identity, device.fault, device.received) for device in told] == [("", "", 0)] * len(told)
        assert told[0].streams[0].age is None


def test_the_days_left_are_those_of_the_bench_file_and_it_looks_twice_a_second(tmp_path):
    with virtual(tmp_path) as world:
        calibration = CalibrationConfig(date(2026, 3, 2), date(2027, 3, 1), "DKD 1")
        config = replace(world.session.bench.config, calibration={"load_cell": calibration})
        devices = Devices(replace(world.session.bench, config=config), world.session.loop.readings)
        days = iter((date(2027, 2, 1), date(2027, 3, 2)))

        def left(now):
            cell, motor = devices.view(now, lambda: next(days), None)
            assert (motor.calibrated, motor.days_left) == ("", None)
            assert (cell.calibrated, cell.valid_until, cell.certificate) == ("2026-03-02", "2027-03-01", "DKD 1")
            return cell.days_left

        assert [left(0.0), left(0.9 * REFRESH), left(REFRESH)] == [28, 28, -1]


def test_they_cross_the_wire(tmp_path):
    with virtual(tmp_path) as world:
        snapshot = play(world)[-1]
        frame = encode(snapshot)
        assert snapshot.devices
        assert decode(HEADER.unpack_from(frame)[1], frame[HEADER.size :]) == snapshot
