"""The simulated CANopen device by itself: golden SDO exchanges, PDOs, heartbeats, what CiA 301 says of its states."""

from __future__ import annotations

import tomllib
from math import inf
from pathlib import Path

import pytest

from sim_devices.instruments.canopen.drive import Drive402
from sim_devices.instruments.canopen.drive_options import Cia402Options, Measured
from sim_devices.instruments.canopen.node import Node
from sim_devices.instruments.canopen.objects import Object
from sim_devices.wires.can_frame import CanFrame

FRAMES = tomllib.loads((Path(__file__).parents[2] / "frames" / "canopen.toml").read_text(encoding="utf-8"))


class Bench:
    def __init__(self, **options) -> None:
        self.said: list[tuple[str, dict]] = []
        self.now = Measured(0.0, 0.0, 48.0)
        log = lambda event, **more: self.said.append((event, more))  # noqa: E731 - two words long
        self.drive = Drive402(Cia402Options("cia402", **options), 48.0, lambda: 1.0, lambda: self.now, log)
        self.t = 0.0

    def send(self, identifier: int, data: str) -> list[tuple[int, str]]:
        sent = self.drive.receive(CanFrame(identifier, bytes.fromhex(data), extended=False), self.t)
        return [(each.id, each.data.hex(" ")) for each in sent]

    def until(self, t: float) -> list[tuple[float, int, str]]:
        """(s, identifier, bytes) of everything it says by itself until t."""
        said = []
        while (due := self.drive.due) <= t:
            self.t = max(due, self.t)
            said += [(self.t, each.id, each.data.hex(" ")) for each in self.drive.tick(self.t)]
        self.t = t
        return said

    def write(self, index: int, sub: int, value: int, size: int) -> None:
        head = {1: 0x2F, 2: 0x2B, 4: 0x23}[size]
        data = bytes((head, index & 0xFF, index >> 8, sub)) + value.to_bytes(4, "little", signed=value < 0)
        (reply,) = [said for identifier, said in self.send(0x605, data.hex()) if identifier == 0x585]
        assert reply.startswith("60"), reply


@pytest.mark.parametrize("sdo", FRAMES["sdo"] + FRAMES["abort"], ids=lambda sdo: sdo["what"])
def test_golden_exchanges(sdo):
    def nothing(*_) -> None:
        """The node alone."""

    node = Node(5, 0x00020192, "alone", nothing, nothing, nothing, nothing)
    node.objects[0x6041, 0] = Object("H", 0x0270)
    for index, form in ((0x6040, "H"), (0x6060, "b"), (0x60FF, "i")):
        node.objects[index, 0] = Object(form, 0, writable=True)
    (reply,) = node.receive(CanFrame(0x605, bytes.fromhex(sdo["request"]), extended=False), 0.0)
    assert (reply.id, reply.data.hex(" ")) == (0x585, sdo["reply"])
    if "written" in sdo:
        assert node.objects[sdo["index"], sdo.get("sub", 0)].value == sdo["written"]


def test_a_name_comes_in_segments():
    bench = Bench()
    assert bench.send(0x605, "40 08 10 00 00 00 00 00") == [(0x585, "41 08 10 00 12 00 00 00")]
    parts = [bench.send(0x605, f"{head} 00 00 00 00 00 00 00")[0][1] for head in ("60", "70", "60")]
    assert [part[:2] for part in parts] == ["00", "10", "07"], "toggle bit; three bytes unused, no more"
    assert b"".join(bytes.fromhex(part)[1:] for part in parts)[:18] == b"SIM402 servo drive"
    bench.send(0x605, "40 08 10 00 00 00 00 00")
    assert bench.send(0x605, "70 00 00 00 00 00 00 00") == [(0x585, "80 00 00 00 00 00 03 05")], "wrong toggle"


def test_pdos_come_when_operational_only_and_no_closer_than_the_inhibit_time():
    bench = Bench()
    bench.write(0x1800, 1, 1 << 31 | 0x185, 4)
    bench.write(0x1800, 3, 200, 2)
    bench.write(0x1800, 5, 50, 2)
    bench.write(0x1800, 1, 0x185, 4)
    assert bench.until(1.0) == []
    bench.send(0x000, "01 05")
    times = [t for t, identifier, _ in bench.until(1.21) if identifier == 0x185]
    assert times == pytest.approx([1.0, 1.05, 1.10, 1.15, 1.20])
    bench.send(0x205, "06 00")  # ready to switch on: told as soon as it may be
    assert bench.until(1.23)[-1] == (pytest.approx(1.22), 0x185, "31 02")
    bench.send(0x000, "80 05")
    assert bench.until(2.0) == []
    bench.send(0x205, "07 00")
    assert bench.drive.state == "ready", "not obeyed before it is operational"


