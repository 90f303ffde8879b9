"""Pololu Simple Motor Controller G2: golden packets, and the driver against a scripted controller."""

from __future__ import annotations

import threading
import time
import tomllib

import pytest

from drivers.errors import DeviceError, LinkError
from drivers.pololu.packets import Packets
from drivers.pololu.smc import SmcG2
from drivers.pololu.smc_options import Options, errors, signed
from tests.drivers.collecting import FOLDER
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((FOLDER / "smc_g2.toml").read_text())


def options(port="p", **changed):
    return Options(port, **({"nominal_bus_voltage": 48.0, "watchdog_timeout": 0.2, "timeout": 0.3} | changed))


class Scripted:
    """Compact protocol; its timeout is by the machine's clock. `stuck`: errors that are there for ever."""

    def __init__(self, timeout=0.2, stuck=0, deaf=False):
        self.timeout, self.stuck, self.deaf = timeout, stuck, deaf
        self.speed, self.status, self.occurred = 0, 1, 1
        self.packets = []
        self._rest = b""
        self._fed = None

    def __call__(self, peer, data):
        if self._fed is not None and self.timeout and time.monotonic() - self._fed > self.timeout:
            self.occurred |= 9
            self.status |= 1
        self._fed = time.monotonic()
        self._rest += data
        lengths = {0x83: 1, 0x85: 3, 0x86: 3, 0xA1: 2, 0xC2: 1, 0xE0: 1}
        while self._rest and len(self._rest) >= lengths[self._rest[0]]:
            packet, self._rest = self._rest[: lengths[self._rest[0]]], self._rest[lengths[self._rest[0]] :]
            self.packets.append(packet)
            if not self.deaf:
                peer.send(self._answer(packet))

    def _answer(self, packet):
        match packet[0]:
            case 0x83:
                self.status &= ~1
            case 0x85 | 0x86:
                self.speed = (packet[1] | packet[2] << 5) * (1 if packet[0] == 0x85 else -1)
            case 0xE0:
                self.speed = 0
                self.status |= 1
                self.occurred |= 1
            case 0xC2:
                return bytes.fromhex("a0 00 04 01")
            case 0xA1:
                if packet[1] == 1:
                    occurred, self.occurred = self.occurred, 0
                    return (occurred | self.stuck).to_bytes(2, "little")
                told = {0: self.status | self.stuck, 21: self.speed & 0xFFFF, 23: 48120, 24: 314, 46: 1234}
                return told[packet[1]].to_bytes(2, "little")
        return b""

    @property
    def speeds(self):
        signs = {0x85: 1, 0x86: -1}
        return [(p[1] | p[2] << 5) * signs[p[0]] for p in self.packets if p[0] in signs]


def peer(**made):
    script = Scripted(**made)
    found = Peer(script, terminator=None)
    found.script = script
    return found


def opened(found, **changed):
    device = SmcG2("motor", options(found.port, **changed))
    device.open()
    return device


def drive(device, volts, seconds=0.1):
    """Ticks of a control loop."""
    rows = []
    for _ in range(round(seconds / 0.02)):
        device.command(volts)
        threading.Event().wait(0.02)
        rows += device.drain()
    return rows


@pytest.mark.parametrize("case", FRAMES["packet"], ids=lambda case: case["name"])
def test_golden_packets(case):
    assert Packets().encode(*case["bytes"]) == bytes.fromhex(case["hex"])
    assert Packets(crc=True).encode(*case["bytes"]) == bytes.fromhex(case["crc"])
    assert Packets(13, crc=True).encode(0x85, 0, 100) == bytes.fromhex("aa 0d 05 00 64 21")


