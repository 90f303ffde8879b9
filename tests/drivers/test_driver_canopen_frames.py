"""Golden frames of CANopen both ways, states of CiA 402 beside another author's table, SDO over a bus of the rig."""

from __future__ import annotations

import subprocess
import sys
import threading
import tomllib
from pathlib import Path

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers import KINDS
from drivers.canopen import frames
from drivers.canopen.frames import Field
from drivers.canopen.state402 import State, next_controlword, state_of
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame

ROOT = Path(__file__).parents[2]
GOLDEN = tomllib.loads((ROOT / "tests" / "frames" / "canopen.toml").read_text(encoding="utf-8"))
canopen = pytest.importorskip("canopen")


def golden(what: str) -> Frame:
    (found,) = [each for each in GOLDEN["frame"] if each["what"].startswith(what)]
    return Frame(int(found["id"], 16), False, bytes.fromhex(found["data"]))


def test_golden_frames():
    assert frames.nmt(frames.START, 5) == golden("NMT start")
    assert frames.heartbeat(127) == golden("heartbeat")
    assert frames.as_heartbeat(golden("heartbeat")) == (frames.OPERATIONAL,)
    told = frames.as_emergency(golden("emergency"))
    assert told == (0x8130, 0x11)
    assert str(told) == "0x8130 (monitoring), error register 0x11"
    assert frames.service(golden("emergency")) == frames.EMERGENCY


@pytest.mark.parametrize("pdo", GOLDEN["pdo"], ids=lambda pdo: pdo["what"])
def test_golden_pdos_both_ways(pdo):
    fields = tuple(Field(index, 0, bits, signed) for index, bits, signed in pdo["fields"])
    data = bytes.fromhex(pdo["data"])
    assert frames.unpack(fields, data) == tuple(pdo["values"])
    assert frames.pack(fields, tuple(pdo["values"])) == data
    assert frames.unpack(fields, data[:-1]) is None


@given(st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**16 - 1), st.integers(-128, 127))
def test_fields_go_round(velocity, word, mode):
    fields = (Field(0x6041, 0, 16), Field(0x606C, 0, 32, True), Field(0x6061, 0, 8, True))
    assert frames.unpack(fields, frames.pack(fields, (word, velocity, mode))) == (word, velocity, mode)


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_any_frame_is_something_or_nothing(identifier, data):
    frame = Frame(identifier, False, data)
    frames.as_heartbeat(frame)
    frames.as_emergency(frame)
    frames.unpack((Field(0x6041, 0, 16),), data)


def test_a_value_that_is_too_large_is_refused():
    with pytest.raises(ValueError, match="object 0x6071 has 16 bits, too few for 40000"):
        frames.pack((Field(0x6071, 0, 16, True),), (40_000,))


def test_every_statusword_has_the_state_of_the_library():
    from canopen.profiles.p402 import State402

    names = {
        "NOT READY TO SWITCH ON": State.NOT_READY,
        "SWITCH ON DISABLED": State.SWITCH_ON_DISABLED,
        "READY TO SWITCH ON": State.READY,
        "SWITCHED ON": State.SWITCHED_ON,
        "OPERATION ENABLED": State.OPERATION_ENABLED,
        "FAULT": State.FAULT,
        "FAULT REACTION ACTIVE": State.FAULT_REACTION,
        "QUICK STOP ACTIVE": State.QUICK_STOP_ACTIVE,
    }
    for word in range(0x10000):
        theirs = [names[name] for name, (mask, value) in State402.SW_MASK.items() if word & mask == value]
        assert state_of(word) == (theirs[0] if theirs else None), hex(word)


def test_each_step_is_a_transition_of_the_library():
    from canopen.profiles.p402 import State402

    for state, words in (
        (State.SWITCH_ON_DISABLED, ("SWITCH ON DISABLED", "READY TO SWITCH ON")),
        (State.READY, ("READY TO SWITCH ON", "SWITCHED ON")),
        (State.SWITCHED_ON, ("SWITCHED ON", "OPERATION ENABLED")),
    ):
        assert next_controlword(state, turning=True) == State402.TRANSITIONTABLE[words]
    assert (
        next_controlword(State.OPERATION_ENABLED, turning=False)
        == State402.TRANSITIONTABLE[("OPERATION ENABLED", "SWITCHED ON")]
    )
    assert next_controlword(State.QUICK_STOP_ACTIVE, turning=True) == State402.CW_QUICK_STOP
    for state in (State.FAULT, State.FAULT_REACTION, State.NOT_READY, None):
        assert next_controlword(state, turning=True) == 0


class Scripted:
    """Replies to SDO requests of node 5 as the golden exchanges say; what has none gets no reply."""

    def __init__(self, name: str) -> None:
        self.bus = can.Bus(name, interface="virtual")
        self.requests: list[bytes] = []
        self._replies = {
            bytes.fromhex(each["request"]): bytes.fromhex(each["reply"]) for each in GOLDEN["sdo"] + GOLDEN["abort"]
        }
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.is_set():
            message = self.bus.recv(0.01)
            if message is None or message.arbitration_id != 0x605:
                continue
            self.requests.append(bytes(message.data))
            if reply := self._replies.get(bytes(message.data)):
                self.bus.send(can.Message(arbitration_id=0x585, data=reply, is_extended_id=False))

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self.bus.shutdown()


