"""A campaign recorded in virtual time: drivers, control loop, guard, recorder and file are those of a run."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.cli import record_in_virtual_time
from rig.hdf5.load import load
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host

ROOT = Path(__file__).parents[3]
CAMPAIGN = """
[campaign]
name = "short"
bench = "bench.toml"
output = "out"
thrusters = ["T2"]
prove_watchdog = {proved}
[watch]
off = true
[tare]
duration = 1.0
max_drift = 1.0
[plan]
kind = "levels"
voltages = [8.0, -8.0, 16.0, -16.0]
slew = 24.0
[plan.dwell]
kind = "fixed"
duration = 1.5
"""


def files(folder: Path, proved: str = "true", limit: float = 300.0) -> Path:
    """The demo's bench without its thermometer."""
    text = (ROOT / "benches" / "simulated" / "bench.toml").read_text(encoding="utf-8")
    text = text[: text.index("[devices.thermometer]")] + text[text.index('[limits."load_cell') : text.index("[mount]")]
    folder.mkdir(exist_ok=True)
    (folder / "bench.toml").write_text(text.replace("300.0", f"{limit}"), encoding="utf-8")
    unproved = "" if proved == "true" else '[overrides]\n"campaign.prove_watchdog" = "measured elsewhere"\n'
    (folder / "campaign.toml").write_text(CAMPAIGN.format(proved=proved) + unproved, encoding="utf-8")
    return folder / "campaign.toml"


def world(seed: int = 1) -> VirtualBench:
    settings = load_world(ROOT / "benches" / "simulated" / "world.toml")
    thrusters = {name: replace(each, rotor="instant") for name, each in settings.world.thrusters.items()}
    made = replace(settings.world, thrusters=thrusters, mounted="T2")
    host = Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4, stall_every=5.0, stall=0.01)
    return VirtualBench(replace(settings, world=made, seed=seed, step=0.005), host, "bus0")


def recorded(folder: Path, bench: VirtualBench, **options):
    path, t0_ns = record_in_virtual_time(files(folder, **options), folder / "run", bench, ("some-id", "2026-01-01"))
    return load(path), t0_ns


def test_a_campaign_is_recorded_whole(tmp_path):
    bench = world()
    found, t0_ns = recorded(tmp_path, bench)
    assert (found.complete, found.outcome, found.recording_id) == (True, "completed", "some-id")
    assert [step.phase for step in found.steps].count("hold") == 4
    thrust, command = found.first_of("thrust"), found.first_of("command_voltage")
    assert thrust.acquisition.delay == pytest.approx(180 / 38400)
    assert np.median(np.diff(thrust.time)) == pytest.approx(1 / 92, rel=0.02)
    volts = command.value[np.searchsorted(command.time, thrust.time, side="right") - 1]
    held = np.abs(volts) == 16.0
    reading = thrust.value[held] - np.mean(thrust.value[volts == 0.0])
    assert np.median(np.abs(reading)) / 16.0**2 == pytest.approx(0.3985, rel=0.003)
    first = next(t for t, v in bench.commands if v == pytest.approx(-16.0, abs=1e-3))
    row = command.time[command.value == -16.0][0] + t0_ns * 1e-9 - bench.stamp(0.0) * 1e-9
    assert first - row == pytest.approx(8e-4, abs=1e-5), "obeyed when it has come, stamped when it was decided"
    assert any("watchdog proved" in event.text for event in found.events)


def test_the_same_seed_gives_the_same_recording(tmp_path):
    one, same, other = (recorded(tmp_path / str(i), world(seed), proved="false")[0] for i, seed in enumerate((1, 1, 2)))
    for a, b in zip(one.channels, same.channels, strict=True):
        assert (a.name, a.stream) == (b.name, b.stream)
        np.testing.assert_array_equal(a.time, b.time)
        np.testing.assert_array_equal(a.value, b.value)
    assert one.events == same.events
    assert one.first_of("thrust").value[:50].tolist() != other.first_of("thrust").value[:50].tolist()


def test_a_run_that_trips_says_so_and_leaves_a_closed_file(tmp_path):
    with pytest.raises(RuntimeError, match=r"the run ended tripped: load_cell\.thrust"):
        recorded(tmp_path, world(), proved="false", limit=40.0)
    left = load(tmp_path / "run" / "T2.h5")
    assert (left.complete, left.outcome) == (True, "tripped")


def test_a_device_without_a_wire_is_refused(tmp_path):
    campaign = files(tmp_path)
    bench = tmp_path / "bench.toml"
    bench.write_text(bench.read_text(encoding="utf-8").replace("[devices.flow]", "[devices.stream]"), encoding="utf-8")
    with pytest.raises(RuntimeError, match="stream has no wire on this bench; it has bus0, load_cell"):
        record_in_virtual_time(campaign, tmp_path / "run", world(), ("", ""))


def test_the_thermometer_is_asked_in_virtual_time(tmp_path):
    """Two requests a row, each sent by the loop that takes the rows."""
    campaign = files(tmp_path, proved="false")
    with (tmp_path / "bench.toml").open("a", encoding="utf-8") as bench:
        bench.write('\n[devices.thermometer]\nkind = "keller"\nport = "here"\nbaud = 9600\nrate = 2.0\n')
    path, _ = record_in_virtual_time(campaign, tmp_path / "run", world(), ("some-id", "2026-01-01"))
    found = load(path).first_of("water_temperature")
    assert np.diff(found.time) == pytest.approx(0.5, abs=0.06)
    assert found.value == pytest.approx(18.2, abs=0.1)
