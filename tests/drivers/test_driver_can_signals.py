"""Signals of a DBC file as channels: maps, cantools as the codec, and the driver on python-can's virtual bus."""

from __future__ import annotations

import json
import math
import struct
import sys
import threading

import can
import pytest

from drivers.can_signals import signal_map
from drivers.can_signals.signal_map import load_signals
from drivers.can_signals.signals import CanSignals, Options
from drivers.errors import DeviceError
from drivers.ports.can_bus import CanBus
from tests.drivers.scripted_peer import wait_until

pytest.importorskip("cantools", reason="cantools is not installed (pip install -e .[dbc])")
DBC = """VERSION ""

NS_ :

BS_:

BU_: CELL

BO_ 2147484672 TORQUE: 8 CELL
 SG_ torque : 0|32@1- (0.001,0) [-100|100] "N.m" CELL
 SG_ temperature : 32|16@1- (0.1,-40) [0|0] "degC" CELL
 SG_ which M : 48|8@1+ (1,0) [0|3] "" CELL

BO_ 256 SAFETY: 2 CELL
 SG_ contact : 8|1@1+ (1,0) [0|1] "" CELL

BO_ 257 MIXED: 3 CELL
 SG_ page M : 0|8@1+ (1,0) [0|3] "" CELL
 SG_ low m0 : 8|16@1- (1,0) [0|0] "" CELL
 SG_ high m1 : 8|16@1- (1,0) [0|0] "" CELL

CM_ SG_ 2147484672 torque "of the shaft";
"""
MAP = """
title = "Torque cell"
source = "made up for this test"
dbc = "cell.dbc"
[rates]
TORQUE = 100.0
SAFETY = 50.0
[channels.torque]
signal = "TORQUE.torque"
unit = "N.m"
quantity = "torque"
scale = -1.0
range_max = 20.0
[channels.cell_temperature]
signal = "TORQUE.temperature"
unit = "degC"
absent = [32767]
[channels.emergency_stop]
signal = "SAFETY.contact"
unit = "1"
quantity = "emergency_stop"
scale = -1.0
offset = 1.0
"""
TORQUE, SAFETY, MIXED = 0x400, 0x100, 0x101


@pytest.fixture
def written(tmp_path):
    def write(text=MAP, dbc=DBC):
        (tmp_path / "cell.dbc").write_text(dbc, encoding="utf-8")
        (tmp_path / "cell.toml").write_text(text, encoding="utf-8")
        load_signals.cache_clear()
        return str(tmp_path / "cell.toml")

    return write


class Sender:
    """Somebody else on the virtual bus; sends its frames again and again until it is told to stop."""

    def __init__(self, channel):
        self.frames = {}
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

    def _run(self):
        while not self._stop.wait(0.002):
            for (identifier, extended), data in list(self.frames.items()):
                self._bus.send(can.Message(arbitration_id=identifier, is_extended_id=extended, data=data))


@pytest.fixture
def sender(request):
    with Sender(request.node.name) as sending:
        sending.frames = {
            (TORQUE, True): struct.pack("<ihBx", 12_345, 582, 0),
            (SAFETY, False): b"\x00\x01",
        }
        yield sending


@pytest.fixture
def bus(request):
    bus = CanBus("virtual", request.node.name, 500_000)
    bus.open()
    yield bus
    bus.close()


def rows(device, count):
    samples = []
    wait_until(lambda: len(samples.extend(device.drain()) or samples) >= count)
    return samples


def silent(device, seconds):
    device.drain()
    threading.Event().wait(seconds)
    return device.drain() == []


# -- maps ------------------------------------------------------------------------------------------------------------


def test_streams(written):
    bus = CanBus("virtual", "x", 1)
    first, second = CanSignals("cell", Options("b", written(), delay=0.01), bus).streams
    assert (first.name, second.name) == ("cell", "cell_safety")
    assert (first.period_s, second.period_s) == (0.01, 0.02)
    torque, temperature = first.channels
    assert (torque.quantity, torque.unit, torque.quantum, torque.range_max) == ("torque", "N.m", 0.001, 20.0)
    assert (torque.description, torque.delay) == ("of the shaft", 0.01)
    assert json.loads(torque.calibration)["unit_of_dbc"] == "N.m"
    assert (temperature.name, temperature.quantum) == ("cell_temperature", pytest.approx(0.1))


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('dbc = "cell.dbc"', 'dbc = "none.dbc"', r"dbc .*none\.dbc cannot be read \(No such file or directory\)"),
        ("TORQUE.torque", "TORK.torque", "the DBC file has no message 'TORK', but TORQUE, SAFETY, MIXED"),
        ("TORQUE.torque", "TORQUE.tork", r"signal must be MESSAGE\.SIGNAL; TORQUE has torque, temperature, which"),
        ("TORQUE = 100.0", "TORQUE = 0.0", r"rates\.TORQUE must be its frames/s, up to 10000, not 0"),
        ("SAFETY = 50.0", "", r"rates\.SAFETY must be its frames/s"),
        ("SAFETY = 50.0", "SAFETY = 50.0\nMIXED = 1.0", "rates has MIXED, of which no channel is"),
        ("scale = -1.0\nrange", "scale = 0.0\nrange", "scale must be finite and not 0"),
        ("[channels.torque]", '[channels."a b"]', "letters, digits and _ alone"),
        ('title = "Torque cell"', "", "title: Field required"),
        ("[rates]", "[rates", "is not TOML"),
    ],
)
def test_maps_that_are_none(written, old, new, sentence):
    assert old in MAP
    with pytest.raises(ValueError, match=rf"can_signals map .*cell\.toml.*{sentence}"):
        Options("b", written(MAP.replace(old, new)))


