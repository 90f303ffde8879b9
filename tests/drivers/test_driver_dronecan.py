"""DroneCAN ESC: golden transfers, what is no transfer, and the driver against a scripted ESC on a virtual bus."""

from __future__ import annotations

import contextlib
import math
import subprocess
import sys
import threading
import tomllib
from pathlib import Path

import can
import pytest
from dronecan import uavcan
from dronecan.transport import Transfer
from hypothesis import given
from hypothesis import strategies as st

from drivers.dronecan.esc import DronecanEsc
from drivers.dronecan.options import Options
from drivers.dronecan.transfers import (
    Assembler,
    NotUnderstood,
    Received,
    Sender,
    is_anonymous,
    is_answer,
    is_message,
    text,
)
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.protocols import OneWay
from tests.drivers.collecting import FOLDER, collect
from tests.drivers.scripted_peer import wait_until

GOLDEN = tomllib.loads((FOLDER / "dronecan.toml").read_text())
ROOT = Path(__file__).parents[2]
NODE, RIG = 42, 10


def golden(*path):
    table = GOLDEN
    for each in path:
        table = table[each]
    return [Frame(int(line[:8], 16), True, bytes.fromhex(line[8:])) for line in table["frames"]]


def options(**changed):
    known = {"max_voltage": 24.0, "full_voltage": 48.0, "watchdog_timeout": 0.5, "reversible": True}
    return Options("b", NODE, **known | {"state_rate": 50.0} | changed)


# -- transfers -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", range(len(GOLDEN["raw"])))
def test_golden_set_points(case):
    wanted, sender = GOLDEN["raw"][case], Sender(RIG)
    for _ in range(wanted["number"]):
        sender.raw_command([])
    assert sender.raw_command(wanted["cmd"]) == golden("raw", case)


def test_other_golden_words():
    sender = Sender(RIG)
    assert sender.rpm_command(GOLDEN["rpm"]["values"]) == golden("rpm")
    assert sender.arming_status(armed=True) == golden("arming")
    assert sender.ask_node_info(NODE) == golden("question")
    assert sender.arming_status(armed=False)[0].data == b"\x00\xc1", "each kind has its own number"
    (state,) = sender.node_status(7)
    assert (state.id & 0xFFFFFF, state.data) == (0x01550A, bytes.fromhex("07 00 00 00 00 00 00 c0"))


@pytest.mark.parametrize(("name", "kind"), [("status", 1034), ("node_status", 341)])
def test_golden_messages(name, kind):
    assembler = Assembler()
    *first, last = [assembler.feed(frame) for frame in golden(name)]
    assert first == [None] * len(first)
    assert last[:4] == (kind, NODE, False, 0)
    for key, value in GOLDEN[name].items():
        assert key == "frames" or getattr(last.value, key) == value


def test_the_golden_identity():
    assembler = Assembler()
    found = [assembler.feed(frame) for frame in golden("identity")][-1]
    assert found.service
    assert text(found.value.name) == "org.example.esc"
    assert is_answer(golden("identity")[0], 1, NODE, RIG)
    assert not is_answer(golden("identity")[0], 1, NODE, RIG + 1)


@pytest.mark.parametrize(
    ("order", "why"),
    [
        ([1], "beginning of its transfer is missing"),
        ([0, 2], "Toggle|CRC|toggle"),
        ([0, 0], "the end of its transfer is missing"),
        ([0, 1, 1], "Toggle"),
    ],
)
def test_lost_and_repeated_frames_are_said(order, why):
    frames, assembler = golden("status"), Assembler()
    answers = [assembler.feed(frames[index]) for index in order]
    if isinstance(answers[-1], NotUnderstood):
        assert any(word in answers[-1].why for word in why.split("|"))
    else:
        last = assembler.feed(frames[2])
        assert isinstance(last, NotUnderstood)
        assert any(word in last.why for word in why.split("|"))


