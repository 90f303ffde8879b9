"""The bench of benches/cia401 in virtual time: an analogue output as control voltage and a load cell, both on CANopen.
A campaign finds the truth without a rotation rate; a silence, a stop and a restart leave 0 V at the output."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from drivers.canopen.cia401_options import Options
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from rig.campaign.loading import load_bench
from rig.cli import record_in_virtual_time
from rig.fit.answer import fit_recordings
from rig.hdf5.load import load
from rig.operate.check import check_campaign
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from sim_devices.wires.can_frame import CanFrame
from tests.rig.faulty_bench import Faulty

pytest.importorskip("canopen")
BENCH = Path(__file__).parents[3] / "benches" / "cia401"
CAMPAIGN = """
[campaign]
name = "short"
bench = "bench.toml"
output = "out"
thrusters = ["T2"]
expected_C = 2.3
prove_watchdog = false
[watch]
off = true
[tare]
duration = 1.0
max_drift = 1.0
[plan]
kind = "levels"
voltages = [3.0, -3.0, 5.0, -5.0, 7.0, -7.0, 8.0, -8.0]
zero_every = 4
slew = 10.0
[plan.dwell]
kind = "fixed"
duration = 2.5
[overrides]
"campaign.prove_watchdog" = "this arrangement measures no rotation rate"
"""
TRUTH = 0.3985 * 1.0002 * 2.4**2
"""N/V^2 of control voltage: of T2, times the cell's gain and the square of the amplifier's."""
STAMP = ("some-id", "2026-01-01")


def bench(seed: int = 1, **motor) -> VirtualBench:
    settings = load_world(BENCH / "world.toml")
    devices = {**settings.devices, "motor": replace(settings.devices["motor"], **motor)}
    made = replace(settings, world=replace(settings.world, mounted="T2"), devices=devices, seed=seed, step=0.005)
    return VirtualBench(made, Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4), "bus0")


def files(folder: Path) -> Path:
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    (folder / "bench.toml").write_text(text[: text.index("[mount]")], encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def test_a_campaign_finds_the_truth_and_never_confirms_its_rest(tmp_path):
    """As each bench without a rotation rate (docs/devices/roboteq.md)."""
    world = bench()
    with pytest.raises(RuntimeError, match="STOP NOT CONFIRMED at the end of the run"):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", world, STAMP)
    recording = load(tmp_path / "run" / "T2.h5")
    (fitted,) = fit_recordings([recording])
    constant = fitted.fit.parameters["C"]
    assert abs(constant.value - TRUTH) < 3.0 * constant.std
    assert constant.std < 0.002 * TRUTH
    assert recording.first_of("rotation_rate") is None
    assert any("no rotation rate is measured on this bench" in event.text for event in recording.events)
    assert not [event.text for event in recording.events if "could not be understood" in event.text]
    assert world.commands[-1][1] == 0.0
    assert world.drive.output == 0.0


def test_the_watchdog_cannot_be_proved_on_this_bench(tmp_path):
    campaign = files(tmp_path)
    text = campaign.read_text(encoding="utf-8").replace("prove_watchdog = false\n", "")
    campaign.write_text(text[: text.index("[overrides]")], encoding="utf-8")
    with pytest.raises(RuntimeError, match="the watchdog can't be proved: no rotation rate is measured"):
        record_in_virtual_time(campaign, tmp_path / "run", bench(), STAMP)


@pytest.mark.parametrize(
    ("device", "fault", "amount", "cause"),
    [
        ("motor", "no_heartbeat", 0.1, "motor is silent: its last heartbeat"),
        ("motor", "silent", 0.1, "motor is silent: its last heartbeat"),
        ("motor", "reboot", 0.1, "motor is silent|started anew|contradict"),
        ("motor", "redrives", 0.5, "contradict|does not|by itself|limit"),
        ("motor", "ignores_commands", 0.1, "contradict|does not"),
        ("load_cell", "silent", 0.1, "load_cell.thrust is stale|load_cell is silent"),
    ],
)
def test_a_fault_ends_the_run(tmp_path, device, fault, amount, cause):
    world = Faulty(bench(), device, fault, amount, volts=5.0)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", world, STAMP)
    assert world.begun is not None
    assert world.bench.commands[-1][1] == 0.0
    assert world.bench.drive.output == 0.0


# -- the driver on the bench -------------------------------------------------------------------------------------------


class Driven:
    """Bench, bus and driver; `hold` commands as the control loop does."""

    def __init__(self, world: VirtualBench, **keys) -> None:
        from drivers.canopen.cia401 import Cia401

        self.world = world
        self.bus = CanBus("slcan", "can0", 500_000, "", world.wires["bus0"])
        self.bus.open()
        options = replace(load_bench(BENCH / "bench.toml").devices["motor"].options, **keys)
        self.device = Cia401("motor", options, self.bus)

    @property
    def output(self) -> float:
        return self.world.drive.output

    def rest(self, seconds: float) -> None:
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


@pytest.fixture
def drive_on():
    made = []

    def make(world: VirtualBench, **keys) -> Driven:
        made.append(Driven(world, **keys))
        return made[-1]

    yield make
    for each in made:
        each.bus.close()


@pytest.mark.parametrize("bits", [16, 32])
def test_opening_writes_the_error_value_before_anything_may_be_driven(drive_on, bits):
    driven = drive_on(bench(error_value_bits=bits))
    assert driven.device.open().startswith("SIM401 analogue output, vendor 0x53494D")
    number = driven.world.drive.node.objects.number
    assert (number(0x6443, 1), number(0x6444, 1), number(0x1029, 1)) == (1, 0, 2)
    assert number(0x1016, 1) == 127 << 16 | 500
    assert driven.world.commands == []
    driven.hold(0.0, 0.2)
    driven.hold(5.0, 0.5)
    assert driven.output == pytest.approx(5.0, abs=2e-4)
    driven.hold(-10.0, 0.5)
    assert driven.output == pytest.approx(-10.0, abs=2e-4)
    assert driven.device.health().alive


def test_a_second_output_has_its_place_and_the_first_is_set_to_0(drive_on):
    driven = drive_on(bench(), channel=2)
    driven.device.open()
    driven.hold(0.0, 0.2)
    driven.hold(5.0, 0.5)
    number = driven.world.drive.node.objects.number
    assert (number(0x6411, 1), number(0x6411, 2), number(0x6411, 3)) == (0, 16384, 0)


def test_an_output_that_is_in_no_pdo_is_laid_out(drive_on):
    world = bench()
    world.drive.node.objects[0x1601, 0].value = 0
    driven = drive_on(world)
    driven.device.open()
    assert world.drive.node.objects.number(0x1601, 1) == 0x64110110
    driven.hold(0.0, 0.2)
    driven.hold(5.0, 0.5)
    assert driven.output == pytest.approx(5.0, abs=2e-4)


def test_a_silence_ends_in_0_volts_and_a_set_point_after_it_is_refused(drive_on):
    driven = drive_on(bench())
    driven.device.open()
    driven.hold(0.0, 0.2)
    driven.hold(5.0, 1.0)
    driven.rest(0.4)
    assert driven.output == pytest.approx(5.0, abs=2e-4)
    driven.rest(0.3)
    assert driven.output == 0.0
    assert driven.device.health().alive, "it did what it was set to do"
    driven.world.commands.clear()
    with pytest.raises(LinkError, match="5 V; command 0 V first"):
        driven.device.command(5.0)
    driven.hold(0.0, 0.5)
    assert driven.output == 0.0
    (there, volts), (gone, zero) = driven.world.commands
    assert (volts, zero) == (pytest.approx(5.0, abs=2e-4), 0.0)
    assert gone - there < 1e-3, "between two frames: it is started again at 0"
    assert driven.world.world.state.n < 5.0
    driven.hold(5.0, 0.2)
    assert driven.output == pytest.approx(5.0, abs=2e-4)
    assert driven.device.health().alive


def test_whoever_starts_a_module_after_a_kill_without_a_zero_makes_the_propeller_turn(drive_on):
    """The trap is there; our opening is not caught in it."""
    world = bench()
    killed = drive_on(world)
    killed.device.open()
    killed.hold(0.0, 0.2)
    killed.hold(5.0, 1.0)
    killed.rest(2.0)
    assert killed.output == 0.0
    killed.send(0x000, b"\x01\x07")  # a naive host: start
    killed.rest(0.1)
    assert killed.output == pytest.approx(5.0, abs=2e-4)
    killed.bus.close()
    following = drive_on(world)
    following.device.open()
    assert following.output == 0.0
    following.rest(1.0)
    following.hold(0.0, 0.5)
    assert following.output == 0.0


def test_release_is_an_nmt_stop(drive_on):
    driven = drive_on(bench())
    driven.device.open()
    driven.hold(0.0, 0.2)
    driven.hold(5.0, 0.5)
    driven.world.fault("motor", "ignores_commands")
    driven.device.command(0.0)
    driven.rest(0.02)
    assert driven.output == pytest.approx(5.0, abs=2e-4)
    driven.device.release()
    driven.rest(0.02)
    assert driven.output == 0.0
    driven.hold(0.0, 1.0)
    assert driven.output == 0.0
    assert driven.device.health().alive


def test_closing_leaves_0_volts(drive_on):
    driven = drive_on(bench())
    driven.device.open()
    driven.hold(0.0, 0.2)
    driven.hold(5.0, 0.5)
    driven.device.close()
    driven.device.close()
    driven.rest(0.1)
    assert driven.output == 0.0
    assert not driven.device.health().alive


def test_without_the_error_value_the_last_voltage_would_stay(drive_on):
    """What CiA 401 has as delivered: why the module is refused when it does not take 0x6443."""
    world = bench(keeps_error_mode=True)
    driven = drive_on(world)
    with pytest.raises(DeviceError, match=r"0x6443:1 .* was set to 1 and reads back 0"):
        driven.device.open()
    driven.send(0x000, b"\x01\x07")
    driven.send(0x307, bytes.fromhex("0040"))
    driven.send(0x307, bytes.fromhex("0040000000000000"))
    driven.rest(0.1)
    driven.send(0x000, b"\x02\x07")
    driven.rest(2.0)
    assert driven.output == pytest.approx(5.0, abs=2e-3)


@pytest.mark.parametrize(
    ("motor", "sentence"),
    [
        ({"lacks": ("1029",)}, "0x1029:1"),
        ({"lacks": ("6444",)}, "0x6444:1"),
        ({"node_id": 9}, "no CANopen device answers as node 7"),
    ],
)
def test_modules_that_are_refused(drive_on, motor, sentence):
    driven = drive_on(bench(**motor))
    with pytest.raises(DeviceError, match=sentence):
        driven.device.open()
    assert driven.world.commands == []


def test_an_output_that_waits_for_sync_is_refused(drive_on):
    world = bench()
    world.drive.node.objects[0x1401, 2].value = 1
    with pytest.raises(DeviceError, match="waits for SYNC"):
        drive_on(world).device.open()


def test_commands_that_are_refused(drive_on):
    driven = drive_on(bench())
    driven.device.open()
    for volts in (float("nan"), float("inf"), 10.1, -10.1):
        with pytest.raises(ValueError, match="within"):
            driven.device.command(volts)
    assert driven.world.commands == []


WHOLE = {"bus": "b", "node_id": 7, "watchdog_timeout": 0.5}


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"node_id": 0}, "node_id must be 1 to 127"),
        ({"master_id": 7}, "master_id must differ from node_id"),
        ({"channel": 0}, "channel must be 1 to 254"),
        ({"at_zero": "stop"}, "at_zero must be brake or coast"),
        ({"max_voltage": 0.0}, "max_voltage must be positive"),
        ({"max_voltage": 11.0}, "more than 32767"),
        ({"watchdog_timeout": 100.0}, "watchdog_timeout must be 0.02 to 65 s"),
        ({"heartbeat": 0.0}, "heartbeat must be 0.01 to 10 s"),
    ],
)
def test_options_that_cannot_be(keys, sentence):
    with pytest.raises(ValueError, match=sentence):
        Options(**(WHOLE | keys))


def test_the_bench_as_it_is_shipped_passes_the_check(tmp_path):
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    (tmp_path / "can0").touch()
    text = text.replace("ports/can0", str(tmp_path / "can0"))
    (tmp_path / "bench.toml").write_text(text, encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    assert check_campaign(tmp_path / "campaign.toml").peak_thrust == pytest.approx(2.3 * 8.0**2)
