"""`rig devices` against each simulated device over ptys, and its sentences where nobody, or somebody else, is there."""

from __future__ import annotations

import errno
import os
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
import serial

from drivers import KINDS
from drivers.ports.refusals import why_not_open
from rig.cli import main
from sim_devices.bench.process import RunningBench, running
from tests.rig.devices.baud_relay import BaudRelay

HEAD = """
seed = 1
links = "ports"
mounted = "T1"
[thrusters]
T1 = { C = 0.4 }
[supply]
voltage = 48.0
[cell]
zero_offset = 1.5
"""
SERIAL = (
    HEAD
    + """
[devices.load_cell]
kind = "mt_sics"
port = "load_cell"
baud = 38400
[devices.motor]
kind = "roboteq"
port = "motor"
[devices.flow]
kind = "nortek"
port = "flow"
rate = 4.0
[devices.thermometer]
kind = "keller"
port = "thermometer"
[devices.counts]
kind = "line"
port = "counts"
[devices.button]
kind = "button"
port = "button"
[devices.laumas]
kind = "modbus_cell"
port = "laumas"
[devices.seneca]
kind = "modbus_cell"
port = "seneca"
map = "seneca_z_sg"
unit = "N"
[devices.dini]
kind = "modbus_cell"
port = "dini"
map = "dini_argeo_dgt"
[devices.hbm]
kind = "hbm_aed"
port = "hbm"
[devices.loadstar]
kind = "loadstar"
port = "loadstar"
[devices.card]
kind = "mantracourt_dsc"
port = "card"
[devices.meter]
kind = "pzem"
port = "meter"
"""
)
QUICK = ("--seconds", "0.3")
VESC = HEAD + '[devices.motor]\nkind = "vesc"\nvesc_id = 23\ntimeout = 0.5\n'
TELLING = VESC + 'messages_1 = ["STATUS", "STATUS_5"]\nmessages_2 = ["STATUS_4"]\n'


def started(folder: Path, world: str) -> Iterator[RunningBench]:
    (folder / "world.toml").write_text(world, encoding="utf-8")
    with running(folder / "world.toml", folder / "ports") as bench:
        yield bench


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningBench]:
    yield from started(tmp_path_factory.mktemp("serial"), SERIAL)


@pytest.mark.parametrize(
    ("port", "kind", "told"),
    [
        ("load_cell", "mt_sics", "WXS-SIM"),
        ("motor", "roboteq", r"1 s \(RWD, read from it\)"),
        ("flow", "nortek_nmea", r"sends about [3-6](\.\d)? measurements/s of 1 cell"),
        ("thermometer", "keller", r"P1 = 1\.\d+ bar"),
        ("counts", "line_stream", r"sends about (6|7|8|9)\d lines/s"),
        ("button", "line_stream", "such as '1'"),
        ("laumas", "modbus_cell", "registers as Laumas"),
        ("seneca", "modbus_cell", "registers as Seneca"),
        ("dini", "modbus_cell", "registers as Dini Argeo"),
        ("hbm", "hbm_aed", "HBM, AED104,1234"),
        ("loadstar", "loadstar", "FCM DI-1000, F1234-5678"),
        ("meter", "pzem", r"48\.?\d* V, "),
    ],
)
def test_each_simulated_device_is_recognised(bench, capsys, port, kind, told):
    assert main(["devices", str(bench.links / port), "--seconds", "1.0" if port == "flow" else "0.3"]) == 0
    said = capsys.readouterr().out
    assert f": {kind}\n" in said
    assert re.search(told, said), said


def running_world(folder: Path, world: str):
    (folder / "world.toml").write_text(world, encoding="utf-8")
    return running(folder / "world.toml", folder / "ports")


def test_a_bench_file_to_start_from(bench, tmp_path, capsys):
    ports = [str(bench.links / name) for name in ("load_cell", "motor", "thermometer")]
    file = tmp_path / "bench.toml"
    assert main(["devices", *QUICK, *ports, "--write", str(file)]) == 0
    tables = tomllib.loads(file.read_text(encoding="utf-8"))
    assert tables["bench"]["motor"] == "motor"
    assert tables["bench"]["force"] == "load_cell"
    assert {name: table["kind"] for name, table in tables["devices"].items()} == {
        "load_cell": "mt_sics",
        "motor": "roboteq",
        "keller": "keller",
    }
    assert tables["devices"]["motor"]["watchdog_timeout"] == 1.0
    assert "#! nominal_bus_voltage = " in file.read_text(encoding="utf-8")
    for table in tables["devices"].values():
        keys = set(table) - {"kind"}
        assert keys <= set(KINDS[table["kind"]].options.__dataclass_fields__)
    capsys.readouterr()
    assert main(["devices", *QUICK, ports[0], "--write", str(file)]) == 2
    assert "exists and is not overwritten" in capsys.readouterr().err


def test_a_kind_whose_questions_another_may_take_for_commands_is_asked_only_by_name(bench, capsys):
    card = ["devices", *QUICK, str(bench.links / "card"), "--baud", "115200"]
    assert main(card) == 1
    assert "mantracourt_dsc" not in capsys.readouterr().out.replace("cannot be recognised", "")
    assert main([*card, "--kind", "mantracourt_dsc"]) == 0
    assert "serial number 123456" in capsys.readouterr().out


