"""The simulated Roboteq by its bytes: what feeds its watchdog, and how the motor goes on after it."""

import pytest

from sim_devices.instruments.roboteq.controller import Roboteq
from sim_devices.instruments.roboteq.options import Measured, RoboteqOptions

NOW = Measured(rotation_rate=-10.0, current=3.42, input_current=1.26, bus_voltage=48.17, temperature=31.4)


class Line:
    """A controller whose motor is driven for the time between two words to it."""

    def __init__(self, **options):
        self.log = []
        settings = RoboteqOptions("roboteq", "p", **{"echo": False, "watchdog": 500, **options})
        self.now = NOW
        self.device = Roboteq(
            settings, 48.0, lambda: self.now, lambda event, **fields: self.log.append((event, fields))
        )

    def say(self, text, t=0.0):
        return self.device.feed(text.encode(), t).decode()

    def volts(self, t=0.0):
        self.device.tick(t)
        return self.device.drive(0.0, 0.001)[0]


def test_answers():
    line = Line()
    asked = {
        "?A": "A=34", "?A 1": "A=34", "?BA 1": "BA=13", "?BS 1": "BS=-600", "?S 1": "S=-600", "?V": "V=135:482:4990",
        "?V 2": "V=482", "?T 2": "T=31", "?P 1": "P=0", "?M 1": "M=0", "?FF": "FF=0", "?FM 1": "FM=0", "?FS": "FS=1",
        "~RWD": "RWD=500", "~MMOD 1": "MMOD=0", "~BPOL 1": "BPOL=7", "~EPPR 1": "EPPR=100", "~ECHOF": "ECHOF=1",
        "?FID": "FID=Roboteq v2.0 SIM1360 01/01/2020", "?TRN": "TRN=RCB500:SIM1360",
    }  # fmt: skip
    for query, answer in asked.items():
        assert line.say(f"{query}\r") == f"{answer}\r"
    assert Line(channels=2).say("?A\r") == "A=34:0\r"
    for wrong in ("?A 2", "?X", "!G 2 100", "!G", "!G x", "?A 1 2", "~X", "^X 1", "hello", "!EX 1"):
        assert line.say(f"{wrong}\r") == "-\r", wrong
    assert line.say("?A 1_?FF_!G 1 0\r") == "A=34\rFF=0\r+\r", "an underline ends a command as well"


def test_echo_goes_off():
    line = Line(echo=True)
    assert line.say("?A 1\r") == "?A 1\rA=34\r"
    assert line.say("?F") == "?F"
    assert line.say("F\r") == "F\rFF=0\r"
    assert line.say("^ECHOF 1\r") == "^ECHOF 1\r+\r"
    assert line.say("?A 1\r") == "A=34\r"


def test_power_is_a_share_of_the_supply():
    line = Line()
    assert line.say("!G 1 250\r") == "+\r"
    assert line.volts() == 12.0
    assert line.say("?P 1\r?M 1\r") == "P=250\rM=250\r"
    line.say("!G 1 -3000\r")
    assert line.volts() == -48.0
    line.say("!MS 1\r")
    assert line.volts() == 0.0
    coasting = Line(at_zero="coast")
    assert coasting.device.drive(5.0, 0.001) == (None, 0.0)


def test_power_ramps():
    line = Line(ramp=1.0)
    line.say("!G 1 500\r")
    for _ in range(250):
        line.device.drive(0.0, 0.001)
    assert line.device.power == pytest.approx(250.0)


def test_only_commands_feed_the_watchdog():
    line = Line()
    line.say("!G 1 250\r", 0.0)
    line.say("?A 1\r~RWD\r^ECHOF 1\r", 0.45)
    assert line.volts(0.499) == 12.0
    assert line.device.due == 0.5
    assert line.volts(0.5) == 0.0
    assert line.log[-1] == ("timeout", {"volts": 0.0, "after": 0.5})
    line.say("?A 1\r!G 7 1\r", 0.6)
    assert line.volts(0.6) == 0.0, "neither a query nor a refused command wakes it"


