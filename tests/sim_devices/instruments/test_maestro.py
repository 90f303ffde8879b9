"""The simulated Maestro and its ESC by their bytes: errors, timeout, home, and when the ESC obeys."""

import pytest

from sim_devices.instruments.pololu.esc import Arming, Esc
from sim_devices.instruments.pololu.maestro import Maestro, MaestroOptions, checksum

TARGET = bytes.fromhex("84 00 70 2e")  # 1500 us
AHEAD = bytes.fromhex("84 00 30 3b")  # 1900 us
POSITION, ERRORS, HOME = bytes.fromhex("90 00"), b"\xa1", b"\xa2"


class Line:
    def __init__(self, **options):
        self.log = []
        settings = MaestroOptions("maestro", "p", **{"timeout": 0.5, "on_error": "go_to", **options})
        self.device = Maestro(settings, 48.0, lambda event, **fields: self.log.append((event, fields)))

    def say(self, data, t=0.0):
        return self.device.feed(data, t)

    def pulse(self, t):
        self.device.tick(t)
        return self.device.pulse

    def arm(self, t=0.0):
        for i in range(21):
            self.say(TARGET, t + 0.1 * i)
            self.device.tick(t + 0.1 * i + 0.02)
            self.device.drive(0.0, 0.1)
        return t + 2.1


def test_a_target_is_there_at_the_next_pulse():
    line = Line(on_error="off")
    assert line.say(POSITION, 0.0) == b"\x00\x00"
    line.say(AHEAD, 0.005)
    assert line.pulse(0.01) == 0.0
    assert line.pulse(0.02) == 1900.0
    assert line.say(POSITION, 0.03) == (7600).to_bytes(2, "little")
    line.say(bytes.fromhex("84 00 7f 7f"), 0.03)
    assert line.pulse(0.04) == 2000.0, "held within min and max"
    line.say(bytes.fromhex("84 00 00 00"), 0.05)
    assert line.pulse(0.06) == 0.0


def test_the_pololu_protocol_and_another_device():
    line = Line(on_error="off")
    line.say(bytes.fromhex("aa 0d 04 00 70 2e"), 0.0)
    assert line.pulse(0.02) == 0.0
    assert line.say(bytes.fromhex("aa 0c 04 00 70 2e aa 0c 10 00"), 0.02) == b"\x00\x00"
    assert line.pulse(0.04) == 1500.0


def test_crc():
    assert [checksum(bytes.fromhex(each)) for each in ("83 01", "84 00 70 2e")] == [0x17, 0x2B]
    line = Line(crc=True, on_error="off")
    line.say(TARGET + b"\x2b", 0.0)
    assert line.pulse(0.02) == 1500.0
    line.say(AHEAD + b"\x00", 0.02)
    assert line.pulse(0.04) == 0.0, "an error sends it home"
    assert line.say(ERRORS + bytes((checksum(ERRORS),)), 0.05) == b"\x08\x00"


def test_every_valid_command_feeds_the_timeout():
    line = Line()
    line.say(AHEAD, 0.0)
    line.say(POSITION, 0.4)
    line.say(ERRORS, 0.8)
    assert line.pulse(1.2) == 1900.0
    assert line.device.due == pytest.approx(1.3)
    assert line.pulse(1.3) == 1500.0
    assert line.log[-1] == ("timeout", {"volts": 0.0, "after": 0.5})
    assert line.say(ERRORS, 1.4) == b"\x20\x00"
    assert line.say(ERRORS, 1.4) == b"\x00\x00", "read, and forgotten"
    line.say(AHEAD, 1.5)
    assert line.pulse(1.52) == 1900.0, "the next target goes on"


@pytest.mark.parametrize(
    ("options", "pulse"),
    [
        ({"timeout": 0.0}, 1900.0),
        ({"on_error": "ignore"}, 1900.0),
        ({"broken_watchdog": True}, 1900.0),
        ({"on_error": "off"}, 0.0),
    ],
)
def test_a_timeout_that_is_off_or_does_nothing(options, pulse):
    line = Line(**options)
    line.say(AHEAD, 0.0)
    line.pulse(0.02)
    assert line.pulse(100.0) == pulse


def test_half_a_packet_is_an_error():
    line = Line()
    line.say(AHEAD, 0.0)
    line.pulse(0.02)
    assert line.say(b"\x84\x00" + ERRORS, 0.1) == b"\x10\x00"
    assert line.device.pulse == 1500.0
    assert line.say(b"\x12" + ERRORS, 0.1) == b"\x00\x00", "a byte of data alone is of another device"


def test_the_esc_obeys_after_neutral():
    esc = Esc(arming=2.0, lost=0.5)
    assert [esc.share(each) for each in (1500.0, 1525.0, 1900.0, 1100.0, 1712.5)] == [0.0, 0.0, 1.0, -1.0, 0.5]
    arming = Arming(esc)
    for pulse, seconds, obeys in ((1900.0, 5.0, False), (1500.0, 1.9, False), (1500.0, 0.2, True), (1900.0, 9.0, True),
                                  (0.0, 0.4, True), (0.0, 0.2, False)):  # fmt: skip
        arming.pass_time(pulse, seconds)
        assert arming.obeys == obeys


def test_volts():
    line = Line()
    now = line.arm()
    line.say(AHEAD, now)
    line.device.tick(now + 0.02)
    assert line.device.drive(0.0, 0.001) == (48.0, 0.0)
    for fault, volts in (("backwards", -48.0), ("redrives", 24.0), ("esc_off", None)):
        line.device.fault(fault, now, 0.5)
        assert line.device.drive(0.0, 0.001)[0] == volts
        line.device.clear(now)
    line.say(HOME, now)
    assert line.device.drive(0.0, 0.001) == (None, 0.0)
    assert Line(at_zero="brake").device.drive(0.0, 0.001) == (0.0, 0.0)


def test_other_faults():
    line = Line()
    line.say(AHEAD, 0.0)
    line.pulse(0.02)
    line.say(POSITION, 0.02)
    line.device.fault("frozen", 0.02)
    line.say(TARGET, 0.02)
    line.pulse(0.04)
    assert line.say(POSITION, 0.04) == (7600).to_bytes(2, "little")
    line.device.fault("ignores_commands", 0.04)
    line.say(AHEAD, 0.04)
    assert line.pulse(0.06) == 1500.0
    line.device.fault("silent", 0.06)
    assert line.say(POSITION, 0.06) == b""
    line.device.clear(0.06)
    line.device.fault("reboot", 0.1)
    assert (line.say(POSITION, 0.5), line.say(POSITION, 1.2)) == (b"", (6000).to_bytes(2, "little"))
    for fault, flag in (("protocol_error", 0x10), ("crc_error", 0x08)):
        line.device.fault(fault, 1.2)
        assert line.say(ERRORS, 1.2)[0] == flag
    with pytest.raises(ValueError, match="expected one of"):
        line.device.fault("tired", 0.0)


def test_impossible_settings():
    for options, sentence in (({"on_error": "stop"}, "off, go_to or ignore"), ({"timeout": -1.0}, "timeout >= 0"),
                              ({"at_zero": "stop"}, "brake or coast")):  # fmt: skip
        with pytest.raises(ValueError, match=sentence):
            MaestroOptions("maestro", "p", **options)
