"""Load-cell transmitter on Modbus: scripted transmitters on ptys, each map, each refusal, each way to fail."""

from __future__ import annotations

import json
import math
import struct

import pytest

from drivers.errors import DeviceError, LinkError
from drivers.modbus.cell import ModbusCell
from drivers.modbus.cell_options import Options
from tests.drivers.collecting import collect, quiet
from tests.drivers.modbus_peer import Transmitter, crc
from tests.drivers.scripted_peer import Peer, wait_until

G = 9.80665
DIVISIONS = """
title = "Transmitter with divisions"
source = "this test"
function = 3
[readings.weight]
register = 0
type = "i32"
word_order = "low_first"
[status]
register = 2
[unit]
register = 3
byte = "low"
codes = { 1 = "N", 2 = "kg", 9 = "" }
[division]
register = 3
byte = "high"
codes = { 4 = "5", 13 = "0.005" }
"""


def laumas(counts=12345, status=0x0880):
    return Transmitter({6: status, 7: counts >> 16, 8: counts & 0xFFFF, 9: 0, 10: 12000, 13: 3})


def floats(value, order="high_first", unit=0):
    words = struct.unpack(">HH", struct.pack(">f", value))
    first, second = words if order == "high_first" else words[::-1]
    return Transmitter(dict.fromkeys(range(100), 0) | {2: unit << 8, 63: first, 64: second, 77: 0x10})


def options(port="p", **changes):
    told = {"map": "laumas", "rate": 50.0, "baud": 115_200, "unit": "kg", "decimals": 3, "timeout": 0.15}
    return Options(port, **(told | changes))


def seneca(port="p", **changes):
    return options(port, **({"map": "seneca_z_sg", "decimals": None, "unit": None} | changes))


@pytest.fixture
def opened():
    """`opened(script, options of a port)`: a device that is polled; closed at the end."""
    devices, peers = [], []

    def make(script, make_options=options, **changes):
        peer = Peer(script, terminator=None)
        peers.append(peer.__enter__())
        devices.append(ModbusCell("cell", make_options(peer.port, **changes)))
        devices[-1].said = devices[-1].open()
        return devices[-1]

    yield make
    for device in devices:
        device.close()
    for peer in peers:
        peer.unplug()


def test_a_laumas_in_newtons_with_its_sign_from_the_status(opened):
    script = laumas()
    cell = opened(script, sign=-1)
    assert cell.said == "Laumas TLx, TLU, LCB, Modbus address 1, in kg (serial number not read)"
    assert collect(cell, 3)[-1].values == (pytest.approx(12.345 * G), 1.0, 0x0880, -12345.0)
    assert set(script.asked) == {(6, 3)}, "status and weight in one reply"
    (stream,) = cell.streams
    assert [(c.name, c.integer) for c in stream.channels] == [
        ("thrust", False), ("stable", False), ("status", True), ("raw", True),
    ]  # fmt: skip
    thrust = stream.channels[0]
    assert (thrust.quantity, thrust.unit, thrust.quantum) == ("thrust", "N", pytest.approx(0.001 * G))
    assert thrust.delay == pytest.approx(11 * 10 / 115_200)
    assert (stream.period_s, stream.clock_drift_std) == (0.02, None)
    assert json.loads(thrust.calibration)["word_order"] == "high_first"
    health = cell.health()
    assert (health.alive, health.bad, health.error) == (True, 0, None)


def test_the_other_reading(opened):
    script = laumas()
    cell = opened(script, reading="net", unit="N", decimals=2)
    assert collect(cell, 1)[0].values == (pytest.approx(120.0), 1.0, 0x0880, 12000.0)
    assert set(script.asked) == {(6, 5)}


def test_a_dini_argeo_by_function_4(opened):
    script = Transmitter({0: 0, 1: 3055, 2: 0, 3: 1, 4: 0b0110}, function=4)
    cell = opened(script, map="dini_argeo_dgt")
    assert collect(cell, 1)[0].values == (pytest.approx(-3.055 * G), 1.0, 6.0, -3055.0)


def test_a_seneca_says_its_unit(opened):
    cell = opened(floats(25.0), seneca)
    assert collect(cell, 1)[0].values == (pytest.approx(25.0 * G), 1.0, 16.0)
    assert cell.streams[0].channels[0].quantum is None
    cell = opened(floats(-3.75, unit=5), seneca, resolution=0.01)
    assert collect(cell, 1)[0].values[0] == -3.75
    assert cell.streams[0].channels[0].quantum == 0.01


def test_the_rate_that_was_asked_for(opened):
    """Twenty samples at 50/s take 0.38 s and more, never less: a poll is not sent before its time."""
    cell = opened(laumas())
    samples = collect(cell, 20)
    assert samples[19].t_ns - samples[0].t_ns > 0.36e9


# -- refused at opening ------------------------------------------------------------------------------------------------