def test_a_damaged_transfer_is_none():
    first, second, third = golden("status")
    assembler = Assembler()
    assembler.feed(first)
    assembler.feed(second._replace(data=b"\x53" + second.data[1:]))
    assert "CRC" in assembler.feed(third).why
    assert assembler.feed(Frame(first.id, True, b"")).why == "it has no tail byte"
    short = assembler.feed(Frame(first.id, True, b"\x01\x80"))
    assert "is not full" in short.why


@given(st.lists(st.tuples(st.sampled_from([0x10040A2A, 0x1801552A, 0x0804060A, 0x10010AAA]), st.binary(max_size=8))))
def test_any_frames_make_a_transfer_or_are_handed_back(rows):
    assembler = Assembler()
    for identifier, data in rows:
        found = assembler.feed(Frame(identifier, True, data))
        assert found is None or isinstance(found, Received | NotUnderstood)


def test_whose_frames_they_are():
    status, anonymous = golden("status")[0], Frame(0x1E055500 & ~0xFF | 0x100, True, b"\x01\xc0")
    assert is_message(status, 1034)
    assert not is_message(status, 341)
    assert not is_message(status._replace(extended=False), 1034)
    assert not is_message(anonymous, 1)
    assert is_anonymous(anonymous)
    assert not is_anonymous(Frame(0x900, True, bytes(8))), "VESC 0's STATUS"


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"max_voltage": 0.0}, "max_voltage must be positive"),
        ({"full_voltage": math.inf}, "full_voltage must be positive"),
        ({"watchdog_timeout": math.nan}, "watchdog_timeout must be positive"),
        ({"max_voltage": 50.0}, "max_voltage must be at most full_voltage"),
        ({"esc_index": 20}, "esc_index must be 0 to 19"),
        ({"own_node_id": 0}, "own_node_id must be 1 to 127"),
        ({"own_node_id": NODE}, "must differ, both are 42"),
        ({"current": "battery"}, "current must be supply or motor"),
        ({"rate": 0.0}, "rate must be above 0"),
        ({"state_rate": 0.5}, "state_rate 1 to 500"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


def test_a_node_that_cannot_be():
    with pytest.raises(ValueError, match="node_id must be 1 to 127"):
        Options("b", 128, 24.0, 48.0, 0.5)


def test_without_the_library_a_bench_is_told_the_extra(tmp_path):
    """In a process of its own, where `dronecan` can't be imported: all else can."""
    bench = (ROOT / "benches" / "dronecan" / "bench.toml").read_text(encoding="utf-8")
    (tmp_path / "bench.toml").write_text(bench[: bench.index("[mount]")], encoding="utf-8")
    code = (
        "import sys, drivers\nprint('dronecan' in sys.modules)\n"
        "sys.modules['dronecan'] = None\n"
        "from pathlib import Path\n"
        "import rig.cli\n"
        "from rig.campaign.loading import load_bench\n"
        "from rig.errors import ConfigError\n"
        "try: load_bench(Path(sys.argv[1]))\n"
        "except ConfigError as error: print(error)\n"
    )
    path = str(tmp_path / "bench.toml")
    said = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, cwd=ROOT, check=True)
    assert said.stdout == (
        f"False\n{path}: devices.motor: this kind of device needs the Python package dronecan, which is not installed:"
        " pip install 'thruster-rig[dronecan]'\n"
    )


# -- the driver ------------------------------------------------------------------------------------------------------


