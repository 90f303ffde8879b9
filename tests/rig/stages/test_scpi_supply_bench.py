"""The bench of benches/scpi_supply over real bytes in virtual time: one direction, no rotation rate. A campaign finds
the truth, the supply's watchdog is proved by the thrust, faults end a run at 0 V, and a plan in reverse is refused."""

from dataclasses import replace
from pathlib import Path

import pytest

from drivers.errors import DeviceError, LinkError
from drivers.scpi.supply import ScpiSupply
from rig.campaign.loading import load_bench
from rig.cli import record_in_virtual_time
from rig.errors import PlanError
from rig.fit.answer import fit_recordings
from rig.hdf5.load import load
from rig.operate.check import check_campaign
from rig.recording.ledger import read
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from tests.rig.faulty_bench import Faulty

BENCH = Path(__file__).parents[3] / "benches" / "scpi_supply"
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
voltages = [8.0, 12.0, 16.0, 20.0, 14.0, 10.0]
slew = 24.0
[plan.dwell]
kind = "fixed"
duration = 2.5
"""
TRUTH = 0.3985 * 1.0002
"""N/V^2: of T2, times the cell's gain."""
ID = ("some-id", "2026-01-01")


def bench(seed: int = 1, **motor) -> VirtualBench:
    settings = load_world(BENCH / "world.toml")
    devices = {**settings.devices, "motor": replace(settings.devices["motor"], **motor)}
    devices["load_cell"] = replace(devices["load_cell"], rate=100.0)
    made = replace(settings, world=replace(settings.world, mounted="T2"), devices=devices, seed=seed, step=0.005)
    return VirtualBench(made, Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4), "none")


def files(folder: Path, *changes: tuple[str, str]) -> Path:
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    text = text[: text.index("[mount]")].replace("min = -300.0 ", "max_age = 1.0\nmin = -300.0 ")
    text = text.replace("rate = 575.0 ", "rate = 100.0 ")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def pass_time(world: VirtualBench, seconds: float) -> None:
    world.sleep_until_ns(world.now_ns() + round(seconds * 1e9))


def test_a_campaign_finds_the_truth_and_proves_the_watchdog(tmp_path):
    world = bench()
    path, _ = record_in_virtual_time(files(tmp_path), tmp_path / "run", world, ID)
    recording = load(path)
    assert (recording.outcome, recording.cause) == ("completed", "")
    (fitted,) = fit_recordings([recording])
    constant = fitted.fit.parameters["C"]
    assert abs(constant.value - TRUTH) < 3.0 * constant.std
    assert constant.std < 0.003 * TRUTH
    end = next(fact for fact in read(tmp_path / "run") if fact["fact"] == "run_end")
    assert 0.5 <= end["time_to_zero_s"] < 4.0
    assert recording.first_of("rotation_rate") is None
    volts = recording.first_of("motor_voltage")
    assert len(volts.time) / volts.time[-1] > 4.0
    assert not [event.text for event in recording.events if "could not be understood" in event.text]
    pass_time(world, 0.1)
    assert not world.drive.on, "switched off at the end"


@pytest.mark.parametrize(
    ("fault", "amount", "within", "cause"),
    [
        ("output_off", 0.1, 3.0, "a protection that has switched its output off|does not|contradict"),
        ("error", 0.1, 3.0, r"motor reports error -240 \(Hardware error\)"),
        ("silent", 0.1, 3.0, "contradict|does not answer any more"),
        ("redrives", 0.35, 3.0, "contradict|does not|by itself|above its limit"),
        ("reboot", 0.1, 3.0, "is stale|output off|contradict"),
    ],
)
def test_a_fault_ends_the_run(tmp_path, fault, amount, within, cause):
    world = Faulty(bench(), "motor", fault, amount, after=1.5)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", world, ID)
    assert world.begun is not None
    pass_time(world.bench, 1.0)
    zeros = [t for t, volts in world.bench.commands if volts == 0.0 and t >= world.begun]
    assert zeros[0] - world.begun < within
    assert world.bench.commands[-1][1] == 0.0
    assert world.bench.drive.voltage == 0.0


def test_a_watchdog_that_never_fires_is_refused_by_the_proof(tmp_path):
    with pytest.raises(RuntimeError, match="the motor's own watchdog is refused"):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(broken_watchdog=True), ID)