def refused(script, make_options=options, **changes):
    with Peer(script, terminator=None) as peer:
        cell = ModbusCell("cell", make_options(peer.port, **changes))
        with pytest.raises(DeviceError) as caught:
            cell.open()
        assert not cell.health().alive
        cell.close()
    return str(caught.value)


def test_a_unit_that_is_not_the_one_expected():
    said = refused(floats(25.0, unit=5), seneca, unit="kg")
    assert said == "cell shows N, the bench file says kg: change one of them"
    assert "no force and no mass (code 6 in register 2)" in refused(floats(25.0, unit=6), seneca)
    assert "no force and no mass (code 77" in refused(floats(25.0, unit=77), seneca)


def test_words_in_the_other_order():
    said = refused(floats(25.0, "low_first"), seneca, range_max=500.0)
    assert "in the order high_first, which is no weight, but 25 kg in the order low_first" in said
    assert said.endswith('set word_order = "low_first"')
    said = refused(floats(0.1), seneca, range_max=500.0, word_order="low_first")
    assert "but 0.1 kg in the order high_first" in said
    said = refused(laumas(counts=12000 << 16), options, range_max=500.0)
    assert 'but -12 kg in the order low_first: set word_order = "low_first"' in said


def test_words_that_are_no_weight_in_any_order():
    said = refused(floats(math.nan), seneca)
    assert "nor is it one in the other order: check map and reading" in said


def test_words_in_the_order_that_was_set(opened):
    cell = opened(floats(25.0, "low_first"), seneca, word_order="low_first")
    assert collect(cell, 1)[0].values[0] == pytest.approx(25.0 * G)


def test_an_order_that_zero_could_not_tell_is_found_out_by_the_first_load(opened):
    script = floats(0.0)
    cell = opened(script, seneca, range_max=500.0)
    assert collect(cell, 1)[0].values[0] == 0.0
    script.registers.update(floats(25.0, "low_first").registers)
    wait_until(lambda: [s for s in cell.drain() if math.isnan(s.values[0])])
    health = cell.health()
    assert not health.alive
    assert health.error.endswith('but 25 kg in the order low_first: set word_order = "low_first"')


@pytest.mark.parametrize(
    ("status", "sentence"),
    [(0b1, "fault of cell or converter (status 0x0001)"), (0b100, "is overloaded (status 0x0004): unload it")],
)
def test_a_transmitter_in_trouble_is_not_begun_with(status, sentence):
    assert sentence in refused(laumas(status=status))


def test_nobody_answers():
    said = refused(quiet)
    assert "address 1 on /dev/" in said
    assert "115200 baud 8N1, asked by function 3 for registers 6 to 8: no reply" in said
    with pytest.raises(LinkError, match="cannot open"):
        ModbusCell("cell", options("/dev/none")).open()


def test_another_address_answers():
    script = laumas()
    script.spoil = lambda reply: crc(b"\x02" + reply[1:-2])
    assert "a reply of address 2 to a request to 1" in refused(script)


def test_registers_that_are_not_there():
    assert refused(Transmitter({6: 0})).endswith("exception 2 (no such register)")
    assert refused(Transmitter({6: 0}, function=4)).endswith("exception 1 (function not supported)")


def test_divisions_and_unit_from_registers(tmp_path, opened):
    path = tmp_path / "own.toml"
    path.write_text(DIVISIONS.replace('word_order = "low_first"\n', ""))
    own = {"map": str(path), "unit": None, "decimals": None}
    script = Transmitter({0: 0xFFFF, 1: 0xFFFB, 2: 7, 3: 0x0D01})
    cell = opened(script, **own)
    assert collect(cell, 1)[0].values == (pytest.approx(-0.005), 7.0, -5.0)
    assert cell.streams[0].channels[0].quantum == 0.005
    script = Transmitter({0: 0, 1: 35, 2: 0, 3: 0x0402})
    cell = opened(script, **own)
    assert collect(cell, 1)[0].values[0] == pytest.approx(35 * G)
    assert cell.streams[0].channels[0].quantum == pytest.approx(5 * G)
    script.registers[3] = 0x0D01
    assert "has divisions of 0.005 (3 decimals), the bench file says 2" in refused(script, **(own | {"decimals": 2}))
    script.registers[3] = 0x6301
    assert "division that its map does not know (code 99 in register 3)" in refused(script, **own)
    script.registers[3] = 0x0D09
    assert "no force and no mass (code 9 in register 3)" in refused(script, **own)


# -- while it runs -----------------------------------------------------------------------------------------------------


def test_overload_is_no_number_and_passes(opened):
    script = laumas()
    cell = opened(script)
    collect(cell, 1)
    script.registers[6] = 0x0884
    wait_until(lambda: any(math.isnan(s.values[0]) and s.values[2] == 0x0884 for s in cell.drain()))
    assert cell.health().alive
    script.registers[6] = 0x0880
    wait_until(lambda: any(s.values[0] == pytest.approx(-12.345 * G) for s in cell.drain()))


