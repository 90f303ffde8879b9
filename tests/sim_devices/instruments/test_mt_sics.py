"""The simulated weigh module: literal conversations in the format of the MT-SICS manual."""

from math import nan

import pytest

from sim_devices.instruments.serial_lines.mt_sics import MtSics
from sim_devices.instruments.serial_lines.mt_sics_options import MtSicsOptions


class Cell:
    """A module with a force on it that the test sets."""

    def __init__(self, **options):
        self.force = 0.0
        self.t = 0.0
        self.module = MtSics(MtSicsOptions("mt_sics", "cell", **{"rate": 10.0, **options}), lambda: self.force)
        self.wait(2.0)

    def wait(self, seconds):
        out = b""
        for _ in range(round(seconds * 10)):
            self.t += 0.1
            out += self.module.tick(self.t)
        return out

    def say(self, text):
        return self.module.feed(text.encode() + b"\r\n", self.t)


def test_the_format_of_a_weight():
    cell = Cell()
    cell.force = 12.345
    cell.wait(1.0)
    assert cell.say("S") == b"S S     12.345 N\r\n"
    cell.force = -1234.5678
    cell.wait(0.1)
    assert Cell(capacity=2000.0).say("SI") == b"S S      0.000 N\r\n"


def test_dynamic_until_it_has_been_still_for_half_a_second():
    cell = Cell()
    cell.force = 50.0
    cell.wait(0.1)
    assert cell.say("SI") == b"S D     50.000 N\r\n"
    cell.wait(0.5)
    assert cell.say("SI") == b"S S     50.000 N\r\n"


def test_s_waits_for_stability_and_gives_up_after_the_balance_timeout():
    cell = Cell()
    cell.force = 50.0
    cell.wait(0.1)
    assert cell.say("S") == b""
    assert cell.wait(0.6) == b"S S     50.000 N\r\n"
    cell.force = nan
    cell.wait(0.1)
    assert cell.say("SI") == b"S I\r\n"
    assert cell.say("S") == b""
    assert cell.wait(31.0) == b"S I\r\n"


def test_repeated_weights_at_the_rate_asked_for():
    cell = Cell(max_rate=20.0)
    assert cell.say("UPD 20") == b"UPD A\r\n"
    assert cell.say("UPD") == b"UPD A 20.000\r\n"
    assert cell.say("SIR") == b""
    assert cell.wait(2.0).count(b"      0.000 N\r\n") == pytest.approx(40, abs=1)
    assert cell.say("SI").endswith(b"N\r\n")
    assert cell.wait(1.0) == b""


@pytest.mark.parametrize("argument", ["21", "0", "fast", "5 5"])
def test_a_rate_it_has_not(argument):
    assert Cell(max_rate=20.0).say(f"UPD {argument}") == b"UPD L\r\n"


def test_cancel_stops_repeating_and_answers_with_the_serial_number():
    cell = Cell()
    cell.say("SIR")
    assert cell.say("@") == b'I4 A "B021002593"\r\n'
    assert cell.wait(1.0) == b""


def test_who_it_is():
    cell = Cell()
    assert cell.say("I1") == b'I1 A "012" "2.00" "2.20" "1.00"\r\n'
    assert cell.say("I2") == b'I2 A "WXS-SIM 500 N"\r\n'
    assert cell.say("I3") == b'I3 A "1.00 0.0.0.0"\r\n'
    assert cell.say("I4") == b'I4 A "B021002593"\r\n'
    listed = cell.say("I0").splitlines()
    assert listed[0] == b'I0 B 0 "@"'
    assert listed[-1] == b'I0 A 2 "UPD"'


def test_zero_and_tare():
    cell = Cell()
    cell.force = 2.0
    assert cell.say("Z") == b"Z A\r\n"  # what was read before the force changed
    cell.wait(1.0)
    assert cell.say("ZI") == b"ZI S\r\n"
    assert cell.say("SI") == b"S S      0.000 N\r\n"
    cell.force = 5.0
    cell.wait(0.1)
    assert cell.say("TI") == b"TI D      3.000 N\r\n"
    assert cell.say("SI") == b"S D      0.000 N\r\n"
    assert cell.say("TA") == b"TA A      3.000 N\r\n"
    assert cell.say("TAC") == b"TAC A\r\n"
    assert cell.say("TA 1.5 N") == b"TA A      1.500 N\r\n"
    assert cell.say("SI") == b"S D      1.500 N\r\n"
    assert cell.say("TA much") == b"TA L\r\n"
    assert cell.say("T") == b""
    assert cell.wait(1.0) == b"T S      3.000 N\r\n"