def test_a_supply_without_a_watchdog_is_not_armed(tmp_path):
    changes = [
        ("watchdog_timeout = 0.5 ", "# watchdog_timeout "),
        ('watchdog_settings = ["OUTP:PROT:WDOG:DEL 0.5", "OUTP:PROT:WDOG ON"]', ""),
    ]
    world = bench(has_watchdog=False)
    with pytest.raises(RuntimeError, match="watchdog"):
        record_in_virtual_time(files(tmp_path, *changes), tmp_path / "run", world, ID)
    assert all(volts == 0.0 for _, volts in world.commands)


def test_a_plan_in_reverse_is_refused(tmp_path):
    campaign = files(tmp_path)
    campaign.write_text(CAMPAIGN.replace("8.0, 12.0", "8.0, -12.0"), encoding="utf-8")
    for port in ("load_cell", "meter", "motor"):
        (tmp_path / "ports").mkdir(exist_ok=True)
        (tmp_path / "ports" / port).touch()
    with pytest.raises(
        PlanError, match=r"goes down to -12 V, but the motor controller 'motor' gives nothing below 0 V"
    ):
        check_campaign(campaign)


def driver(world: VirtualBench) -> ScpiSupply:
    return ScpiSupply("motor", load_bench(BENCH / "bench.toml").devices["motor"].options, world.wires["motor"])


def test_after_a_silence_the_output_is_off_until_it_was_told_zero():
    world = bench()
    device = driver(world)
    device.open()
    for volts in (0.0, 12.0, 12.0, 12.0):
        device.command(volts)
        device.drain()
        pass_time(world, 0.1)
    assert world.drive.voltage == pytest.approx(12.0)
    pass_time(world, 0.7)
    assert not world.drive.on, "its own watchdog"
    with pytest.raises(LinkError, match="command 0 V before 12 V: 0 V was sent"):
        device.command(12.0)
    pass_time(world, 0.1)
    assert world.drive.voltage == 0.0
    device.command(0.0)
    device.command(12.0)
    pass_time(world, 0.1)
    assert world.drive.voltage == pytest.approx(12.0)
    with pytest.raises(LinkError, match="gives no negative voltage, and -5 V were commanded: 0 V was sent"):
        device.command(-5.0)
    pass_time(world, 0.1)
    assert world.drive.voltage == 0.0
    device.release()
    pass_time(world, 0.1)
    assert not world.drive.on
    device.close()


def test_what_the_watchdog_latched_is_not_brought_back_by_clearing_it():
    world = bench()
    first = driver(world)
    first.open()
    for volts in (0.0, 12.0, 12.0):
        first.command(volts)
        pass_time(world, 0.1)
    pass_time(world, 0.7)
    assert world.drive.voltage == 0.0
    world.commands.clear()
    second = driver(world)
    second.open()
    second.command(0.0)
    pass_time(world, 0.2)
    assert all(volts == 0.0 for _, volts in world.commands), "0 V and output off go before OUTP:PROT:CLE"
    second.command(12.0)
    pass_time(world, 0.1)
    assert world.drive.voltage == pytest.approx(12.0)
    second.close()


def test_a_naive_host_that_clears_the_protection_makes_the_propeller_turn():
    world = bench()
    first = driver(world)
    first.open()
    for volts in (0.0, 12.0, 12.0):
        first.command(volts)
        pass_time(world, 0.1)
    pass_time(world, 0.7)
    world.wires["motor"].write(b"OUTP:PROT:CLE\n")
    pass_time(world, 0.1)
    assert world.drive.voltage == pytest.approx(12.0)


def test_a_supply_that_knows_no_watchdog_is_refused():
    with pytest.raises(DeviceError, match=r"was told 'OUTP:PROT:WDOG:DEL 0\.5' and answers None"):
        driver(bench(has_watchdog=False)).open()


def test_the_bench_as_it_is_shipped_passes_the_check(tmp_path):
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    for port in ("load_cell", "meter", "motor"):
        (tmp_path / port).touch()
        text = text.replace(f"ports/{port}", str(tmp_path / port))
    (tmp_path / "bench.toml").write_text(text, encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    assert check_campaign(tmp_path / "campaign.toml").peak_thrust == pytest.approx(0.4 * 20.0**2)