def test_other_files_that_are_none(written, tmp_path):
    with pytest.raises(ValueError, match="is no DBC file"):
        Options("b", written(dbc="BO_ what"))
    with pytest.raises(ValueError, match=r"map must be the path of a \.toml file, not 'cell\.dbc'"):
        Options("b", "cell.dbc")
    with pytest.raises(ValueError, match="cannot be read"):
        Options("b", str(tmp_path / "none.toml"))
    with pytest.raises(ValueError, match="delay must be"):
        Options("b", written(), delay=-1.0)


def test_without_the_extra_the_sentence_names_it(written, monkeypatch):
    path = written()
    monkeypatch.setitem(sys.modules, "cantools.database", None)
    monkeypatch.setitem(sys.modules, "cantools", None)
    with pytest.raises(ValueError, match=r"needs the Python package cantools.*pip install 'thruster-rig\[dbc\]'"):
        Options("b", path)
    assert "thruster-rig[dbc]" in signal_map.MISSING_EXTRA


# -- the driver ------------------------------------------------------------------------------------------------------


def test_rows(written, bus, sender):
    device = CanSignals("cell", Options("b", written()), bus)
    assert device.open() == "Torque cell: TORQUE, SAFETY on b"
    values = {row.stream: row.values for row in rows(device, 6)}
    assert values == {"cell": pytest.approx((-12.345, 18.2)), "cell_safety": (0.0,)}
    assert (device.health().alive, device.health().bad) == (True, 0)
    sender.frames[(SAFETY, False)] = b"\xff\xfe"
    wait_until(lambda: any(row == ("cell_safety", row.t_ns, (1.0,)) for row in device.drain()))
    sender.frames[(TORQUE, True)] = struct.pack("<ihBx", 0, 32767, 0)
    wait_until(lambda: any(row.stream == "cell" and math.isnan(row.values[1]) for row in device.drain()))
    device.close()
    assert not device.health().alive


def test_a_standard_and_an_extended_identifier_are_two(written, bus, sender):
    device = CanSignals("cell", Options("b", written()), bus)
    device.open()
    sender.frames = {(TORQUE, False): bytes(8)}
    rows(device, 1)
    wait_until(lambda: silent(device, 0.05))
    assert silent(device, 0.025)
    device.close()


def test_short_frames_are_counted_and_no_row(written, bus, sender):
    device = CanSignals("cell", Options("b", written()), bus)
    device.open()
    sender.frames[(TORQUE, True)] = bytes(3)
    wait_until(lambda: device.drain() is not None and device.health().bad >= 1)
    assert device.health().first_bad[0].startswith("00000400#")
    device.close()


def test_a_page_of_a_multiplexed_message(written, bus, sender):
    mixed = MAP[: MAP.index("[rates]")] + '[rates]\nMIXED = 10.0\n[channels.high]\nsignal = "MIXED.high"\nunit = "1"\n'
    sender.frames[(MIXED, False)] = struct.pack("<Bh", 0, 11)
    path = written(mixed)
    device = CanSignals("cell", Options("b", path), bus)
    with pytest.raises(DeviceError, match=r"no frame of MIXED \(id 101\) with high came within 1 s"):
        device.open()
    sender.frames[(MIXED, False)] = struct.pack("<Bh", 1, -12)
    device.open()
    assert rows(device, 1)[-1].values == (-12.0,)
    sender.frames[(MIXED, False)] = struct.pack("<Bh", 3, 1)
    wait_until(lambda: device.drain() == [])
    assert device.health().bad == 0, "another page is no error"
    device.close()


def test_a_message_that_does_not_come(written, bus, sender):
    del sender.frames[(TORQUE, True)]
    device = CanSignals("cell", Options("b", written()), bus)
    with pytest.raises(DeviceError, match=r"no frame of TORQUE \(id 400, 29 bits\) with torque, temperature came"):
        device.open()
    assert not device.health().alive
    device.close()
    device.close()
