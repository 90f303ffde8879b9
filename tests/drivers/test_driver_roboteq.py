"""Roboteq on a serial port: golden lines, rows from rounds of answers, and the driver against a scripted controller."""

from __future__ import annotations

import threading
import time
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError, LinkError
from drivers.roboteq.controller import Roboteq
from drivers.roboteq.lines import (
    FAULTS,
    Accepted,
    Answer,
    Decoder,
    Echo,
    Refused,
    Text,
    Unreadable,
    decode,
    encode,
    flags,
    go,
    of_channel,
)
from drivers.roboteq.options import Options
from drivers.roboteq.polling import Round, characters_per_second, motor_queries
from tests.drivers.collecting import FOLDER, collect
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((FOLDER / "roboteq.toml").read_text())
SENSED = {
    b"?FID": b"FID=Roboteq v2.1 HBL1360 03/01/2021", b"?TRN": b"TRN=RCB500:HBL1360", b"~RWD": b"RWD=500",
    b"~MMOD 1": b"MMOD=0", b"~BPOL 1": b"BPOL=7", b"?FF": b"FF=0", b"?FM 1": b"FM=0", b"?FS": b"FS=1", b"?T 2": b"T=31",
    b"?BA 1": b"BA=12", b"?M 1": b"M=0", b"?BS 1": b"BS=-600", b"?A 1": b"A=34", b"?P 1": b"P=-250", b"?V 2": b"V=482",
}  # fmt: skip


def options(port="p", **changed):
    given_ones = {"nominal_bus_voltage": 48.0, "watchdog_timeout": 0.5, "rotation": "brushless", "timeout": 0.3}
    return Options(port, **(given_ones | changed))


def controller(*, echo=False, **answers):
    """A controller that says what a table has; `FF=b"FF=8"` changes an answer, None takes it away."""
    table = dict(SENSED)
    for name, answer in answers.items():
        (query,) = [query for query in table if query[1:].split()[0].decode() == name]
        table[query] = answer

    def script(peer, request):
        said = b"+" if request[:1] in (b"!", b"^") else table.get(request, b"-")
        peer.send((request + b"\r" if echo else b"") + (said + b"\r" if said is not None else b""))

    peer = Peer(script, terminator=b"\r")
    peer.table = table
    return peer


def opened(peer, **changed):
    device = Roboteq("motor", options(peer.port, **changed))
    device.open()
    return device


# -- lines -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", FRAMES["answer"], ids=lambda case: case["line"])
def test_answers(case):
    assert decode(case["line"].encode()) == Answer(case["name"], tuple(case["values"]))


@pytest.mark.parametrize("case", FRAMES["command"], ids=lambda case: case["text"])
def test_commands(case):
    assert encode(case["text"]) == bytes.fromhex(case["hex"])


def test_go_is_a_command_in_thousandths():
    assert go(1, 250) == bytes.fromhex(FRAMES["command"][0]["hex"])
    for per_mille in (1001, -1001):
        with pytest.raises(ValueError, match="-1000 to 1000"):
            go(1, per_mille)
    for wrong in ("", "G 1 2", "!G 1 2\r", "!G_1", "!Gö"):
        with pytest.raises(ValueError, match="begins with one of"):
            encode(wrong)


def test_other_lines():
    assert decode(b"+") == Accepted()
    assert decode(b"-") == Refused()
    assert decode(b"TRN=RCB500:HDC2460") == Text("TRN", "RCB500:HDC2460")
    assert decode(b"!G 1 250") == Echo(b"!G 1 250")
    for line in (b"?A 1A=5", b"A=", b"A=1.5", b"a=5", b"A=5:", b"A=12345678901", b"\xff\x00", b"FID=\x01", b"++"):
        assert decode(line) == Unreadable(line)


@given(st.sampled_from(["A", "BS", "FF", "V"]), st.lists(st.integers(-(2**31), 2**31), min_size=1, max_size=4))
def test_numbers_come_back(name, values):
    assert decode(f"{name}={':'.join(map(str, values))}".encode()) == Answer(name, tuple(values))


@given(st.binary(max_size=60))
def test_garbage_is_followed_by_a_good_line(garbage):
    assert Decoder().feed(garbage + b"\rA=5\r")[-1] == Answer("A", (5,))


def test_a_channel_alone_or_among_all():
    assert (of_channel((7,), 2), of_channel((7, 8), 2), of_channel((7, 8), 1)) == (7, 8, 7)
    assert flags(0b11000, FAULTS) == "short circuit, emergency stop"


# -- rounds ----------------------------------------------------------------------------------------------------------


def test_a_round_is_asked_at_its_rate_and_not_twice_at_once():
    asked = Round(motor_queries(1, "brushless"), 50.0, 115200)
    assert asked.request == b"?BS 1\r?A 1\r?P 1\r?V 2\r"
    ms = 1_000_000
    assert asked.begin(1000 * ms)
    assert not asked.begin(1020 * ms), "the answers are not there"
    for name in ("BS", "A", "P"):
        assert asked.take(name, (1,)) is None
    assert asked.take("V", (2,)) == ((1,), (1,), (1,), (2,))
    assert not asked.begin(1010 * ms)
    assert asked.begin(1019 * ms), "a turn that is a little early is in time"
    assert not asked.begin(1042 * ms), "24 ms: 15, and twice 54 characters"
    assert asked.begin(1044 * ms), "answers that never came are given up"