class Esc:
    """Somebody else on the virtual bus, by the library's transfers: says its messages again and again."""

    def __init__(self, channel):
        self.status = {"voltage": 48.0, "current": 1.5, "temperature": 300.0, "rpm": 0, "power_rating_pct": 25}
        self.index, self.uptime, self.health, self.mode = 0, 5, 0, 0
        self.says = {"state", "status", "identity"}
        self.extra = []
        self.heard = []
        self._ear, self._number = Assembler(), 0
        self._bus = can.Bus(channel, interface="virtual")
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()
        self._bus.shutdown()

    def say(self, value, node=NODE, **more):
        self._number = (self._number + 1) % 32
        transfer = Transfer(
            payload=value, source_node_id=node, transfer_priority=16, **{"transfer_id": self._number} | more
        )
        for frame in transfer.to_frames():
            self.send(frame.message_id, frame.bytes)

    def send(self, identifier, data):
        self._bus.send(can.Message(arbitration_id=identifier, is_extended_id=True, data=data))

    def _run(self):
        while not self._stop.wait(0.004):
            while (message := self._bus.recv(0.0)) is not None:
                self._hear(Frame(message.arbitration_id, message.is_extended_id, bytes(message.data)))
            if "state" in self.says:
                self.say(uavcan.protocol.NodeStatus(uptime_sec=self.uptime, health=self.health, mode=self.mode))
            if "status" in self.says:
                self.say(uavcan.equipment.esc.Status(esc_index=self.index, **self.status))
            for value, node in list(self.extra):
                self.say(value, node)

    def _hear(self, frame):
        transfer = self._ear.feed(frame)
        if transfer is None:
            return
        if transfer.service and "identity" in self.says:
            answer = uavcan.protocol.GetNodeInfo.Response()
            answer.name.encode("org.somebody.esc")
            answer.hardware_version.unique_id.from_bytes(bytes(range(16)))
            more = {"dest_node_id": transfer.source, "service_not_message": True, "transfer_id": transfer.number}
            self.say(answer, **more)
        field = {1030: "cmd", 1031: "rpm", 1100: "status"}.get(transfer.data_type) if not transfer.service else None
        if field:
            value = getattr(transfer.value, field)
            self.heard.append((field, value if field == "status" else list(value)))


@pytest.fixture
def start(request):
    """Starts an ESC that is so from its first message on."""
    with contextlib.ExitStack() as running:

        def begin(**changed):
            esc = Esc(request.node.name)
            esc.says -= {changed.pop("silent_of", "")}
            for key, value in changed.items():
                if hasattr(esc, key):
                    setattr(esc, key, value)
                else:
                    esc.status[key] = value
            return running.enter_context(esc)

        yield begin


@pytest.fixture
def esc(start):
    return start()


@pytest.fixture
def bus(request):
    bus = CanBus("virtual", request.node.name, 1_000_000)
    bus.open()
    yield bus
    bus.close()


@pytest.fixture
def motor(bus, esc):
    device = DronecanEsc("motor", options(), bus)
    device.open()
    yield device
    device.close()


LET_GO = [("rpm", [0]), ("cmd", [])]


def test_identity_and_rows_and_that_opening_commands_nothing(bus, esc):
    device = DronecanEsc("motor", options(), bus)
    assert device.open() == (
        "org.somebody.esc, node 42, hardware 0.0, software 0.0, serial 000102030405060708090a0b0c0d0e0f"
    )
    assert esc.heard == []
    esc.status["rpm"] = -600
    seen = {}

    def told():
        seen.update({row.stream: row.values for row in device.drain()})
        return len(seen) == 2 and seen["motor"][0] == -10.0

    wait_until(told)
    assert seen["motor"] == pytest.approx((-10.0, 48.0, 1.5, 26.85, 0.25, 0.0), abs=1e-6)
    assert seen["motor_state"] == (0.0, 0.0, 5.0, 0.0)
    assert {stream.name for stream in device.streams} == set(seen)
    assert all(len(stream.channels) == len(seen[stream.name]) for stream in device.streams)
    assert (device.health().alive, device.health().bad) == (True, 0)
    device.close()
    wait_until(lambda: esc.heard == LET_GO)


def test_volts_are_a_fraction_of_all_that_it_gives(esc, motor):
    for volts in (0.0, 24.0, -12.0, 0.0):
        motor.command(volts)
    wait_until(lambda: len(esc.heard) == 4)
    assert esc.heard == [("cmd", [0]), ("cmd", [4096]), ("cmd", [-2048]), ("cmd", [0])]
    esc.heard.clear()
    motor.release()
    wait_until(lambda: esc.heard == LET_GO)


