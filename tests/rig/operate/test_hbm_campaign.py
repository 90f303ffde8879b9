"""The bench of benches/roboteq_hbm over real bytes in virtual time: the campaign of the other benches finds the truth,
in four bytes and in text, and what goes wrong with the electronics ends a run."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.cli import main, record_in_virtual_time
from rig.hdf5.load import load
from rig.operate.check import check_campaign
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from tests.rig.faulty_bench import Faulty

BENCH = Path(__file__).parents[3] / "benches" / "roboteq_hbm"
CAMPAIGN = """
[campaign]
name = "short"
bench = "bench.toml"
output = "out"
thrusters = ["T2"]
expected_C = 0.4
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


def files(folder: Path, **cell: str) -> Path:
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    text = text[: text.index("[mount]")]
    for key, value in cell.items():
        text = text.replace('kind = "hbm_aed"\n', f'kind = "hbm_aed"\n{key} = {value}\n')
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def world(**cell) -> VirtualBench:
    settings = load_world(BENCH / "world.toml")
    devices = {**settings.devices, "load_cell": replace(settings.devices["load_cell"], **cell)}
    thrusters = {name: replace(each, rotor="instant") for name, each in settings.world.thrusters.items()}
    made = replace(settings.world, thrusters=thrusters, mounted="T2")
    host = Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4, stall_every=5.0, stall=0.01)
    return VirtualBench(replace(settings, world=made, devices=devices, seed=3, step=0.005), host, "bus0")


@pytest.mark.parametrize("form", ["binary", "ascii"])
def test_a_campaign_with_roboteq_and_hbm_finds_the_truth_of_the_world(tmp_path, capsys, form):
    path, _ = record_in_virtual_time(
        files(tmp_path, format=f'"{form}"'), tmp_path / "run", world(checksum=1), ("some-id", "2026-01-01")
    )
    found = load(path)
    assert (found.complete, found.outcome) == (True, "completed")
    thrust = found.first_of("thrust")
    assert np.mean(np.diff(thrust.time)) == pytest.approx(1 / 50, rel=0.005)
    assert thrust.acquisition.delay == pytest.approx((6 if form == "binary" else 17) * 11 / 38400)
    assert thrust.acquisition.window == pytest.approx(1 / 50)
    assert not np.isnan(thrust.value).any()
    assert main(["fit", str(path), "--json", str(tmp_path / "fit.json")]) == 0
    capsys.readouterr()
    (fit,) = json.loads((tmp_path / "fit.json").read_text())["fits"]
    found_C = fit["parameters"]["C"]
    assert (fit["thruster"], fit["model"]) == ("T2", "C V|V|")
    assert found_C["std"] < 0.001 * TRUTH
    assert abs(found_C["value"] - TRUTH) < 2.0 * found_C["std"]


@pytest.mark.parametrize(
    ("fault", "amount", "within", "cause"),
    [
        ("overload", 0.1, 0.1, "load_cell.thrust"),
        ("incoherent", 0.1, 0.1, "load_cell.thrust"),
        ("silent", 0.1, 1.0, "is stale"),
        ("reboot", 0.1, 1.0, "is stale"),
        ("frozen", 0.1, 3.0, "frozen"),
        ("merged", 1.0, 1.0, "is stale"),
    ],
)
def test_a_fault_of_the_cell_ends_the_run(tmp_path, fault, amount, within, cause):
    bench = Faulty(world(), "load_cell", fault, amount)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", bench, ("some-id", "2026-01-01"))
    assert bench.begun is not None
    zeros = [t for t, volts in bench.bench.commands if volts == 0.0 and t >= bench.begun]
    assert zeros[0] - bench.begun < within
    assert bench.bench.commands[-1][1] == 0.0


def test_a_line_that_loses_bytes_costs_rows_and_is_told(tmp_path):
    bench = Faulty(world(), "load_cell", "shifted", 0.01)
    path, _ = record_in_virtual_time(files(tmp_path), tmp_path / "run", bench, ("some-id", "2026-01-01"))
    recording = load(path)
    assert recording.outcome == "completed"
    assert any("load_cell: " in event.text and "could not be understood" in event.text for event in recording.events)
    assert np.abs(recording.first_of("thrust").value).max() < 200.0, "no value is invented"


def test_the_bench_as_it_is_shipped_passes_the_check(tmp_path):
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    for port in ("load_cell", "motor"):
        (tmp_path / port).touch()
        text = text.replace(f"ports/{port}", str(tmp_path / port))
    (tmp_path / "bench.toml").write_text(text, encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    assert check_campaign(tmp_path / "campaign.toml").peak_thrust == pytest.approx(0.4 * 19.2**2)
