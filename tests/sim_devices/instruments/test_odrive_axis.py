"""The simulated axis: literal frames, states, its watchdog, and all that it can do wrong."""

from struct import pack, unpack

import pytest

from sim_devices.instruments.odrive.axis import CLOSED_LOOP, IDLE, ODriveAxis
from sim_devices.instruments.odrive.options import Measured, ODriveOptions
from sim_devices.wires.can_frame import CanFrame

NOW = Measured(-12.5, 1.5, 0.5, 48.0, 30.0, 40.0)


class Bed:
    def __init__(self, **options):
        self.log, self.t = [], 0.0
        made = ODriveOptions("odrive", 3, **options)
        self.axis = ODriveAxis(
            made, 48.0, lambda: 2.0, lambda: NOW, lambda event, **more: self.log.append((event, more))
        )

    def say(self, command, data=b"", **more):
        return self.axis.receive(CanFrame(3 << 5 | command, data, extended=False, **more), self.t)

    def turn(self, velocity=10.0):
        self.say(0x0B, pack("<II", 2, 1))
        self.say(0x07, pack("<II", 8, 0))
        self.say(0x0D, pack("<ff", velocity, 0.0))

    def run(self, seconds):
        self.t += seconds
        return self.axis.tick(self.t)


def test_literal_frames():
    bed = Bed(heartbeat=10.0, encoder=0.0, iq=0.0, bus_voltage=0.0)
    assert bed.run(0.1) == [CanFrame(0x61, bytes.fromhex("00 00 00 00 01 00 00 00"), extended=False)]
    (answer,) = bed.say(0x17, remote=True)
    assert answer.data.hex(" ") == "00 00 40 42 00 00 00 3f"
    (answer,) = bed.say(0x09)
    assert unpack("<ff", answer.data) == (0.0, -12.5)
    assert unpack("<ff", bed.say(0x15, remote=True)[0].data) == (30.0, 40.0)
    assert bed.say(0x1F, remote=True) == []
    assert bed.axis.receive(CanFrame(0x41, b"", extended=False), 0.0) == []
    assert bed.axis.receive(CanFrame(0x61, b"", extended=True), 0.0) == []


def test_rates():
    bed = Bed(heartbeat=10.0, encoder=100.0, iq=50.0, bus_voltage=5.0, temperature=1.0)
    ids = [frame.id & 0x1F for frame in bed.run(1.0 + 1e-9)]
    assert {each: ids.count(each) for each in set(ids)} == {0x01: 10, 0x09: 100, 0x14: 50, 0x17: 5, 0x15: 1}


def test_velocity_and_torque():
    bed = Bed(velocity_limit=20.0)
    assert bed.axis.drive(0.0, 0.001) == (None, 0.0)
    bed.say(0x0D, pack("<ff", 10.0, 0.0))
    assert bed.axis.drive(0.0, 0.001) == (None, 0.0), "a set-point alone moves nothing"
    bed.turn(10.0)
    assert bed.axis.drive(0.0, 0.001) == (5.0, 0.0)
    bed.turn(-1000.0)
    assert bed.axis.drive(0.0, 0.001) == (-10.0, 0.0), "its velocity limit"
    bed.say(0x0D, pack("<ff", float("nan"), 0.0))
    assert bed.axis.drive(0.0, 0.001) == (0.0, 0.0)
    bed.say(0x0B, pack("<II", 1, 1))
    bed.say(0x0E, pack("<f", -0.25))
    assert bed.axis.drive(0.0, 0.001) == (None, -2.5)
    bed.say(0x07, pack("<II", 1, 0))
    assert bed.axis.drive(0.0, 0.001) == (None, 0.0)
    assert [more["mode"] for event, more in bed.log if event == "command"][-1] == "idle"


def test_the_watchdog_makes_it_idle_until_errors_are_cleared_and_the_loop_is_asked_for():
    bed = Bed(timeout=0.5)
    bed.turn()
    bed.run(0.4)
    bed.say(0x17, remote=True)
    bed.run(0.4)
    assert bed.axis.state == CLOSED_LOOP, "a query feeds it"
    bed.run(0.2)
    assert (bed.axis.state, bed.axis.error) == (IDLE, 0x1000000)
    assert bed.log[-2][0] == "timeout"
    bed.turn()
    assert bed.axis.state == IDLE, "an error keeps it from its loop"
    bed.say(0x18)
    assert bed.axis.error == 0
    assert bed.axis.drive(0.0, 0.001) == (None, 0.0)
    bed.turn()
    assert bed.axis.state == CLOSED_LOOP


@pytest.mark.parametrize("options", [{"timeout": 0.0}, {"broken_watchdog": True}])
def test_without_a_watchdog_it_goes_on(options):
    bed = Bed(**options)
    bed.turn()
    bed.run(60.0)
    assert bed.axis.state == CLOSED_LOOP


@pytest.mark.parametrize(
    ("fault", "firmware", "error"),
    [
        ("over_current", "0.6", 0x1000),
        ("over_temperature", "0.6", 0x4000),
        ("under_voltage", "0.6", 0x200),
        ("spinout", "0.6", 0x4000000),
        ("over_temperature", "0.5", 0x40000),
    ],
)
def test_errors_disarm(fault, firmware, error):
    bed = Bed(firmware=firmware)
    bed.turn()
    bed.axis.fault(fault, 0.0)
    assert (bed.axis.state, bed.axis.error) == (IDLE, error)
    bed.axis.clear(0.0)
    assert bed.axis.error == 0


def test_estop_and_other_faults():
    bed = Bed(timeout=0.0)
    bed.turn()
    bed.say(0x02)
    assert (bed.axis.state, bed.axis.error) == (IDLE, 0x2000000)
    bed.say(0x18)
    bed.turn()
    bed.axis.fault("disarms", 0.0)
    assert (bed.axis.state, bed.axis.error) == (IDLE, 0)
    bed.turn()
    bed.axis.fault("backwards", 0.0)
    assert bed.axis.drive(0.0, 0.001) == (-5.0, 0.0)
    bed.axis.fault("redrives", 0.0, 0.5)
    assert bed.axis.drive(0.0, 0.001) == (24.0, 0.0)
    bed.axis.fault("ignores_commands", 0.0)
    bed.say(0x07, pack("<II", 1, 0))
    assert bed.axis.state == CLOSED_LOOP
    bed.axis.fault("rate_factor", 0.0, 2.0)
    assert unpack("<ff", bed.say(0x09)[0].data)[1] == -25.0
    bed.axis.fault("current_factor", 0.0, 2.0)
    assert unpack("<ff", bed.say(0x14)[0].data)[1] == 3.0
    bed.axis.fault("silent", 0.0)
    assert bed.run(1.0) == []
    assert bed.say(0x09) == []
    bed.axis.clear(0.0)
    bed.axis.fault("reboot", bed.t)
    assert bed.axis.state == IDLE
    assert bed.run(0.5) == []
    assert bed.run(0.6)
    with pytest.raises(ValueError, match="expected one of frozen"):
        bed.axis.fault("pulled", 0.0)


def test_an_axis_that_is_not_calibrated():
    bed = Bed(calibrated=False)
    bed.turn()
    assert bed.axis.state == IDLE


def test_impossible_options():
    for changed in ({"node_id": 63}, {"firmware": "0.4"}, {"timeout": -1.0}):
        with pytest.raises(ValueError, match=r"needed|must not"):
            ODriveOptions("odrive", **changed)
