"""The simulated Simple Motor Controller by its bytes: safe-start, errors, timeout, variables."""

import pytest

from sim_devices.instruments.pololu.smc import Measured, SmcG2, SmcG2Options

AHEAD = bytes.fromhex("85 08 1f")  # 1000
ARM, STOP = b"\x83", b"\xe0"


class Line:
    def __init__(self, **options):
        self.log = []
        settings = SmcG2Options("smc_g2", "p", **{"timeout": 0.5, **options})
        now = Measured(1.234, 48.12, 31.4)
        self.device = SmcG2(settings, 48.0, lambda: now, lambda event, **fields: self.log.append((event, fields)))

    def say(self, data, t=0.0):
        return self.device.feed(data, t)

    def variable(self, number, t=0.0):
        return int.from_bytes(self.say(bytes((0xA1, number)), t), "little")


def test_safe_start_comes_first():
    line = Line()
    line.say(AHEAD)
    assert (line.device.speed, line.variable(0)) == (0, 1)
    line.say(ARM)
    assert line.device.speed == 1000
    assert line.device.drive(0.0, 0.001) == (15.0, 0.0)
    line.say(STOP)
    line.say(AHEAD)
    assert line.device.speed == 0
    assert Line(safe_start=False).variable(0) == 0


def test_variables():
    line = Line()
    line.say(ARM + bytes.fromhex("86 00 32"))
    told = {n: line.variable(n) for n in (0, 20, 21, 23, 24, 46, 99)}
    assert told == {0: 0, 20: 0x10000 - 1600, 21: 0x10000 - 1600, 23: 48120, 24: 314, 46: 1234, 99: 0}
    assert line.say(b"\xc2") == bytes.fromhex("a0 00 04 01")
    assert (line.variable(1), line.variable(1)) == (1, 0), "read, and forgotten"


def test_every_valid_command_feeds_the_timeout_and_it_needs_arming_again():
    line = Line()
    line.say(ARM + AHEAD, 0.0)
    line.variable(23, 0.4)
    line.device.tick(0.8)
    assert line.device.speed == 1000
    line.device.tick(0.9)
    assert line.device.speed == 0
    assert line.log[-1] == ("timeout", {"volts": 0.0, "after": 0.5})
    line.say(AHEAD, 1.0)
    assert line.device.speed == 0
    assert line.variable(1, 1.0) & 9 == 9
    line.say(ARM, 1.1)
    assert line.device.speed == 1000


@pytest.mark.parametrize("options", [{"timeout": 0.0}, {"broken_watchdog": True}])
def test_a_timeout_that_is_off_or_stops_nothing(options):
    line = Line(**options)
    line.say(ARM + AHEAD, 0.0)
    line.device.tick(100.0)
    assert line.device.speed == 1000


def test_protocols():
    line = Line(crc=True)
    line.say(bytes.fromhex("83 1a 85 08 1f 32"))
    assert line.device.speed == 1000
    line.say(bytes.fromhex("85 08 1f 33"))
    assert line.device.speed == 0
    line = Line()
    line.say(bytes.fromhex("aa 0d 03 aa 0d 05 00 64"))
    assert line.device.speed == 3200
    line.say(bytes.fromhex("aa 0c 05 00 00"))
    assert line.device.speed == 3200, "another device"
    line.say(b"\x85\x00\xe0")
    assert line.variable(1) & 4, "half a packet is a serial error"


@pytest.mark.parametrize(
    ("fault", "flag"),
    [("kill_switch", 16), ("under_voltage", 32), ("over_temperature", 128), ("over_current", 256)],
)
def test_an_error_lasts_until_it_is_cleared(fault, flag):
    line = Line()
    line.say(ARM + AHEAD)
    line.device.fault(fault, 0.0)
    assert line.device.speed == 0
    line.say(ARM)
    assert line.variable(0) == flag
    line.device.clear(0.0)
    assert line.device.speed == 1000


def test_other_faults():
    line = Line()
    line.say(ARM + AHEAD)
    line.device.fault("backwards", 0.0)
    assert line.device.drive(0.0, 0.001)[0] == -15.0
    line.device.fault("redrives", 0.0, 0.5)
    assert line.device.drive(0.0, 0.001)[0] == 24.0
    line.device.fault("ignores_commands", 0.0)
    line.say(STOP)
    assert line.device.speed == 1000
    line.device.fault("frozen", 0.0)
    line.variable(21)
    line.device.fault("silent", 0.0)
    assert line.say(b"\xa1\x17") == b""
    line.device.clear(0.0)
    line.device.fault("serial_error", 0.0)
    assert line.device.speed == 0
    line.device.fault("reboot", 1.0)
    assert line.say(b"\xc2", 1.5) == b""
    assert line.variable(0, 2.5) == 1
    assert Line(at_zero="brake").device.drive(0.0, 0.001) == (0.0, 0.0)
    with pytest.raises(ValueError, match="expected one of"):
        line.device.fault("tired", 0.0)
    with pytest.raises(ValueError, match="brake or coast"):
        SmcG2Options("smc_g2", "p", at_zero="stop")
