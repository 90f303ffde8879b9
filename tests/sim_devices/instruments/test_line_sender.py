"""The amplifier that says counts, and the low pass before its converter."""

from math import exp, inf, nan

import pytest

from sim_devices.instruments.low_pass import LowPass
from sim_devices.instruments.serial_lines.line_sender import FULL_SCALE, LineOptions, LineSender

OPTIONS = LineOptions("line", "cell", rate=10.0, newtons_per_count=0.01)


def said(device: LineSender, seconds: float, steps: int = 1000) -> list[bytes]:
    out = b"".join(device.tick(i * seconds / steps) for i in range(steps + 1))
    return out.splitlines(keepends=True)


def test_a_line_is_a_padded_count():
    device = LineSender(OPTIONS, lambda: -1.234)
    assert said(device, 0.35) == [b"     -123\r\n"] * 3
    assert device.feed(b"anything\r\n", 0.0) == b""


def test_a_line_is_the_mean_of_its_conversions():
    values = iter([1.0, 2.0, 3.0, 6.0] * 3)
    device = LineSender(LineOptions("line", "cell", rate=10.0, newtons_per_count=0.01, average=4), values.__next__)
    assert said(device, 0.25) == [b"      300\r\n"] * 2


def test_its_own_clock_is_fast():
    device = LineSender(LineOptions("line", "cell", rate=10.0, clock_error=0.05), lambda: 0.0)
    assert device.due == pytest.approx(0.1 / 1.05)


def test_the_converter_stays_at_its_end_and_says_nothing_of_what_is_no_number():
    assert said(LineSender(OPTIONS, lambda: 1e9), 0.15) == [f"{FULL_SCALE:9d}\r\n".encode()]
    assert said(LineSender(OPTIONS, lambda: nan), 0.35) == []


def test_faults():
    value = [1.0]
    device = LineSender(OPTIONS, lambda: value[0])
    assert device.tick(0.1) == b"      100\r\n"
    device.fault("frozen", 0.1)
    value[0] = 2.0
    assert device.tick(0.2) == b"      100\r\n"
    device.fault("silent", 0.2)
    assert device.due == inf
    device.clear(0.5)
    assert device.tick(0.5) == b"      200\r\n"
    with pytest.raises(ValueError, match="expected one of frozen, silent"):
        device.fault("loud", 0.0)


@pytest.mark.parametrize("wrong", [{"average": 0}, {"rate": 0.0}, {"newtons_per_count": -1.0}])
def test_options_that_cannot_be(wrong):
    with pytest.raises(ValueError, match="must be"):
        LineOptions("line", "cell", **wrong)


def test_the_low_pass_follows_a_step_as_an_rc_does():
    filtered = LowPass(0.02)
    filtered.follow(0.0, 0.0)
    assert filtered.value == 0.0
    for dt in (0.005, 0.006, 0.029):
        filtered.follow(1.0, dt)
    assert filtered.value == pytest.approx(1.0 - exp(-0.04 / 0.02))
    without = LowPass(0.0)
    without.follow(3.0, 0.001)
    assert without.value == 3.0
