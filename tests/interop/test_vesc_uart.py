"""VESC on a serial port beside pyvesc, which is not ours: its packets at our simulated device, ours at its decoder."""

from __future__ import annotations

import os
import select
import time
import warnings

import pytest
import serial

from drivers.vesc.over_uart import Options, VescUart
from drivers.vesc.uart_packets import set_current, set_duty
from sim_devices.bench.process import running
from tests.drivers.collecting import collect
from tests.drivers.scripted_peer import Peer, wait_until
from tests.drivers.test_driver_vesc_uart import Scripted

pytestmark = pytest.mark.interop
WORLD = """
mounted = "T1"
[thrusters]
T1 = { C = 0.4 }
[can]
adapters = []
[devices.motor]
kind = "vesc_uart"
port = "motor"
timeout = 0.5
"""


@pytest.fixture
def bench(tmp_path):
    (tmp_path / "world.toml").write_text(WORLD, encoding="utf-8")
    with running(tmp_path / "world.toml", tmp_path / "ports", seed=1) as each:
        yield each


def pyvesc_of(third_party):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return third_party("pyvesc")


def test_our_set_points_are_read_by_pyvesc(third_party):
    pyvesc = pyvesc_of(third_party)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for duty in (0.25, -0.5, 0.0, 0.9):
            assert set_duty(duty) == pyvesc.encode(pyvesc.SetDutyCycle(round(duty * 1e5)))
            message, used = pyvesc.decode(set_duty(duty))
            assert (message.duty_cycle, used) == (round(duty * 1e5), 10)
        assert set_current(-12.5) == pyvesc.encode(pyvesc.SetCurrent(-12500))


def test_our_driver_commands_what_pyvesc_understands(third_party):
    pyvesc = pyvesc_of(third_party)
    script = Scripted()
    with Peer(script, terminator=None) as peer, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        device = VescUart("motor", Options(peer.port, 7, 48.0, 0.5))
        device.open()
        device.command(12.0)
        wait_until(lambda: bool(script.commands))
        message, _ = pyvesc.decode(script.commands[-1])
        assert message.duty_cycle == 25000
        device.close()


def test_pyvesc_turns_our_simulated_controller_until_its_watchdog(bench, third_party):
    pyvesc = pyvesc_of(third_party)
    with serial.Serial(str(bench.links / "motor"), 115200, timeout=1.0) as port, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(40):
            port.write(pyvesc.encode(pyvesc.SetDutyCycle(25000)))
            select.select([], [], [], 0.02)
        port.write(pyvesc.encode_request(pyvesc.GetValues))
        head = port.read(2)
        assert head[:1] == b"\x02"
        rest = port.read(head[1] + 3)
        assert rest[0] == 4
        assert len(rest) == head[1] + 3
    assert [line["value"] for line in bench.truth("command")] == [0.25]
    deadline = time.monotonic() + 5.0
    while not bench.truth("timeout") and time.monotonic() < deadline:
        select.select([], [], [], 0.02)
    assert bench.truth("timeout")[0]["after"] == pytest.approx(0.5, abs=0.05)


def test_our_driver_reads_our_simulated_controller(bench):
    device = VescUart("motor", Options(os.fspath(bench.links / "motor"), 7, 48.0, 0.5))
    assert device.open().startswith("VESC SIM 60, firmware 6.05")
    rows = collect(device, 3)
    assert rows[-1].values[4] == pytest.approx(48.0, abs=0.1)
    device.close()
