"""The bench of benches/roboteq over real bytes in virtual time: a campaign finds the truth, its faults end a run, and
after the controller's watchdog the motor stays where it is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.errors import DeviceError, LinkError
from drivers.roboteq.controller import Roboteq
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

BENCH = Path(__file__).parents[3] / "benches" / "roboteq"
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
zero_every = 4
slew = 24.0
[plan.dwell]
kind = "fixed"
duration = 2.5
"""
TRUTH = 0.3985 * 1.0002
"""N/V^2: of T2, times the cell's gain."""


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


@pytest.mark.parametrize("motor", [{}, {"echo": False, "at_zero": "coast"}], ids=["as delivered", "quiet, coasting"])
def test_a_campaign_finds_the_truth_and_proves_the_watchdog(tmp_path, motor):
    world = bench(**motor)
    path, _ = record_in_virtual_time(files(tmp_path), tmp_path / "run", world, ("some-id", "2026-01-01"))
    recording = load(path)
    assert (recording.outcome, recording.cause) == ("completed", "")
    (fitted,) = fit_recordings([recording])
    constant = fitted.fit.parameters["C"]
    assert abs(constant.value - TRUTH) < 3.0 * constant.std
    assert constant.std < 0.002 * TRUTH
    end = next(fact for fact in read(tmp_path / "run") if fact["fact"] == "run_end")
    assert 0.5 <= end["time_to_zero_s"] < 3.0
    names = {(channel.stream, channel.name) for channel in recording.channels}
    assert {("motor", "rotation_rate"), ("motor", "motor_voltage"), ("motor_state", "fault_flags")} <= names
    rotation = recording.first_of("rotation_rate")
    assert len(rotation.time) / rotation.time[-1] == pytest.approx(50.0, rel=0.05)
    assert not [event.text for event in recording.events if "could not be understood" in event.text]


def test_levels_between_two_set_points_are_recorded_as_the_controller_was_told(tmp_path):
    """5 V is 4.992 V for a controller of thousandths of 48 V, 9.1 V is 9.12 V."""
    campaign = files(tmp_path)
    asked = "[5.0, -5.0, 9.1, -9.1, 13.0, -13.0]"
    text = campaign.read_text().replace("[7.2, -7.2, 12.0, -12.0, 16.8, -16.8, 19.2, -19.2]", asked)
    campaign.write_text(text, encoding="utf-8")
    path, _ = record_in_virtual_time(campaign, tmp_path / "run", bench(), ("some-id", "2026-01-01"))
    recording = load(path)
    held = {round(abs(step.command_voltage), 6) for step in recording.steps if step.phase == "hold"}
    assert held == {4.992, 9.12, 13.008}
    steps = recording.first_of("command_voltage").value / 0.048
    assert np.abs(steps - np.round(steps))[np.isfinite(steps)].max() < 1e-6
    (fitted,) = fit_recordings([recording])
    constant = fitted.fit.parameters["C"]
    assert abs(constant.value - TRUTH) < 3.0 * constant.std < 0.004 * TRUTH


@pytest.mark.parametrize(
    ("fault", "amount", "within", "cause"),
    [
        ("over_temperature", 0.1, 0.3, "motor reports overheat"),
        ("over_current", 0.1, 0.3, "motor reports short circuit"),
        ("stall", 0.1, 0.3, "motor reports stall detected"),
        ("pulse_mode", 0.1, 0.3, "motor reports commanded by a pulse input"),
        ("silent", 0.1, 0.5, "is stale"),
        ("frozen", 0.1, 3.0, "frozen"),
        ("ignores_commands", 0.1, 3.0, "the motor does not follow|contradict"),
        ("redrives", 0.5, 3.0, "contradict|does not|by itself"),
        ("rate_factor", 1.3, 3.0, "contradict"),
    ],
)
def test_a_fault_ends_the_run(tmp_path, fault, amount, within, cause):
    world = Faulty(bench(), "motor", fault, amount)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", world, ("some-id", "2026-01-01"))
    assert world.begun is not None
    zeros = [t for t, volts in world.bench.commands if volts == 0.0 and t >= world.begun]
    if fault != "silent":  # hears nothing any more: its own watchdog stops it
        assert zeros[0] - world.begun < within
    assert world.bench.commands[-1][1] == 0.0
    assert world.bench.drive.power == 0.0 or fault == "redrives"


def test_a_watchdog_that_never_fires_is_refused_by_the_proof(tmp_path):
    with pytest.raises(RuntimeError, match="the motor's own watchdog is refused"):
        record_in_virtual_time(
            files(tmp_path), tmp_path / "run", bench(broken_watchdog=True), ("some-id", "2026-01-01")
        )


def without_a_rate(folder: Path) -> Path:
    """The same bench, its controller without a sensor on the motor."""
    campaign = files(folder)
    text = (folder / "bench.toml").read_text(encoding="utf-8")
    text = text.replace('rotation = "brushless"', 'rotation = "none"').replace("pole_pairs = 7 ", "# pole_pairs ")
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    return campaign


def test_without_a_rate_the_watchdog_cannot_be_proved(tmp_path):
    campaign = without_a_rate(tmp_path)
    with pytest.raises(RuntimeError, match="the watchdog can't be proved: no rotation rate is measured"):
        record_in_virtual_time(campaign, tmp_path / "run", bench(), ("some-id", "2026-01-01"))


