"""A CANopen load cell beside a CiA 402 drive on one bus, in virtual time: a campaign finds the truth with each of its
values; what it tells of itself, and its silence, end a run."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.canopen.cia404_options import Options
from drivers.errors import DeviceError
from drivers.ports.can_bus import CanBus
from rig.cli import record_in_virtual_time
from rig.fit.answer import fit_recordings
from rig.hdf5.load import load
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from sim_devices.instruments.canopen.cell import Cia404Options
from tests.rig.faulty_bench import Faulty

pytest.importorskip("canopen")
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


def bench(seed: int = 1, **cell) -> VirtualBench:
    settings = load_world(BENCH / "world.toml")
    devices = {**settings.devices, "load_cell": Cia404Options("cia404", **cell)}
    made = replace(settings, world=replace(settings.world, mounted="T2"), devices=devices, seed=seed, step=0.005)
    return VirtualBench(made, Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4), "bus0")


def files(folder: Path, keys: str) -> Path:
    text = (BENCH / "bench.toml").read_text(encoding="utf-8")
    cell = f'kind = "cia404"\nbus = "bus0"\nnode_id = 6\n{keys}\ngain_std = 0.0005\n'
    text = re.sub(r"(?<=\[devices\.load_cell\]\n)(?:.+\n)+", cell, text[: text.index("[mount]")])
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return folder / "campaign.toml"


@pytest.mark.parametrize(
    ("keys", "cell", "channels"),
    [
        ("rate = 100.0", {}, {"thrust", "status"}),
        ('rate = 50.0\nvalue = "int32"\nsync = true', {"decimals": 3}, {"thrust", "status", "raw"}),
        ('rate = 100.0\nvalue = "int16"\ndecimals = 2\nstatus = false', {"lacks": ("6132", "6150")}, {"thrust", "raw"}),
        ('rate = 100.0\nunit = "kg"', {"unit": "kg"}, {"thrust", "status"}),
    ],
    ids=["float by timer", "int32 for SYNC", "int16 without status", "kg"],
)
def test_a_campaign_finds_the_truth(tmp_path, keys, cell, channels):
    path, _ = record_in_virtual_time(files(tmp_path, keys), tmp_path / "run", bench(**cell), STAMP)
    recording = load(path)
    assert (recording.outcome, recording.cause) == ("completed", "")
    (fitted,) = fit_recordings([recording])
    constant = fitted.fit.parameters["C"]
    assert abs(constant.value - TRUTH) < 3.0 * constant.std
    assert constant.std < 0.002 * TRUTH
    assert {each.name for each in recording.channels if each.stream == "load_cell"} == channels
    thrust = recording.first_of("thrust")
    wanted = float(re.search(r"rate = ([\d.]+)", keys)[1])
    assert np.mean(np.diff(thrust.time)) == pytest.approx(1.0 / wanted, rel=0.02)
    assert not np.isnan(thrust.value).any()
    assert not [event.text for event in recording.events if "could not be understood" in event.text]


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        ("silent", "load_cell.thrust is stale|load_cell is silent"),
        ("no_heartbeat", "load_cell is silent: its last heartbeat"),
        ("converter", "load_cell.thrust is NaN|reports a fault of cell or converter"),
        ("overload", "load_cell.thrust is NaN"),
        ("frozen", "frozen|has not changed|contradict|very same"),
        ("reboot", "load_cell.thrust is stale|started anew|load_cell is silent"),
    ],
)
def test_a_fault_ends_the_run(tmp_path, fault, cause):
    world = Faulty(bench(), "load_cell", fault)
    with pytest.raises(RuntimeError, match=cause):
        record_in_virtual_time(files(tmp_path, "rate = 100.0"), tmp_path / "run", world, STAMP)
    zeros = [t for t, volts in world.bench.commands if volts == 0.0 and t >= world.begun]
    assert zeros[0] - world.begun < (4.0 if fault == "frozen" else 1.0)
    assert world.bench.commands[-1][1] == 0.0


@pytest.fixture
def opened():
    """Makes a cell's driver on a bench."""
    from drivers.canopen.cia404 import Cia404

    buses = []

    def make(world: VirtualBench, **keys) -> Cia404:
        buses.append(CanBus("slcan", "can0", 500_000, "", world.wires["bus0"]))
        buses[-1].open()
        return Cia404("load_cell", Options(**({"bus": "bus0", "node_id": 6, "rate": 100.0} | keys)), buses[-1])

    yield make
    for bus in buses:
        bus.close()


def pass_time(world: VirtualBench, seconds: float) -> None:
    world.sleep_until_ns(world.now_ns() + round(seconds * 1e9))


def test_it_says_who_it_is_and_tares_itself(opened):
    world = bench()
    cell = opened(world)
    assert cell.open().startswith("SIM404 load cell, vendor 0x53494D")
    pass_time(world, 0.5)
    before = np.mean([row.values[0] for row in cell.drain()])
    assert before == pytest.approx(0.75, abs=0.1)
    cell.tare()
    cell.drain()
    pass_time(world, 0.5)
    assert np.mean([row.values[0] for row in cell.drain()]) == pytest.approx(0.0, abs=0.2)
    cell.close()
    cell.close()
    assert not cell.health().alive


def test_status_and_integer_are_in_the_row(opened):
    world = bench(decimals=1)
    cell = opened(world, value="int32", sign=-1)
    cell.open()
    assert cell.streams[0].channels[0].quantum == pytest.approx(0.1)
    world.fault("load_cell", "underload")
    pass_time(world, 0.1)
    thrust, status, raw = cell.drain()[-1].values
    assert math.isnan(thrust)
    assert (status, raw) == (5.0, pytest.approx(7.5, abs=3.0))
    assert cell.health().alive, "too much load is no fault of the cell"
    world.clear("load_cell")
    pass_time(world, 0.1)
    thrust, status, raw = cell.drain()[-1].values
    assert (thrust, status) == (pytest.approx(-0.1 * raw), 0.0)


@pytest.mark.parametrize(
    ("cell", "keys", "sentence"),
    [
        ({"unit": "kg"}, {}, r"unit \(0x6131:1\) is 0x00020000, which is no force by its code"),
        ({}, {"unit": "kg"}, r"measures in 1 N \(0x6131:1\), the bench file says kg"),
        ({"decimals": 2}, {"value": "int32", "decimals": 3}, "has 2 decimal digits .* says 3"),
        ({"lacks": ("6132",)}, {"value": "int32"}, "tells no decimal digits"),
        ({"lacks": ("6150",)}, {}, "TPDO 1, which shall hold 0x6150"),
        ({"node_id": 9}, {}, "no CANopen device answers as node 6"),
    ],
)
def test_settings_that_are_refused(opened, cell, keys, sentence):
    with pytest.raises(DeviceError, match=sentence):
        opened(bench(**cell), **keys).open()


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"node_id": 200}, "node_id must be 1 to 127"),
        ({"channel": 0}, "channel must be 1 to 199"),
        ({"value": "double"}, "value must be one of"),
        ({"sign": 2}, "sign must be 1 or -1"),
        ({"rate": 0.0}, "rate must be 0.1 to 1000/s"),
        ({"unit": "bar"}, "unit must be one of"),
        ({"decimals": 2}, "decimals are those of an integer value"),
        ({"heartbeat": 0.0}, "heartbeat must be 0.01 to 60 s"),
        ({"gain_std": 0.5}, "gain_std is relative"),
    ],
)
def test_options_that_cannot_be(keys, sentence):
    with pytest.raises(ValueError, match=sentence):
        Options(**({"bus": "b", "node_id": 6, "rate": 100.0} | keys))