def test_a_mapping_is_written_as_the_standard_has_it():
    bench = Bench()
    assert bench.send(0x605, "23 00 1a 01 20 00 6c 60")[0][1].startswith("80"), "switched on"
    bench.write(0x1800, 1, 1 << 31 | 0x185, 4)
    assert bench.send(0x605, "23 00 1a 01 20 00 6c 60")[0][1].startswith("80"), "count is not 0"
    bench.write(0x1A00, 0, 0, 1)
    bench.write(0x1A00, 1, 0x606C0020, 4)
    assert bench.send(0x605, "23 00 1a 02 20 00 ff 5f") == [(0x585, "80 00 1a 02 00 00 02 06")]
    assert bench.send(0x605, "2f 00 1a 00 02 00 00 00") == [(0x585, "80 00 1a 00 41 00 04 06")]
    bench.write(0x1A00, 0, 1, 1)
    bench.write(0x1800, 1, 0x185, 4)
    bench.now = Measured(10.0, 0.0, 48.0)
    bench.send(0x000, "01 05")
    assert (0.0, 0x185, "58 02 00 00") in bench.until(0.0)


def test_its_heartbeat_and_the_one_it_waits_for():
    bench = Bench()
    bench.write(0x1017, 0, 100, 2)
    assert [(round(t, 3), i, d) for t, i, d in bench.until(0.25)] == [(t, 0x705, "7f") for t in (0.0, 0.1, 0.2)]
    bench.write(0x1016, 1, 127 << 16 | 300, 4)
    bench.until(2.0)
    assert bench.said == [], "waiting begins with the first"
    bench.send(0x77E, "05")
    bench.until(3.0)
    assert bench.said == [], "of another node"
    bench.send(0x77F, "05")
    emergencies = [(t, d) for t, i, d in bench.until(3.5) if i == 0x085]
    assert emergencies == [(pytest.approx(3.3), "30 81 11 00 00 00 00 00")]
    assert bench.said[0][0] == "timeout"
    assert bench.drive.state == "fault", "0x6007 is 1 as delivered"
    assert bench.until(3.65)[-1][2] == "7f"


@pytest.mark.parametrize(("behaviour", "state"), [(0, 0x7F), (1, 0x05), (2, 0x04)])
def test_error_behaviour(behaviour, state):
    bench = Bench()
    bench.write(0x1029, 1, behaviour, 1)
    bench.write(0x1016, 1, 127 << 16 | 300, 4)
    bench.send(0x000, "01 05")
    bench.send(0x77F, "05")
    bench.until(1.0)
    assert bench.drive.node.state == state


def test_a_reset_boots_with_what_was_delivered():
    bench = Bench()
    bench.write(0x1017, 0, 100, 2)
    bench.send(0x000, "81 05")
    assert bench.send(0x605, "40 00 10 00 00 00 00 00") == []
    assert bench.until(5.0) == [(1.0, 0x705, "00")]
    assert bench.drive.due == inf


def test_the_state_machine():
    bench = Bench()
    for word, state in (
        (0x0F, "switch on disabled"),
        (0x06, "ready"),
        (0x0F, "switched on"),
        (0x0F, "enabled"),
        (0x07, "switched on"),
        (0x0F, "enabled"),
        (0x06, "ready"),
        (0x07, "switched on"),
        (0x02, "switch on disabled"),
        (0x06, "ready"),
        (0x00, "switch on disabled"),
    ):
        bench.write(0x6040, 0, word, 2)
        assert bench.drive.state == state, hex(word)


def test_a_fault_ends_with_an_edge_only():
    bench = Bench()
    bench.drive.fault("over_current", 0.0)
    assert bench.until(0.0) == [(0.0, 0x085, "10 23 03 00 00 00 00 00")]
    for word, state in ((0x0F, "fault"), (0x80, "switch on disabled")):
        bench.write(0x6040, 0, word, 2)
        assert bench.drive.state == state
    bench.drive.fault("over_current", 0.0)
    bench.write(0x6040, 0, 0x80, 2)
    assert bench.drive.state == "fault", "the bit was set already"


def test_what_it_cannot_be_told():
    with pytest.raises(ValueError, match="expected one of"):
        Bench().drive.fault("bored", 0.0)
    with pytest.raises(ValueError, match="node_id must be 1 to 127"):
        Cia402Options("cia402", node_id=0)