def test_without_a_rate_a_run_is_measured_and_its_rest_is_never_confirmed(tmp_path):
    campaign = without_a_rate(tmp_path)
    text = campaign.read_text(encoding="utf-8").replace("[watch]", "prove_watchdog = false\n[watch]")
    text += '[overrides]\n"campaign.prove_watchdog" = "this controller measures no rotation rate"\n'
    campaign.write_text(text, encoding="utf-8")
    world = bench()
    with pytest.raises(RuntimeError, match="STOP NOT CONFIRMED at the end of the run"):
        record_in_virtual_time(campaign, tmp_path / "run", world, ("some-id", "2026-01-01"))
    recording = load(tmp_path / "run" / "T2.h5")
    (fitted,) = fit_recordings([recording])
    constant = fitted.fit.parameters["C"]
    assert abs(constant.value - TRUTH) < 3.0 * constant.std
    assert any("no rotation rate is measured on this bench" in event.text for event in recording.events)
    assert recording.first_of("rotation_rate") is None
    assert world.drive.power == 0.0


def test_a_line_that_loses_bytes_costs_rows_and_is_told(tmp_path):
    world = bench()
    path, _ = record_in_virtual_time(
        files(tmp_path), tmp_path / "run", Faulty(world, "motor", "shifted", 0.01), ("some-id", "2026-01-01")
    )
    recording = load(path)
    assert recording.outcome == "completed"
    rotation = recording.first_of("rotation_rate")
    assert 0.9 < len(rotation.time) / rotation.time[-1] / 50.0 < 1.0
    assert any("motor: " in event.text and "could not be understood" in event.text for event in recording.events)


def driver(world: VirtualBench) -> Roboteq:
    return Roboteq("motor", load_bench(BENCH / "bench.toml").devices["motor"].options, world.wires["motor"])


def pass_time(world: VirtualBench, seconds: float) -> None:
    world.sleep_until_ns(world.now_ns() + round(seconds * 1e9))


def left_running(**motor) -> VirtualBench:
    """A controller whose host is gone in the middle of a hold at 12 V; its watchdog has stopped the motor."""
    world = bench(channels=2, **motor)
    world.wires["motor"].write(b"!G 1 250\r")
    pass_time(world, 0.4)
    assert world.drive.power == 250.0
    pass_time(world, 5.0)
    assert world.drive.power == 0.0
    return world


def test_a_naive_host_makes_the_motor_run():
    world = left_running()
    world.wires["motor"].write(b"!AC 1 5000\r")  # an acceleration, no set-point
    pass_time(world, 0.1)
    assert world.drive.power == 250.0
    assert world.world.state.n > 1.0


def test_the_driver_does_not():
    world = left_running()
    device = driver(world)
    device.open()
    world.commands.clear()
    for _ in range(100):
        device.drain()
        pass_time(world, 0.02)
        assert world.drive.power == 0.0
    world.wires["motor"].write(b"!AC 1 5000\r")
    pass_time(world, 0.1)
    assert world.drive.power == 0.0, "what could have been resumed is gone"
    assert all(volts == 0.0 for _, volts in world.commands)
    device.close()


def test_half_a_command_of_a_killed_host_does_no_more_than_a_tick():
    world = left_running()
    world.wires["motor"].write(b"!G 1 5")
    device = driver(world)
    device.open()
    assert world.drive.power == 0.0
    device.close()


def test_a_silence_of_the_loop_ends_in_zero():
    world = bench()
    device = driver(world)
    device.open()
    device.command(0.0)
    device.command(12.0)
    pass_time(world, 0.3)
    device.command(12.0)
    pass_time(world, 0.6)
    assert world.drive.power == 0.0, "its own watchdog"
    with pytest.raises(LinkError, match="command 0 V first"):
        device.command(12.0)
    pass_time(world, 0.1)
    assert world.drive.power == 0.0
    device.command(0.0)
    device.command(12.0)
    pass_time(world, 0.1)
    assert world.drive.power == 250.0
    device.close()
    pass_time(world, 0.1)
    assert world.drive.power == 0.0
    world.wires["motor"].write(b"!AC 1 5000\r")
    pass_time(world, 0.1)
    assert world.drive.power == 0.0, "what is closed left nothing to resume"


@pytest.mark.parametrize(
    ("motor", "sentence"),
    [
        ({"watchdog": 0}, "watchdog is switched off"),
        ({"watchdog": 1000}, "1000 ms"),
        ({"mode": 1}, "closes a loop"),
        ({"pole_pairs": 4}, "BPOL = 4"),
    ],
)
def test_settings_that_are_refused(motor, sentence):
    world = left_running(**motor) if motor.get("watchdog") != 0 and motor.get("watchdog") != 1000 else bench(**motor)
    device = driver(world)
    with pytest.raises(DeviceError, match=sentence):
        device.open()
    pass_time(world, 0.1)
    assert world.drive.power == 0.0


def test_the_bench_as_it_is_shipped_passes_the_check(tmp_path):
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    for port in ("load_cell", "motor"):
        (tmp_path / port).touch()
        text = text.replace(f"ports/{port}", str(tmp_path / port))
    (tmp_path / "bench.toml").write_text(text, encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    assert check_campaign(tmp_path / "campaign.toml").peak_thrust == pytest.approx(0.4 * 19.2**2)