def test_the_place_of_its_index_and_arming(bus, start):
    esc = start(index=2)
    device = DronecanEsc("motor", options(esc_index=2, arming=True), bus)
    device.open()
    device.command(0.0)
    device.command(24.0)
    device.release()
    wait_until(lambda: len(esc.heard) == 6)
    assert esc.heard == [
        ("status", 255), ("cmd", [0, 0, 0]), ("cmd", [0, 0, 4096]), ("rpm", [0, 0, 0]), ("cmd", []), ("status", 0),
    ]  # fmt: skip
    device.close()


def test_what_is_no_set_point(esc, motor):
    for volts in (24.1, -24.1, math.nan, math.inf):
        with pytest.raises(ValueError, match=r"within \+-24 V"):
            motor.command(volts)
    assert esc.heard == []


def test_the_first_word_is_zero(esc, motor):
    with pytest.raises(LinkError, match=r"watchdog of 0\.5 s, command 0 V first: 0 was sent in the place of 5 V"):
        motor.command(5.0)
    wait_until(lambda: esc.heard == [("cmd", [0])])


def test_an_esc_of_one_direction(bus, esc):
    device = DronecanEsc("motor", options(reversible=False), bus)
    assert isinstance(device, OneWay)
    assert (device.min_voltage, device.max_voltage) == (0.0, 24.0)
    assert DronecanEsc("motor", options(), bus).min_voltage == -24.0
    device.open()
    device.command(0.0)
    with pytest.raises(LinkError, match=r"one direction.*gives no negative voltage: 0 was sent in the place of -5 V"):
        device.command(-5.0)
    wait_until(lambda: esc.heard == [("cmd", [0]), ("cmd", [0])])
    device.close()


def test_after_a_silence_zero_goes_first(bus, esc):
    device = DronecanEsc("motor", options(watchdog_timeout=0.05), bus)
    device.open()
    device.command(0.0)
    device.command(5.0)
    threading.Event().wait(0.06)
    with pytest.raises(LinkError, match="command 0 V first"):
        device.command(5.0)
    device.command(0.0)
    device.command(5.0)
    wait_until(lambda: len(esc.heard) == 5)
    assert [value for _, value in esc.heard] == [[0], [853], [0], [0], [853]]
    device.close()


def test_the_watchdog_is_said(bus):
    watchdog = DronecanEsc("motor", options(), bus).watchdog
    assert (watchdog.timeout_s, watchdog.fed_by, watchdog.resumes_by_itself) == (0.5, "RawCommand", True)


def test_an_esc_that_was_left_turning_is_let_go(bus, start):
    esc = start(rpm=-600)
    device = DronecanEsc("motor", options(), bus)
    device.open()
    wait_until(lambda: esc.heard == LET_GO)
    device.close()


def gone(motor):
    wait_until(lambda: motor.drain() is not None and not motor.health().alive)
    return motor.health().error


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("health", 2, r"motor reports health error (vendor status 0): clear its cause"),
        ("health", 3, r"motor reports health critical (vendor status 0): clear its cause"),
        ("mode", 2, "motor is in maintenance and not operational"),
        ("mode", 6, "motor is in mode 6 and not operational"),
    ],
)
def test_health_and_mode_are_faults_while_they_last(esc, motor, field, value, words):
    setattr(esc, field, value)
    assert gone(motor) == words
    setattr(esc, field, 0)
    wait_until(lambda: motor.drain() is not None and motor.health().alive)


def test_a_warning_is_recorded_alone(esc, motor):
    esc.health = 1
    wait_until(lambda: any(row.stream == "motor_state" and row.values[0] == 1.0 for row in motor.drain()))
    assert motor.health().alive


def test_a_restart_stays_a_fault(esc, motor):
    wait_until(lambda: any(row.stream == "motor_state" for row in motor.drain()))
    esc.uptime = 0
    assert "was up for 5 s and is for 0 s now: it has restarted, or two nodes have that identifier" in gone(motor)
    esc.uptime = 9
    wait_until(lambda: any(row.values[2] == 9.0 for row in motor.drain() if row.stream == "motor_state"))
    assert not motor.health().alive


