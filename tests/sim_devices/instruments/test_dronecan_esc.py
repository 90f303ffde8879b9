"""The simulated DroneCAN ESC: golden frames, set-points, its timeout, and all that it can do wrong."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_devices.instruments.dronecan.esc import DronecanEsc
from sim_devices.instruments.dronecan.options import DronecanEscOptions, Measured
from sim_devices.instruments.dronecan.wire import (
    ARMING_STATUS,
    RAW_COMMAND,
    RPM_COMMAND,
    SIGNATURES,
    Bits,
    Ear,
    checksum,
    frames,
    message_id,
    signed,
)
from sim_devices.wires.can_frame import CanFrame

GOLDEN = tomllib.loads((Path(__file__).parents[2] / "frames" / "dronecan.toml").read_text())
NOW = Measured(-1234 / 60.0, -1.5, 48.0, 300.0 - 273.15)


def golden(*path):
    table = GOLDEN
    for each in path:
        table = table[each]
    return [CanFrame(int(line[:8], 16), bytes.fromhex(line[8:])) for line in table["frames"]]


def raw(*values):
    bits = Bits()
    for value in values:
        bits.add(value, 14)
    return bits.bytes()


class Bed:
    def __init__(self, **options):
        self.log, self.t, self._number = [], 0.0, 0
        made = DronecanEscOptions("dronecan_esc", **options)
        self.esc = DronecanEsc(
            made, 48.0, lambda: 2.0, lambda: NOW, lambda event, **more: self.log.append((event, more))
        )

    def say(self, kind, data):
        self._number += 1
        name = {RAW_COMMAND: "RawCommand", RPM_COMMAND: "RPMCommand"}.get(kind, "RawCommand")
        for frame in frames(message_id(kind, 10), data, self._number, SIGNATURES[name]):
            assert self.esc.receive(frame, self.t) == []

    def run(self, seconds):
        self.t += seconds
        return self.esc.tick(self.t)

    @property
    def volts(self):
        return self.esc.drive(0.0, 0.001)[0]


# -- wire ------------------------------------------------------------------------------------------------------------


def test_the_checksum_of_the_book():
    assert checksum(b"123456789") == 0x29B1, "CRC-16/CCITT-FALSE"


@pytest.mark.parametrize("case", range(len(GOLDEN["raw"])))
def test_golden_set_points_are_heard(case):
    ear, wanted = Ear(), GOLDEN["raw"][case]
    *first, heard = [ear.hear(frame) for frame in golden("raw", case)]
    assert first == [None] * len(first)
    assert (heard.data_type, heard.source, heard.destination, heard.number) == (1030, 10, None, wanted["number"])
    assert signed(heard.data, 14) == wanted["cmd"]


def test_other_golden_words_are_heard():
    assert signed(Ear().hear(golden("rpm")[0]).data, 18) == GOLDEN["rpm"]["values"]
    assert Ear().hear(golden("arming")[0])[0] == ARMING_STATUS
    question = Ear().hear(golden("question")[0])
    assert (question.data_type, question.destination, question.request) == (1, 42, True)


@given(st.lists(st.integers(-8192, 8191), max_size=20))
def test_set_points_come_back(values):
    ear = Ear()
    made = frames(message_id(RAW_COMMAND, 10), raw(*values), 3, SIGNATURES["RawCommand"])
    assert signed([ear.hear(frame) for frame in made][-1].data, 14) == values


def test_what_is_damaged_is_dropped():
    first, second, third = golden("raw", 2)
    for order in ([second, third], [first, third], [first, second, second]):
        ear = Ear()
        assert [ear.hear(frame) for frame in order] == [None] * len(order)
    ear = Ear()
    broken = second._replace(data=b"\x01" + second.data[1:])
    assert [ear.hear(frame) for frame in (first, broken, third)] == [None] * 3
    assert ear.hear(CanFrame(first.id, b"\x00\xc0", extended=False)) is None
    unknown = frames(message_id(1034, 10), bytes(14), 0, SIGNATURES["Status"])
    assert [ear.hear(frame) for frame in unknown] == [None] * 3


# -- the ESC ---------------------------------------------------------------------------------------------------------


def test_golden_status():
    bed = Bed(rate=10.0, state_rate=0.0, timeout=0.0)
    bed.say(RAW_COMMAND, raw(2048))  # 25 %
    assert bed.run(0.1) == golden("status")


def test_golden_identity():
    bed, (question,) = Bed(), golden("question")
    bed.run(7.0)
    assert bed.esc.receive(question, bed.t) == golden("identity")
    assert Bed(answers=False).esc.receive(question, 0.0) == []
    assert Bed(node_id=41).esc.receive(question, 0.0) == []


def test_state_in_bits():
    bed = Bed(rate=0.0)
    (frame,) = bed.run(1.0)
    assert (frame.id, frame.data.hex(" ")) == (0x1801552A, "01 00 00 00 00 00 00 c0")
    bed.esc.fault("over_temperature", bed.t)
    (frame,) = bed.run(1.0)
    assert frame.data.hex(" ") == "02 00 00 00 80 00 00 c1"
    bed.esc.fault("maintenance", bed.t)
    (frame,) = bed.run(1.0)
    assert frame.data.hex(" ") == "03 00 00 00 10 00 00 c2"


def test_set_points():
    bed = Bed(esc_index=1)
    assert bed.volts is None
    bed.say(RAW_COMMAND, raw(0, 8191))
    assert bed.volts == 48.0
    bed.say(RAW_COMMAND, raw(8191, -8191))
    assert bed.volts == -48.0
    bed.say(RAW_COMMAND, raw(8191))
    assert bed.volts is None, "an array too short stops it"
    bed.say(RPM_COMMAND, Bits().add(0, 18).add(600, 18).bytes())
    assert bed.volts == 5.0
    bed.say(RPM_COMMAND, b"")
    assert bed.volts is None
    assert [more["volts"] for event, more in bed.log if event == "command"] == [48.0, -48.0, 0.0, 5.0, 0.0]


def test_one_direction_and_arming():
    bed = Bed(reversible=False)
    bed.say(RAW_COMMAND, raw(-4096))
    assert bed.volts is None
    bed = Bed(needs_arming=True)
    bed.say(RAW_COMMAND, raw(4096))
    assert bed.volts is None
    bed.say(ARMING_STATUS, b"\xff")
    bed.say(RAW_COMMAND, raw(8191))
    assert bed.volts == 48.0
    bed.say(ARMING_STATUS, b"\x00")
    assert bed.volts is None


def test_its_timeout_is_fed_by_set_points_alone_and_the_next_one_turns_it():
    bed = Bed(timeout=0.5)
    bed.say(RAW_COMMAND, raw(8191))
    bed.run(0.4)
    bed.say(ARMING_STATUS, b"\xff")
    bed.say(341, bytes(7))
    assert bed.volts == 48.0
    bed.run(0.11)
    assert bed.volts is None
    assert next(more for event, more in bed.log if event == "timeout")["after"] == pytest.approx(0.51)
    bed.say(RAW_COMMAND, raw(8191))
    assert bed.volts == 48.0


@pytest.mark.parametrize("options", [{"timeout": 0.0}, {"broken_watchdog": True}])
def test_without_a_timeout_it_goes_on(options):
    bed = Bed(**options)
    bed.say(RAW_COMMAND, raw(8191))
    bed.run(60.0)
    assert bed.volts == 48.0


@pytest.mark.parametrize("fault", ["over_temperature", "over_current", "maintenance"])
def test_health_and_mode_stop_it(fault):
    bed = Bed()
    bed.say(RAW_COMMAND, raw(8191))
    bed.esc.fault(fault, 0.0)
    assert bed.volts is None
    bed.esc.clear(0.0)
    bed.say(RAW_COMMAND, raw(8191))
    assert bed.volts == 48.0


def test_other_faults():
    bed = Bed(timeout=0.0, rate=10.0, state_rate=0.0)
    bed.say(RAW_COMMAND, raw(8191))
    bed.esc.fault("warning", 0.0)
    assert bed.volts == 48.0
    bed.esc.fault("backwards", 0.0)
    assert bed.volts == -48.0
    bed.esc.fault("redrives", 0.0, 0.5)
    assert bed.volts == 24.0
    bed.esc.fault("ignores_commands", 0.0)
    bed.say(RAW_COMMAND, raw(0))
    assert bed.volts == 48.0
    bed.esc.fault("other_esc", 0.0)
    assert {frame.id & 0x7F for frame in bed.run(0.1)} == {42, 99}
    bed.esc.fault("other_master", 0.0)
    assert [frame.id for frame in bed.run(0.1)][-1] == message_id(RAW_COMMAND, 99)
    bed.esc.fault("desync", 0.0)
    assert bed.run(0.1)[0].data[2] == 1, "error_count"
    bed.esc.fault("silent", 0.0)
    assert bed.run(1.0) == []
    bed.esc.clear(0.0)
    bed.esc.fault("reboot", bed.t)
    assert bed.volts is None
    assert bed.run(0.5) == []
    assert bed.run(0.6)
    with pytest.raises(ValueError, match="expected one of frozen"):
        bed.esc.fault("pulled", 0.0)


@pytest.mark.parametrize(("fault", "rpm", "amps"), [("rate_factor", -2468, -1.5), ("current_factor", -1234, -3.0)])
def test_what_it_tells_wrongly(fault, rpm, amps):
    bed = Bed(rate=10.0, state_rate=0.0)
    bed.esc.fault(fault, 0.0, 2.0)
    data = b"".join(frame.data[:-1] for frame in bed.run(0.1))[2:]
    expected = Bits().add(0, 32).half(48.0).half(amps).half(300.0).add(rpm, 18).add(0, 7).add(0, 5).bytes()
    assert data == expected


def test_a_node_without_identifier_asks_for_one_and_does_nothing_else():
    bed = Bed(node_id=0)
    (frame,) = bed.run(1.0)
    assert (frame.id & 0x3FF, frame.data[:-1].hex()) == (0x100, "01000102030405")
    bed.say(RAW_COMMAND, raw(8191))
    assert bed.volts is None


def test_impossible_options():
    for changed in ({"node_id": 128}, {"esc_index": 20}, {"timeout": -1.0}, {"current": "x"}, {"serial": "00"}):
        with pytest.raises(ValueError, match=r"needed|must not|needs"):
            DronecanEscOptions("dronecan_esc", **changed)
