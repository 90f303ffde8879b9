"""The simulated VESC: bytes of the firmware, its timeout, its polling."""

import struct

import pytest

from sim_devices.instruments.vesc import codec
from sim_devices.instruments.vesc.codec import Telemetry
from sim_devices.instruments.vesc.controller import Vesc, VescOptions
from sim_devices.wires.can_frame import CanFrame

# Vectors made by the firmware's own packet.c, crc.c and buffer.c, compiled with -fsingle-precision-constant.
SHOWN = Telemetry(
    erpm=-7012.0,
    current=12.34,
    duty=-0.253,
    input_current=5.67,
    bus_voltage=48.17,
    fet_temperature=31.4,
    motor_temperature=25.0,
    tachometer=-4321,
    position=123.4,
)
GET_VALUES = bytes.fromhex(
    "04013a00fa000004d20000023700000000000004ce00fcffffe49c01e1000004d2000000000000e67800000000ffffef1f000010e102"
    "075bca0017013601360136000005dc00002fa800"
)


class Bus:
    """A VESC with what it said and what it wrote into the truth."""

    def __init__(self, **options):
        self.truth = []
        self.telemetry = SHOWN
        self.vesc = Vesc(
            VescOptions("vesc", **{"timeout": 0.5, **options}),
            48.0,
            lambda: self.telemetry,
            lambda event, **fields: self.truth.append((event, fields)),
        )

    def send(self, command, data, t, to=23):
        return self.vesc.receive(CanFrame(command << 8 | to, data), t)

    def duty(self, value, t):
        return self.send(codec.SET_DUTY, struct.pack(">i", round(value * 1e5)), t)

    def poll(self, payload, t, sender=254):
        """Reassemble the answer to a PROCESS_SHORT_BUFFER request, as comm_can.c of a receiver does."""
        buffer = bytearray(600)
        for frame in self.send(codec.PROCESS_SHORT_BUFFER, bytes((sender, 0)) + payload, t):
            assert frame.id & 0xFF == sender
            command, data = frame.id >> 8, frame.data
            assert len(data) <= 8
            if command == codec.PROCESS_SHORT_BUFFER:
                return data[2:]
            if command == codec.FILL_RX_BUFFER:
                buffer[data[0] : data[0] + len(data) - 1] = data[1:]
            if command == codec.PROCESS_RX_BUFFER:
                length, crc = struct.unpack(">HH", data[2:])
                assert codec.crc16(bytes(buffer[:length])) == crc
                return bytes(buffer[:length])
        return b""


def test_status_frames_are_the_firmwares():
    assert codec.status(SHOWN, 23) == CanFrame(0x917, bytes.fromhex("ffffe49c007bff04"))
    faster = Telemetry(erpm=-7012.0, current=12.34, duty=-0.2531)
    assert codec.status(faster, 23) == CanFrame(0x917, bytes.fromhex("ffffe49c007bff03"))
    assert codec.status_5(SHOWN, 23) == CanFrame(0x1B17, bytes.fromhex("ffffef1f01e10000"))
    assert codec.status_4(SHOWN, 23) == CanFrame(0x1017, bytes.fromhex("013a00fa0038181a"))


def test_the_checksum_is_xmodem():
    assert codec.crc16(b"123456789") == 0x31C3


def test_get_values_is_the_firmwares():
    shown = Telemetry(
        erpm=-7012.0, current=12.34, input_current=5.67, i_q=12.30, duty=0.253, bus_voltage=48.1,
        fet_temperature=31.4, motor_temperature=25.0, charge=0.1234, energy=5.9, tachometer=-4321,
        tachometer_abs=4321, fault=2, position=123.456, controller_id=23, v_d=1.5, v_q=12.2,
    )  # fmt: skip
    # the vector was made with 31 degC in the three MOSFET fields and 31.4 degC in the first
    ours = b"\x04" + codec.values(shown)
    assert len(ours) == 74
    assert ours[:60] == GET_VALUES[:60]
    assert ours[66:] == GET_VALUES[66:]


