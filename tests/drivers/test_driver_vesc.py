"""VESC over CAN: golden frames, and the driver against a scripted slcan adapter on a pty."""

from __future__ import annotations

import math
import threading
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.vesc.can_frames import (
    FaultCode,
    NotUnderstood,
    Pong,
    Status,
    Status4,
    Status5,
    ask_fault,
    decode,
    ping,
    set_current,
    set_duty,
)
from drivers.vesc.over_can import Options, VescCan
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((Path(__file__).parents[1] / "frames" / "vesc_can.toml").read_text())


def golden(case):
    return Frame(int(case["id"], 16), True, bytes.fromhex(case["data"]))


@pytest.mark.parametrize("case", FRAMES["status"], ids=lambda case: case["data"])
def test_status(case):
    assert decode(golden(case)) == Status(case["erpm"], case["current"], case["duty"])


def test_status_4_and_5():
    (four,), (five,) = FRAMES["status_4"], FRAMES["status_5"]
    keys = ("fet_temperature", "motor_temperature", "input_current", "position")
    assert decode(golden(four)) == Status4(*(four[key] for key in keys))
    assert decode(golden(five)) == Status5(five["tachometer"], five["bus_voltage"])


def test_commands():
    assert set_duty(23, FRAMES["set_duty"][0]["duty"]) == golden(FRAMES["set_duty"][0])
    assert set_current(23, FRAMES["set_current"][0]["amperes"]) == golden(FRAMES["set_current"][0])
    assert set_current(23, 0.0) == Frame(0x117, True, bytes(4))
    assert ping(23, 250) == Frame(0x1117, True, b"\xfa")
    assert ask_fault(23, 250) == Frame(0x817, True, bytes.fromhex("fa 00 32 00 00 80 00"))


@given(st.floats(-0.95, 0.95))
def test_duty_is_within_half_a_count(duty):
    frame = set_duty(1, duty)
    assert abs(int.from_bytes(frame.data, "big", signed=True) / 1e5 - duty) <= 0.51e-5


@given(st.integers(0, 0x1FFFFFFF), st.binary(max_size=8))
def test_any_frame_is_decoded_or_handed_back(identifier, data):
    record = decode(Frame(identifier, True, data))
    assert isinstance(record, Status | Status4 | Status5 | Pong | FaultCode | NotUnderstood)


