"""The bench of benches/maestro over real bytes in virtual time: nothing measures the rotation. A campaign finds the
truth, its watchdog is proved by the thrust, rest is told by thrust and current, and faults end a run at zero."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.errors import DeviceError, LinkError
from drivers.pololu.maestro import Maestro
from rig.campaign.loading import load_bench
from rig.cli import main, record_in_virtual_time
from rig.errors import ConfigError
from rig.hdf5.load import load
from rig.operate.check import check_campaign
from rig.recording.ledger import read
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from tests.rig.faulty_bench import Faulty
from tests.rig.operate.test_modbus_campaign import CAMPAIGN

BENCH = Path(__file__).parents[3] / "benches" / "maestro"
TRUTH = 0.3985 * 1.0002
"""N/V^2: of T2, times the cell's gain."""
SLOW, SLOW_FILE = {"rate": 100.0}, ("rate = 575.0 ", "rate = 100.0 ")
"""For what needs no fast cell: a tenth of the work."""
ID = ("some-id", "2026-01-01")


def bench(seed: int = 1, **changes) -> VirtualBench:
    """`changes`: by the device's name, a dictionary of its options."""
    settings = load_world(BENCH / "world.toml")
    devices = {name: replace(each, **changes.get(name, {})) for name, each in settings.devices.items()}
    made = replace(settings, world=replace(settings.world, mounted="T2"), devices=devices, seed=seed, step=0.005)
    return VirtualBench(made, Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4), "none")


def files(folder: Path, *changes: tuple[str, str]) -> Path:
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    text = text[: text.index("[mount]")].replace("min = -300.0 ", "max_age = 1.0\nmin = -300.0 ")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


def test_the_same_campaign_finds_the_truth_with_another_bench_file_alone(tmp_path, capsys):
    path, _ = record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(), ID)
    found = load(path)
    assert (found.complete, found.outcome, found.cause) == (True, "completed", "")
    assert main(["fit", str(path), "--json", str(tmp_path / "fit.json")]) == 0
    capsys.readouterr()
    (fit,) = json.loads((tmp_path / "fit.json").read_text())["fits"]
    constant = fit["parameters"]["C"]
    assert (fit["thruster"], fit["model"]) == ("T2", "C V|V|")
    assert constant["std"] < 0.001 * TRUTH
    assert abs(constant["value"] - TRUTH) < 2.0 * constant["std"]
    assert found.first_of("rotation_rate") is None
    assert found.first_of("bus_voltage").value.mean() == pytest.approx(48.0, abs=0.2)
    told = [event.text for event in found.events]
    assert any(
        text.startswith("at rest 3.0") and "no rotation rate is measured, and a propeller that turns too slowly" in text
        for text in told
    )
    assert any(
        "at rest means 3 s at 0 V, then thrust within 1 N of its tare and current at most 0.2 A" in e for e in told
    )
    assert any("the command is compared with current and thrust; not measured: rotation rate" in text for text in told)
    end = next(fact for fact in read(tmp_path / "run") if fact["fact"] == "run_end")
    assert 0.5 <= end["time_to_zero_s"] < 2.0, "the watchdog is proved by the thrust"
    assert not [text for text in told if "could not be understood" in text]


def test_raw_counts_at_a_thousand_a_second(tmp_path):
    """The Loadstar's fast mode, where now and then a count is -1 and is left out."""
    campaign = files(tmp_path, ("rate = 575.0 ", 'mode = "hex"\nrate = 1000.0 '))
    text = campaign.read_text(encoding="utf-8")
    campaign.write_text(text.replace("[8.0, -8.0, 12.0, -12.0, 16.0, -16.0, 20.0, -20.0]", "[12.0]"), encoding="utf-8")
    path, _ = record_in_virtual_time(campaign, tmp_path / "run", bench(load_cell={"odd": 200}), ID)
    found = load(path)
    assert found.outcome == "completed"
    thrust = found.first_of("thrust")
    assert len(thrust.time) / thrust.time[-1] == pytest.approx(995.0, rel=0.01)
    assert thrust.value[-100:].mean() == pytest.approx(0.75, abs=0.1)


@pytest.mark.parametrize(
    ("device", "fault", "amount", "within", "cause"),
    [
        ("motor", "protocol_error", 0.1, 0.2, "motor reports serial protocol error, and has stopped the motor"),
        ("motor", "crc_error", 0.1, 0.2, "motor reports serial CRC error"),
        ("motor", "silent", 0.1, 1.0, "motor does not answer any more"),
        ("motor", "reboot", 0.1, 1.0, "motor does not answer any more|contradict"),
        ("motor", "ignores_commands", 0.1, 3.0, "motor sends a pulse of .* us were commanded"),
        ("motor", "esc_off", 0.1, 3.0, "contradict"),
        ("motor", "redrives", 0.45, 3.0, "contradict"),
        ("motor", "backwards", 0.1, 3.0, "contradict"),
        ("meter", "silent", 0.1, 3.0, "meter.current is stale"),
        ("meter", "current_factor", 60.0, 1.5, "meter.current is .* above its limit of 20 A"),
        ("load_cell", "silent", 0.1, 2.0, "load_cell"),
        ("load_cell", "frozen", 0.1, 3.0, "load_cell.thrust is frozen"),
    ],
)  # fmt: skip
def test_a_fault_ends_the_run(tmp_path, device, fault, amount, within, cause):
    world = Faulty(bench(load_cell=SLOW), device, fault, amount, after=1.5)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path, SLOW_FILE), tmp_path / "run", world, ID)
    assert world.begun is not None
    zeros = [t for t, volts in world.bench.commands if volts == 0.0 and t >= world.begun]
    assert zeros[0] - world.begun < within
    assert world.bench.commands[-1][1] == 0.0
    assert world.bench.drive.volts == 0.0