def test_a_short_answer_and_a_long_one():
    bus = Bus()
    reply = bus.poll(bytes((codec.COMM_FW_VERSION,)), 0.0)
    assert reply[:3] == bytes((0, *codec.FIRMWARE))
    assert reply[3 : reply.index(b"\0", 3)] == codec.HARDWARE_NAME
    assert len(bus.poll(bytes((codec.COMM_GET_VALUES,)), 0.0)) == 74
    mask = bytes.fromhex("00000100")  # V_in alone
    assert bus.poll(bytes((codec.COMM_GET_VALUES_SELECTIVE,)) + mask, 0.0) == b"\x32" + mask + bytes.fromhex("01e1")
    first_long = codec.buffer_frames(bytes(300), 254, 23)[37]  # 37 frames of 7 bytes end at offset 259
    assert first_long.id == codec.FILL_RX_BUFFER_LONG << 8 | 254
    assert first_long.data == bytes.fromhex("0103") + bytes(6)


def test_readings_are_averages_since_the_last_read():
    bus = Bus()
    for amps in (1.0, 2.0, 6.0):
        bus.vesc.average(amps, 0.0, 0.0, 0.0)
    request = bytes((codec.COMM_GET_VALUES_SELECTIVE, 0, 0, 0, 4))
    assert struct.unpack(">i", bus.poll(request, 0.0)[5:]) == (300,)
    assert struct.unpack(">i", bus.poll(request, 0.0)[5:]) == (1234,)


def test_ping_is_answered_to_the_asker():
    assert Bus().send(codec.PING, bytes((253,)), 0.0) == [CanFrame(0x12FD, bytes((23, 0)))]


def test_it_obeys_the_documented_frames():
    bus = Bus()
    bus.vesc.receive(CanFrame(0x17, bytes.fromhex("000061a8")), 0.0)  # duty 0.25
    assert bus.vesc.drive(0.0, 1e-3) == (12.0, 0.0)
    bus.vesc.receive(CanFrame(0x117, bytes.fromhex("0000c738")), 0.0)  # 51 A
    assert bus.vesc.drive(0.0, 1e-3) == (None, 51.0)
    assert bus.truth[0] == ("command", {"mode": "duty", "value": 0.25, "volts": 12.0})


def test_a_long_current_frame_loses_its_first_two_bytes_as_in_the_firmware():
    bus = Bus()
    bus.send(codec.SET_CURRENT, bytes.fromhex("0000000013880000"), 0.0)
    assert bus.vesc.drive(0.0, 1e-3) == (None, 5.0)


def test_relative_currents_brake_and_speed():
    bus = Bus(max_current=50.0)
    bus.send(codec.SET_CURRENT_REL, struct.pack(">i", -50000), 0.0)
    assert bus.vesc.drive(0.0, 1e-3) == (None, -25.0)
    bus.send(codec.SET_CURRENT_BRAKE, struct.pack(">i", 8000), 0.0)
    assert bus.vesc.drive(10.0, 1e-3) == (None, -8.0)
    assert bus.vesc.drive(-10.0, 1e-3) == (None, 8.0)
    bus.send(codec.SET_RPM, struct.pack(">i", 4200), 0.0)
    volts, amps = bus.vesc.drive(0.0, 1e-3)
    assert volts is None
    assert amps > 0.0


def test_out_of_range_is_clipped_in_silence():
    bus = Bus()
    bus.duty(2.0, 0.0)
    assert bus.vesc.drive(0.0, 1e-3)[0] == pytest.approx(0.95 * 48.0)


@pytest.mark.parametrize("frame", [CanFrame(0x18, bytes(4)), CanFrame(0x17, bytes(4), extended=False), CanFrame(0x17)])
def test_frames_for_others_are_not_obeyed(frame):
    bus = Bus()
    bus.duty(0.2, 0.0)
    assert bus.vesc.receive(frame, 0.1) == []
    assert bus.vesc.duty == 0.2


def test_it_lets_go_when_nobody_commands():
    bus = Bus()
    bus.duty(0.2, 1.0)
    bus.vesc.tick(1.499)
    assert bus.vesc.duty == 0.2
    assert bus.vesc.due == pytest.approx(1.5)
    bus.poll(bytes((codec.COMM_GET_VALUES,)), 1.49)  # reading does not feed
    bus.vesc.tick(1.5)
    assert bus.vesc.drive(10.0, 1e-3) == (None, -0.0)
    assert bus.vesc.timed_out
    assert bus.truth[-1][0] == "timeout"


