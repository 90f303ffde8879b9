"""The simulated card: literal lines, its status, and all that it can do wrong; its driver over virtual bytes."""

from math import nan

import pytest

from sim_devices.instruments.serial_lines.mantracourt import Mantracourt, MantracourtOptions


class Bed:
    """A card and the force on it, N."""

    def __init__(self, force=0.0, **options):
        self.force, self.t = force, 0.0
        self.device = Mantracourt(MantracourtOptions("mantracourt_dsc", "cell", **options), lambda: self.force)

    def run(self, seconds):
        self.t += seconds
        assert self.device.tick(self.t) == b""

    def ask(self, name, station=1):
        return self.device.feed(f"!{station:03d}:{name}\r".encode(), self.t)


def test_the_line_of_the_manual():
    bed = Bed(32.1)
    assert bed.ask("SOUT?") == b"+00032.100\r"
    assert bed.ask("SYS?", station=2) == b""
    assert bed.ask("SNAP", station=0) == b""
    assert bed.ask("XYZ?") == b"?\r"
    assert bed.ask("CGAI=1.0") == b"?\r"
    assert bed.ask("SNAP") == b"\r"
    assert bed.device.feed(b"garbage!001:sys", bed.t) == b""
    assert bed.device.feed(b"?\r", bed.t) == b"+00032.100\r"


def test_identity_and_digits():
    bed = Bed(-1.5 * 9.80665, unit="kg", dp=1, dpb=6)
    assert bed.ask("SYS?") == b"-000001.5\r"
    assert bed.ask("SERL?") + bed.ask("SERH?") + bed.ask("VER?") == b"+057920.0\r+000001.0\r+001031.0\r"
    assert Bed(dpb=3).ask("SERL?") == b"+920.000\r", "cut: too few digits"


def test_a_value_is_new_until_it_is_read():
    bed = Bed(5.0)
    assert bed.ask("STAT?") == b"+00000.000\r"
    bed.ask("SYS?")
    assert bed.ask("STAT?") == b"+08192.000\r"
    bed.run(0.011)
    assert bed.ask("STAT?") == b"+00000.000\r"


@pytest.mark.parametrize(
    ("fault", "status"), [("overload", 640), ("underload", 320), ("integrity", 2048), ("shunt", 4096)]
)
def test_bits_of_the_status(fault, status):
    bed = Bed()
    bed.device.fault(fault, 0.0)
    assert bed.ask("STAT?") == b"%+010.3f\r" % float(status)
    bed.device.clear(0.0)
    assert bed.ask("STAT?") == b"+00000.000\r"


def test_out_of_range():
    for force, status in ((501.0, 640), (-501.0, 320), (nan, 640)):
        assert Bed(force).ask("STAT?") == b"%+010.3f\r" % float(status)


def test_other_faults():
    bed = Bed(5.0)
    bed.device.fault("frozen", 0.0)
    bed.force = 6.0
    bed.run(0.05)
    assert bed.ask("SYS?") == b"+00005.000\r"
    bed.run(0.05)
    assert bed.ask("STAT?") == b"+00000.000\r", "a frozen converter looks new"
    bed.device.fault("stopped", 0.0)
    bed.ask("SYS?")
    bed.run(0.05)
    assert bed.ask("STAT?") == b"+08192.000\r"
    bed.device.fault("sign", 0.0)
    bed.run(0.05)
    assert bed.ask("SYS?") == b"-00006.000\r"
    bed.device.fault("refuses", 0.0)
    assert bed.ask("SYS?") == b"?\r"
    bed.device.fault("silent", 0.0)
    assert bed.ask("SYS?") == b""
    bed.device.fault("wrong_station", 0.0)
    assert bed.ask("SYS?") == b""
    assert bed.ask("SYS?", station=2) != b""
    with pytest.raises(ValueError, match="expected one of frozen, stopped"):
        bed.device.fault("pulled", 0.0)


def test_impossible_options():
    for changed in ({"unit": "lb"}, {"rate": 0.0}, {"dpb": 0}):
        with pytest.raises(ValueError, match=r"needed|must be"):
            MantracourtOptions("mantracourt_dsc", "cell", **changed)
