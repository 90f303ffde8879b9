"""Bench and campaign files, right and wrong."""

import re
from datetime import date
from pathlib import Path

import pytest

from drivers.ports.can_frame import Frame
from drivers.ports.transcript import read_transcript
from rig.campaign.bench import build
from rig.campaign.config import CalibrationConfig
from rig.campaign.dwell import FixedDwell, SteadyDwell
from rig.campaign.loading import load_bench, load_campaign
from rig.campaign.shapes import Interleaved, Ramp
from rig.errors import ConfigError

ROOT = Path(__file__).parents[3]
WRONG = Path(__file__).parents[1] / "wrong"


def test_simulated_bench():
    bench = load_bench(ROOT / "benches/simulated/bench.toml")
    assert (bench.motor, bench.force, bench.max_voltage) == ("motor", "load_cell", 24.0)
    assert bench.devices["load_cell"].options.port == str(ROOT / "benches/simulated/ports/load_cell")
    assert bench.can["bus0"].channel == str(ROOT / "benches/simulated/ports/can0")
    assert [(limit.channel, limit.min, limit.max) for limit in bench.limits] == [
        ("load_cell.thrust", -300.0, 300.0),
        ("motor.current", None, 40.0),
    ]
    assert bench.mount.command[:3] == ("{python}", "-m", "sim_devices")
    assert bench.text == (ROOT / "benches/simulated/bench.toml").read_text()


@pytest.mark.parametrize("path", sorted((ROOT / "campaigns").glob("*.toml")), ids=lambda p: p.stem)
def test_example_campaigns_load_and_fit_the_bench(path):
    campaign = load_campaign(path)
    campaign.plan.require_within(campaign.bench.max_voltage, campaign.bench.slew, "the bench")
    assert campaign.plan.duration().expected > 0
    assert campaign.output == ROOT / "recordings"


def with_calibration(folder: Path, table: str) -> Path:
    path = folder / "bench.toml"
    path.write_text((ROOT / "benches/simulated/bench.toml").read_text() + f"\n{table}\n")
    return path


def test_calibration_of_a_device(tmp_path):
    table = '[calibration.load_cell]\ndate = 2026-03-02\nvalid_until = 2027-03-01\ncertificate = "DKD 1"'
    bench = load_bench(with_calibration(tmp_path, table))
    assert bench.calibration == {"load_cell": CalibrationConfig(date(2026, 3, 2), date(2027, 3, 1), "DKD 1")}
    assert bench.calibration["load_cell"].days_left(date(2027, 3, 2)) == -1
    assert load_bench(ROOT / "benches/simulated/bench.toml").calibration == {}


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (
            "[calibration.cell]\ndate = 2026-03-02",
            "[calibration.cell] is of no device of this bench; there are load_cell",
        ),
        ('[calibration.flow]\ndate = "2026-03-02"', "calibration.flow.date must be a date such as 2026-03-01, but is"),
        ("[calibration.flow]\ncertificate = 'x'", "missing key calibration.flow.date (a date such as 2026-03-01)"),
        ("[calibration.flow]\ndate = 2026-03-02\nvalid_until = 2026-03-01", "valid_until (2026-03-01) is before date"),
        ("[calibration.flow]\ndate = 2026-03-02\nvalid_until = 12", "valid_until must be a date such as 2026-03-01"),
    ],
)
def test_calibration_that_is_refused(tmp_path, table, said):
    with pytest.raises(ConfigError) as caught:
        load_bench(with_calibration(tmp_path, table))
    assert said in str(caught.value)


def test_demo_runs_are_short():
    campaign = load_campaign(ROOT / "campaigns/demo.toml")
    assert campaign.thrusters == ("T1", "T3")
    assert campaign.plan.duration().expected < 45.0


def test_campaign_in_full():
    campaign = load_campaign(WRONG / "right.toml")
    assert campaign.plan.shape == Interleaved(20.0, 2)
    assert campaign.plan.dwell == FixedDwell(2.0)
    assert campaign.plan.tare is campaign.tare
    assert campaign.bench.path == WRONG / "right_bench.toml"
    assert campaign.output == WRONG / "recordings"


def written(folder: Path, plan: str) -> Path:
    path = folder / "campaign.toml"
    bench = WRONG / "right_bench.toml"
    path.write_text(f'[campaign]\nname = "n"\nbench = "{bench}"\noutput = "."\nthrusters = ["T"]\n{plan}')
    return path


def test_sweep_needs_no_dwell_and_a_whole_number_is_a_number(tmp_path):
    campaign = load_campaign(written(tmp_path, '[plan]\nkind = "ramp"\nmax = 10\nrate = 1\nslew = 10\nrepeats = 2'))
    assert campaign.plan.shape == Ramp(10.0, 1.0)
    assert campaign.plan.repeats == 2