def test_errors_that_are_counted_while_it_is_open_are_a_fault(bus, start):
    esc = start(error_count=7)
    device = DronecanEsc("motor", options(), bus)
    device.open()
    device.drain()
    assert device.health().alive, "those from before are nobody's"
    esc.status["error_count"] = 0
    wait_until(lambda: any(row.stream == "motor" and row.values[5] == 0.0 for row in device.drain()))
    esc.status["error_count"] = 2
    assert "error_count went from 0 to 2" in gone(device)
    device.close()


@pytest.mark.parametrize(
    ("value", "node", "words"),
    [
        (uavcan.protocol.NodeStatus(), RIG, "another node has own_node_id 10"),
        (uavcan.equipment.esc.RawCommand(cmd=[0]), 11, "node 11 commands ESCs as well"),
        (uavcan.equipment.esc.RPMCommand(rpm=[0]), 11, "node 11 commands ESCs as well"),
        (uavcan.equipment.esc.RawCommand(cmd=[]), RIG, "node 10 commands ESCs as well"),
        (uavcan.equipment.esc.Status(esc_index=0), 43, "node 43 says as well that it is ESC 0"),
    ],
    ids=["own_id", "raw", "rpm", "our_own_words", "index"],
)
def test_conflicts_on_the_bus(esc, motor, value, node, words):
    esc.extra.append((value, node))
    assert words in gone(motor)


def test_other_escs_are_no_conflict(esc, motor):
    esc.extra += [(uavcan.equipment.esc.Status(esc_index=1), 43), (uavcan.equipment.esc.Status(esc_index=1), NODE)]
    esc.extra.append((uavcan.protocol.NodeStatus(health=3), 43))
    rows = collect(motor, 20)
    assert {row.values[1] for row in rows if row.stream == "motor"} == {48.0}, "those of the other index are not ours"
    assert motor.health().alive


@pytest.mark.parametrize(
    ("missing", "sentence"),
    [
        ("state", r"no NodeStatus of node 42 came: check node_id, bit rate and power; heard: node 42 as ESC 0$"),
        (
            "status",
            r"node 42 is there, but sends no esc.Status of ESC 0: check esc_index and the ESC's telemetry rate$",
        ),
    ],
)
def test_a_message_that_is_not_sent_is_named(bus, start, missing, sentence):
    start(silent_of=missing)
    with pytest.raises(DeviceError, match=sentence):
        DronecanEsc("motor", options(), bus).open()


def test_an_esc_that_does_not_say_who_it_is_and_a_nameless_node(bus, start):
    esc = start(silent_of="identity")
    device = DronecanEsc("motor", options(), bus)
    opening = threading.Thread(target=lambda: esc.heard.append(device.open()))
    opening.start()
    while opening.is_alive():
        esc.send(0x1E055500 & ~0xFF | 0x100, b"\x01\x02\xc0")
        opening.join(0.05)
    assert esc.heard == [
        "DroneCAN ESC, node 42, which does not say who it is (GetNodeInfo),"
        " a node without identifier asks for one on this bus"
    ]
    device.close()


def test_a_fault_at_opening_is_refused(bus, start):
    start(health=3)
    with pytest.raises(DeviceError, match="motor reports health critical"):
        DronecanEsc("motor", options(), bus).open()


def test_frames_that_are_none_are_counted(esc, motor):
    esc.send(0x10040A2A, b"\x00\x20")
    wait_until(lambda: motor.drain() is not None and motor.health().bad >= 1)
    assert any("missing" in words for words in motor.health().first_bad)


def test_nobody_is_there(bus):
    device = DronecanEsc("motor", options(), bus)
    with pytest.raises(DeviceError, match=r"no NodeStatus of node 42 came: check node_id, bit rate and power$"):
        device.open()
    assert not device.health().alive
    device.close()
    device.close()


def test_a_bus_that_is_closed(bus):
    bus.close()
    with pytest.raises(LinkError, match="motor: its CAN bus was closed"):
        DronecanEsc("motor", options(), bus).open()
