"""The bench of benches/dronecan over real bytes in virtual time: a campaign finds the truth and proves the watchdog,
faults end a run, and an ESC that lost its set-point is told 0 first."""

from dataclasses import replace
from pathlib import Path

import pytest

from drivers.dronecan.esc import DronecanEsc
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from identification.mismatch.answer.as_json import diagnosis_json
from rig.campaign.loading import load_bench
from rig.cli import record_in_virtual_time
from rig.diagnose.command import diagnose_files
from rig.errors import PlanError
from rig.fit.answer import fit_recordings
from rig.hdf5.load import load
from rig.operate.check import check_campaign
from rig.recording.ledger import read
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from tests.rig.faulty_bench import Faulty

BENCH = Path(__file__).parents[3] / "benches" / "dronecan"
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
    return VirtualBench(made, Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4), "bus0")


def files(folder: Path, *changes: tuple[str, str]) -> Path:
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    (folder / "bench.toml").write_text(text[: text.index("[mount]")], encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def test_a_campaign_finds_the_truth_and_proves_the_watchdog(tmp_path):
    world = bench()
    path, _ = record_in_virtual_time(files(tmp_path), tmp_path / "run", world, ("some-id", "2026-01-01"))
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
    pass_time(world, 0.1)
    assert world.drive.volts is None, "let go at the end"
    assert not [event.text for event in recording.events if "could not be understood" in event.text]
    assert_it_coasts(diagnosis_json(diagnose_files([path])))


def assert_it_coasts(found):
    """Let go, the rotor keeps 1.5 of the 3.0 1/s by which the ESC holds it; that is all that C V|V| leaves out."""
    assert (found["verdict"], [each["effect"] for each in found["findings"]]) == ("explained", ["motor_lag"])
    told = found["findings"][0]["parameters"]["released"]
    assert abs(told["value"] - 0.5) < 3 * told["std"] < 0.03
    C = found["model"]["parameters"]["C"]
    assert abs(C["value"] - TRUTH) < 3 * C["std"] < 0.003 * TRUTH


def test_an_esc_that_wants_arming_status_and_is_second_of_its_bus(tmp_path):
    world = bench(needs_arming=True, esc_index=3, current="motor", answers=False)
    changed = files(
        tmp_path,
        ("node_id = 42", 'node_id = 42\nesc_index = 3\narming = true\ncurrent = "motor"'),
        ("motor.input_current", "motor.current"),
    )
    path, _ = record_in_virtual_time(changed, tmp_path / "run", world, ("some-id", "2026-01-01"))
    assert load(path).outcome == "completed"


def test_without_the_arming_status_that_it_wants_the_run_ends(tmp_path):
    with pytest.raises(RuntimeError, match=r"refused|does not follow|contradict"):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(needs_arming=True), ("some-id", "2026-01-01"))


@pytest.mark.parametrize(
    ("fault", "amount", "within", "cause"),
    [
        ("over_temperature", 0.1, 1.3, r"motor reports health error|contradict|does not"),
        ("over_current", 0.1, 1.3, r"motor reports health critical|contradict|does not"),
        ("maintenance", 0.1, 1.3, r"in maintenance and not operational|contradict|does not"),
        ("desync", 0.1, 0.3, "error_count went from 0 to 1"),
        ("other_esc", 0.1, 0.3, "node 99 says as well that it is ESC 0"),
        ("other_master", 0.1, 0.3, "node 99 commands ESCs as well"),
        ("silent", 0.1, 0.5, "is stale"),
        ("frozen", 0.1, 3.0, "frozen|runs backwards"),
        ("redrives", 0.5, 3.0, "contradict|does not|by itself"),
        ("rate_factor", 1.3, 3.0, "contradict"),
        ("reboot", 0.1, 1.5, "is stale|has restarted"),
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
    pass_time(world.bench, 0.1)
    assert world.bench.commands[-1][1] == 0.0


def test_an_esc_that_ignores_its_commands_stops_by_its_own_watchdog(tmp_path):
    world = Faulty(bench(), "motor", "ignores_commands", 0.1)
    with pytest.raises(RuntimeError, match=r"contradict|does not"):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", world, ("some-id", "2026-01-01"))
    assert world.bench.drive.volts is None


@pytest.mark.parametrize("motor", [{"broken_watchdog": True}, {"timeout": 0.0}], ids=["broken", "none"])
def test_a_watchdog_that_never_fires_is_refused_by_the_proof(tmp_path, motor):
    with pytest.raises(RuntimeError, match="the motor's own watchdog is refused"):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(**motor), ("some-id", "2026-01-01"))


def test_a_watchdog_that_is_later_than_the_bench_file_says_is_refused(tmp_path):
    with pytest.raises(RuntimeError, match="the motor's own watchdog is refused"):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(timeout=1.5), ("some-id", "2026-01-01"))


