"""The bench of benches/roboteq_hbm with another cell in the place of its own, a campaign on it, and its faults."""

import re
from dataclasses import replace
from pathlib import Path

from sim_devices.bench.settings import SerialOptions
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host

BENCH = Path(__file__).parents[3] / "benches" / "roboteq_hbm"
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
voltages = [7.2, -7.2, 12.0, -12.0, 16.8, -16.8, 19.2, -19.2]
slew = 24.0
[plan.dwell]
kind = "fixed"
duration = 3.0
"""
TRUTH = 0.3985 * 1.0002
"""N/V^2: of T2, times the cell's gain."""
RUN = ("some-id", "2026-01-01")


def files(folder: Path, cell: str) -> Path:
    """The campaign, on a bench file whose load cell has the table `cell`."""
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?<=\[devices\.load_cell\]\n)(?:.+\n)+", cell, text)
    (folder / "bench.toml").write_text(text[: text.index("[mount]")], encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def world(cell: SerialOptions) -> VirtualBench:
    """The simulated bench with that cell."""
    settings = load_world(BENCH / "world.toml")
    thrusters = {name: replace(each, rotor="instant") for name, each in settings.world.thrusters.items()}
    made = replace(settings.world, thrusters=thrusters, mounted="T2")
    host = Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4)
    devices = {**settings.devices, "load_cell": cell}
    return VirtualBench(replace(settings, world=made, devices=devices, seed=5, step=0.005), host, "bus0")
