"""An emergency stop's contact, line by line."""

import pytest

from sim_devices.instruments.button import Button, ButtonOptions


def said(device: Button, until: float) -> list[float]:
    return [float(line) for line in device.tick(until).splitlines()]


def test_its_contact_opens_when_it_is_pressed():
    device = Button(ButtonOptions("button", "stop", rate=10.0))
    assert device.tick(0.15) == b"1\r\n"
    device.fault("pressed", 0.1)
    assert said(device, 0.35) == [0.0, 0.0]
    device.clear(0.35)
    assert said(device, 0.45) == [1.0]
    assert device.feed(b"anything", 0.5) == b""


def test_an_analogue_input_says_volts_with_noise():
    device = Button(ButtonOptions("button", "stop", rate=100.0, closed=24.0, noise=0.05))
    volts = said(device, 1.0)
    assert len(set(volts)) > 10
    assert all(23.5 < value < 24.5 for value in volts)


def test_bridged_or_silent():
    device = Button(ButtonOptions("button", "stop", rate=10.0))
    device.tick(0.15)
    device.fault("frozen", 0.1)
    device.fault("pressed", 0.1)
    assert said(device, 0.25) == [1.0]
    device.fault("silent", 0.2)
    assert device.due == float("inf")


def test_what_it_can_not_be():
    with pytest.raises(ValueError, match="rate must be above 0"):
        ButtonOptions("button", "stop", rate=0.0)
    with pytest.raises(ValueError, match="must differ"):
        ButtonOptions("button", "stop", closed=0.0)
    with pytest.raises(ValueError, match="expected one of pressed"):
        Button(ButtonOptions("button", "stop")).fault("hot", 0.0)
