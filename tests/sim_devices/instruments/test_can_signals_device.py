"""The simulated CAN device: literal frames, and all that it can do wrong; decoded by cantools as well."""

from math import nan

import pytest

from sim_devices.instruments.can_signals import CanSender, CanSignalsOptions
from sim_devices.wires.can_frame import CanFrame

VALUES = ("0 i32 current 0.001", "4 u16 bus_voltage 0.01", "6 u8 contact 1", "7 i8 water_temperature 1")
WORLD = {"current": -12.345, "bus_voltage": 48.0, "water_temperature": 18.4}


class Bed:
    def __init__(self, values=VALUES, **options):
        self.world = dict(WORLD)
        self.device = CanSender(CanSignalsOptions("can_signals", values, **options), lambda name: self.world[name])

    def data(self, t=0.02):
        (frame,) = self.device.tick(t)
        return frame.data.hex(" ")


def test_literal_frames():
    assert Bed().device.tick(0.019) == []
    assert Bed(id=0x400, extended=True).device.tick(0.02) == [
        CanFrame(0x400, bytes.fromhex("c7 cf ff ff c0 12 01 12"), extended=True)
    ]
    assert Bed(byte_order="big").data() == "ff ff cf c7 12 c0 01 12"
    assert Bed(("0 float32 bus_voltage 1",), length=4).data() == "00 00 40 42"
    assert len(Bed().device.tick(0.1001)) == 5
    assert Bed().device.receive(CanFrame(1), 0.0) == ()


def test_ends():
    bed = Bed()
    bed.world |= {"current": nan, "bus_voltage": 1e9, "water_temperature": -1000.0}
    assert bed.data() == "00 00 00 80 ff ff 01 80"


def test_faults():
    bed = Bed()
    bed.data(0.02)
    bed.device.fault("frozen", 0.02)
    bed.world["current"] = 0.0
    assert bed.data(0.04).startswith("c7 cf")
    bed.device.fault("short", 0.04)
    assert len(bed.data(0.06).split()) == 7
    bed.device.fault("pressed", 0.06)
    assert bed.data(0.08).split()[6] == "00"
    bed.device.fault("silent", 0.08)
    assert bed.device.due == float("inf")
    bed.device.clear(1.0)
    assert bed.device.due == 1.0
    with pytest.raises(ValueError, match="expected one of frozen, silent"):
        bed.device.fault("pulled", 0.0)


def test_cantools_reads_it(third_party_dbc):
    message = third_party_dbc.get_message_by_name("METER")
    frame = Bed().device.tick(0.02)[0]
    assert message.frame_id == frame.id
    assert message.decode(frame.data) == pytest.approx(
        {"current": -12.345, "bus_voltage": 48.0, "contact": 1, "temperature": 18}
    )


@pytest.fixture
def third_party_dbc():
    database = pytest.importorskip("cantools.database", reason="cantools is not installed (pip install -e .[dbc])")
    return database.load_string(
        'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: A\n\nBO_ 256 METER: 8 A\n'
        ' SG_ current : 0|32@1- (0.001,0) [0|0] "A" A\n SG_ bus_voltage : 32|16@1+ (0.01,0) [0|0] "V" A\n'
        ' SG_ contact : 48|8@1+ (1,0) [0|0] "" A\n SG_ temperature : 56|8@1- (1,0) [0|0] "degC" A\n',
        "dbc",
    )


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"values": ("7 u16 current 1",)}, "beyond a frame of 8 bytes"),
        ({"values": ("0 u12 current 1",)}, "byte type channel scale"),
        ({"values": ("0 u16 volts 1",)}, "'volts' is none of"),
        ({"id": 0x800}, "an id of 11 bits"),
        ({"rate": 0.0}, "rate above 0"),
        ({"byte_order": "middle"}, "byte_order must be little or big"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        CanSignalsOptions("can_signals", **{"values": VALUES, **changed})