def test_short_replies():
    assert decode(Frame(0x12FA, True, b"\x17\x00")) == Pong(23, 0)
    assert decode(Frame(0x12FA, True, b"\x17")) == Pong(23, None)
    assert decode(Frame(0x8FA, True, bytes.fromhex("17 01 32 00 00 80 00 02"))) == FaultCode(23, 2)
    other = Frame(0x8FA, True, bytes.fromhex("17 01 32 00 00 00 01 02"))
    assert decode(other) == NotUnderstood(other)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"vesc_id": 300}, "vesc_id must be 0 to 254"),
        ({"host_id": 23}, "host_id must differ"),
        ({"pole_pairs": 0}, "pole_pairs must be at least 1"),
        ({"nominal_bus_voltage": 0.0}, "nominal_bus_voltage must be positive"),
        ({"watchdog_timeout": 0.0}, "watchdog_timeout must be positive"),
        ({"max_voltage": 48.0}, "at most 45.6 V"),
        ({"rate": 0.0}, "rate must be"),
        ({"fault_every": -1}, "rate must be"),
    ],
)
def test_impossible_options(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        motor_options(**options)


def motor_options(**options):
    defaults = {"bus": "b", "vesc_id": 23, "pole_pairs": 7, "nominal_bus_voltage": 48.0, "watchdog_timeout": 0.5}
    return Options(**(defaults | options))


STATUS = b"T0000091780000104000C80082\r"  # 4160 ERPM, 20.0 A, duty 0.130
STATUS_5 = b"T00001B178000001F401E10000\r"  # 500 counts, 48.1 V
STATUS_4 = b"T000010178013A00FA00380000\r"  # 31.4 degC, 25.0 degC, 5.6 A


def adapter(*frames, pong=b"T000012FA21700\r", fault=b""):
    """An slcan adapter with one VESC behind it: PING brings PONG, then the given frames."""

    def script(peer, request):
        peer.send(b"Z\r" if request.startswith(b"T") else b"\r")
        if request.startswith(b"T00001117"):
            peer.send(pong + b"".join(frames))
        if request.startswith(b"T00000817"):
            peer.send(fault)

    return Peer(script, terminator=b"\r")


class Bench:
    """A bus and a motor on a scripted adapter, closed at the end."""

    def __init__(self, peer, **options):
        self.bus = CanBus("slcan", peer.port, 500_000)
        self.motor = VescCan("motor", motor_options(**options), self.bus)

    def __enter__(self):
        self.bus.open()
        return self.motor, self.bus

    def __exit__(self, *_):
        self.motor.close()
        self.bus.close()


def test_streams_are_those_of_the_contract():
    with adapter() as peer:
        streams = VescCan("motor", motor_options(fault_every=10), CanBus("slcan", peer.port, 500_000)).streams
    assert [s.name for s in streams] == ["motor", "motor_supply", "motor_thermal", "motor_fault"]
    channels = [[(c.name, c.quantity, c.unit, c.integer) for c in s.channels] for s in streams]
    assert channels[0][0] == ("rotation_rate", "rotation_rate", "rev/s", False)
    assert [c[0] for c in channels[0]] == ["rotation_rate", "current", "duty", "motor_voltage"]
    assert channels[1] == [("bus_voltage", "bus_voltage", "V", False), ("tachometer", None, "1", True)]
    assert [c[0] for c in channels[2]] == ["motor_temperature", "fet_temperature", "input_current"]
    assert channels[2][2] == ("input_current", None, "A", False)


def test_a_session():
    with adapter(STATUS, STATUS_5, STATUS, STATUS_4) as peer, Bench(peer) as (motor, _):
        assert motor.open() == "VESC, CAN id 23"
        first, supply, second, thermal = motor.drain()
        assert first.values[:3] == pytest.approx((4160 / 60 / 7, 20.0, 0.130))
        assert math.isnan(first.values[3])
        assert supply.values == (48.1, 500.0)
        assert second.values[3] == pytest.approx(0.130 * 48.1)
        assert thermal.values == (25.0, 31.4, 5.6)
        motor.command(12.0)
        motor.command(-24.0)
        motor.release()
        duties = [b"T000000174000061A8", b"T000000174FFFF3CB0", b"T00000117400000000"]
        wait_until(lambda: [line for line in peer.heard if not line.startswith(b"T00000817")][-3:] == duties)
        assert motor.health().alive
        assert (motor.watchdog.timeout_s, motor.watchdog.action, motor.watchdog.resumes_by_itself) == (
            0.5,
            "coast",
            True,
        )


def test_the_adapter_is_set_up_without_a_pause():
    with adapter() as peer, Bench(peer):
        wait_until(lambda: b"O" in peer.heard)
        assert b"S6" in peer.heard


@pytest.mark.parametrize("volts", [math.nan, math.inf, -math.inf, 45.7, -45.7])
def test_impossible_commands(volts):
    with adapter(STATUS, STATUS_5, STATUS_4) as peer, Bench(peer) as (motor, _):
        motor.open()
        with pytest.raises(ValueError, match=r"within \+-45.6 V"):
            motor.command(volts)
        assert not any(line.startswith(b"T00000017") for line in peer.heard)


def test_max_voltage_of_the_bench_file():
    with adapter() as peer:
        assert VescCan("m", motor_options(max_voltage=24.0), CanBus("slcan", peer.port, 500_000)).max_voltage == 24.0


@pytest.mark.parametrize(
    ("frames", "options", "sentence"),
    [
        ([], {}, "CAN Status Rate 1 to 50 Hz and tick CAN Status Message 1"),
        ([STATUS, STATUS_4], {}, "tick CAN Status Message 5"),
        ([STATUS, STATUS_5], {}, "sends no STATUS 4 message"),
    ],
)
def test_a_vesc_with_factory_settings_is_refused_with_what_to_change(frames, options, sentence):
    with adapter(*frames) as peer, Bench(peer, **options) as (motor, _):
        with pytest.raises(DeviceError, match=sentence):
            motor.open()
        assert not motor.health().alive


def test_messages_that_the_bench_file_does_not_expect_are_not_required():
    with adapter(STATUS) as peer, Bench(peer, supply_rate=0.0, thermal_rate=0.0) as (motor, _):
        motor.open()
        assert [s.name for s in motor.streams] == ["motor"]
        assert math.isnan(motor.drain()[0].values[3])


def test_no_answer_to_ping():
    with adapter(pong=b"") as peer, Bench(peer) as (motor, _), pytest.raises(DeviceError, match="does not answer PING"):
        motor.open()


def test_the_bus_must_be_open():
    with adapter() as peer:
        motor = VescCan("motor", motor_options(), CanBus("slcan", peer.port, 500_000))
        with pytest.raises(LinkError, match="is not open"):
            motor.open()
        with pytest.raises(LinkError, match="is not open"):
            motor.command(0.0)
        motor.close()


def test_a_stale_supply_voltage_gives_no_motor_voltage():
    with adapter(STATUS_5, STATUS, STATUS_4) as peer, Bench(peer, supply_rate=1000.0) as (motor, _):
        motor.open()
        assert not math.isnan(motor.drain()[1].values[3])
        threading.Event().wait(1.05)  # the limit is 1 s
        peer.send(STATUS)
        samples = []
        wait_until(lambda: samples.extend(motor.drain()) or bool(samples))
        assert math.isnan(samples[0].values[3])


@pytest.mark.parametrize(("code", "alive"), [(b"00", True), (b"02", False)])
def test_fault_polling(code, alive):
    fault = b"T000008FA81701320000800" + b"0" + code + b"\r"
    with adapter(STATUS, STATUS_5, STATUS_4, fault=fault) as peer, Bench(peer, fault_every=2) as (motor, _):
        motor.open()
        motor.drain()
        motor.command(0.0)
        motor.command(0.0)
        samples = []
        wait_until(lambda: samples.extend(motor.drain()) or bool(samples))
        assert samples[0].stream == "motor_fault"
        assert samples[0].values == (float(code),)
        assert motor.health().alive is alive
        assert alive or "under-voltage" in motor.health().error


def test_a_fault_is_asked_for_without_being_told_to_and_is_no_stream_then():
    fault = b"T000008FA81701320000800004\r"
    with adapter(STATUS, STATUS_5, STATUS_4, fault=fault) as peer, Bench(peer) as (motor, _):
        motor.open()
        motor.drain()
        for _ in range(10):
            motor.command(0.0)
        wait_until(lambda: motor.drain() is not None and not motor.health().alive)
        assert "fault 4 (absolute over-current)" in motor.health().error
        assert "motor_fault" not in {stream.name for stream in motor.streams}
        asked = [request for request in peer.heard if request.startswith(b"T00000817")]
        assert len(asked) == 1, "ten commands within 0.2 s"


def test_a_frame_of_the_wrong_length_is_counted():
    with adapter(STATUS, STATUS_5, STATUS_4, b"T00000917400000000\r") as peer, Bench(peer) as (motor, _):
        motor.open()
        wait_until(lambda: motor.drain() is not None and motor.health().bad == 1)
        assert motor.health().first_bad == ("00000917#00 00 00 00",)


def test_a_pulled_cable():
    with adapter(STATUS, STATUS_5, STATUS_4) as peer, Bench(peer) as (motor, bus):
        motor.open()
        peer.unplug()
        wait_until(lambda: not motor.health().alive)
        assert "was lost" in bus.health().error
        with pytest.raises(LinkError, match="check adapter"):
            motor.command(1.0)
        with pytest.raises(LinkError):
            motor.release()


def test_a_cable_pulled_while_opening():
    with Peer(lambda peer, request: None, terminator=b"\r") as peer, Bench(peer) as (motor, _):
        unplugging = threading.Timer(0.2, peer.unplug)
        unplugging.start()
        with pytest.raises(LinkError, match="was lost"):
            motor.open()
        unplugging.join()
