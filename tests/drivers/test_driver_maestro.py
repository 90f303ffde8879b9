"""An ESC behind a Pololu Maestro: golden packets, the pulse of a voltage, and the driver against a scripted Maestro."""

from __future__ import annotations

import threading
import time
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError, LinkError
from drivers.pololu.maestro import Maestro
from drivers.pololu.maestro_options import Options, flags
from drivers.pololu.packets import Answer, Decoder, Packets, Unreadable, crc7, seven_bits
from tests.drivers.collecting import FOLDER
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((FOLDER / "maestro.toml").read_text())
NEUTRAL = bytes.fromhex("84 00 70 2e")


def options(port="p", **changed):
    given_ones = {"channel": 0, "full_voltage": 48.0, "dead_zone": 25.0, "watchdog_timeout": 0.2, "arming_time": 0.0}
    return Options(port, **(given_ones | {"timeout": 0.3} | changed))


class Scripted:
    """Compact protocol, one byte after the other; its timeout is by the machine's clock."""

    def __init__(self, timeout=0.2, home=6000, deaf=False):
        self.timeout, self.home, self.deaf = timeout, home, deaf
        self.position, self.errors, self.lag = 0, 0, 0
        self.clip = 16383
        self.packets = []
        self._rest = b""
        self._fed = None

    def __call__(self, peer, data):
        if self._fed is not None and self.timeout and time.monotonic() - self._fed > self.timeout:
            self.errors |= 0x20
            self.position = self.position if self.home is None else self.home
        self._fed = time.monotonic()
        self._rest += data
        lengths = {0x84: 4, 0x87: 4, 0x89: 4, 0x90: 2, 0xA1: 1, 0xA2: 1}
        while self._rest and len(self._rest) >= lengths[self._rest[0]]:
            packet, self._rest = self._rest[: lengths[self._rest[0]]], self._rest[lengths[self._rest[0]] :]
            self.packets.append(packet)
            if not self.deaf:
                peer.send(self._answer(packet))

    def _answer(self, packet):
        match packet[0]:
            case 0x84:
                self.position = min(packet[2] | packet[3] << 7, self.clip)
            case 0x90:
                return self.position.to_bytes(2, "little")
            case 0xA1:
                errors, self.errors = self.errors, 0
                return errors.to_bytes(2, "little")
            case 0xA2:
                self.position = self.home
        return b""

    @property
    def targets(self):
        return [packet[2] | packet[3] << 7 for packet in self.packets if packet[0] == 0x84]


def opened(peer, **changed):
    device = Maestro("motor", options(peer.port, **changed))
    device.open()
    return device


def peer(**made):
    script = Scripted(**made)
    found = Peer(script, terminator=None)
    found.script = script
    return found


def drive(device, volts, seconds=0.1):
    """Ticks of a control loop."""
    rows = []
    for _ in range(round(seconds / 0.02)):
        device.command(volts)
        threading.Event().wait(0.02)
        rows += device.drain()
    return rows


# -- packets ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", FRAMES["target"], ids=lambda case: case["compact"])
def test_golden_packets(case):
    words = (0x84, case["channel"], *seven_bits(case["target"]))
    assert Packets().encode(*words) == bytes.fromhex(case["compact"])
    if "pololu" in case:
        assert Packets(12).encode(*words) == bytes.fromhex(case["pololu"])
    if "crc" in case:
        assert Packets(crc=True).encode(*words) == bytes.fromhex(case["crc"])


def test_the_checksum_of_the_guide():
    (case,) = FRAMES["crc"]
    assert crc7(bytes.fromhex(case["packet"])) == case["value"]


@given(st.integers(0, 16383))
def test_numbers_of_14_bits_come_back(value):
    low, high = seven_bits(value)
    assert low | high << 7 == value
    assert max(low, high) < 0x80