def test_a_propeller_that_goes_on_is_never_called_at_rest(tmp_path):
    world = Faulty(bench(load_cell=SLOW), "motor", "redrives", 0.45, after=1.5)
    with pytest.raises(RuntimeError):
        record_in_virtual_time(files(tmp_path, SLOW_FILE), tmp_path / "run", world, ID)
    told = [event.text for event in load(tmp_path / "run" / "T2.h5").events]
    (stop,) = [text for text in told if "STOP NOT CONFIRMED" in text]
    assert "the thrust is not back at its tare and the current still drives something" in stop
    assert not [text for text in told if text.startswith("at rest 3")]


def test_without_limits_of_rest_it_is_never_confirmed_and_the_watchdog_is_not_proved(tmp_path):
    campaign = files(tmp_path, ("rest_current = 0.2 ", "# rest_current = 0.2 "))
    with pytest.raises(RuntimeError, match="the watchdog can't be proved: no rotation rate is measured"):
        record_in_virtual_time(campaign, tmp_path / "run", bench(), ID)


def test_a_watchdog_that_leaves_the_pulse_as_it_is_is_refused_at_opening(tmp_path):
    with pytest.raises(RuntimeError, match=r"gives 1500\.25 us on channel 0, not neutral"):
        record_in_virtual_time(files(tmp_path), tmp_path / "run", bench(motor={"broken_watchdog": True}), ID)


def test_limits_of_rest_that_protect_nobody_are_refused(tmp_path):
    for old, new, key in (
        ("rest_thrust = 1.0 ", "rest_thrust = 20.0 ", "bench.rest_thrust"),
        ("rest_current = 0.2 ", "rest_current = 2.0 ", "bench.rest_current"),
    ):
        campaign = files(tmp_path, (old, new), ('"ports/', '"/dev/null#'))
        with pytest.raises(ConfigError, match=f"{key}.*protects nobody"):
            check_campaign(campaign)


def driver(world: VirtualBench) -> Maestro:
    return Maestro("motor", load_bench(BENCH / "bench.toml").devices["motor"].options, world.wires["motor"])


def pass_time(world: VirtualBench, seconds: float) -> None:
    world.sleep_until_ns(world.now_ns() + round(seconds * 1e9))


def loop(world: VirtualBench, device: Maestro, volts: float, seconds: float) -> None:
    for _ in range(round(seconds / 0.02)):
        device.drain()
        device.command(volts)
        pass_time(world, 0.02)


def test_opening_arms_the_esc_and_turns_nothing():
    world = bench()
    device = driver(world)
    device.open()
    assert world.drive.obeys
    assert all(volts == 0.0 for _, volts in world.commands)
    assert world.world.state.n == 0.0
    loop(world, device, 12.0, 0.5)
    assert world.drive.pulse == 1500 + 25 + 375 * 0.25
    assert world.drive.volts == pytest.approx(12.0)
    device.close()
    pass_time(world, 0.1)
    assert world.drive.volts == 0.0


def test_silence_stops_it_and_the_next_word_must_be_zero():
    world = bench()
    device = driver(world)
    device.open()
    loop(world, device, 12.0, 1.0)
    for _ in range(50):
        device.drain()
        pass_time(world, 0.02)
    assert world.drive.volts == 0.0, "its own timeout, though the rows were drained all the while"
    with pytest.raises(LinkError, match="command 0 V first"):
        device.command(12.0)
    pass_time(world, 0.1)
    assert world.drive.volts == 0.0
    loop(world, device, 0.0, 0.2)
    loop(world, device, 12.0, 0.2)
    assert world.drive.volts == pytest.approx(12.0)
    assert device.health().alive
    device.release()
    pass_time(world, 0.1)
    assert world.drive.volts == 0.0
    device.close()


@pytest.mark.parametrize(
    ("motor", "sentence"),
    [
        ({"timeout": 0.0}, "did not come in"),
        ({"timeout": 2.0}, "did not come in"),
        ({"timeout": 0.2}, "comes within"),
        ({"on_error": "off"}, "gives no pulses"),
        ({"on_error": "ignore"}, "not neutral"),
        ({"home": 1900.0}, "gives 1900 us"),
        ({"crc": True}, "no Maestro answers"),
    ],
)
def test_settings_that_are_refused(motor, sentence):
    world = bench(motor=motor)
    device = driver(world)
    with pytest.raises(DeviceError, match=sentence):
        device.open()
    pass_time(world, 1.0)
    assert world.drive.pulse in (0.0, 1500.0) or motor.get("home") == 1900.0


def test_the_bench_as_it_is_shipped_passes_the_check(tmp_path):
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    for port in ("load_cell", "meter", "motor"):
        (tmp_path / port).touch()
        text = text.replace(f"ports/{port}", str(tmp_path / port))
    (tmp_path / "bench.toml").write_text(text, encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    check_campaign(tmp_path / "campaign.toml")