@pytest.mark.parametrize("lost", [0, 1, 2, 3])
def test_a_row_that_lacks_an_answer_is_none(lost):
    asked, names = Round(motor_queries(1, "brushless"), 50.0, 115200), ["BS", "A", "P", "V"]
    asked.begin(0)
    for name in names[:lost] + names[lost + 1 :]:
        assert asked.take(name, (1,)) is None
    whole = [asked.take(name, (2,)) for name in names]
    assert whole == [None, None, None, ((2,), (2,), (2,), (2,))]


def test_what_the_line_has_to_carry():
    # "?BS 1\rBS=-65535\r" 16, "?A 1\rA=-1000\r" 13, "?P 1\rP=-1000\r" 13, "?V 2\rV=1000\r" 12; 50 set-points of 13
    assert characters_per_second(1, "brushless", 1.0, 1e-9) == pytest.approx(54 + 650)
    assert options(baud=115200, rate=150.0).rate == 150.0
    with pytest.raises(ValueError, match=r"answers \d+ characters/s .* 9600 baud carries 960/s: lower a rate"):
        options(baud=9600)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"rotation": "hall"}, "rotation must be brushless, encoder or none"),
        ({"at_zero": "stop"}, "at_zero must be brake or coast"),
        ({"channel": 0}, "channel must be at least 1"),
        ({"pole_pairs": 0}, "pole_pairs must be at least 1"),
        ({"nominal_bus_voltage": 0.0}, "nominal_bus_voltage must be positive"),
        ({"watchdog_timeout": 0.0}, "watchdog_timeout must be 0.001 to 65 s"),
        ({"max_voltage": 50.0}, "at most nominal_bus_voltage"),
        ({"timeout": 0.0}, "timeout must be between"),
        ({"rate": 0.0}, "rate must be"),
        ({"state_rate": 51.0}, "at most rate"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


# -- the driver ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("echo", [False, True])
def test_rows(echo):
    with controller(echo=echo) as peer:
        device = Roboteq("motor", options(peer.port, pole_pairs=7))
        assert device.open() == "RCB500:HBL1360, Roboteq v2.1 HBL1360 03/01/2021"
        assert peer.heard[:2] == [b"!G 1 0", b"!G 1 0"], "zero before anything is asked"
        assert not any(b"!EX" in each for each in peer.heard)
        rows = collect(device, 8)
        motor = [row for row in rows if row.stream == "motor"]
        (state,) = [row for row in rows if row.stream == "motor_state"][:1]
        assert motor[0].values == pytest.approx((-10.0, 3.4, -0.25, -12.05, 48.2))
        assert state.values == (0.0, 0.0, 1.0, 31.0, 1.2, 0.0)
        assert [len(stream.channels) for stream in device.streams] == [5, 6]
        assert device.health().alive
        assert device.health().bad == 0
        device.close()
        wait_until(lambda: peer.heard[-1] == b"!G 1 0")
        assert not device.health().alive


def test_without_a_rate_nothing_is_said_of_it():
    with controller(BS=None) as peer:
        device = opened(peer, rotation="none")
        assert [channel.name for channel in device.streams[0].channels][:2] == ["current", "power"]
        (row, *_) = [row for row in collect(device, 3) if row.stream == "motor"]
        assert row.values == pytest.approx((3.4, -0.25, -12.05, 48.2))
        assert b"?BS 1" not in peer.heard
        device.close()


def test_set_points_and_release():
    with controller() as peer:
        device = opened(peer, max_voltage=24.0)
        assert device.max_voltage == 24.0
        told = len(peer.heard)
        device.command(0.0)
        device.command(12.0)
        device.command(-0.03)
        device.release()
        wait_until(lambda: b"!MS 1" in peer.heard)
        assert [each for each in peer.heard[told:] if each[:1] == b"!"] == [
            b"!G 1 0",
            b"!G 1 250",
            b"!G 1 -1",
            b"!MS 1",
        ]
        for volts in (24.1, float("nan"), float("inf")):
            with pytest.raises(ValueError, match="within"):
                device.command(volts)
        assert peer.heard[-1] == b"!MS 1"
        device.close()


def test_watchdog_is_what_the_manual_says():
    watchdog = Roboteq("motor", options(at_zero="coast")).watchdog
    assert (watchdog.timeout_s, watchdog.action, watchdog.resumes_by_itself) == (0.5, "coast", True)
    assert watchdog.fed_by == "! commands"


def test_after_a_silence_zero_goes_first_and_a_set_point_is_refused():
    with controller(RWD=b"RWD=60") as peer:
        device = opened(peer, watchdog_timeout=0.06)
        device.command(0.0)
        device.command(24.0)
        threading.Event().wait(0.07)
        with pytest.raises(LinkError, match=r"longer than the watchdog of 0\.06 s.*0 V was sent in the place of 24 V"):
            device.command(24.0)
        device.command(0.0)
        device.command(12.0)
        wait_until(lambda: peer.heard[-1] == b"!G 1 250")
        commands = [each for each in peer.heard if each[:2] == b"!G"]
        assert commands[-4:] == [b"!G 1 500", b"!G 1 0", b"!G 1 0", b"!G 1 250"]
        device.close()


@pytest.mark.parametrize(
    ("answers", "changed", "sentence"),
    [
        ({"FID": None}, {}, r"no Roboteq controller answers .* came nothing\): check port, baud and power"),
        ({"RWD": b"RWD=0"}, {}, r"watchdog is switched off \(RWD = 0\).*set '\^RWD 500'"),
        ({"RWD": b"RWD=1000"}, {}, r"watchdog is 1000 ms \(RWD\), the bench file says 500 ms"),
        ({"RWD": b"-"}, {}, "does not answer '~RWD'"),
        ({"MMOD": b"MMOD=1"}, {}, r"in mode 1 \(MMOD\), which closes a loop"),
        ({"BPOL": b"BPOL=4"}, {"pole_pairs": 7}, "BPOL = 4, the bench file says pole_pairs = 7"),
        ({"FF": b"FF=20"}, {}, "motor reports undervoltage, emergency stop: clear its cause"),
        ({"FM": b"FM=2"}, {}, "motor reports stall detected"),
        ({"FS": b"FS=4"}, {}, "motor reports commanded by an analogue input"),
        ({"BS": b"-"}, {}, r"does not answer '\?BS 1' within 0\.3 s \(it answers others\)"),
        ({"T": None}, {}, r"does not answer '\?T 2'"),
    ],
)
def test_what_is_refused_at_opening(answers, changed, sentence):
    with controller(**answers) as peer:
        device = Roboteq("motor", options(peer.port, **changed))
        with pytest.raises(DeviceError, match=sentence):
            device.open()
        assert not device.health().alive
        drives = [each for each in peer.heard if each[:2] == b"!G"]
        assert drives
        assert set(drives) == {b"!G 1 0"}


def test_a_channel_that_is_not_there():
    def script(peer, request):
        peer.send(SENSED.get(request, b"-" if request[:2] == b"!G" else b"+") + b"\r")

    with (
        Peer(script, terminator=b"\r") as peer,
        pytest.raises(DeviceError, match=r"does not accept '!G 1 0' \(came Refused"),
    ):
        Roboteq("motor", options(peer.port)).open()


@pytest.mark.parametrize(
    ("name", "answer", "word"),
    [(b"?FF", b"FF=8", "short circuit"), (b"?FM 1", b"FM=64", "amps trigger"), (b"?FS", b"FS=9", "power stage off")],
)
def test_a_flag_is_the_fault_of_the_link_until_it_is_gone(name, answer, word):
    with controller() as peer:
        device = opened(peer)
        good, peer.table[name] = peer.table[name], answer
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        assert device.health().error == f"motor reports {word}: clear its cause, then open again"
        peer.table[name] = good
        wait_until(lambda: device.drain() is not None and device.health().alive)
        device.close()


def test_commands_that_are_refused_are_a_fault_and_one_is_none():
    refusing = threading.Event()

    def script(peer, request):
        refused = refusing.is_set() and request[:1] == b"!"
        peer.send((b"-" if refused else SENSED.get(request, b"+")) + b"\r")

    with Peer(script, terminator=b"\r") as peer:
        device = opened(peer)
        refusing.set()
        device.command(0.0)
        wait_until(lambda: device.drain() is not None and device.health().bad == 1)
        assert device.health().alive
        for _ in range(2):
            device.command(0.0)
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        assert "refuses its commands" in device.health().error
        device.close()


def test_spoilt_lines_are_counted():
    with controller() as peer:
        device = opened(peer)
        peer.send(b"\xff\xfeA=3x\r")
        wait_until(lambda: device.drain() is not None and device.health().bad == 1)
        assert "A=3x" in device.health().first_bad[0]
        assert len([row for row in collect(device, 5) if row.stream == "motor"]) >= 4
        device.close()


def test_a_pulled_cable():
    with controller() as peer:
        device = opened(peer)
        peer.unplug()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        assert "cable and power" in device.health().error
        with pytest.raises(LinkError):
            device.command(0.0)
        device.close()
        device.close()


def test_polling_is_no_faster_than_its_rate():
    with controller() as peer:
        device = opened(peer, rate=50.0, state_rate=5.0)
        peer.heard.clear()
        begun = time.monotonic()
        while time.monotonic() - begun < 0.5:
            device.drain()
            threading.Event().wait(0.002)
        device.close()
        assert 15 <= sum(each == b"?BS 1" for each in peer.heard) <= 27
        assert 2 <= sum(each == b"?FF" for each in peer.heard) <= 4
