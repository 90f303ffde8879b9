"""ODrive on CAN: golden frames, round trips, and the driver against a scripted axis on python-can's virtual bus."""

from __future__ import annotations

import math
import struct
import threading
import tomllib

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError, LinkError
from drivers.odrive import can_frames
from drivers.odrive.can_frames import (
    Encoder,
    Heartbeat,
    NotUnderstood,
    clear_errors,
    decode,
    errors,
    set_mode,
    set_state,
    set_torque,
    set_velocity,
)
from drivers.odrive.options import Options
from drivers.odrive.over_can import ODriveCan
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from tests.drivers.collecting import FOLDER
from tests.drivers.scripted_peer import wait_until

FRAMES = tomllib.loads((FOLDER / "odrive.toml").read_text())
NODE = 3


def options(**changed):
    return Options(
        "b", NODE,
        **{"max_voltage": 24.0, "watchdog_timeout": 0.5, "rate_per_volt": 2.0, "thermal_rate": 5.0} | changed,
    )  # fmt: skip


class Axis:
    """Somebody else on the virtual bus: says its messages again and again, notes what it is sent."""

    def __init__(self, channel, obeys=True, state=1):
        self.state, self.error, self.parts, self.obeys = state, 0, (0, 0, 0), obeys
        self.messages = {0x09: (1.0, -12.5), 0x14: (2.0, 1.5), 0x17: (48.0, 0.5), 0x15: (30.0, 40.0)}
        self.heard = []
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

    def say(self, command, data):
        self._bus.send(can.Message(arbitration_id=NODE << 5 | command, is_extended_id=False, data=data))

    def _run(self):
        while not self._stop.wait(0.004):
            while (message := self._bus.recv(0.0)) is not None:
                self._hear(message)
            self.say(0x01, struct.pack("<IBBBB", self.error, self.state, *self.parts))
            for command, values in list(self.messages.items()):
                self.say(command, struct.pack("<ff", *values))

    def _hear(self, message):
        command = message.arbitration_id & 0x1F
        self.heard.append((command, bytes(message.data)))
        if command == 0x07 and self.obeys:
            self.state = message.data[0]
        if command == 0x18:
            self.error = 0

    def told(self, *commands):
        return [pair for pair in self.heard if pair[0] in commands]


@pytest.fixture
def axis(request):
    """`indirect`: its state when it is first heard."""
    with Axis(request.node.name, state=getattr(request, "param", 1)) as axis:
        yield axis


@pytest.fixture
def bus(request):
    bus = CanBus("virtual", request.node.name, 250_000)
    bus.open()
    yield bus
    bus.close()


@pytest.fixture
def motor(bus, axis):
    device = ODriveCan("motor", options(), bus)
    device.open()
    yield device
    device.close()


def velocity(value):
    return struct.pack("<ff", value, 0.0)


# -- frames ----------------------------------------------------------------------------------------------------------


def test_golden_commands():
    ours = [set_velocity(3, 5.0), set_torque(3, -0.25), set_state(3, 8), set_mode(3, 2, 2)]
    assert ours == [Frame(case["id"], False, bytes.fromhex(case["hex"])) for case in FRAMES["command"]]
    assert clear_errors(3) == Frame(0x78, False, bytes(8))
    for value in (math.nan, math.inf):
        with pytest.raises(ValueError, match="a number"):
            set_velocity(3, value)


def test_an_infinite_number_is_none():
    told = decode(Frame(NODE << 5 | 0x09, False, struct.pack("<ff", math.inf, -math.inf)))
    assert all(math.isnan(value) for value in told)


def test_golden_messages():
    (beat,) = FRAMES["heartbeat"]
    assert decode(Frame(beat["id"], False, bytes.fromhex(beat["hex"])))[:2] == (beat["error"], beat["state"])
    for case in FRAMES["pair"]:
        found = decode(Frame(case["id"], False, bytes.fromhex(case["hex"])))
        assert found == getattr(can_frames, case["kind"])(*case["values"])


@given(st.integers(0, 0x7FF), st.binary(max_size=8), st.booleans())
def test_any_frame_is_decoded_or_handed_back(identifier, data, extended):
    frame = Frame(identifier, extended, data)
    found = decode(frame)
    assert found == NotUnderstood(frame) or (not extended and len(data) == 8)


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_numbers_come_back(value):
    assert decode(Frame(0x69, False, struct.pack("<ff", 0.0, value))) == Encoder(0.0, value)


