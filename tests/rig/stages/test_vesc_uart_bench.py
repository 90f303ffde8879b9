"""The bench of benches/vesc_uart over real bytes in virtual time: a campaign finds the truth, faults end a run."""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.cli import record_in_virtual_time
from rig.fit.answer import fit_recordings
from rig.hdf5.load import load
from rig.operate.check import check_campaign
from rig.recording.ledger import read
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from tests.rig.faulty_bench import Faulty
from tests.rig.operate.test_modbus_campaign import CAMPAIGN

BENCH = Path(__file__).parents[3] / "benches" / "vesc_uart"
TRUTH = 0.3985 * 1.0002
"""N/V^2: of T2, times the cell's gain."""
ID = ("some-id", "2026-01-01")


def bench(seed: int = 1, **motor) -> VirtualBench:
    settings = load_world(BENCH / "world.toml")
    devices = {**settings.devices, "motor": replace(settings.devices["motor"], **motor)}
    made = replace(settings, world=replace(settings.world, mounted="T2"), devices=devices, seed=seed, step=0.005)
    return VirtualBench(made, Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4), "none")


def files(folder: Path) -> Path:
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    text = text[: text.index("[mount]")].replace("min = -300.0 ", "max_age = 1.0\nmin = -300.0 ")
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def test_a_campaign_finds_the_truth_of_the_world(tmp_path):
    path, _ = record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(), ID)
    recording = load(path)
    assert (recording.outcome, recording.cause) == ("completed", "")
    (fitted,) = fit_recordings([recording])
    constant = fitted.fit.parameters["C"]
    assert abs(constant.value - TRUTH) < 3.0 * constant.std
    assert constant.std < 0.002 * TRUTH
    end = next(fact for fact in read(tmp_path / "run") if fact["fact"] == "run_end")
    assert 0.5 <= end["time_to_zero_s"] < 3.0
    rotation = recording.first_of("rotation_rate")
    assert len(rotation.time) / rotation.time[-1] == pytest.approx(50.0, rel=0.05)
    assert not [event.text for event in recording.events if "could not be understood" in event.text]


@pytest.mark.parametrize(
    ("fault", "amount", "within", "cause"),
    [
        ("over_current", 0.1, 0.2, r"motor reports fault 4 \(absolute over-current\)"),
        ("over_temperature", 0.1, 0.2, r"motor reports fault 6 \(over-temperature motor\)"),
        ("silent", 0.1, 0.8, "is stale"),
        ("reboot", 0.1, 0.8, "is stale"),
        ("frozen", 0.1, 3.0, "frozen"),
        ("ignores_commands", 0.1, 3.0, "does not follow|contradict"),
        ("redrives", 0.5, 3.0, "contradict|does not|by itself"),
        ("rate_factor", 1.5, 3.0, "contradict"),
    ],
)
def test_a_fault_ends_the_run(tmp_path, fault, amount, within, cause):
    world = Faulty(bench(), "motor", fault, amount)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", world, ID)
    assert world.begun is not None
    zeros = [t for t, volts in world.bench.commands if volts == 0.0 and t >= world.begun]
    if fault not in ("over_current", "over_temperature", "reboot"):  # these have stopped by themselves
        assert zeros[0] - world.begun < within
    assert world.bench.world.state.n < 1.0 or fault == "redrives"


def test_a_watchdog_that_never_fires_is_refused_by_the_proof(tmp_path):
    with pytest.raises(RuntimeError, match="the motor's own watchdog is refused"):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(broken_watchdog=True), ID)


def test_the_bench_as_it_is_shipped_passes_the_check(tmp_path):
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    for port in ("load_cell", "motor"):
        (tmp_path / port).touch()
        text = text.replace(f"ports/{port}", str(tmp_path / port))
    (tmp_path / "bench.toml").write_text(text, encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    check_campaign(tmp_path / "campaign.toml")
