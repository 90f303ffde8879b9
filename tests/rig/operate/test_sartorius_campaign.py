"""The campaign of the other benches with a Sartorius balance in the place of the cell: only its table is another."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.cli import record_in_virtual_time
from rig.fit.answer import fit_recordings
from rig.hdf5.load import load
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from sim_devices.instruments.serial_lines.sartorius import SartoriusOptions

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
CELL = """kind = "sartorius_sbi"
port = "ports/load_cell"
rate = 10.0
unit = "kg"
baud = 19200
resolution = 0.0098
gain_std = 0.0005
delay = 0.035
delay_std = 0.015
"""
TRUTH = 0.3985 * 1.0002
"""N/V^2: of T2, times the cell's gain."""


def files(folder: Path) -> Path:
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?<=\[devices\.load_cell\]\n)(?:.+\n)+", CELL, text)
    (folder / "bench.toml").write_text(text[: text.index("[mount]")], encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def world(**cell) -> VirtualBench:
    settings = load_world(BENCH / "world.toml")
    card = SartoriusOptions("sartorius_sbi", "load_cell", unit="kg", decimals=3, baud=19200, **cell)
    thrusters = {name: replace(each, rotor="instant") for name, each in settings.world.thrusters.items()}
    made = replace(settings.world, thrusters=thrusters, mounted="T2")
    host = Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4)
    devices = {**settings.devices, "load_cell": card}
    return VirtualBench(replace(settings, world=made, devices=devices, seed=5, step=0.005), host, "bus0")


class Faulty:
    """The bench, whose cell gets a fault once the motor was driven with 12 V for two seconds."""

    def __init__(self, bench: VirtualBench, fault: str) -> None:
        self.bench, self.wires, self._fault = bench, bench.wires, fault
        self.begun: float | None = None

    def now_ns(self) -> int:
        return self.bench.now_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        self.bench.sleep_until_ns(t_ns)
        if self.begun is None and self.bench.commands:
            since, volts = self.bench.commands[-1]
            if abs(volts - 12.0) < 0.01 and self.bench.now() - since > 2.0:
                self.begun = self.bench.now()
                self.bench.fault("load_cell", self._fault)


def test_the_truth_of_the_world_is_found(tmp_path):
    path, _ = record_in_virtual_time(files(tmp_path), tmp_path / "run", world(), ("some-id", "2026-01-01"))
    recording = load(path)
    assert (recording.outcome, recording.cause) == ("completed", "")
    thrust = recording.first_of("thrust")
    assert np.mean(np.diff(thrust.time)) == pytest.approx(1 / 10, rel=0.02)
    (fitted,) = fit_recordings([recording])
    constant = fitted.fit.parameters["C"]
    assert constant.std < 0.002 * TRUTH
    assert abs(constant.value - TRUTH) < 2.0 * constant.std


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        ("overload", "load_cell.thrust"),
        ("error", "load_cell reports Err 54"),
        ("display_off", "load_cell reports OFF"),
        ("silent", "is stale"),
        ("frozen", "contradict"),
    ],
)
def test_a_fault_of_the_balance_ends_the_run(tmp_path, fault, cause):
    bench = Faulty(world(), fault)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", bench, ("some-id", "2026-01-01"))
    assert bench.begun is not None
    zeros = [t for t, volts in bench.bench.commands if volts == 0.0 and t >= bench.begun]
    assert zeros[0] - bench.begun < 4.0, (
        "the balance says so ten times a second, and a wrong sign only at the next level"
    )
    assert bench.bench.commands[-1][1] == 0.0