@pytest.fixture
def node(request):
    """Our node on a bus of the rig, and the scripted device."""
    from drivers.canopen.node import CanopenNode

    device = Scripted(request.node.name)
    bus = CanBus("virtual", request.node.name, 500_000)
    bus.open()
    made = CanopenNode("motor", 5, bus, 0.3)
    made.open()
    yield made, device, bus
    bus.close()
    device.close()


@pytest.mark.parametrize("sdo", GOLDEN["sdo"], ids=lambda sdo: sdo["what"])
def test_golden_transfers(node, sdo):
    ours, device, _ = node
    if "value" in sdo:
        assert ours.number(sdo["index"]) == sdo["value"]
    else:
        field = Field(sdo["index"], sdo.get("sub", 0), sdo["bits"], sdo["written"] < 0)
        ours.write(field, sdo["written"], "test")
    assert device.requests == [bytes.fromhex(sdo["request"])]


def test_golden_aborts_are_told_in_words(node):
    ours, _, _ = node
    read_only, absent = GOLDEN["abort"]
    with pytest.raises(DeviceError, match=r"motor: object 0x6041:0 \(word\) refuses 0: .*" + read_only["words"]):
        ours.write(Field(read_only["index"], 0, 16), 0, "word")
    with pytest.raises(DeviceError, match=absent["words"]):
        ours.number(absent["index"])
    assert ours.number_if_there(absent["index"]) is None


def test_a_device_that_does_not_answer_and_a_bus_that_is_gone(node):
    ours, _, bus = node
    with pytest.raises(DeviceError, match=r"no CANopen device answers as node 5 within 0\.3 s: check node_id"):
        ours.require_profile(402)
    bus.close()
    with pytest.raises(LinkError, match="is not open"):
        ours.number(0x1000)


def test_a_setting_that_reads_back_as_another_is_refused(node):
    ours, _, _ = node
    with pytest.raises(DeviceError, match="0x6041"):
        ours.set(Field(0x6041, 0, 16), 0, "word")


def test_without_the_library_a_bench_is_told_the_extra(tmp_path):
    """In a process of its own, where `canopen` can't be imported: all else can."""
    bench = (ROOT / "benches" / "cia402" / "bench.toml").read_text(encoding="utf-8")
    (tmp_path / "bench.toml").write_text(bench[: bench.index("[mount]")], encoding="utf-8")
    code = (
        "import sys; sys.modules['canopen'] = None\n"
        "from pathlib import Path\n"
        "import drivers, rig.cli\n"
        "from rig.campaign.loading import load_bench\n"
        "from rig.errors import ConfigError\n"
        "try: load_bench(Path(sys.argv[1]))\n"
        "except ConfigError as error: print(error)\n"
    )
    path = str(tmp_path / "bench.toml")
    said = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, cwd=ROOT, check=True)
    assert said.stdout == (
        f"{path}: devices.motor: this kind of device needs the Python package canopen, which is not installed:"
        " pip install 'thruster-rig[canopen]'\n"
    )


def test_the_base_imports_no_canopen():
    code = "import sys, drivers; print('canopen' in sys.modules)"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert said.stdout == "False\n"


WHOLE = {"bus": "b", "node_id": 5, "max_voltage": 24.0, "watchdog_timeout": 0.5, "rate_per_volt": 1.0}


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"node_id": 0}, "node_id must be 1 to 127, not 0"),
        ({"master_id": 5}, "master_id must differ from node_id"),
        ({"mode": "volts"}, "mode must be one of velocity, torque"),
        ({"rate_per_volt": None}, "in mode velocity needs rate_per_volt"),
        ({"torque_per_volt": 0.1}, "needs rate_per_volt, and no torque_per_volt"),
        ({"mode": "torque", "rate_per_volt": None, "torque_per_volt": 0.1}, "needs rated_torque"),
        ({"rate_per_volt": -1.0}, "rate_per_volt must be positive"),
        ({"rate_per_volt": 1e9}, "more than 32 bits carry"),
        ({"quick_stop_option": 6}, "quick_stop_option must be 1 or 2"),
        ({"on_silence": "nothing"}, "on_silence must be one of fault, coast, quick_stop"),
        ({"watchdog_timeout": 0.0}, "watchdog_timeout must be 0.02 to 65 s"),
        ({"state_rate": 80.0}, "state_rate 0.1/s to rate"),
        ({"idle_time": 0.0}, "idle_time must be positive"),
        ({"timeout": 0.0}, "timeout must be between 0 and 60 s"),
        ({"bus_voltage_unit": -1.0}, "bus_voltage_unit must be positive, or 0"),
    ],
)
def test_options_that_cannot_be(keys, sentence):
    with pytest.raises(ValueError, match=sentence):
        KINDS["cia402"].options(**(WHOLE | keys))