def test_it_resumes_at_the_next_command():
    bus = Bus()
    bus.duty(0.2, 0.0)
    bus.vesc.tick(1.0)
    bus.duty(0.2, 2.0)
    assert bus.vesc.drive(0.0, 1e-3)[0] == pytest.approx(9.6)
    assert [event for event, _ in bus.truth] == ["command", "timeout", "command"]


def test_alive_feeds_and_a_repeated_command_is_no_news():
    bus = Bus()
    bus.duty(0.2, 0.0)
    bus.poll(bytes((codec.COMM_ALIVE,)), 0.4)
    bus.vesc.tick(0.6)
    bus.duty(0.2, 0.7)
    assert len(bus.truth) == 1


@pytest.mark.parametrize("how", ["option", "fault", "zero"])
def test_a_watchdog_can_be_broken_or_off(how):
    bus = Bus(broken_watchdog=how == "option", timeout=0.0 if how == "zero" else 0.5)
    if how == "fault":
        bus.vesc.fault("broken_watchdog", 0.0)
    bus.duty(0.2, 0.0)
    bus.vesc.tick(1e4)
    assert bus.vesc.duty == 0.2


def test_brake_current_after_the_timeout():
    bus = Bus(brake_current=3.0)
    bus.duty(0.2, 0.0)
    bus.vesc.tick(0.5)
    assert bus.vesc.drive(10.0, 1e-3) == (None, -3.0)


def test_status_is_off_by_factory_default_and_otherwise_at_its_rate():
    assert Bus().vesc.tick(10.0) == []
    bus = Bus(messages_1=("STATUS", "STATUS_5"), messages_2=("STATUS_4",))
    said = [f for i in range(100) for f in bus.vesc.tick(i * 0.01)]
    assert [sum(f.id >> 8 == n for f in said) for n in (9, 27, 16)] == [50, 50, 5]


def test_after_a_gap_it_does_not_catch_up():
    bus = Bus(messages_1=("STATUS",))
    bus.vesc.tick(0.0)
    assert len(bus.vesc.tick(100.0)) == 1


def test_faults_stop_the_motor_and_are_reported():
    bus = Bus()
    bus.duty(0.2, 0.0)
    bus.vesc.fault("over_current", 1.0)
    bus.duty(0.2, 1.1)
    assert (bus.vesc.drive(0.0, 1e-3), bus.vesc.code) == ((None, 0.0), 4)
    bus.duty(0.2, 1.6)
    assert (bus.vesc.duty, bus.vesc.code) == (0.2, 0)


def test_frozen_silent_deaf_and_rebooting():
    bus = Bus(messages_1=("STATUS",))
    first = bus.vesc.tick(0.0)
    bus.vesc.fault("frozen", 0.0)
    bus.telemetry = Telemetry(erpm=100.0)
    assert bus.vesc.tick(0.02) == first
    bus.vesc.clear(0.02)
    assert bus.vesc.tick(0.04) != first
    bus.vesc.fault("silent", 0.04)
    assert bus.vesc.tick(0.06) == []
    assert bus.send(codec.PING, b"\xfd", 0.06) == []
    bus.vesc.clear(0.06)
    bus.vesc.fault("ignores_commands", 0.06)
    bus.duty(0.3, 0.07)
    assert bus.vesc.duty == 0.0
    bus.vesc.clear(0.07)
    bus.vesc.fault("reboot", 0.1)
    assert bus.send(codec.PING, b"\xfd", 0.5) == []
    assert bus.vesc.due == pytest.approx(1.1)
    bus.vesc.tick(1.1)
    assert bus.send(codec.PING, b"\xfd", 1.2) != []
    with pytest.raises(ValueError, match="expected one of frozen"):
        bus.vesc.fault("tired", 0.0)


def test_options_that_cannot_be():
    with pytest.raises(ValueError, match="STATUS_9"):
        VescOptions("vesc", messages_1=("STATUS_9",))
    with pytest.raises(ValueError, match="vesc_id"):
        VescOptions("vesc", vesc_id=254)
