"""The same campaign with a load-cell transmitter on Modbus: only the bench file's table of the cell is another."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.cli import main, record_in_virtual_time
from rig.hdf5.load import load
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from sim_devices.instruments.modbus.registers import ModbusCellOptions

BENCHES = Path(__file__).parents[3] / "benches" / "simulated"
CAMPAIGN = """
[campaign]
name = "short"
bench = "bench.toml"
output = "out"
thrusters = ["T2"]
[watch]
off = true
[tare]
duration = 1.0
max_drift = 1.0
[plan]
kind = "levels"
voltages = [8.0, -8.0, 12.0, -12.0, 16.0, -16.0, 20.0, -20.0]
slew = 24.0
[plan.dwell]
kind = "fixed"
duration = 3.0
"""
CELLS = {
    "laumas": 'unit = "kg"\ndecimals = 3\n',
    "dini_argeo_dgt": 'unit = "kg"\ndecimals = 3\n',
    "seneca_z_sg": 'unit = "N"\n',
}
C = 0.3985
"""N/V^2 of T2 in the world file."""


def files(folder: Path, kind: str) -> Path:
    """The demo's bench without its thermometer, with another cell."""
    text = (BENCHES / "bench.toml").read_text(encoding="utf-8")
    cell = f'kind = "modbus_cell"\nport = "ports/load_cell"\nmap = "{kind}"\nbaud = 38400\nrate = 25.0\n'
    text = re.sub(r"(?<=\[devices\.load_cell\]\n)(?:.+\n)+", cell + CELLS[kind] + "gain_std = 0.0005\n", text)
    text = text[: text.index("[devices.thermometer]")] + text[text.index('[limits."load_cell') : text.index("[mount]")]
    folder.mkdir(exist_ok=True)
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def world(kind: str, seed: int = 1) -> VirtualBench:
    settings = load_world(BENCHES / "world.toml")
    unit = "N" if kind == "seneca_z_sg" else "kg"
    cell = ModbusCellOptions("modbus_cell", "load_cell", kind, 38400, unit=unit)
    thrusters = {name: replace(each, rotor="instant") for name, each in settings.world.thrusters.items()}
    made = replace(settings.world, thrusters=thrusters, mounted="T2")
    host = Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4, stall_every=5.0, stall=0.01)
    devices = {**settings.devices, "load_cell": cell}
    return VirtualBench(replace(settings, world=made, devices=devices, seed=seed, step=0.005), host, "bus0")


@pytest.mark.parametrize("kind", CELLS)
def test_a_campaign_with_a_modbus_cell_finds_the_truth_of_the_world(tmp_path, capsys, kind):
    path, _ = record_in_virtual_time(files(tmp_path, kind), tmp_path / "run", world(kind), ("some-id", "2026-01-01"))
    found = load(path)
    assert (found.complete, found.outcome) == (True, "completed")
    thrust = found.first_of("thrust")
    assert np.median(np.diff(thrust.time)) == pytest.approx(1 / 25, abs=2e-3)
    assert np.mean(np.diff(thrust.time)) == pytest.approx(1 / 25, rel=0.02), "no poll is missed"
    reply = {"laumas": 11, "dini_argeo_dgt": 15, "seneca_z_sg": 35}[kind]
    assert thrust.acquisition.delay == pytest.approx(reply * 10 / 38400)
    assert not np.isnan(thrust.value).any()
    assert main(["fit", str(path), "--json", str(tmp_path / "fit.json")]) == 0
    capsys.readouterr()
    (fit,) = json.loads((tmp_path / "fit.json").read_text())["fits"]
    found_C = fit["parameters"]["C"]
    assert (fit["thruster"], fit["model"]) == ("T2", "C V|V|")
    assert found_C["std"] < 0.001 * C
    assert abs(found_C["value"] - C) < 2.0 * found_C["std"]