def test_numbers_and_names():
    assert (signed(0xF380), signed(3200)) == (-3200, 3200)
    assert errors(0b1001) == "safe start violation, command timeout"
    assert errors(0x8000) == "errors 0x8000"


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"nominal_bus_voltage": 0.0}, "nominal_bus_voltage must be positive"),
        ({"watchdog_timeout": 0.0}, "watchdog_timeout must be 0.05"),
        ({"max_voltage": 50.0}, "at most nominal_bus_voltage"),
        ({"at_zero": "stop"}, "at_zero must be brake or coast"),
        ({"protocol": "ascii"}, "protocol must be compact or pololu"),
        ({"current_variable": 128}, "current_variable must be 0 to 127"),
        ({"timeout": 0.0}, "timeout must be"),
        ({"baud": 9600}, "baud carries at most"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


def test_opening_commands_no_speed_but_zero():
    with peer() as found:
        device = SmcG2("motor", options(found.port))
        assert device.open() == "Pololu Simple Motor Controller, product 160, firmware 1.04"
        assert found.script.packets[0] == b"\xe0", "stop before anything is asked"
        assert set(found.script.speeds) == {0}
        assert (device.watchdog.timeout_s, device.watchdog.resumes_by_itself) == (0.2, False)
        device.close()
        wait_until(lambda: found.script.packets[-1] == b"\xe0")


def test_rows_come_with_set_points_alone():
    with peer() as found:
        device = opened(found)
        rows = drive(device, -12.0)
        names = [channel.name for channel in device.streams[0].channels]
        row = dict(zip(names, rows[-1].values, strict=True))
        assert row == pytest.approx(
            {"power": -0.25, "motor_voltage": -12.03, "bus_voltage": 48.12, "current": 1.234, "board_temperature": 31.4,
             "error_flags": 0.0}
        )  # fmt: skip
        heard = len(found.script.packets)
        threading.Event().wait(0.1)
        device.drain()
        threading.Event().wait(0.02)
        assert len(found.script.packets) == heard, "a question would feed the controller's timeout"
        device.close()


def test_without_a_current_there_is_none():
    with peer() as found:
        device = opened(found, current_variable=None)
        assert "current" not in [channel.name for channel in device.streams[0].channels]
        assert len(drive(device, 0.0)[-1].values) == 5
        assert b"\xa1\x2e" not in found.script.packets
        device.close()


def test_set_points_and_release():
    with peer() as found:
        device = opened(found, max_voltage=24.0)
        for volts in (0.0, 12.0, -24.0, 0.015):
            device.command(volts)
        device.release()
        wait_until(lambda: found.script.packets[-1] == b"\xe0")
        assert found.script.speeds[-4:] == [0, 800, -1600, 1]
        after = found.script.packets[-10:]
        assert b"\x83" not in after[-6:], "safe-start is left with a command of 0 alone"
        for volts in (24.1, float("nan")):
            with pytest.raises(ValueError, match="within"):
                device.command(volts)
        drive(device, 0.0)
        assert device.health().alive, "the safe-start of our own stop is no fault"
        device.close()


def test_after_a_silence_zero_goes_first():
    with peer() as found:
        device = opened(found)
        drive(device, 12.0)
        threading.Event().wait(0.25)
        with pytest.raises(LinkError, match=r"longer than the watchdog of 0\.2 s: 0 V was sent in the place of 12 V"):
            device.command(12.0)
        wait_until(lambda: found.script.speeds[-1] == 0)
        drive(device, 0.0)
        assert device.health().alive
        device.close()


@pytest.mark.parametrize(
    ("made", "sentence"),
    [
        ({"deaf": True}, r"no Simple Motor Controller answers .* \(compact protocol, CRC off, 115200 baud\)"),
        ({"timeout": 0.0}, r"did not come in 0\.30 s .*off as delivered"),
        ({"timeout": 0.03}, r"comes within 0\.12 s, the bench file says 0\.2 s"),
        ({"stuck": 0x20}, "reports low supply voltage: clear its cause"),
    ],
)
def test_what_is_refused_at_opening(made, sentence):
    with peer(**made) as found:
        device = SmcG2("motor", options(found.port))
        with pytest.raises(DeviceError, match=sentence):
            device.open()
        assert not device.health().alive
        assert set(found.script.speeds) <= {0}


@pytest.mark.parametrize(("bit", "word"), [(2, "serial error"), (3, "command timeout"), (7, "over temperature")])
def test_an_error_of_a_run_is_a_fault(bit, word):
    with peer() as found:
        device = opened(found)
        drive(device, 12.0)
        assert device.health().alive
        found.script.occurred |= 1 << bit
        drive(device, 12.0)
        assert f"reports {word}, and has stopped the motor for it" in device.health().error
        device.close()


def test_no_answers_and_a_pulled_cable():
    with peer() as found:
        device = opened(found)
        found.script.deaf = True
        drive(device, 12.0, 0.8)
        assert "does not answer any more" in device.health().error
        found.unplug()
        wait_until(lambda: device.drain() is not None and not device._port.alive)
        with pytest.raises(LinkError):
            device.command(0.0)
        device.close()
        device.close()
