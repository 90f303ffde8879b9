"""VESC on a serial port: golden packets, and the driver against a scripted controller."""

from __future__ import annotations

import threading
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError, LinkError
from drivers.vesc.over_uart import Options, VescUart
from drivers.vesc.uart_packets import (
    MASK,
    Decoder,
    Firmware,
    Unreadable,
    Values,
    ask_firmware,
    ask_values,
    crc16,
    framed,
    set_current,
    set_duty,
)
from tests.drivers.collecting import FOLDER, collect
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((FOLDER / "vesc_uart.toml").read_text())
FIELDS = bytes.fromhex(FRAMES["values"]["fields"].replace(" ", ""))
FIRMWARE = bytes((0, 6, 5)) + b"60_MK6\0" + bytes(range(12)) + bytes(4)


def options(port="p", **changed):
    given_ones = {"pole_pairs": 7, "nominal_bus_voltage": 48.0, "watchdog_timeout": 0.5, "timeout": 0.3}
    return Options(port, **(given_ones | changed))


def reply(fields=FIELDS, fault=0):
    return framed(bytes((50,)) + MASK.to_bytes(4, "big") + fields[:-1] + bytes((fault,)))


class Scripted:
    """Answers whole packets; `values` may be changed, None: says nothing."""

    def __init__(self):
        self.firmware, self.values = framed(FIRMWARE), reply()
        self.heard = []

    def __call__(self, peer, data):
        while data:
            packet, data = data[: data[1] + 5], data[data[1] + 5 :]
            self.heard.append(packet)
            answer = {0: self.firmware, 50: self.values}.get(packet[2])
            if answer:
                peer.send(answer)

    @property
    def commands(self):
        return [packet for packet in self.heard if packet[2] in (5, 6)]


def controller():
    script = Scripted()
    peer = Peer(script, terminator=None)
    peer.script = script
    return peer


def opened(peer, **changed):
    device = VescUart("motor", options(peer.port, **changed))
    device.open()
    return device


def test_golden_packets():
    made = (ask_firmware(), set_duty(0.25), set_duty(-0.5), set_current(5.0))
    assert list(made) == [bytes.fromhex(case["hex"]) for case in FRAMES["request"]]
    selective = FRAMES["selective"]
    assert framed(bytes.fromhex(selective["payload"])) == bytes.fromhex(selective["hex"])
    assert ask_values()[2:7] == bytes.fromhex("32 00 00 81 cf")
    assert crc16(b"123456789") == 0x31C3


def test_golden_values():
    (found,) = Decoder().feed(reply(fault=2))
    assert found == Values(31.4, 25.0, 12.34, 5.67, 0.252, -7012, 48.1, 2)
    (found,) = Decoder().feed(framed(FIRMWARE))
    assert found == Firmware(6, 5, "60_MK6", bytes(range(12)).hex())


@given(st.integers(1, 30))
def test_a_packet_in_two_portions(at):
    decoder = Decoder()
    (found,) = decoder.feed(reply()[:at]) + decoder.feed(reply()[at:])
    assert isinstance(found, Values)
    assert Decoder().feed(framed(b"\x63\x00")) == [Unreadable(b"\x63\x00")]


@given(st.binary(max_size=40))
def test_garbage_is_followed_by_a_good_packet(garbage):
    decoder = Decoder()
    records = decoder.feed(garbage + reply() * 5)
    assert records[-1] == Values(31.4, 25.0, 12.34, 5.67, 0.252, -7012, 48.1, 0)


def test_a_spoilt_packet_costs_itself_alone():
    spoilt = bytearray(reply())
    spoilt[9] ^= 4
    records = Decoder().feed(bytes(spoilt) + reply())
    assert isinstance(records[0], Unreadable)
    assert isinstance(records[-1], Values)
    for wrong in (b"", bytes(256)):
        with pytest.raises(ValueError, match="1 to 255 bytes"):
            framed(wrong)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"pole_pairs": 0}, "pole_pairs must be at least 1"),
        ({"nominal_bus_voltage": 0.0}, "nominal_bus_voltage must be positive"),
        ({"watchdog_timeout": 0.0}, "watchdog_timeout must be positive"),
        ({"timeout": 0.0}, "timeout must be positive"),
        ({"max_voltage": 46.0}, r"at most 45\.6 V"),
        ({"baud": 9600}, "9600 baud carries at most"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


def test_rows_and_who_it_is():
    with controller() as peer:
        device = VescUart("motor", options(peer.port))
        assert device.open() == f"VESC 60_MK6, firmware 6.05, {bytes(range(12)).hex()}"
        assert not peer.script.commands, "opening sends no set-point"
        (row, *_) = collect(device, 3)
        rate = -7012 / 420
        assert row.values == pytest.approx((rate, 12.34, 0.252, 0.252 * 48.1, 48.1, 5.67, 25.0, 31.4, 0.0))
        assert len(device.streams[0].channels) == len(row.values)
        assert (device.watchdog.timeout_s, device.watchdog.action) == (0.5, "coast")
        assert device.health().bad == 0
        device.close()
        wait_until(lambda: peer.script.heard[-1] == set_current(0.0))
        assert not device.health().alive


def test_set_points_and_release():
    with controller() as peer:
        device = opened(peer, max_voltage=24.0)
        for volts in (0.0, 12.0, -24.0):
            device.command(volts)
        device.release()
        wait_until(lambda: len(peer.script.commands) == 4)
        assert peer.script.commands == [set_duty(0.0), set_duty(0.25), set_duty(-0.5), set_current(0.0)]
        for volts in (24.1, float("nan")):
            with pytest.raises(ValueError, match="within"):
                device.command(volts)
        device.close()


def test_a_fault_is_the_fault_of_the_link_until_it_is_gone():
    with controller() as peer:
        device = opened(peer)
        peer.script.values = reply(fault=4)
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        assert device.health().error == (
            "motor reports fault 4 (absolute over-current): clear its cause, then open again"
        )
        peer.script.values = reply()
        wait_until(lambda: device.drain() is not None and device.health().alive)
        device.close()


def test_what_is_refused_at_opening():
    for name, value, sentence in (
        ("firmware", None, "no VESC answers FW_VERSION"),
        ("values", None, "does not answer GET_VALUES_SELECTIVE"),
        ("values", reply(fault=2), "reports fault 2 .under-voltage."),
    ):
        with controller() as peer:
            setattr(peer.script, name, value)
            device = VescUart("motor", options(peer.port, timeout=0.1))
            with pytest.raises(DeviceError, match=sentence):
                device.open()
            assert not device.health().alive
            assert not peer.script.commands


def test_an_answer_that_is_lost_is_asked_for_again():
    with controller() as peer:
        device = opened(peer)
        peer.script.values = None
        for _ in range(4):
            assert device.drain() in ([], device.drain())
            threading.Event().wait(0.03)
        peer.script.values = reply()
        assert collect(device, 2)
        device.close()


def test_a_pulled_cable():
    with controller() as peer:
        device = opened(peer)
        peer.unplug()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        with pytest.raises(LinkError):
            device.command(0.0)
        device.close()
        device.close()
