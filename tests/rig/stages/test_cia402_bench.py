"""The bench of benches/cia402 over real bytes in virtual time: a drive on CANopen, a load cell on Modbus. A campaign
finds the truth, faults of the drive end a run, and after a silence the motor stays where it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from drivers.canopen.cia402 import Cia402
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from identification.mismatch.answer.as_json import diagnosis_json
from rig.campaign.loading import load_bench
from rig.cli import record_in_virtual_time
from rig.diagnose.command import diagnose_files
from rig.fit.answer import fit_recordings
from rig.hdf5.load import load
from rig.operate.check import check_campaign
from rig.recording.ledger import read
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from sim_devices.wires.can_frame import CanFrame
from tests.rig.faulty_bench import Faulty

BENCH = Path(__file__).parents[3] / "benches" / "cia402"
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
STAMP = ("some-id", "2026-01-01")


def bench(seed: int = 1, **motor) -> VirtualBench:
    settings = load_world(BENCH / "world.toml")
    devices = {**settings.devices, "motor": replace(settings.devices["motor"], **motor)}
    made = replace(settings, world=replace(settings.world, mounted="T2"), devices=devices, seed=seed, step=0.005)
    return VirtualBench(made, Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4), "bus0")


def files(folder: Path, **motor) -> Path:
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    text = text[: text.index("[mount]")]
    for key, line in motor.items():
        (old,) = [each for each in text.splitlines() if each.startswith(f"{key} ")] or [""]
        text = text.replace(old, line) if old else text.replace("node_id = 5", f"node_id = 5\n{line}")
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def fitted_C(path: Path):
    recording = load(path)
    assert (recording.outcome, recording.cause) == ("completed", "")
    (fitted,) = fit_recordings([recording])
    return recording, fitted.fit.parameters["C"]


@pytest.mark.parametrize(
    ("keys", "motor"),
    [
        ({}, {}),
        ({"on_silence": 'on_silence = "fault"'}, {}),
        ({"on_silence": 'on_silence = "coast"'}, {}),
        (
            {
                "velocity_unit": "velocity_unit = 0.1\ngear_ratio = 4.0",
                "rated_current": "rated_current = 20.0\nrated_torque = 2.0",
            },
            {"velocity_unit": 0.1, "gear_ratio": 4.0, "max_velocity": 60_000, "acceleration": 1_200_000},
        ),
    ],
    ids=["as shipped", "fault", "coast", "tenths of rev/min and a gear"],
)
def test_a_campaign_finds_the_truth_and_proves_the_watchdog(tmp_path, keys, motor):
    world = bench(**motor)
    path, _ = record_in_virtual_time(files(tmp_path, **keys), tmp_path / "run", world, STAMP)
    recording, constant = fitted_C(path)
    assert abs(constant.value - TRUTH) < 3.0 * constant.std
    assert constant.std < 0.002 * TRUTH
    end = next(fact for fact in read(tmp_path / "run") if fact["fact"] == "run_end")
    assert 0.5 <= end["time_to_zero_s"] < 3.0
    names = {(channel.stream, channel.name) for channel in recording.channels}
    assert {("motor", "rotation_rate"), ("motor", "statusword"), ("motor_state", "bus_voltage")} <= names
    rotation = recording.first_of("rotation_rate")
    assert len(rotation.time) / rotation.time[-1] == pytest.approx(50.0, rel=0.05)
    assert not [event.text for event in recording.events if "could not be understood" in event.text]


def test_a_loop_that_holds_the_speed_gets_no_curve_that_the_rate_excludes(tmp_path):
    """A rotor that a loop drives overshoots, which no lag does: thrust follows the rate, and the volts are its own. A
    loss in the winding was told beside it, with C 10 % too large."""
    path, _ = record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(), STAMP)
    found = diagnosis_json(diagnose_files([path]))
    assert {each["effect"] for each in found["findings"]} == {"rotation_coupling", "motor_lag"}
    constant = found["model"]["parameters"]["C"]
    assert abs(constant["value"] - TRUTH) < 0.003 * TRUTH
    assert constant["std"] < 0.01 * TRUTH


def test_rate_per_volt_is_what_a_volt_is(tmp_path):
    """C is of the control voltage: with half the rotation for a volt it is a quarter."""
    campaign = files(tmp_path, rate_per_volt="rate_per_volt = 0.5")
    text = campaign.read_text(encoding="utf-8").replace("expected_C = 0.4\n", "")
    campaign.write_text(text, encoding="utf-8")
    (tmp_path / "bench.toml").write_text(
        (tmp_path / "bench.toml").read_text(encoding="utf-8").replace("proof_voltage = 4.0", "proof_voltage = 8.0")
    )
    path, _ = record_in_virtual_time(campaign, tmp_path / "run", bench(), STAMP)
    _, constant = fitted_C(path)
    assert abs(constant.value - 0.25 * TRUTH) < 3.0 * constant.std


@pytest.mark.parametrize(
    ("fault", "amount", "within", "cause"),
    [
        ("over_temperature", 0.1, 0.3, r"motor reports emergency 0x4310 \(temperature\)"),
        ("over_current", 0.1, 0.3, r"motor reports emergency 0x2310 \(current\)"),
        ("disabled", 0.1, 0.3, "motor stopped by itself: its state is switch on disabled"),
        ("leaves_mode", 0.1, 0.3, "motor left its mode: 0x6061 is 0, expected 3"),
        ("no_heartbeat", 0.1, 0.6, "motor is silent: its last heartbeat is"),
        ("reboot", 0.1, 0.6, "is stale|motor is silent"),
        ("silent", 0.1, 0.5, "is stale|motor is silent"),
        ("frozen", 0.1, 3.0, "frozen"),
        ("ignores_commands", 0.1, 3.0, "does not follow|contradict|runs backwards"),
        ("redrives", 0.5, 3.0, "contradict|does not|by itself"),
        ("rate_factor", 1.3, 3.0, "contradict"),
    ],
)
def test_a_fault_ends_the_run(tmp_path, fault, amount, within, cause):
    world = Faulty(bench(), "motor", fault, amount)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", world, STAMP)
    assert world.begun is not None
    zeros = [t for t, volts in world.bench.commands if volts == 0.0 and t >= world.begun]
    if fault not in ("silent", "reboot", "ignores_commands"):  # hear nothing any more: their own watchdog stops them
        assert zeros[0] - world.begun < within
    assert world.bench.commands[-1][1] == 0.0
    assert world.bench.drive.state != "enabled" or fault in ("frozen", "rate_factor")  # held at 0, and obeys


def test_a_watchdog_that_never_fires_is_refused_by_the_proof(tmp_path):
    with pytest.raises(RuntimeError, match="the motor's own watchdog is refused"):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(broken_watchdog=True), STAMP)


# -- the driver on the bench -------------------------------------------------------------------------------------------


@pytest.fixture
def drive_on():
    """Makes them, and shuts their buses down."""
    made = []

    def make(world: VirtualBench, **keys) -> Driven:
        made.append(Driven(world, **keys))
        return made[-1]

    yield make
    for each in made:
        each.bus.close()


class Driven:
    """Bench, bus and driver; `hold` commands as the control loop does."""

    def __init__(self, world: VirtualBench, **keys) -> None:
        self.world = world
        self.bus = CanBus("slcan", "can0", 500_000, "", world.wires["bus0"])
        self.bus.open()
        options = replace(load_bench(BENCH / "bench.toml").devices["motor"].options, **keys)
        self.device = Cia402("motor", options, self.bus)

    def open(self) -> str:
        return self.device.open()

    def rest(self, seconds: float) -> None:
        """Nothing is sent, what comes is taken."""
        for _ in range(round(seconds / 0.02)):
            self.world.sleep_until_ns(self.world.now_ns() + 20_000_000)
            self.device.drain()

    def hold(self, volts: float, seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            self.device.command(volts)
            self.rest(0.02)

    def send(self, identifier: int, data: bytes) -> None:
        """Somebody else on the bus."""
        self.world._broadcast(CanFrame(identifier, data, extended=False), self.world.now(), None)


def test_opening_sends_no_set_point_and_leaves_the_power_stage_off(drive_on):
    driven = drive_on(bench())
    assert driven.open().startswith("SIM402 servo drive, vendor 0x53494D")
    driven.rest(1.0)
    assert driven.world.commands == []
    assert driven.world.drive.state == "switch on disabled"
    assert driven.device.health().alive


def test_only_a_set_point_other_than_0_gives_torque_and_a_long_rest_takes_it_away(drive_on):
    driven = drive_on(bench(), idle_time=2.0)
    driven.open()
    driven.hold(0.0, 1.0)
    assert driven.world.drive.state == "switched on"
    driven.hold(6.0, 1.0)
    assert driven.world.drive.state == "enabled"
    assert driven.world.world.state.n == pytest.approx(6.0, rel=0.01)
    driven.hold(0.0, 1.5)
    assert driven.world.drive.state == "enabled"
    driven.hold(0.0, 1.0)
    assert driven.world.drive.state == "switched on"
    driven.hold(6.0, 0.5)
    assert driven.world.drive.state == "enabled"
    assert driven.device.health().alive


def test_release_is_a_quick_stop(drive_on):
    driven = drive_on(bench(), quick_stop_deceleration=10.0)
    driven.open()
    driven.hold(0.0, 0.3)
    driven.hold(20.0, 3.0)
    driven.device.release()
    driven.rest(0.1)
    assert driven.world.drive.state == "quick stop"
    driven.hold(0.0, 0.9)
    assert 5.0 < driven.world.world.state.n < 15.0, "down its ramp of 10 rev/s^2"
    driven.hold(0.0, 2.0)
    assert driven.world.drive.state == "switched on"
    assert driven.device.health().alive


@pytest.mark.parametrize("on_silence", ["quick_stop", "coast", "fault"])
def test_a_silence_of_the_loop_ends_in_zero_and_a_set_point_after_it_is_refused(on_silence, drive_on):
    driven = drive_on(bench(), on_silence=on_silence)
    driven.open()
    driven.hold(0.0, 0.3)
    driven.hold(12.0, 2.0)
    driven.rest(0.4)
    assert driven.world.drive.state == "enabled"
    driven.rest(1.1)
    assert driven.world.drive.state == ("fault" if on_silence == "fault" else "switch on disabled")
    assert driven.device.health().alive, "it did what it was set to do"
    with pytest.raises(LinkError, match="12 V; command 0 V first"):
        driven.device.command(12.0)
    driven.rest(0.02)
    assert driven.world.drive.state != "enabled"
    driven.hold(0.0, 0.5)
    assert driven.world.drive.state == "switched on"
    driven.hold(12.0, 1.0)
    assert driven.world.drive.state == "enabled"


def test_what_is_left_by_a_killed_controller_turns_nothing_for_whoever_comes_next(drive_on):
    world = bench()
    killed = drive_on(world, on_silence="fault")
    killed.open()
    killed.hold(0.0, 0.3)
    killed.hold(12.0, 2.0)
    killed.rest(5.0)
    assert world.drive.state == "fault"
    killed.send(0x205, bytes.fromhex("0f00 d0020000"))  # a naive host: enable, 720 rev/min
    killed.rest(0.1)
    assert world.drive.state == "fault"
    killed.bus.close()
    world.commands.clear()
    following = drive_on(world)
    following.open()
    following.hold(0.0, 1.0)
    assert world.drive.state == "switched on"
    assert all(volts == 0.0 for _, volts in world.commands)


def test_a_controller_that_is_replaced_while_the_motor_turns_stops_it(drive_on):
    world = bench()
    first = drive_on(world)
    first.open()
    first.hold(0.0, 0.3)
    first.hold(12.0, 2.0)
    first.bus.close()
    second = drive_on(world)
    second.open()
    assert world.drive.state == "switch on disabled"
    second.rest(1.0)
    assert abs(world.world.state.n) < 3.0


def test_the_heartbeat_is_withheld_from_a_drive_that_does_not_obey_a_quick_stop(drive_on):
    driven = drive_on(bench())
    driven.open()
    driven.hold(0.0, 0.3)
    driven.hold(12.0, 2.0)
    driven.world.fault("motor", "ignores_commands")
    driven.device.release()
    driven.hold(0.0, 0.28)
    assert driven.world.drive.state == "enabled"
    driven.hold(0.0, 2.0)
    assert driven.world.drive.state == "switch on disabled", "its own watchdog"
    assert "does not obey a quick stop" in driven.device.health().error


def test_closing_stops_a_motor_that_turns(drive_on):
    driven = drive_on(bench())
    driven.open()
    driven.hold(0.0, 0.3)
    driven.hold(12.0, 2.0)
    driven.device.close()
    driven.device.close()
    driven.rest(1.0)
    assert driven.world.drive.state == "switch on disabled"
    assert not driven.device.health().alive


def test_commands_that_are_refused(drive_on):
    driven = drive_on(bench())
    driven.open()
    for volts in (float("nan"), float("inf"), 24.1, -24.1):
        with pytest.raises(ValueError, match="within"):
            driven.device.command(volts)
    with pytest.raises(LinkError, match=r"not switched on.*0 V was sent in the place of 3 V"):
        driven.device.command(3.0)
    driven.rest(0.3)
    assert driven.world.commands == []


@pytest.mark.parametrize(
    ("motor", "keys", "sentence"),
    [
        ({"keeps_option": True}, {}, "0x6007:0 .* was set to 3 and reads back 1"),
        ({"keeps_mode": True}, {}, "does not enter mode 3"),
        ({"modes": 0x20}, {}, "has no mode profile velocity"),
        ({"rated_current": 10.0}, {}, "has 10 A .* says 20 A"),
        ({"max_velocity": 1000}, {}, "clips set-points at 1000 counts .* 24 V is 1440"),
        ({}, {"velocity_unit": 0.1}, "counts velocity in 1 rev/min"),
        ({"lacks": ("1029",)}, {}, "0x1029:1 .* refuses 1: .*does not exist"),
        ({"lacks": ("6079",)}, {}, "TPDO 2, which shall hold 0x6079.* refuses"),
        ({"node_id": 6}, {}, "no CANopen device answers as node 5"),
    ],
)
def test_settings_that_are_refused(motor, keys, sentence, drive_on):
    driven = drive_on(bench(**motor), **keys)
    with pytest.raises(DeviceError, match=sentence):
        driven.open()
    driven.rest(0.2)
    assert driven.world.commands == []
    assert driven.world.drive.state == "switch on disabled"


def test_a_fault_that_is_there_at_opening(drive_on):
    driven = drive_on(bench())
    driven.world.fault("motor", "over_temperature")
    with pytest.raises(DeviceError, match=r"0x603F is 0x4310 \(temperature\), error register 0x09"):
        driven.open()
    clearing = drive_on(driven.world, reset_faults=True)
    clearing.open()
    clearing.hold(0.0, 0.5)
    assert driven.world.drive.state == "switched on"


def test_torque_turns_the_propeller_too(drive_on):
    driven = drive_on(bench(), mode="torque", rate_per_volt=None, torque_per_volt=0.05, rated_torque=2.0)
    driven.open()
    driven.hold(0.0, 0.3)
    driven.hold(10.0, 3.0)  # 0.5 N.m of 2 N.m: a quarter of the rated 20 A
    state = driven.world.world.state
    assert state.current == pytest.approx(5.0)
    assert state.n > 2.0
    driven.device.release()
    driven.hold(0.0, 2.0)
    assert abs(state.n) < 0.3


def test_the_bench_as_it_is_shipped_passes_the_check(tmp_path):
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    for port in ("load_cell", "can0"):
        (tmp_path / port).touch()
        text = text.replace(f"ports/{port}", str(tmp_path / port))
    (tmp_path / "bench.toml").write_text(text, encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    assert check_campaign(tmp_path / "campaign.toml").peak_thrust == pytest.approx(0.4 * 19.2**2)