@pytest.mark.parametrize("word", ["!G 2 0", "!AC 1 5000", "!MS 2"])
def test_the_next_command_resumes_what_ran_before(word):
    line = Line(channels=2)
    line.say("!G 1 250\r", 0.0)
    assert line.volts(1.0) == 0.0
    assert line.say(f"{word}\r", 2.0) == "+\r"
    assert line.volts(2.0) == 12.0, "the trap"


@pytest.mark.parametrize("word", ["!G 1 0", "!MS 1"])
def test_zero_first_resumes_nothing(word):
    line = Line(channels=2)
    line.say("!G 1 250\r", 0.0)
    assert line.volts(1.0) == 0.0
    line.say(f"{word}\r", 2.0)
    line.say("!G 2 0\r", 2.1)
    assert line.volts(2.1) == 0.0


def test_a_watchdog_that_is_off_or_broken():
    for options in ({"watchdog": 0}, {"broken_watchdog": True}):
        line = Line(**options)
        line.say("!G 1 250\r", 0.0)
        assert line.volts(100.0) == 12.0
    line = Line()
    line.device.fault("broken_watchdog", 0.0)
    line.say("!G 1 250\r", 0.0)
    assert line.volts(100.0) == 12.0


def test_emergency_stop_lasts_until_it_is_lifted():
    line = Line()
    line.say("!G 1 250\r")
    line.say("!EX\r")
    assert (line.volts(), line.say("?FF\r")) == (0.0, "FF=16\r")
    line.say("!G 1 250\r")
    assert line.volts() == 0.0
    line.say("!MG\r!G 1 250\r")
    assert line.volts() == 12.0


@pytest.mark.parametrize(
    ("fault", "query", "answer"),
    [
        ("over_temperature", "?FF", "FF=1"),
        ("under_voltage", "?FF", "FF=4"),
        ("over_current", "?FF", "FF=8"),
        ("emergency_stop", "?FF", "FF=16"),
        ("stall", "?FM 1", "FM=2"),
    ],
)
def test_a_flag_stops_the_motor_until_it_is_cleared(fault, query, answer):
    line = Line()
    line.say("!G 1 250\r")
    line.device.fault(fault, 0.0)
    assert line.volts() == 0.0
    assert line.say(f"{query}\r") == f"{answer}\r"
    line.device.clear(0.0)
    assert line.volts() == 12.0


def test_other_faults():
    line = Line()
    line.say("!G 1 250\r")
    line.device.fault("backwards", 0.0)
    assert line.volts() == -12.0
    line.device.fault("redrives", 0.0, 0.5)
    assert line.volts() == 24.0
    line.device.fault("rate_factor", 0.0, 2.0)
    assert line.say("?BS 1\r") == "BS=-1200\r"
    line.device.fault("current_factor", 0.0, 2.0)
    assert line.say("?A 1\r") == "A=68\r"
    line.device.fault("pulse_mode", 0.0)
    assert line.say("?FS\r") == "FS=2\r"
    line.device.fault("ignores_commands", 0.0)
    assert line.say("!G 1 0\r", 0.4) == "+\r"
    assert line.volts(0.4) == 12.0
    assert line.volts(0.5) == 0.0, "nor is its watchdog fed"
    line.device.clear(0.5)
    line.device.fault("frozen", 0.5)
    line.now = Measured(current=9.0)
    assert line.say("?A 1\r") == "A=34\r"
    line.device.fault("silent", 0.5)
    assert line.say("?A 1\r") == ""
    with pytest.raises(ValueError, match="expected one of"):
        line.device.fault("tired", 0.0)


def test_a_reboot_forgets_what_ran():
    line = Line(echo=True)
    line.say("^ECHOF 1\r!G 1 250\r")
    line.device.fault("reboot", 1.0)
    assert (line.volts(1.5), line.say("?A 1\r", 1.5)) == (0.0, "")
    assert line.volts(2.0) == 0.0
    assert line.say("!G 2 0\r?M 1\r", 2.1) == "!G 2 0\r-\r?M 1\rM=0\r"
    assert line.volts(2.1) == 0.0


def test_impossible_settings():
    for options, sentence in (
        ({"at_zero": "stop"}, "brake or coast"),
        ({"watchdog": -1}, "65000"),
        ({"channels": 0}, "channels"),
    ):
        with pytest.raises(ValueError, match=sentence):
            RoboteqOptions("roboteq", "p", **options)