def test_beyond_its_capacity():
    cell = Cell(capacity=100.0)
    cell.force = 100.1
    cell.wait(0.1)
    assert [cell.say(c) for c in ("S", "SI", "Z", "ZI", "T", "TI")] == [
        b"S +\r\n", b"S +\r\n", b"Z +\r\n", b"ZI +\r\n", b"T +\r\n", b"TI +\r\n",
    ]  # fmt: skip
    cell.force = -100.1
    cell.wait(0.1)
    assert cell.say("SI") == b"S -\r\n"


def test_what_it_does_not_understand():
    cell = Cell()
    assert cell.say("HELLO") == b"ES\r\n"
    assert cell.say("si") == b"ES\r\n"
    assert cell.say("SI now") == b"EL\r\n"
    assert cell.module.feed(b"\xff\r\n", cell.t) == b"ET\r\n"
    assert cell.say("") == b""


def test_half_a_line_waits_for_its_end():
    cell = Cell()
    assert cell.module.feed(b"S", cell.t) == b""
    assert cell.module.feed(b"I\r", cell.t) == b""
    assert cell.module.feed(b"\n", cell.t) == b"S S      0.000 N\r\n"


def test_it_can_show_grams():
    cell = Cell(unit="g", digit=0.1)
    cell.force = 9.80665
    cell.wait(1.0)
    assert cell.say("SI") == b"S S     1000.0 g\r\n"


def test_faults():
    cell = Cell()
    cell.module.fault("frozen", cell.t)
    cell.force = 7.0
    cell.wait(1.0)
    assert cell.say("SI") == b"S S      0.000 N\r\n"
    cell.module.clear(cell.t)
    cell.wait(1.0)
    assert cell.say("SI") == b"S S      7.000 N\r\n"
    cell.module.fault("wrong_unit", cell.t)
    assert cell.say("SI") == b"S S      0.714 kg\r\n"
    cell.module.fault("overload", cell.t)
    assert cell.say("SI") == b"S +\r\n"
    cell.module.fault("underload", cell.t)
    assert cell.say("SI") == b"S -\r\n"
    cell.module.fault("transmission_error", cell.t)
    assert cell.say("SI") == b"ET\r\n"
    cell.module.fault("logical_error", cell.t)
    assert cell.say("SI") == b"EL\r\n"
    cell.module.fault("no_value", cell.t)
    assert cell.say("SI") == b"S I\r\n"
    cell.module.fault("internal_error", cell.t)
    assert cell.say("SI") == b"S S Error 10b\r\n"
    cell.module.fault("silent", cell.t)
    assert cell.say("SI") == b""
    with pytest.raises(ValueError, match="expected one of frozen"):
        cell.module.fault("tired", cell.t)


def test_a_reboot_loses_tare_and_repeating():
    cell = Cell()
    cell.force = 7.0
    cell.wait(1.0)
    cell.say("TI")
    cell.say("SIR")
    cell.module.fault("reboot", cell.t)
    assert cell.say("SI") == b""
    assert cell.wait(1.9) == b""
    assert cell.wait(0.3) == b'I4 A "B021002593"\r\n'
    assert cell.say("SI").endswith(b"7.000 N\r\n")


@pytest.mark.parametrize("options", [{"unit": "stone"}, {"rate": 200.0}, {"digit": 0.0}])
def test_options_that_cannot_be(options):
    with pytest.raises(ValueError, match=r"must be|needed"):
        MtSicsOptions("mt_sics", "cell", **options)


def test_a_module_that_runs_away_or_falls_asleep():
    cell = Cell()
    cell.say("SIR")
    cell.module.fault("fast", cell.t)
    assert cell.wait(2.0).count(b"N\r\n") == pytest.approx(200, abs=12)
    cell.module.fault("slow", cell.t)
    assert cell.wait(5.0).count(b"N\r\n") == pytest.approx(5, abs=2)


def test_a_reading_is_the_mean_of_its_conversions():
    forces = iter([0.0, *range(1, 100)])
    module = MtSics(MtSicsOptions("mt_sics", "cell", rate=10.0, average=4), lambda: float(next(forces)))
    module.feed(b"SIR\r\n", 0.0)
    said = b"".join(module.tick(0.025 * k) for k in range(9))
    values = [float(line.split()[2]) for line in said.splitlines()]
    assert values[:2] == [pytest.approx(3.5), pytest.approx(7.5)]
