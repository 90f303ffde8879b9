"""SCPI: pyvisa-py, a client that others wrote, talks to our simulated supply over a pty."""

from __future__ import annotations

import pytest

from sim_devices.bench.process import running

pytestmark = pytest.mark.interop
WORLD = """
mounted = "T1"
[thrusters]
T1 = { C = 0.4 }
[can]
adapters = []
[devices.motor]
kind = "scpi_supply"
port = "motor"
baud = 115200
"""


def test_pyvisa_drives_our_supply(tmp_path, third_party):
    pyvisa = third_party("pyvisa")
    third_party("pyvisa_py")
    (tmp_path / "world.toml").write_text(WORLD)
    with running(tmp_path / "world.toml", tmp_path / "ports", seed=1) as ours:
        manager = pyvisa.ResourceManager("@py")
        port = (ours.links / "motor").resolve()
        supply = manager.open_resource(f"ASRL{port}::INSTR", baud_rate=115200, timeout=2000)
        supply.read_termination, supply.write_termination = "\r\n", "\n"
        try:
            assert supply.query("*IDN?") == "SIM,PSU-60,1234,1.0"
            supply.write("VOLT 12.5")
            supply.write("OUTP ON")
            assert float(supply.query("VOLT?")) == 12.5
            assert float(supply.query("MEAS:VOLT?")) == pytest.approx(12.5, abs=0.1)
            assert supply.query("SYST:ERR?") == '0,"No error"'
            supply.write("VOLT 1000")
            assert supply.query("SYST:ERR?").startswith("-222")
            supply.write("OUTP OFF")
            assert supply.query("OUTP?") == "0"
        finally:
            supply.close()
            manager.close()
