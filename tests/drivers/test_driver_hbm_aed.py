"""HBM AED: golden lines and frames, bytes lost in the middle of a stream, and the driver against a scripted peer."""

from __future__ import annotations

import json
import math
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError, LinkError
from drivers.hbm.aed import HbmAed
from drivers.hbm.frames import Answer, Decoder, Unreadable, Value, decode_frame, decode_line, encode, flags
from drivers.hbm.options import Options
from tests.drivers.collecting import FOLDER, collect, quiet
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((FOLDER / "hbm_aed.toml").read_text())
IDENTITY = b'HBM, "AED104","1234", P20'
WEIGHT = bytes.fromhex("00 30 39 08 0d 0a")


def options(port="p", **changed):
    return Options(
        port,
        **{"rate": 25.0, "top_rate": 100.0, "nominal_force": 500.0, "baud": 38400, "timeout": 0.3} | changed,
    )


class Electronics:
    """Settings from a table; `answers` override what is said to a command. Streams `streaming` while it streams."""

    def __init__(self, streaming=WEIGHT, **answers):
        self.set = {"COF": 9, "TEX": 172, "CSM": 0, "ICR": 2, "FMD": 0, "ASF": 5, "NOV": 0}
        self.answers = {name.encode(): answer for name, answer in answers.items()}
        self.streaming = streaming

    def __call__(self, peer, request):
        if request == b"STP":
            peer.streaming = None
        elif request == b"MSV?0":
            peer.streaming = self.streaming
        elif peer.streaming is None and request and not request.startswith(b"S3"):
            said = self.answers.get(request, self.said(request.decode()))
            if said is not None:
                peer.send(said + b"\r\n")

    def said(self, request):
        if request == "IDN?":
            return IDENTITY
        if request == "TAR":
            return b"0"
        name, value = request[:3], request[3:]
        if name not in self.set:
            return b"?"
        if value == "?":
            return b"%02d" % self.set[name]
        self.set[name] = int(value)
        return b"0"


def electronics(**answers):
    return Peer(Electronics(**answers), terminator=b";")


def opened(peer, **changed):
    device = HbmAed("cell", options(peer.port, **changed))
    device.open()
    return device


# -- lines and frames ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", FRAMES["value"], ids=lambda case: case["line"])
def test_values_in_text(case):
    assert decode_line(case["line"].encode()) == Value(case["digits"], case["status"])


@pytest.mark.parametrize("case", FRAMES["answer"], ids=lambda case: case["line"])
def test_answers(case):
    assert decode_line(case["line"].encode()) == Answer(case["line"])


@pytest.mark.parametrize("case", FRAMES["frame"], ids=lambda case: case["hex"])
def test_frames(case):
    frame = bytes.fromhex(case["hex"])
    assert decode_frame(frame) == Value(case["digits"], case["status"])
    decoder = Decoder()
    decoder.begin_binary()
    assert decoder.feed(3 * frame) == 3 * [Value(case["digits"], case["status"])]


@pytest.mark.parametrize("case", FRAMES["command"], ids=lambda case: case["text"])
def test_commands(case):
    assert encode(case["text"]) == bytes.fromhex(case["hex"])


def test_what_is_no_command_and_no_line():
    for wrong in ("", "MSV?;", "MSV\n", "MSÜ"):
        with pytest.raises(ValueError, match="printable ASCII"):
            encode(wrong)
    for line in (b"\xff\x00", b"1,2,300", b"   "):
        assert decode_line(line) == Unreadable(line)


def test_which_status_makes_a_value_none():
    assert [bit for bit in range(8) if not Value(0, 1 << bit).valid] == [0, 1, 2, 6, 7]
    assert flags(0b11000101) == "net overflow, converter overdriven, values not coherent"


def frame(digits, status=0):
    return digits.to_bytes(3, "big", signed=True) + bytes((status,)) + b"\r\n"


@given(st.lists(st.integers(-(2**23), 2**23 - 1), min_size=1, max_size=20), st.lists(st.integers(1, 13), max_size=9))
def test_values_come_back_in_whatever_portions(values, cuts):
    data, records, decoder = b"".join(map(frame, values)), [], Decoder()
    decoder.begin_binary()
    for size in cuts:
        records += decoder.feed(data[:size])
        data = data[size:]
    assert records + decoder.feed(data) == [Value(value, 0) for value in values]


