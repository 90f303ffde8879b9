"""`rig devices` on a bus of CANopen devices: silent as delivered, heard when their heartbeat is on, asked by name."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

import pytest

from drivers.canopen.recognising import owns
from drivers.ports.can_frame import Frame
from rig.cli import main
from sim_devices.bench.process import running

pytest.importorskip("canopen")
SERIAL = b"43 18 10 04"
"""Reply of an SDO with the serial number, as a transcript has it: the frame's text in hexadecimal."""
BENCHES = Path(__file__).parents[3] / "benches"


def test_frames_of_a_canopen_device_and_of_others():
    assert owns(Frame(0x705, False, b"\x05"))
    assert owns(Frame(0x185, False, bytes(8)))
    assert not owns(Frame(0x701, False, bytes(8))), "the heartbeat of ODrive's axis 56"
    assert not owns(Frame(0x705, True, b"\x05"))
    assert not owns(Frame(0x080, False, b"")), "SYNC is of no node"


def test_a_drive_and_a_silent_bus(tmp_path, capsys):
    shutil.copy(BENCHES / "cia402" / "world.toml", tmp_path)
    shutil.copy(BENCHES / "cia402" / "bench.toml", tmp_path)
    with running(tmp_path / "world.toml", tmp_path / "ports") as bench:
        bus = ["devices", "--seconds", "1.2", "--can", f"slcan:{bench.links / 'can0'}@500000"]
        assert main(bus) == 1
        assert "--kind cia402 (or another) asks every node" in capsys.readouterr().out
        assert main([*bus, "--kind", "cia402", "--write", str(tmp_path / "b.toml")]) == 0
        said = capsys.readouterr().out
        assert "CANopen node 5, vendor 0x53494D" in said
        assert "no heartbeat (0x1017 is 0, as delivered)" in said
        assert "heartbeat consumer (0x1016): off, as delivered" in said
        tables = tomllib.loads((tmp_path / "b.toml").read_text(encoding="utf-8"))
        assert tables["devices"]["motor"]["node_id"] == 5
        # the driver switches its heartbeat on: from now on it is heard, and asked without being named
        words = ["capture", str(tmp_path / "bench.toml"), "motor", "--seconds", "0.3"]
        assert main([*words, "-o", str(tmp_path / "c.txt")]) == 0
        capsys.readouterr()
        before = bench.truth("command")
        assert main(bus) == 0
        said = capsys.readouterr().out
        assert "heartbeat every 100 ms; operational" in said
        assert "heartbeat consumer (0x1016): waits" in said
        assert bench.truth("command") == before
        assert main([*words, "-o", str(tmp_path / "an.txt"), "--anonymise"]) == 0
        told = [line for line in (tmp_path / "an.txt").read_text().splitlines() if SERIAL.hex(" ") in line]
        assert told
        assert all(line.endswith((SERIAL + b" 01 00 00 00").hex(" ")) for line in told)
        assert main(["replay", str(tmp_path / "c.txt"), "--rows", str(tmp_path / "rows")]) == 0
        assert "motor: " in capsys.readouterr().out


def test_a_motor_and_a_cell_on_one_bus(tmp_path, capsys):
    shutil.copy(BENCHES / "cia401" / "world.toml", tmp_path)
    with running(tmp_path / "world.toml", tmp_path / "ports") as bench:
        bus = ["devices", "--seconds", "0.5", "--can", f"slcan:{bench.links / 'can0'}@500000"]
        for kind, node in (("cia401", 7), ("cia404", 6)):
            assert main([*bus, "--kind", kind]) == 0
            assert f"{kind}\n  identity   CANopen node {node}" in capsys.readouterr().out