OPEN: list[CanBus] = []


@pytest.fixture(autouse=True)
def _buses_closed():
    yield
    while OPEN:
        OPEN.pop().close()


def driver(world: VirtualBench) -> DronecanEsc:
    config = load_bench(BENCH / "bench.toml")
    bus = CanBus("slcan", "ports/can0", 1_000_000, wire=world.wires["bus0"])
    bus.open()
    OPEN.append(bus)
    return DronecanEsc("motor", config.devices["motor"].options, bus)


def pass_time(world: VirtualBench, seconds: float) -> None:
    world.sleep_until_ns(world.now_ns() + round(seconds * 1e9))


def driven(world: VirtualBench) -> DronecanEsc:
    device = driver(world)
    device.open()
    for volts in (0.0, 12.0, 12.0, 12.0):
        device.command(volts)
        device.drain()
        pass_time(world, 0.1)
    assert world.drive.volts == pytest.approx(12.0, abs=0.01)
    assert world.world.state.n > 1.0
    return device


def test_after_a_silence_zero_goes_first():
    world = bench()
    device = driven(world)
    pass_time(world, 0.6)
    assert world.drive.volts is None, "its own watchdog"
    device.drain()
    assert device.health().alive, "it was our silence"
    with pytest.raises(LinkError, match="command 0 V first"):
        device.command(12.0)
    pass_time(world, 0.1)
    assert world.drive.volts is None
    device.command(0.0)
    device.command(12.0)
    pass_time(world, 0.1)
    assert world.drive.volts is not None
    device.close()
    pass_time(world, 0.1)
    assert world.drive.volts is None, "what is closed lets go"


def test_whoever_comes_next_stops_an_esc_that_turns():
    world = bench(timeout=0.0)
    left = driven(world)
    left._bus.close()
    pass_time(world, 1.0)
    assert world.drive.volts is not None, "no watchdog: it turns on"
    device = driver(world)
    device.open()
    pass_time(world, 0.01)
    assert world.drive.volts is None
    device.close()


@pytest.mark.parametrize(
    ("motor", "sentence"),
    [
        ({"node_id": 0}, r"no NodeStatus of node 42 came.*a node without identifier asks for one: set a fixed node ID"),
        ({"node_id": 43, "esc_index": 2}, r"no NodeStatus of node 42 came.*heard: node 43 as ESC 2"),
        ({"esc_index": 1}, r"node 42 is there, but sends no esc.Status of ESC 0.*heard: node 42 as ESC 1"),
    ],
)
def test_what_is_refused_at_opening(motor, sentence):
    world = bench(**motor)
    with pytest.raises(DeviceError, match=sentence):
        driver(world).open()
    assert all(volts == 0.0 for _, volts in world.commands)


def checked(folder: Path, text: str) -> Path:
    for port in ("load_cell", "can0"):
        (folder / port).touch()
        text = text.replace(f"ports/{port}", str(folder / port))
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def test_the_bench_as_it_is_shipped_passes_the_check(tmp_path):
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    assert check_campaign(checked(tmp_path, text)).peak_thrust == pytest.approx(0.4 * 19.2**2)


def test_a_plan_in_both_directions_is_refused_for_an_esc_of_one(tmp_path):
    text = (BENCH / "bench.toml").read_text(encoding="utf-8").replace("reversible = true", "reversible = false")
    with pytest.raises(PlanError, match=r"goes down to -19\.2 V, but .*'motor' gives nothing below 0"):
        check_campaign(checked(tmp_path, text))