def test_errors_in_words():
    assert errors(Heartbeat(0x1000200, 1, (0, 0, 0)), "0.6") == "DC bus under voltage, watchdog timer expired"
    assert errors(Heartbeat(0x80, 1, (1, 1, 1)), "0.6") == "0x80", "bytes 5 to 7 are no errors there"
    assert errors(Heartbeat(0x840, 1, (1, 0, 1)), "0.5") == (
        "motor failed, watchdog timer expired, motor error, controller error"
    )
    assert errors(Heartbeat(0, 8, (0, 0, 0)), "0.5") == ""


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"max_voltage": 0.0}, "max_voltage must be positive"),
        ({"watchdog_timeout": math.nan}, "watchdog_timeout must be positive"),
        ({"mode": "position"}, "mode must be velocity or torque"),
        ({"rate_per_volt": None}, "mode velocity needs rate_per_volt"),
        ({"mode": "torque"}, "mode torque needs torque_per_volt"),
        ({"torque_per_volt": 1.0}, "torque_per_volt has no meaning in mode velocity"),
        ({"firmware": "0.4"}, "firmware must be 0.6 or 0.5"),
        ({"rate": 0.0}, "rates must be 0 to 1000"),
        ({"current_rate": -1.0}, "rates must be 0 to 1000"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


def test_a_node_that_cannot_be():
    with pytest.raises(ValueError, match="node_id must be 0 to 62"):
        Options("b", 63, 24.0, 0.5, rate_per_volt=1.0)


# -- the driver ------------------------------------------------------------------------------------------------------


def test_rows_and_that_opening_says_nothing(bus, axis, motor):
    seen = {}
    wait_until(lambda: len(seen.update({row.stream: row.values for row in motor.drain()}) or seen) == 5)
    assert seen == {
        "motor": (-12.5, 1.0),
        "motor_current": (1.5, 2.0),
        "motor_supply": (48.0, 0.5),
        "motor_thermal": (30.0, 40.0),
        "motor_state": (0.0, 1.0),
    }
    assert [stream.name for stream in motor.streams] == list(dict.fromkeys(stream.name for stream in motor.streams))
    assert {stream.name for stream in motor.streams} == set(seen)
    assert axis.heard == []
    assert (motor.health().alive, motor.health().bad) == (True, 0)


def test_what_is_not_sent_is_no_stream(bus, axis):
    axis.messages = {0x09: (0.0, 0.0)}
    device = ODriveCan("motor", options(current_rate=0.0, supply_rate=0.0, thermal_rate=0.0), bus)
    device.open()
    assert [stream.name for stream in device.streams] == ["motor", "motor_state"]
    device.close()


def test_a_first_set_point_closes_the_loop_with_nothing_old_to_go_on_with(axis, motor):
    motor.command(0.0)
    wait_until(lambda: axis.told(0x0D))
    assert axis.heard == [(0x07, bytes((1, *[0] * 7))), (0x18, bytes(8)), (0x0D, velocity(0.0))]
    axis.heard.clear()
    motor.command(5.0)
    motor.command(-0.5)
    motor.command(0.0)
    wait_until(lambda: len(axis.heard) == 6)
    assert axis.heard == [
        (0x0B, struct.pack("<II", 2, 1)),
        (0x0D, velocity(0.0)),
        (0x07, bytes((8, *[0] * 7))),
        (0x0D, velocity(10.0)),
        (0x0D, velocity(-1.0)),
        (0x0D, velocity(0.0)),
    ]
    motor.release()
    wait_until(lambda: axis.heard[-1] == (0x07, bytes((1, *[0] * 7))))
    assert axis.state == 1


def test_torque(bus, axis):
    device = ODriveCan("motor", options(mode="torque", rate_per_volt=None, torque_per_volt=-0.1), bus)
    device.open()
    device.command(0.0)
    device.command(5.0)
    wait_until(lambda: len(axis.told(0x0E)) == 3)
    assert axis.told(0x0B) == [(0x0B, struct.pack("<II", 1, 1))]
    assert axis.told(0x0E)[-1][1] == struct.pack("<ff", -0.5, 0.0)
    device.close()
    wait_until(lambda: axis.heard[-1] == (0x07, bytes((1, *[0] * 7))))


def test_what_is_no_set_point(axis, motor):
    for volts in (24.1, -24.1, math.nan, math.inf):
        with pytest.raises(ValueError, match=r"within \+-24 V"):
            motor.command(volts)
    assert axis.heard == []
    assert motor.max_voltage == 24.0


def test_the_first_word_is_zero(axis, motor):
    with pytest.raises(LinkError, match=r"longer than the watchdog of 0\.5 s: 0 was sent in the place of 5 V"):
        motor.command(5.0)
    wait_until(lambda: axis.heard)
    assert axis.heard == [(0x0D, velocity(0.0))]
    assert axis.state == 1


def test_after_a_silence_zero_goes_first(bus, axis):
    device = ODriveCan("motor", options(watchdog_timeout=0.05), bus)
    device.open()
    device.command(0.0)
    device.command(5.0)
    wait_until(lambda: axis.state == 8)
    threading.Event().wait(0.06)
    axis.state, axis.error = 1, 0x1000000
    wait_until(lambda: any(row.stream == "motor_state" and row.values[0] for row in device.drain()))
    assert device.health().alive, "our own silence is no fault of the motor"
    with pytest.raises(LinkError, match="command 0 V first"):
        device.command(5.0)
    device.command(0.0)
    wait_until(lambda: axis.error == 0)
    device.command(5.0)
    wait_until(lambda: axis.state == 8)
    assert device.drain() is not None
    assert device.health().alive
    device.close()


def test_the_watchdog_is_said():
    watchdog = ODriveCan("motor", options(), CanBus("virtual", "x", 1)).watchdog
    assert (watchdog.timeout_s, watchdog.action, watchdog.resumes_by_itself) == (0.5, "coast", False)


@pytest.mark.parametrize(("error", "words"), [(0x4000000, "spinout detected"), (0x2000000, "estop requested")])
def test_an_error_is_a_fault_until_it_is_gone(axis, motor, error, words):
    motor.command(0.0)
    wait_until(lambda: axis.told(0x18))
    axis.error = error
    wait_until(lambda: motor.drain() is not None and not motor.health().alive)
    assert motor.health().error == f"motor reports {words}: clear its cause, then open again"
    axis.error = 0
    wait_until(lambda: motor.drain() is not None and motor.health().alive)


def test_a_watchdog_that_ends_while_it_is_fed_is_a_fault(axis, motor):
    motor.command(0.0)
    motor.command(5.0)
    wait_until(lambda: axis.state == 8)
    axis.error = 0x1000000

    def told():
        motor.command(5.0)
        return motor.drain() is not None and not motor.health().alive

    wait_until(told)
    assert "watchdog timer expired" in motor.health().error


def test_an_axis_that_leaves_its_loop_is_a_fault(axis, motor):
    motor.command(0.0)
    motor.command(5.0)
    wait_until(lambda: axis.state == 8)
    axis.obeys, axis.state = False, 1

    def told():
        motor.command(5.0)
        return motor.drain() is not None and not motor.health().alive

    wait_until(told)
    assert motor.health().error == "motor is idle and not in closed loop control: is it calibrated?"


@pytest.mark.parametrize("axis", [8], indirect=True)
def test_an_axis_that_was_left_driving_is_made_idle(bus, axis):
    device = ODriveCan("motor", options(), bus)
    device.open()
    assert axis.heard == [(0x07, bytes((1, *[0] * 7)))]
    device.close()


@pytest.mark.parametrize("axis", [8], indirect=True)
def test_an_axis_that_does_not_become_idle_is_refused(bus, axis):
    axis.obeys = False
    device = ODriveCan("motor", options(), bus)
    with pytest.raises(DeviceError, match="was closed loop control and does not become idle"):
        device.open()


@pytest.mark.parametrize(
    ("missing", "sentence"),
    [
        (0x09, r"no encoder message of node 3 came: check node_id.*encoder_msg_rate_ms to 10 "),
        (0x14, r"no iq message of node 3 came.*iq_msg_rate_ms to 20 "),
    ],
)
def test_a_message_that_is_not_sent_is_named(bus, axis, missing, sentence):
    del axis.messages[missing]
    with pytest.raises(DeviceError, match=sentence):
        ODriveCan("motor", options(), bus).open()


def test_an_error_at_opening_is_refused_but_that_of_an_old_silence(bus, axis):
    axis.error = 0x200
    with pytest.raises(DeviceError, match="motor reports DC bus under voltage: clear its cause"):
        ODriveCan("motor", options(), bus).open()
    axis.error = 0x1000000
    device = ODriveCan("motor", options(), bus)
    device.open()
    device.close()


def test_frames_that_are_none_are_counted(axis, motor):
    axis.say(0x01, b"\x00")
    wait_until(lambda: motor.drain() is not None and motor.health().bad == 1)
    assert motor.health().first_bad[0] == "061#00"


def test_nobody_is_there(bus):
    device = ODriveCan("motor", options(), bus)
    with pytest.raises(DeviceError, match="no heartbeat message of node 3 came"):
        device.open()
    assert not device.health().alive
    device.close()
    device.close()
