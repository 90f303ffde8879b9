"""The simulated electronics: what they say to each command, literal values, averages, and all they can do wrong."""

from math import nan

import pytest

from sim_devices.instruments.serial_lines.hbm_aed import HbmAed, HbmAedOptions


class Bed:
    """One transducer and the force on it, N."""

    def __init__(self, force=0.0, **options):
        self.force, self.t = force, 0.0
        self.device = HbmAed(HbmAedOptions("hbm_aed", "cell", **options), lambda: self.force)

    def say(self, command):
        return self.device.feed(command.encode(), self.t)

    def run(self, seconds):
        self.t += seconds
        return self.device.tick(self.t + 1e-6)


def test_answers():
    bed = Bed()
    assert bed.say("IDN?;") == b'HBM, "AED104","1234", P20\r\n'
    assert bed.say("BDR?;ADR?\n") == b"9600,1\r\n31\r\n"
    assert bed.say("ICR3;ICR?;icr ?;") == b"0\r\n03\r\n?\r\n"
    assert bed.say("ICR8;XYZ;XYZ?;COF99;") == b"?\r\n?\r\n?\r\n?\r\n"
    assert bed.say("AS") == b""
    assert bed.say("F2;;;ASF?;") == b"0\r\n02\r\n"
    assert Bed(checksum=-1).say("CSM0;CSM?;") == b"?\r\n?\r\n"


def test_the_lines_of_the_manual():
    """P. 46: a scale with NOV 3000, half loaded, then tared."""
    bed = Bed(250.0, nominal_value=3000, output_format=3)
    bed.run(0.04)
    assert bed.say("MSV?;") == b""
    assert bed.run(0.04) == b"    1500\r\n"
    assert bed.say("TAR;TAS?;TAV?;") == b"0\r\n00\r\n0001500\r\n"
    bed.say("MSV?;")
    assert bed.run(0.04) == b"       0\r\n"
    bed.force = 500.0
    assert bed.say("TAS1;MSV?;") == b"0\r\n"
    assert bed.run(0.04) == b"    3000\r\n"


def test_a_stream_hears_only_its_end():
    bed = Bed(-60.28125, rate_code=0)
    bed.run(1.0)
    assert bed.say("COF8;MSV?0;") == b"0\r\n"
    frame = (round(-60.28125 / 500 * 5_120_000) & 0xFFFFFF).to_bytes(3, "big") + b"\x08\r\n"
    assert bed.run(0.03) == 3 * frame
    assert bed.say("IDN?;ICR3;") == b""
    assert bed.run(0.01) == frame
    assert bed.say("STP;ICR?;") == b"00\r\n"
    assert bed.run(0.5) == b""


@pytest.mark.parametrize(
    ("form", "said"),
    [
        (0, "00 30 39 00 0d 0a"),
        (4, "00 39 30 00 0d 0a"),
        (8, "00 30 39 08 0d 0a"),
        (12, "08 39 30 00 0d 0a"),
        (1, b"   12345,31\r\n".hex(" ")),
        (3, b"   12345\r\n".hex(" ")),
        (9, b"   12345,31,008\r\n".hex(" ")),
        (11, b"   12345,008\r\n".hex(" ")),
        (2, "30 39 0d 0a"),
        (6, "39 30 0d 0a"),
    ],
)
def test_every_format(form, said):
    bed = Bed(123.45, nominal_value=50_000)
    bed.run(1.0)
    bed.say(f"COF{form};MSV?;")
    assert bed.run(0.04).hex(" ") == said


def test_a_checksum_in_the_place_of_the_status():
    bed = Bed(123.45, nominal_value=50_000, checksum=1, output_format=8)
    bed.run(1.0)
    bed.say("MSV?;")
    assert bed.run(0.04).hex(" ") == "00 30 39 09 0d 0a"


def test_several_values_side_by_side():
    bed = Bed(5.0, nominal_value=500, output_format=3, rate_code=0)
    bed.say("TEX44;MSV?3;")
    assert bed.run(0.05) == b"       5,       5,       5\r\n"


def test_a_value_is_the_mean_of_conversions():
    bed = Bed(100.0, rate_code=1, nominal_value=500, output_format=3)
    bed.say("MSV?0;")
    bed.run(0.01)
    bed.force = 200.0
    assert bed.run(0.01) == b"     150\r\n"


def test_on_a_bus_only_the_one_selected_answers():
    bed = Bed(address=7)
    assert bed.say("S05;IDN?;") == b""
    assert bed.say("S98;ICR1;") == b""
    assert bed.say("S07;ADR?;") == b"07\r\n"


def values(bed, seconds):
    return [int(line.split(b",")[0]) for line in bed.run(seconds).splitlines()]


@pytest.mark.parametrize(("fault", "status"), [("overload", 4), ("tare_overflow", 1), ("incoherent", 128)])
def test_bits_of_the_status(fault, status):
    bed = Bed(10.0)
    bed.run(0.1)
    bed.device.fault(fault, bed.t)
    bed.say("MSV?;")
    assert bed.run(0.04).split(b",")[2] == b"%03d\r\n" % status
    bed.device.clear(bed.t)
    bed.say("MSV?;")
    assert bed.run(0.04).split(b",")[2] == b"000\r\n"


def test_what_is_beyond_its_converter():
    for force in (700.0, -700.0, nan):
        bed = Bed(force)
        bed.say("MSV?;")
        assert bed.run(0.04).endswith(b",004\r\n")


def test_faults():
    bed = Bed(100.0, nominal_value=500, output_format=3)
    bed.say("MSV?0;")
    assert values(bed, 0.04) == [100]
    bed.device.fault("frozen", bed.t)
    bed.force = 50.0
    assert values(bed, 0.04) == [100]
    bed.device.fault("sign", bed.t)
    assert values(bed, 0.04) == [-50]
    bed.device.fault("silent", bed.t)
    assert values(bed, 0.2) == []
    assert bed.say("STP;IDN?;") == b""
    bed.device.clear(bed.t)
    assert values(bed, 0.04)[-1] == 50
    bed.device.fault("reboot", bed.t)
    assert bed.device.due == pytest.approx(bed.t + 1.0)
    assert bed.run(0.5) == b""
    assert bed.say("IDN?;") == b""
    bed.run(0.6)
    assert bed.run(0.5) == b"", "silent after power-up"
    assert bed.say("ICR?;") == b"02\r\n"
    with pytest.raises(ValueError, match="expected one of frozen, silent"):
        bed.device.fault("pulled", 0.0)


def test_impossible_options():
    with pytest.raises(ValueError, match="top_rate and nominal_force above 0"):
        HbmAedOptions("hbm_aed", "cell", nominal_force=0.0)
    with pytest.raises(ValueError, match="address"):
        HbmAedOptions("hbm_aed", "cell", address=32)