def test_what_is_no_packet():
    for wrong in ((0x04, 0), (0x184,), (0x84, 0x80), (0x84, -1)):
        with pytest.raises(ValueError, match="a packet is"):
            Packets().encode(*wrong)
    with pytest.raises(ValueError, match="0 to 16383"):
        seven_bits(16384)


@given(st.binary(min_size=4, max_size=4), st.integers(0, 4))
def test_an_answer_in_two_portions(data, at):
    decoder = Decoder()
    decoder.expect(4)
    assert decoder.feed(data[:at]) + decoder.feed(data[at:]) == [Answer(data)]
    assert not decoder.waiting


def test_bytes_that_nobody_asked_for():
    decoder = Decoder()
    assert decoder.feed(b"\x01\x02") == [Unreadable(b"\x01\x02")]
    decoder.expect(2)
    assert decoder.feed(b"\x70\x17\x00") == [Answer(b"\x70\x17"), Unreadable(b"\x00")]
    assert Answer(b"\x70\x17\x20\x00").words == (6000, 32)
    assert flags(0x21) == "serial signal error, serial timeout"
    assert flags(0x8000) == "flags 0x8000"


# -- the pulse of a voltage ------------------------------------------------------------------------------------------


def test_the_pulse_of_a_voltage():
    o = options()
    assert [o.target(v) / 4 for v in (0.0, 48.0, -48.0, 24.0)] == [1500.0, 1900.0, 1100.0, 1500 + 25 + 187.5]
    assert o.target(1e-6) / 4 == 1525.0
    assert o.target(-1e-6) / 4 == 1475.0
    assert options(min_pulse=1000.0).target(-24.0) / 4 == 1500 - 25 - 237.5


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"channel": 24}, "channel must be 0 to 23"),
        ({"full_voltage": 0.0}, "full_voltage must be positive"),
        ({"dead_zone": 0.0}, "dead_zone must be at least 1 us"),
        ({"dead_zone": 400.0}, "below and max_pulse above neutral"),
        ({"max_pulse": 1510.0}, "below and max_pulse above neutral"),
        ({"watchdog_timeout": 0.0}, "watchdog_timeout must be 0.05 to 655.35 s"),
        ({"arming_time": -1.0}, "arming_time must be"),
        ({"rate": 0.0}, "rate must be"),
        ({"at_zero": "stop"}, "at_zero must be brake or coast"),
        ({"protocol": "mini_ssc"}, "protocol must be compact or pololu"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


# -- the driver ------------------------------------------------------------------------------------------------------


def test_opening_never_leaves_the_dead_zone():
    with peer() as found:
        device = Maestro("motor", options(found.port, arming_time=0.4))
        begun = time.monotonic()
        assert "neither it nor the ESC identifies itself" in device.open()
        assert time.monotonic() - begun >= 0.4
        assert found.script.packets[0] == NEUTRAL, "neutral before anything is asked"
        wait_until(lambda: found.script.targets[-1] == 6000)
        assert set(found.script.targets) == {6000, 6001}
        assert {packet[0] for packet in found.script.packets} == {0x84, 0x87, 0x89, 0x90, 0xA1}
        device.close()


def test_rows_come_with_set_points_alone():
    with peer() as found:
        device = opened(found)
        rows = drive(device, 0.0)
        assert rows[-1].values == (pytest.approx(1500e-6), 0.0)
        heard = len(found.script.packets)
        for _ in range(10):
            threading.Event().wait(0.02)
            assert device.drain() == []
        assert len(found.script.packets) == heard, "a question would feed the Maestro's timeout"
        assert drive(device, 0.0)
        assert device.health().alive, "a timeout after a silence of ours is no fault"
        rows = drive(device, 24.0)
        assert rows[-1].values == (pytest.approx(1712.5e-6), 0.0)
        assert [channel.name for channel in device.streams[0].channels] == ["pulse_width", "error_flags"]
        device.close()


def test_set_points_and_release():
    with peer() as found:
        device = opened(found)
        device.command(0.0)
        device.command(24.0)
        device.command(-48.0)
        device.release()
        wait_until(lambda: b"\xa2" in found.script.packets)
        assert found.script.targets[-3:] == [6000, 6850, 4400]
        for volts in (48.1, float("nan"), float("inf")):
            with pytest.raises(ValueError, match="within"):
                device.command(volts)
        device.close()
        wait_until(lambda: found.script.targets[-1] == 6000)


def test_watchdog_is_what_the_guide_says():
    watchdog = Maestro("motor", options(at_zero="brake")).watchdog
    assert (watchdog.timeout_s, watchdog.action, watchdog.fed_by) == (0.2, "brake", "set-points")


def test_after_a_silence_neutral_goes_first_and_a_set_point_is_refused():
    with peer() as found:
        device = opened(found)
        device.command(0.0)
        device.command(24.0)
        threading.Event().wait(0.25)
        with pytest.raises(
            LinkError, match=r"longer than the watchdog of 0\.2 s: neutral was sent in the place of 24 V"
        ):
            device.command(24.0)
        wait_until(lambda: found.script.targets[-1] == 6000)
        device.command(12.0)
        wait_until(lambda: found.script.targets[-1] > 6000)
        device.close()


@pytest.mark.parametrize(
    ("made", "sentence"),
    [
        ({"deaf": True}, r"no Maestro answers .* \(compact protocol, CRC off\).*USB Dual Port"),
        (
            {"timeout": 0.0},
            r"did not come in 0\.30 s .*off as delivered.*Set it to 0\.2 s in the Maestro Control Center",
        ),
        ({"timeout": 0.5}, r"did not come in 0\.30 s"),
        ({"timeout": 0.03}, r"comes within 0\.12 s, the bench file says 0\.2 s"),
        ({"home": 0}, r"gives no pulses on channel 0, not neutral: set On startup or error .* Go to 1500 us"),
        ({"home": None}, r"gives 1500\.25 us on channel 0, not neutral"),
        ({"home": 7600}, r"gives 1900 us on channel 0, not neutral"),
    ],
)
def test_what_is_refused_at_opening(made, sentence):
    with peer(**made) as found:
        device = Maestro("motor", options(found.port))
        with pytest.raises(DeviceError, match=sentence):
            device.open()
        assert not device.health().alive
        assert set(found.script.targets) <= {6000, 6001}


@pytest.mark.parametrize("bit", [0, 3, 4, 5, 6])
def test_an_error_that_is_not_of_a_silence_is_a_fault(bit):
    with peer() as found:
        device = opened(found)
        drive(device, 12.0)
        assert device.health().alive
        found.script.errors = 1 << bit
        wait_until(lambda: drive(device, 12.0) is not None and not device.health().alive)
        assert "has stopped the motor for it" in device.health().error
        device.close()


def test_another_pulse_than_commanded_is_a_fault():
    with peer() as found:
        device = opened(found)
        found.script.clip = 6400
        drive(device, 4.0)
        assert device.health().alive
        drive(device, 24.0, 0.4)
        assert "sends a pulse of 1600 us, where 1712.5 us were commanded" in device.health().error
        device.close()


def test_no_answers_are_a_fault():
    with peer() as found:
        device = opened(found)
        found.script.deaf = True
        drive(device, 12.0, 0.8)
        assert "does not answer any more" in device.health().error
        device.close()


def test_a_byte_too_many_costs_a_row():
    with peer() as found:
        device = opened(found)
        found.send(b"\x07")
        wait_until(lambda: device.drain() is not None and device.health().bad == 1)
        rows = drive(device, 0.0, 0.4)
        assert rows[-1].values == (pytest.approx(1500e-6), 0.0)
        assert device.health().alive
        device.close()


def test_a_pulled_cable():
    with peer() as found:
        device = opened(found)
        found.unplug()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        with pytest.raises(LinkError):
            device.command(0.0)
        device.close()
        device.close()