@given(st.binary(max_size=60))
def test_text_garbage_is_followed_by_a_good_line(garbage):
    assert Decoder().feed(garbage + b"\r\n-123456,12,000\r\n")[-1] == Value(-123456, 0)


@given(st.integers(0, 100), st.integers(1, 30), st.lists(st.integers(-99999, 99999), min_size=30, max_size=30))
def test_after_lost_bytes_no_value_is_invented(at, lost, values):
    data = b"".join(map(frame, values))
    decoder = Decoder()
    decoder.begin_binary()
    records = decoder.feed(data[:at] + data[at + lost :])
    found = [record.digits for record in records if isinstance(record, Value)]
    good, spoilt = found[: at // 6], found[at // 6 :]
    assert good == values[: at // 6]
    first = (at + lost + 5) // 6
    assert spoilt[1:] == values[len(values) - len(spoilt) + 1 :] or not spoilt[1:]
    assert len(spoilt) >= len(values) - first - 8


@pytest.mark.parametrize("digits", [0x0D0A00, 0x000D0A, 0x0D0A0D])
def test_a_value_that_looks_like_an_end_is_never_read_out_of_step(digits):
    """Where two places look right, none is believed until the value has moved."""
    decoder = Decoder()
    decoder.begin_binary()
    records = decoder.feed(frame(digits)[3:] + 30 * frame(digits) + 9 * frame(77))
    values = {record.digits for record in records if isinstance(record, Value)}
    assert 77 in values
    assert values <= {digits, 77}
    assert any(isinstance(record, Unreadable) for record in records)


# -- options ---------------------------------------------------------------------------------------------------------


def test_scale_rate_and_window():
    binary, text = options(), options(format="ascii", sign=-1)
    assert binary.newtons_per_digit == pytest.approx(500 / 5_120_000)
    assert text.newtons_per_digit == pytest.approx(-500 / 1_000_000)
    assert options(nominal_value=50_000).newtons_per_digit == pytest.approx(0.01)
    assert [options(rate=rate).rate_code for rate in (100.0, 50.0, 12.0, 0.78)] == [0, 1, 3, 7]
    (stream,) = HbmAed("cell", binary).streams
    assert stream.channels[0].window == pytest.approx(0.04)
    assert stream.channels[0].delay == pytest.approx(6 * 11 / 38400)
    assert json.loads(stream.channels[0].calibration)["nominal_force"] == 500.0
    (fast,) = HbmAed("cell", options(rate=100.0)).streams
    assert fast.channels[0].window is None


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"rate": 30.0}, r"no rate of 30/s with a top_rate of 100/s, but 100, 50, 25, 12\.5, 6\.25"),
        ({"rate": 600.0, "top_rate": 600.0}, r"38400 baud carries at most 582/s \(6 characters"),
        ({"rate": 100.0, "baud": 9600, "format": "ascii"}, r"9600 baud carries at most 51/s"),
        ({"top_rate": 0.0}, "top_rate must be positive"),
        ({"nominal_force": 0.0}, "nominal_force must be positive and in N"),
        ({"nominal_value": -1}, "nominal_value must be 0 to 8388607"),
        ({"format": "hex"}, "format must be binary or ascii"),
        ({"address": 32}, "address must be 0 to 31"),
        ({"filter_stage": -1}, "filter_stage must be 0 to 99"),
        ({"sign": 0}, "sign must be 1 or -1"),
        ({"timeout": 0.0}, "timeout must be between"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


# -- the driver ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("streaming", [WEIGHT, b"   12345,31,008\r\n"], ids=["binary", "ascii"])
def test_rows(streaming):
    form = "binary" if streaming == WEIGHT else "ascii"
    with electronics(streaming=streaming) as peer:
        device = HbmAed("cell", options(peer.port, format=form))
        assert device.open() == IDENTITY.decode()
        row = collect(device, 3)[-1]
        full = 5_120_000 if form == "binary" else 1_000_000
        assert row.values == pytest.approx((500 * 12345 / full, 1.0, 8.0, 12345.0))
        assert device.health().alive
        assert device.health().bad == 0
        assert len(device.streams[0].channels) == 4
        device.close()
        wait_until(lambda: peer.heard[-1] == b"STP")
        assert not device.health().alive


def test_all_that_is_set_is_read_back():
    with electronics() as peer:
        device = opened(peer, rate=50.0, filter_mode=1, filter_stage=3, address=31)
        wanted = [b"COF8", b"COF?", b"TEX172", b"TEX?", b"CSM0", b"CSM?", b"CSM?", b"ICR1", b"ICR?", b"FMD1", b"FMD?",
                  b"ASF3", b"ASF?", b"NOV?", b"MSV?0"]  # fmt: skip
        assert [each for each in peer.heard if each] == [b"STP", b"S31", b"IDN?", *wanted]
        device.close()


def test_a_stream_of_somebody_else_is_stopped_first():
    with electronics() as peer:
        peer.streaming = bytes.fromhex("00 30 39 08 0d 0a")
        device = opened(peer)
        assert collect(device, 2)[-1].values[3] == 12345.0
        device.close()


def test_electronics_without_checksums():
    script = Electronics()
    del script.set["CSM"]
    with Peer(script, terminator=b";") as peer:
        opened(peer).close()


@pytest.mark.parametrize(
    ("answers", "changed", "sentence"),
    [
        ({"IDN?": None}, {}, r"no HBM electronics answer on .* 38400 baud 8E1 \('IDN\?' expected 'HBM,\.\.\.', came"),
        ({"IDN?": b"SIM 1"}, {"address": 31}, "address 31 .* came 'SIM 1'; 'SIM 1'"),
        ({"COF8": b"?"}, {}, r"does not accept 'COF8' \(came '\?'\)"),
        ({"ICR2": None}, {}, r"does not accept 'ICR2' \(came nothing\)"),
        ({"ICR?": b"03"}, {}, "was set to ICR2 and says ICR3"),
        ({"CSM0": None}, {}, "'CSM0' is not answered"),
        ({"CSM?": b"1"}, {}, "sends a checksum in the place of the status"),
        ({"NOV?": b"+0500000"}, {}, r"500000 digits at nominal load \(NOV\), the bench file says nominal_value = 0"),
        ({"NOV?": b"?"}, {}, r"'NOV\?' expected a number, came '\?'"),
        ({"streaming": b""}, {}, r"sends no value after 'MSV\?0' within"),
    ],
)
def test_what_is_refused_at_opening(answers, changed, sentence):
    with electronics(**answers) as peer:
        device = HbmAed("cell", options(peer.port, **changed))
        with pytest.raises(DeviceError, match=sentence):
            device.open()
        assert not device.health().alive


def test_an_overdriven_converter_is_no_value():
    with electronics(streaming=bytes.fromhex("7f ff ff 04 0d 0a")) as peer:
        device = opened(peer)
        thrust, stable, status, raw = collect(device, 1)[0].values
        assert math.isnan(thrust)
        assert (stable, status, raw) == (0.0, 4.0, 8388607.0)
        device.close()


def test_tare_stops_and_starts_the_stream():
    with electronics() as peer:
        device = opened(peer)
        device.tare()
        assert [each for each in peer.heard if each][-3:] == [b"STP", b"TAR", b"MSV?0"]
        assert collect(device, 1)
        device.close()
    with electronics(TAR=b"?") as peer:
        device = opened(peer)
        with pytest.raises(DeviceError, match=r"'TAR' expected '0', came '\?'"):
            device.tare()
        device.close()


def test_spoilt_bytes_are_counted_and_the_stream_goes_on():
    with electronics() as peer:
        device = opened(peer)
        collect(device, 2)
        peer.send(b"\x00")
        wait_until(lambda: device.drain() is not None and device.health().bad == 1)
        assert collect(device, 2)[-1].values[3] == 12345.0
        device.close()


def test_a_pulled_cable():
    with electronics() as peer:
        device = opened(peer)
        peer.unplug()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        assert "check adapter, cable" in device.health().error
        with pytest.raises(LinkError):
            device.tare()
        device.close()
        device.close()
    with pytest.raises(LinkError):
        HbmAed("cell", options("/dev/does-not-exist")).open()


def test_silence():
    with Peer(quiet) as peer, pytest.raises(DeviceError, match="came nothing"):
        HbmAed("cell", options(peer.port, timeout=0.05)).open()