def test_underload_is_no_number(opened):
    script = Transmitter({0: 0, 1: 3055, 2: 0, 3: 1, 4: 0b0100}, function=4)
    cell = opened(script, map="dini_argeo_dgt")
    script.registers[4] = 0b1000
    wait_until(lambda: any(math.isnan(s.values[0]) for s in cell.drain()))


def test_a_broken_cell_is_believed_no_more(opened):
    script = laumas()
    cell = opened(script)
    script.registers[6] = 0x0002
    wait_until(lambda: cell.drain() is not None and not cell.health().alive)
    assert "reports a fault of cell or converter (status 0x0002): check the cell and its cable" in cell.health().error


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (lambda reply: b"", "no reply within 0.15 s"),
        (lambda reply: reply[:-1] + bytes((reply[-1] ^ 1,)), "a reply whose checksum is wrong"),
        (lambda reply: crc(b"\x02" + reply[1:-2]), "a reply of address 2 to a request to 1"),
        (lambda reply: crc(b"\x01\x83\x06"), "exception 6 (busy)"),
    ],
)
def test_a_reply_that_is_none_is_counted_and_polling_goes_on(opened, spoil, why):
    script = laumas()
    cell = opened(script)
    collect(cell, 1)
    script.spoil = spoil
    wait_until(lambda: cell.drain() is not None and cell.health().bad >= 2)
    assert cell.health().first_bad[0].startswith(why)
    assert cell.health().alive
    script.spoil = lambda reply: reply
    cell.drain()
    collect(cell, 3)


def test_a_late_reply_answers_no_later_request():
    """It comes in the silence that follows a reply that was missed: each value is one that was asked for then."""
    held = []

    class Late(Transmitter):
        def __call__(self, peer, data):
            if held and held[0] is None:  # keep one reply back until the request after it would have been due
                held[0] = self.answer(3, 6, 3)
                return
            super().__call__(peer, data)

    script = Late(laumas().registers)
    with Peer(script, terminator=None) as peer:
        cell = ModbusCell("cell", options(peer.port))
        cell.open()
        collect(cell, 2)
        held.append(None)
        wait_until(lambda: held[0] is not None)
        script.registers[8] = 777
        before = len(script.asked)
        wait_until(lambda: cell.drain() is not None and cell.health().bad == 1)
        peer.send(held[0])
        wait_until(lambda: cell.drain() is not None and cell.health().bad == 2)
        assert len(script.asked) == before
        assert collect(cell, 1)[0].values[3] == -777.0
        assert cell.health().first_bad[1].startswith("bytes that answer nothing")
        cell.close()


def test_an_adapter_that_hears_itself(opened):
    class Echo(Transmitter):
        def __call__(self, peer, data):
            peer.send(data)
            super().__call__(peer, data)

    cell = opened(Echo(laumas().registers))
    assert collect(cell, 2)[0].values[3] == -12345.0
    assert cell.health().first_bad[0].startswith("bytes beside a reply: 01 03 00 06")


def test_a_pulled_transmitter():
    with Peer(laumas(), terminator=None) as peer:
        cell = ModbusCell("cell", options(peer.port))
        cell.open()
        peer.unplug()
        wait_until(lambda: not cell.health().alive)
        wait_until(lambda: cell.drain() is not None and not cell.health().alive)
        assert any(word in cell.health().error for word in ("was lost", "refused"))
        cell.close()
        cell.close()


def test_opened_again_and_captured(tmp_path):
    capture = tmp_path / "bytes.txt"
    with Peer(laumas(), terminator=None) as peer:
        cell = ModbusCell("cell", options(peer.port, capture=str(capture)))
        for _ in range(2):
            cell.open()
            collect(cell, 1)
            cell.close()
        assert cell.drain() == []
    assert "> 01 03 00 06 00 03" in capture.read_text()


def test_it_is_not_tared_over_the_wire():
    with pytest.raises(DeviceError, match="tare by subtraction"):
        ModbusCell("cell", options()).tare()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"port": ""}, "port is empty"),
        ({"rate": 60.0, "baud": 9600}, "carries at most 37/s"),
        ({"rate": 200.0, "baud": 19200, "framing": "8E1"}, "carries at most"),
        ({"map": "loomas"}, "map must be one of"),
        ({"reading": "peak"}, "reading must be one of gross, net"),
        ({"unit": None}, "cannot ask for the unit"),
        ({"unit": "stone"}, "unit must be one of N, mg"),
        ({"decimals": None}, "cannot ask for the decimal point"),
        ({"decimals": 7}, "decimals must be 0 to 6"),
        ({"map": "seneca_z_sg"}, "is a float32, which has its decimal point"),
        ({"address": 0}, "address must be 1 to 247"),
        ({"timeout": 0.0001}, "timeout must be between 0.00"),
        ({"timeout": 11.0}, "and 10 s"),
        ({"sign": 0}, "sign must be"),
        ({"gain_std": 0.5}, "gain_std is relative"),
        ({"low_pass": 0.1}, "low_pass must be"),
        ({"window": -1.0}, "window must be"),
    ],
)
def test_impossible_options(changes, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changes)