def test_a_device_of_another_kind(bench, capsys):
    assert main(["devices", *QUICK, str(bench.links / "motor"), "--kind", "mt_sics"]) == 0
    assert "no mt_sics answers here: it is a device of another kind, roboteq" in capsys.readouterr().out


def test_a_port_without_permission():
    refused = serial.SerialException(errno.EACCES, "could not open port")
    assert "this user may not open it: join the port's group" in why_not_open(refused)


def test_a_can_adapter_is_told(bench, capsys):
    assert main(["devices", *QUICK, str(bench.links / "can1"), "--baud", "115200"]) == 1
    assert "it answers as an slcan CAN adapter does" in capsys.readouterr().out


def test_an_empty_bus(bench, capsys):
    assert main(["devices", *QUICK, "--can", f"slcan:{bench.links / 'can0'}@500000"]) == 1
    said = capsys.readouterr().out
    assert "no frame is heard, nor does anybody answer (vesc_can" in said
    assert "is this its bit rate" in said


def test_a_port_that_another_program_has(bench, capsys):
    with serial.Serial(str(bench.links / "laumas"), exclusive=True):
        assert main(["devices", *QUICK, str(bench.links / "laumas")]) == 1
    assert "another program has it open: end that first" in capsys.readouterr().out


@pytest.mark.parametrize("told", [True, False], ids=["told", "searched"])
def test_a_wrong_baud_rate(bench, capsys, told):
    """The counts come at 115200 baud; at 9600 their bytes are no numbers."""
    with BaudRelay(bench.links / "counts", 115200) as line:
        status = main(["devices", *QUICK, line.port, *(["--baud", "38400"] if told else [])])
        said = capsys.readouterr().out
    if told:
        assert status == 1
        assert "something sends, but no known kind reads its bytes" in said
        assert "probably the wrong baud rate; leave --baud out" in said
    else:
        assert status == 0
        assert "115200 8N1: line_stream" in said


def test_a_controller_at_another_rate_is_found(bench, capsys):
    with BaudRelay(bench.links / "motor", 115200) as line:
        assert main(["devices", *QUICK, line.port]) == 0
    assert "115200 8N1: roboteq" in capsys.readouterr().out
    assert bench.truth("command") == []


def test_an_empty_port(capsys):
    master, slave = os.openpty()
    try:
        assert main(["devices", *QUICK, os.ttyname(slave), "--baud", "9600", "--baud", "115200"]) == 1
    finally:
        os.close(master)
        os.close(slave)
    assert "nothing is heard and nobody answers (tried 9600 8N1, 115200 8N1)" in capsys.readouterr().out


def test_listening_alone_sends_nothing(capsys):
    master, slave = os.openpty()
    os.set_blocking(master, False)
    try:
        assert main(["devices", *QUICK, os.ttyname(slave), "--listen", "--baud", "9600"]) == 1
        with pytest.raises(BlockingIOError):
            os.read(master, 1)
    finally:
        os.close(master)
        os.close(slave)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["/dev/does_not_exist"], "there is no such port: connect it or correct the path"),
        (["/etc/hostname"], "it is no serial port"),
        (["--can", "slcan:/dev/does_not_exist@500000"], "there is no such port"),
        (["--can", "can0"], "must be INTERFACE:CHANNEL@BITRATE"),
        (["--can", "slcam:/dev/x@500000"], "did you mean slcan?"),
        (["/dev/null", "--kind", "mtsics"], "is no kind of device"),
        (["/dev/null", "--baud", "9600", "--framing", "9N1"], "framing must look like 8N1"),
    ],
)
def test_what_cannot_be_looked_at(capsys, words, sentence):
    assert main(["devices", *words]) in (1, 2)
    captured = capsys.readouterr()
    assert sentence in captured.out + captured.err


def test_without_a_port_it_lists_and_opens_nothing(capsys):
    assert main(["devices"]) == 0
    said = capsys.readouterr().out
    assert "none was opened" in said
    assert all(name in said for name in KINDS)


@pytest.mark.parametrize(
    ("world", "told"),
    [
        (TELLING, "sends STATUS 5\\d/s, STATUS_4 [3-7](.\\d)?/s, STATUS_5 5\\d/s"),
        (VESC, "sends no STATUS, STATUS_4, STATUS_5: tick them in VESC Tool"),
    ],
    ids=["telling", "as delivered"],
)
def test_a_vesc_is_recognised(tmp_path, capsys, world, told):
    with running_world(tmp_path, world) as bench:
        assert (
            main(["devices", *QUICK, "--can", f"slcan:{bench.links / 'can0'}@500000", "--write", str(tmp_path / "b")])
            == 0
        )
        assert bench.truth("command") == []
    said = capsys.readouterr().out
    assert "vesc_can" in said
    assert re.search(told.replace("5\\d", "(4|5)\\d"), said), said
    tables = tomllib.loads((tmp_path / "b").read_text(encoding="utf-8"))
    assert tables["devices"]["motor"]["vesc_id"] == 23
    assert tables["can"][tables["devices"]["motor"]["bus"]]["bitrate"] == 500000
