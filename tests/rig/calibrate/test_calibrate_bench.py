"""`rig calibrate BENCH --loads PLAN` over real bytes: what it records, writes, says, and never sends."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from drivers.errors import DeviceError as DriverDeviceError
from identification.thruster.thrust import fit_thrust
from rig.campaign.bench import build
from rig.campaign.calibrated import RAW
from rig.campaign.loading import load_bench
from rig.cli import record_in_virtual_time
from rig.errors import ConfigError, DeviceError, LinkError
from rig.hdf5.load import load
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from sim_devices.world.settings import Cell
from tests.rig.calibrate.weighing_bench import LOADS, Hanger, bench_of, files, weighed

RECORDING, RESULT = "load_cell-calibration-2026-11-26.h5", "load_cell-calibration-2026-11-26.json"


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("calibration")
    virtual = bench_of(Cell(gain_error=0.012, zero_offset=0.4))
    virtual.wires["bus0"].write = lambda data: virtual.commands.append((virtual.now(), data))
    before = (files(folder)[0]).read_text()
    status, hanger = weighed(folder, virtual)
    return folder, virtual, status, hanger, before


def test_the_gain_is_found_and_written_with_its_covariance(done):
    folder, _, status, hanger, _ = done
    assert status == 0
    found = json.loads((folder / RESULT).read_text())
    gain = found["gain"]
    assert gain["low"] < 1.012 < gain["high"]
    assert gain["high"] - gain["low"] < 2e-3
    assert np.array(found["curve"]["covariance"]).shape == (4, 4)
    assert found["device_id"].endswith("serial number B021002593")
    sources = {each["name"] for each in found["budget"]}
    assert {"repeatability and scatter", "mass of the weights", "lever arm"} <= sources
    assert found["valid_until"] == "2027-11-26"
    assert len(found["steps"]) == 17
    assert hanger.asked[1] == "step 2 of 17: hang 2kg (19.608 N)"
    assert any("reads" in line and "expected" in line and "degC" in line for line in hanger.said)


def test_the_bench_file_names_it_and_keeps_the_rest(done):
    folder, _, _, _, before = done
    after = (folder / "bench.toml").read_text()
    assert after.startswith(before.rstrip("\n"))
    added = after[len(before.rstrip("\n")) :]
    assert "[calibration.load_cell]\ndate = 2026-11-26\nvalid_until = 2027-11-26\n" in added
    assert f'certificate = "DKD 7"\nfile = "{RESULT}"' in added


def test_the_recording_holds_what_was_read_before_any_curve(done):
    folder, _, _, _, _ = done
    found = load(folder / RECORDING)
    assert (found.kind, found.complete, found.outcome) == ("calibration", True, "completed")
    assert found.attributes["loads_toml"] == LOADS
    loads = next(channel for channel in found.channels if channel.name == "force")
    assert loads.value.size == 17
    assert [step.index for step in found.steps] == list(range(17))
    thrust = found.first_of("thrust")
    for step in found.steps:
        force = loads.held_at(np.array([step.t_start]))[0]
        reading = np.nanmean(thrust.window(step.t_start, step.t_end)[1])
        assert reading == pytest.approx(1.012 * force + 0.4, abs=0.05)
    assert sum("step" in event.text for event in found.events) == 17


def test_the_motor_is_not_even_opened(done):
    """Nothing was written to its bus, and the drive took up no voltage."""
    _, virtual, _, _, _ = done
    assert virtual.commands == []
    assert virtual.world.state.n == 0.0


def test_a_run_reads_through_the_curve_and_keeps_the_raw_value(done):
    folder, _, _, _, _ = done
    bench = load_bench(folder / "bench.toml")
    virtual = bench_of(Cell(gain_error=0.012, zero_offset=0.4))
    cell = build(bench, virtual.wires).instruments["load_cell"]
    (stream,) = cell.streams
    assert [channel.name for channel in stream.channels] == ["thrust", "stable", f"thrust{RAW}"]
    facts = json.loads(stream.channels[0].calibration)
    assert facts["curve"]["range"] == pytest.approx([-166.67, 166.67], abs=0.01)
    assert facts["gain_std"] < 5e-4
    assert facts["certificate"] == "DKD 7"
    cell.open()
    virtual.world.state.hung = 120.0
    virtual.sleep_until_ns(virtual.now_ns() + 500_000_000)
    rows = cell.drain()[-20:]
    cell.close()
    assert np.mean([row.values[0] for row in rows]) == pytest.approx(120.0, abs=0.06)
    assert np.mean([row.values[-1] for row in rows]) == pytest.approx(1.012 * 120.0 + 0.4, abs=0.06)


CAMPAIGN = """
[campaign]
name = "after the calibration"
bench = "bench.toml"
thrusters = ["T2"]
output = "out"
[tare]
duration = 1.0
[plan]
kind = "levels"
voltages = [0.0, 10.0, -10.0, 18.0, -18.0, 0.0]
slew = 24.0
dwell = { kind = "fixed", duration = 3.0, settle = 1.0 }
"""


def test_a_campaign_on_the_calibrated_bench_is_fitted_with_its_covariance(done, tmp_path):
    folder, *_ = done
    for name in ("bench.toml", RESULT):
        (tmp_path / name).write_text(re.sub(r"\[mount\]\ncommand.*\n", "", (folder / name).read_text()))
    (tmp_path / "campaign.toml").write_text(CAMPAIGN)
    virtual = bench_of(Cell(gain_error=0.012, zero_offset=0.4), mounted="T2")
    path, _ = record_in_virtual_time(tmp_path / "campaign.toml", tmp_path / "run", virtual, ("id", "2026-11-27"))
    run = load(path)
    found = fit_thrust([run])
    C = found.parameters["C"]
    assert C.low < 0.3985 < C.high
    assert 2e-5 < C.std_calibration < 2e-3 * C.value
    assert found.cov_calibration.shape == (2, 2)
    raw = next(channel for channel in run.channels if channel.name == f"thrust{RAW}")
    assert np.nanmax(raw.value) == pytest.approx(1.012 * np.nanmax(run.first_of("thrust").value) + 0.4, abs=0.2)


def test_another_cell_under_this_calibration_is_refused(done):
    folder, _, _, _, _ = done
    bench = load_bench(folder / "bench.toml")
    settings = bench_of().settings
    other = replace(settings.devices["load_cell"], serial="X1")
    virtual = VirtualBench(replace(settings, devices={**settings.devices, "load_cell": other}), Host(), "bus0")
    cell = build(bench, virtual.wires).instruments["load_cell"]
    with pytest.raises(DriverDeviceError, match=r"but its calibration load_cell-calibration.* is of"):
        cell.open()


def test_a_calibrated_bench_is_calibrated_again_on_what_its_driver_says(done):
    folder, *_ = done
    virtual = bench_of(Cell(gain_error=0.02), seed=5)
    status, _ = weighed(folder, virtual, keep_bench=True)
    assert status == 0
    again = json.loads((folder / "load_cell-calibration-2026-11-26-2.json").read_text())
    assert again["gain"]["value"] == pytest.approx(1.02, abs=1e-3)
    assert RESULT in (folder / "bench.toml").read_text(), "it was asked to keep the bench file"


def test_a_wrong_weight_is_doubted_at_once_and_hung_again(tmp_path):
    virtual = bench_of()
    hanger = Hanger(virtual, {"9": 9.8055 * 3.0})  # step 9: nothing was to hang
    status, _ = weighed(tmp_path, virtual, hanger)
    assert status == 0
    (doubt,) = [line for line in hanger.said if line.startswith("DOUBT")]
    assert "step 9: no load (0 N) was stated, but the reading says 29.4" in doubt
    assert "probably it was 1kg + 2kg" in doubt
    found = load(tmp_path / RECORDING)
    assert any("probably it was" in event.text for event in found.events)
    assert len(json.loads((tmp_path / RESULT).read_text())["steps"]) == 17


def test_one_that_is_kept_is_believed_by_nobody(tmp_path):
    virtual = bench_of()
    hanger = Hanger(virtual, {"9": 29.4}, doubts="keep")
    status, _ = weighed(tmp_path, virtual, hanger)
    assert status == 1
    assert any(line.startswith("WRONG          step 9: no load") for line in hanger.said)
    assert "no calibration was written" in hanger.said[-1]
    assert not (tmp_path / RESULT).exists()
    assert (tmp_path / RECORDING).exists()
    assert "[calibration" not in (tmp_path / "bench.toml").read_text()


def test_a_step_is_read_again_when_asked(tmp_path):
    virtual = bench_of()
    hanger = Hanger(virtual, answers=["go", "go", "again"])
    status, _ = weighed(tmp_path, virtual, hanger)
    assert status == 0
    assert hanger.asked[2].startswith("step 3 of 17")
    assert hanger.asked[3].startswith("step 2 of 17")
    assert len(json.loads((tmp_path / RESULT).read_text())["steps"]) == 17


def test_a_preload_is_recorded_and_not_read(tmp_path):
    one_way = LOADS.replace("preloads = 0", "preloads = 1").replace("[1, -1]", "[1]")
    status, hanger = weighed(tmp_path, bench_of(), loads=one_way)
    assert status == 0
    assert hanger.asked[0] == "step 1 of 10: hang 10kg + 5kg + 2kg (166.67 N), only to load the cell"
    assert [step["index"] for step in json.loads((tmp_path / RESULT).read_text())["steps"]] == list(range(1, 10))
    found = load(tmp_path / RECORDING)
    loads = next(channel for channel in found.channels if channel.name == "force")
    assert loads.value[0] == pytest.approx(166.67, abs=0.01)


def test_the_cell_is_zeroed_inside_where_the_plan_says_so(tmp_path):
    zeroed = LOADS.replace("[place]", "tare = true\n[place]").replace("[1, -1]", "[1]")
    status, _ = weighed(tmp_path, bench_of(Cell(zero_offset=40.0)), loads=zeroed)
    assert status == 0
    assert json.loads((tmp_path / RESULT).read_text())["curve"]["zero"] == pytest.approx(0.0, abs=0.3)


def test_a_cell_that_can_not_be_zeroed_says_so(tmp_path):
    virtual = bench_of()
    virtual.fault("load_cell", "no_value")
    with pytest.raises(DeviceError, match="load_cell"):
        weighed(tmp_path, virtual, loads=LOADS.replace("[place]", "tare = true\n[place]"))


def test_a_cable_that_is_pulled_ends_it_with_a_sentence_and_a_whole_recording(tmp_path):
    virtual = bench_of()
    hanger = Hanger(virtual)

    def pull(prompt, load, force, turn, hang=hanger.hang):
        if prompt.startswith("step 3"):
            virtual.fault("load_cell", "silent")
        return hang(prompt, load, force, turn)

    hanger.hang = pull
    with pytest.raises(LinkError, match=r"load_cell: nothing came for 3\.\d s; look at its cable"):
        weighed(tmp_path, virtual, hanger)
    found = load(tmp_path / RECORDING)
    assert (found.complete, found.outcome) == (True, "aborted")


def test_a_thermometer_that_is_none(tmp_path):
    wrong = LOADS.replace("thermometer.water_temperature", "load_cell.thrust")
    with pytest.raises(ConfigError, match=r"this bench has thermometer\.water_temperature"):
        weighed(tmp_path, bench_of(), loads=wrong)
