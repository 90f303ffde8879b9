"""The simulated balance: literal lines, and all that it can do wrong."""

from math import nan

import pytest

from sim_devices.instruments.serial_lines.sartorius import Sartorius, SartoriusOptions

ASK = b"\x1bP\r\n"


class Bed:
    """A balance and the force on it, N."""

    def __init__(self, force=0.0, **options):
        self.force, self.t = force, 0.0
        self.device = Sartorius(SartoriusOptions("sartorius_sbi", "cell", **options), lambda: self.force)

    def run(self, seconds):
        self.t += seconds
        assert self.device.tick(self.t) == b""

    def ask(self, data=ASK):
        return self.device.feed(data, self.t)


def test_lines_of_the_manual():
    bed = Bed(1.2356 * 9.80665, decimals=2)
    assert bed.ask() == b"N     +  1235.60 g  \r\n"
    assert Bed(-0.5, unit="N", decimals=3, characters=16).ask() == b"-    0.500 N  \r\n"
    assert Bed(-1e-6).ask() == b"N     +      0.0 g  \r\n", "no minus before nothing"
    assert bed.ask(b"\x1bx1_") == b"            LA34001S\r\n"
    assert bed.ask(b"\x1b") + bed.ask(b"x2") + bed.ask(b"_\r\n") == b"            37454321\r\n"
    assert bed.ask(b"P\x1bK\x1b\x1bT") == b""


def test_the_unit_is_blank_while_the_reading_moves():
    bed = Bed(1.0, unit="N", decimals=1)
    bed.force = 2.0
    bed.run(0.05)
    assert bed.ask() == b"N     +      2.0    \r\n"
    bed.run(0.05)
    assert bed.ask() == b"N     +      2.0 N  \r\n"


@pytest.mark.parametrize(
    ("fault", "said"), [("overload", b"High"), ("underload", b"Low"), ("error", b"Err  54"), ("display_off", b"OFF")]
)
def test_what_is_in_the_place_of_a_reading(fault, said):
    bed = Bed()
    bed.device.fault(fault, 0.0)
    line = bed.ask()
    assert said in line
    assert len(line) == 22
    bed.device.clear(0.0)
    assert said not in bed.ask()


def test_beyond_its_range_and_without_a_number():
    assert b"High" in Bed(501.0).ask()
    assert b"Low" in Bed(-501.0).ask()
    assert b"High" in Bed(nan).ask()


def test_frozen_and_silent():
    bed = Bed(1.0, unit="N")
    bed.device.fault("frozen", 0.0)
    bed.force = 9.0
    bed.run(1.0)
    assert b"1.0 N" in bed.ask()
    bed.device.fault("silent", 1.0)
    assert bed.ask() == b""
    with pytest.raises(ValueError, match="balance: expected one of frozen"):
        bed.device.fault("on fire", 0.0)


@pytest.mark.parametrize(
    ("options", "sentence"), [({"unit": "lb"}, "unit must be one of"), ({"characters": 20}, "characters 16 or 22")]
)
def test_impossible_options(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        SartoriusOptions("sartorius_sbi", "cell", **options)
