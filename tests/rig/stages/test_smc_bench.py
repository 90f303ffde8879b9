"""The bench of benches/smc_g2 over real bytes in virtual time: no rotation rate; a campaign finds the truth, faults end
a run at zero, and a silence stops the motor until it is commanded 0."""

from dataclasses import replace
from pathlib import Path

import pytest

from drivers.errors import DeviceError, LinkError
from drivers.pololu.smc import SmcG2
from rig.campaign.loading import load_bench
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

BENCH = Path(__file__).parents[3] / "benches" / "smc_g2"
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
    told = [event.text for event in recording.events]
    assert any("no rotation rate is measured, and a propeller that turns too slowly" in text for text in told)
    assert not [text for text in told if "could not be understood" in text]


@pytest.mark.parametrize(
    ("fault", "amount", "within", "cause"),
    [
        ("over_temperature", 0.1, 0.2, "motor reports safe start violation, over temperature"),
        ("over_current", 0.1, 0.2, "motor driver error"),
        ("kill_switch", 0.1, 0.2, "limit or kill switch"),
        ("under_voltage", 0.1, 0.2, "low supply voltage"),
        ("serial_error", 0.1, 0.2, "serial error"),
        ("silent", 0.1, 1.0, "motor does not answer any more"),
        ("reboot", 0.1, 1.0, "motor does not answer any more|contradict"),
        ("redrives", 0.45, 3.0, "contradict"),
        ("backwards", 0.1, 3.0, "contradict"),
    ],
)
def test_a_fault_ends_the_run(tmp_path, fault, amount, within, cause):
    world = Faulty(bench(), "motor", fault, amount)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", world, ID)
    assert world.begun is not None
    zeros = [t for t, volts in world.bench.commands if volts == 0.0 and t >= world.begun]
    assert zeros[0] - world.begun < within
    assert world.bench.drive.speed == 0


def test_a_watchdog_that_stops_nothing_is_refused_by_the_proof(tmp_path):
    with pytest.raises(RuntimeError, match="the motor's own watchdog is refused"):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(broken_watchdog=True), ID)


def driver(world: VirtualBench) -> SmcG2:
    return SmcG2("motor", load_bench(BENCH / "bench.toml").devices["motor"].options, world.wires["motor"])


def pass_time(world: VirtualBench, seconds: float) -> None:
    world.sleep_until_ns(world.now_ns() + round(seconds * 1e9))


def loop(world: VirtualBench, device: SmcG2, volts: float, seconds: float) -> None:
    for _ in range(round(seconds / 0.02)):
        device.drain()
        device.command(volts)
        pass_time(world, 0.02)


def test_silence_stops_it_until_it_is_commanded_zero():
    world = bench()
    device = driver(world)
    device.open()
    assert all(volts == 0.0 for _, volts in world.commands)
    loop(world, device, 12.0, 0.5)
    assert world.drive.speed == 800
    for _ in range(50):
        device.drain()
        pass_time(world, 0.02)
    assert world.drive.speed == 0, "its own timeout, though the rows were drained all the while"
    with pytest.raises(LinkError, match="command 0 V first"):
        device.command(12.0)
    pass_time(world, 0.1)
    assert world.drive.speed == 0
    loop(world, device, 0.0, 0.2)
    loop(world, device, 12.0, 0.2)
    assert (world.drive.speed, device.health().alive) == (800, True)
    device.close()
    pass_time(world, 0.1)
    assert world.drive.speed == 0


@pytest.mark.parametrize(
    ("motor", "sentence"),
    [
        ({"timeout": 0.0}, "did not come in"),
        ({"timeout": 2.0}, "did not come in"),
        ({"timeout": 0.2}, "comes within"),
        ({"crc": True}, "no Simple Motor Controller answers"),
    ],
)
def test_settings_that_are_refused(motor, sentence):
    world = bench(**motor)
    with pytest.raises(DeviceError, match=sentence):
        driver(world).open()
    pass_time(world, 1.0)
    assert world.drive.speed == 0


def test_the_bench_as_it_is_shipped_passes_the_check(tmp_path):
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    for port in ("load_cell", "motor"):
        (tmp_path / port).touch()
        text = text.replace(f"ports/{port}", str(tmp_path / port))
    (tmp_path / "bench.toml").write_text(text, encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    check_campaign(tmp_path / "campaign.toml")