def test_steady_dwell(tmp_path):
    plan = '[plan]\nkind = "levels"\nvoltages = [1, -2.5]\nslew = 10\n[plan.dwell]\nkind = "steady"\n'
    campaign = load_campaign(written(tmp_path, plan + "min = 1\nmax = 2\nmax_std_error = 0.1\nmax_drift = 0.1"))
    assert campaign.plan.dwell == SteadyDwell(1.0, 2.0, 0.1, 0.1)
    assert campaign.plan.shape.voltages == (1.0, -2.5)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "missing table [bench]"),
        ("[bensh]", "unknown key bensh; did you mean bench?"),
        ("[bench]\nxyzzy = 1", "unknown key bench.xyzzy; known are coast_time, "),
        ('[bench]\nname = "x"', "missing key bench.motor (text)"),
        ("bench = 3", "bench must be a table, but is 3"),
        ("[bench]\n[devices.motor]\n", "missing key bench."),
    ],
)
def test_bench_faults_name_file_and_key(tmp_path, text, sentence):
    path = tmp_path / "bench.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load_bench(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("slew = 24.0", "slew = 0", "bench.slew must be above 0 V/s, but is 0"),
        ("slew = 24.0", "slew = inf", "bench.slew must be above 0 V/s, but is inf"),
        ("slew = 24.0", "slew = 24.0\nwater_density = -1", "bench.water_density must be above 0 kg/m^3"),
        ("max = 300.0", "max = 300.0\nmax_age = 0", 'limits."load_cell.thrust".max_age must be above 0 s'),
        ("rate = 92.0", "rate = 92.0\nsign = 2", "devices.load_cell.sign must be one of [1, -1], but is 2"),
        ("rate = 92.0", "rate = true", "devices.load_cell.rate must be a number, but is True"),
        ("rate = 92.0", "rat = 92.0", "unknown key devices.load_cell.rat; did you mean devices.load_cell.rate?"),
    ],
)
def test_bench_values_are_checked(tmp_path, old, new, sentence):
    path = tmp_path / "bench.toml"
    path.write_text((WRONG / "right_bench.toml").read_text().replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        load_bench(path)
    assert sentence in str(caught.value)


def test_ports_relative_and_not(tmp_path):
    path = tmp_path / "bench.toml"
    text = (WRONG / "right_bench.toml").read_text()
    for port, expected in (
        ("ports/a", str(tmp_path / "ports/a")),
        ("/dev/zero", "/dev/zero"),
        ("COM3", "COM3"),
        ("socket://host:4001", "socket://host:4001"),
    ):
        path.write_text(text.replace('port = "/dev/zero"', f'port = "{port}"', 1))
        assert load_bench(path).devices["load_cell"].options.port == expected


def test_every_frame_of_a_bus_is_captured(tmp_path):
    text = (WRONG / "right_bench.toml").read_text()
    path, out = tmp_path / "bench.toml", tmp_path / "can.txt"
    path.write_text(
        text.replace(
            'interface = "slcan"\nchannel = "/dev/null"',
            f'interface = "virtual"\nchannel = "desk"\ncapture = "{out}"',
        )
    )
    bus = build(load_bench(path)).buses["bus0"]
    bus.open()
    bus.send(Frame(0x123, False, b"\x01"))
    bus.close()
    assert [(c.direction, c.data) for c in read_transcript(out)] == [(">", b"123#01")]


def test_file_that_is_no_text(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="can't be read"):
        load_bench(path)


def test_a_modbus_cell_with_a_map_beside_the_bench_file(tmp_path, monkeypatch):
    """A relative map is relative to the bench file, as a port is; what is wrong with it is said with its name."""
    bench = (ROOT / "benches/simulated/bench.toml").read_text(encoding="utf-8")
    cell = 'kind = "modbus_cell"\nport = "ports/load_cell"\nmap = "own.toml"\nrate = 10.0\nunit = "kg"\n'
    cell += 'word_order = "low_first"\ndecimals = 2\nrange_max = 500.0\n'
    text = re.sub(r"(?<=\[devices\.load_cell\]\n)(?:.+\n)+", cell, bench)
    (tmp_path / "bench.toml").write_text(text, encoding="utf-8")
    (tmp_path / "own.toml").write_text(
        (ROOT / "drivers/modbus/maps/laumas.toml").read_text(encoding="utf-8"), encoding="utf-8"
    )
    monkeypatch.chdir("/")
    options = load_bench(tmp_path / "bench.toml").devices["load_cell"].options
    assert (options.map, options.word_order) == (str(tmp_path / "own.toml"), "low_first")
    (tmp_path / "bench.toml").write_text(text.replace("low_first", "upside_down"), encoding="utf-8")
    with pytest.raises(
        ConfigError, match=r"devices\.load_cell\.word_order must be one of \['high_first', 'low_first'\]"
    ):
        load_bench(tmp_path / "bench.toml")
    (tmp_path / "bench.toml").write_text(text.replace("own.toml", "other.toml"), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"bench\.toml: \[devices\.load_cell\]: .*other\.toml cannot be read"):
        load_bench(tmp_path / "bench.toml")
