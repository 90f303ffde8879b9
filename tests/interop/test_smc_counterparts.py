"""Pololu's Simple Motor Controller beside `smc`, which is not ours: it drives our simulated controller."""

from __future__ import annotations

import select
import time

import pytest

from drivers.pololu.packets import Packets
from drivers.pololu.smc import SmcG2
from drivers.pololu.smc_options import Options
from sim_devices.bench.process import running
from tests.drivers.scripted_peer import Peer

pytestmark = pytest.mark.interop
WORLD = """
mounted = "T1"
[thrusters]
T1 = { C = 0.4 }
[can]
adapters = []
[devices.motor]
kind = "smc_g2"
port = "motor"
timeout = 0.5
"""


@pytest.fixture
def bench(tmp_path):
    (tmp_path / "world.toml").write_text(WORLD, encoding="utf-8")
    with running(tmp_path / "world.toml", tmp_path / "ports", seed=1) as each:
        yield each


def test_smc_drives_our_controller_until_its_timeout(bench, third_party):
    client = third_party("smc").SMC(str(bench.links / "motor"), 115200)
    client.init()
    for _ in range(20):
        client.speed(1000)
        select.select([], [], [], 0.02)
    assert client.getFirmware() == (160, 0x0104)
    deadline = time.monotonic() + 5.0
    while not bench.truth("timeout") and time.monotonic() < deadline:
        select.select([], [], [], 0.02)
    del client  # its destructor stops the motor and lets the port go
    assert [line["value"] for line in bench.truth("command")] == [1000, 0]
    assert bench.truth("timeout")[0]["after"] == pytest.approx(0.5)


def test_our_packets_are_those_of_smc(third_party):
    heard = []
    with Peer(lambda _, data: heard.append(data), terminator=None) as peer:
        client = third_party("smc").SMC(peer.port, 115200)
        client.init()
        client.speed(1000)
        client.speed(-1600)
        client.stop()
        deadline = time.monotonic() + 2.0
        while len(b"".join(heard)) < 8 and time.monotonic() < deadline:
            select.select([], [], [], 0.01)
        del client
    packets = Packets()
    ours = packets.encode(0x83) + packets.encode(0x85, 8, 31) + packets.encode(0x86, 0, 50) + packets.encode(0xE0)
    assert b"".join(heard)[:8] == ours


def test_our_driver_on_our_controller(bench):
    device = SmcG2("motor", Options(str(bench.links / "motor"), 48.0, 0.5))
    assert device.open() == "Pololu Simple Motor Controller, product 160, firmware 1.04"
    device.close()
