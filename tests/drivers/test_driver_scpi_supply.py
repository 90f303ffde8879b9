"""SCPI supply: golden lines, and the driver against a scripted supply on a pty."""

from __future__ import annotations

import math
import random
import threading
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError, LinkError
from drivers.protocols import OneWay
from drivers.scpi.lines import encode, error, number, setting
from drivers.scpi.options import Options
from drivers.scpi.supply import ScpiSupply
from tests.drivers.collecting import FOLDER, quiet
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((FOLDER / "scpi.toml").read_text())
STOPPED = [b"VOLT 0", b"OUTP OFF"]


def options(port="p", **changed):
    defaults = {"max_voltage": 24.0, "current_limit": 5.0, "watchdog_timeout": 0.5, "baud": 115200, "timeout": 0.3}
    return Options(port, **{**defaults, "rate": 50.0, "command_rate": 100.0, **changed})


def supply(**answers):
    """Settings are read back as they were set; `answers`: what is said to a question in their place."""
    table = {
        "*IDN?": "MAKER,PSU,1,1.0", "SYST:ERR?": '0,"No error"', "MEAS:VOLT?": "12.01", "MEAS:CURR?": "1.50",
    } | {key.replace("_", ":") + "?": value for key, value in answers.items()}  # fmt: skip
    kept = {}

    def script(peer, request):
        header, _, value = request.decode().partition(" ")
        if not header.endswith("?"):
            kept[header] = value
        answer = peer.table.get(header, kept.get(header[:-1]) if header.endswith("?") else None)
        if answer is not None:
            peer.send(f"{answer}\r\n".encode())

    peer = Peer(script)
    peer.table = table
    return peer


def opened(peer, **changed):
    device = ScpiSupply("motor", options(peer.port, **changed))
    device.open()
    peer.heard.clear()
    return device


def turned(device, volts, until):
    """Commands and drains as the loop does, until the condition holds; the rows."""
    rows = []

    def turn():
        device.command(volts)
        rows.extend(device.drain())
        return until(rows)

    wait_until(turn)
    return rows


@pytest.mark.parametrize("case", FRAMES["number"], ids=lambda case: case["line"])
def test_numbers(case):
    assert number(case["line"]) == case["value"]


@pytest.mark.parametrize("case", FRAMES["error"], ids=lambda case: case["line"])
def test_errors(case):
    assert error(case["line"]) == (case["code"], case["text"])


def test_what_is_none():
    for text in ("", "VOLT", "1.2.3", "nan", "1e999", "--1", "\xff"):
        assert number(text) is None
    for text in ("", "no error", "x,y"):
        assert error(text) is None
    for wrong in ("", "VOLT\n", "VOLTÄ", " "):
        with pytest.raises(ValueError, match="printable ASCII"):
            encode(wrong)
    assert encode("VOLT 1") == b"VOLT 1\n"
    assert setting("OUTP:PROT:WDOG ON") == ("OUTP:PROT:WDOG?", 1.0)
    for wrong in ("*RST", "SYST:REM now"):
        with pytest.raises(ValueError, match="a header and a number"):
            setting(wrong)


@given(st.floats(-1e6, 1e6))
def test_numbers_come_back(value):
    assert number(f"{value:+.8E}") == pytest.approx(value, abs=1e-2)


@given(st.text(max_size=40))
def test_any_text_is_taken(text):
    assert number(text) is None or math.isfinite(number(text))
    error(text)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"max_voltage": 0.0}, "max_voltage must be positive"),
        ({"current_limit": math.inf}, "current_limit must be positive"),
        ({"over_voltage": 20.0}, "over_voltage must be above max_voltage"),
        ({"watchdog_timeout": 0.01}, r"watchdog_timeout must be at least two set-points \(0\.02 s\)"),
        ({"watchdog_timeout": None, "watchdog_settings": ("OUTP ON",)}, "watchdog_settings need watchdog_timeout"),
        ({"watchdog_settings": ("*RST",)}, "a header and a number"),
        ({"remote": "SYST:REM\n"}, "printable ASCII"),
        ({"timeout": 0.0}, "timeout must be between"),
        ({"baud": 9600}, r"needs 4\d\d\d characters/s .* more than 9600 baud carries"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


def test_opening_stops_first_and_reads_settings_back():
    with supply() as peer:
        device = ScpiSupply(
            "motor", options(peer.port, over_voltage=30.0, remote="SYST:REM", watchdog_settings=("WDOG:DEL 0.5",))
        )
        assert device.open() == "MAKER,PSU,1,1.0"
        assert peer.heard[:6] == [b"SYST:REM", *STOPPED, *STOPPED, b"*CLS"]
        wanted = [b"CURR 5", b"OUTP OFF", b"VOLT:PROT 30", b"WDOG:DEL 0.5"]
        assert [each for each in peer.heard[6:] if not each.endswith(b"?")] == wanted
        assert not [each for each in peer.heard if each.startswith((b"VOLT ", b"OUTP ")) and each not in STOPPED]
        device.close()
        wait_until(lambda: peer.heard[-2:] == STOPPED)


def test_set_points_rows_and_release():
    with supply() as peer:
        device = opened(peer)
        device.command(0.0)
        wait_until(lambda: peer.heard[:2] == STOPPED)
        rows = turned(device, 12.0, lambda rows: len(rows) >= 3)
        assert rows[-1].values == (12.01, 1.5)
        sent = [each for each in peer.heard[2:] if not each.endswith(b"?")]
        assert sent[:3] == [b"VOLT 0", b"OUTP ON", b"VOLT 12"]
        assert set(sent[3:]) <= {b"VOLT 12"}
        device.command(0.0)
        wait_until(lambda: b"VOLT 0" in peer.heard[-2:])
        device.release()
        wait_until(lambda: peer.heard[-1] == b"OUTP OFF")
        assert (device.health().alive, device.health().bad) == (True, 0)
        device.close()


def test_a_same_set_point_is_sent_no_faster_than_its_rate():
    with supply() as peer:
        device = opened(peer, command_rate=5.0, watchdog_timeout=2.0)
        device.command(0.0)
        for _ in range(60):
            device.command(12.0)
            threading.Event().wait(0.005)
        assert sum(each == b"VOLT 12" for each in peer.heard) <= 4
        device.command(0.0)
        wait_until(lambda: b"VOLT 0" in peer.heard[-2:], 0.1)
        device.close()


class InTime:
    """A wire on which nothing is heard, with a clock that is set by hand."""

    def __init__(self):
        self.t_ns, self.said = 10**9, []

    def now(self):
        return self.t_ns * 1e-9

    def wait(self, seconds):
        self.t_ns += round(seconds * 1e9)

    def connect(self, arrived):
        self.arrived = arrived

    def disconnect(self):
        self.arrived = None

    def write(self, data):
        self.said += [(self.t_ns, line) for line in data.split(b"\n") if line.startswith(b"VOLT ")]


def ramp(command_rate, loop_rate, late):
    """Ticks of a ramp, each `late()` s late: the level of each, what is held after it, and what went out."""
    wire = InTime()
    device = ScpiSupply("motor", options(command_rate=command_rate, timeout=60.0), wire)
    device._port.open()
    device.command(0.0)
    began, ticks = wire.t_ns, []
    for k in range(1, 401):
        wire.t_ns = began + round((k / loop_rate + late()) * 1e9)
        device.command(0.05 * k)
        ticks.append((0.05 * k, device.holds))
    return ticks, [(t, float(line[5:])) for t, line in wire.said]


def test_a_loop_of_the_same_rate_that_is_never_quite_punctual_has_each_set_point_sent():
    scatter = random.Random(3)
    ticks, _ = ramp(50.0, 50.0, lambda: scatter.uniform(0.0, 0.004))
    assert [held for _, held in ticks] == pytest.approx([volts for volts, _ in ticks])


@pytest.mark.parametrize(("command_rate", "loop_rate"), [(20.0, 50.0), (50.0, 100.0), (30.0, 50.0)])
def test_what_is_held_is_what_went_out_and_no_more_goes_out_than_its_rate(command_rate, loop_rate):
    scatter = random.Random(4)
    ticks, said = ramp(command_rate, loop_rate, lambda: scatter.uniform(0.0, 0.001))
    assert said[-1][1] == pytest.approx(ticks[-1][1])
    assert {round(held, 6) for _, held in ticks} <= {volts for _, volts in said}
    assert any(held != pytest.approx(volts) for volts, held in ticks)
    span = (said[-1][0] - said[2][0]) * 1e-9
    assert len(said) - 3 <= command_rate * span + 1
    assert len(said) - 3 >= 0.8 * command_rate * span


def test_nothing_is_asked_while_nothing_is_commanded():
    with supply() as peer:
        device = opened(peer)
        device.command(0.0)
        wait_until(lambda: peer.heard and peer.heard[-1].endswith(b"?"))
        for _ in range(20):
            device.drain()
            threading.Event().wait(0.005)
        heard = len(peer.heard)
        for _ in range(20):
            device.drain()
            threading.Event().wait(0.005)
        assert len(peer.heard) == heard, "a watchdog must be able to end"
        device.close()


def test_what_is_no_set_point():
    with supply() as peer:
        device = opened(peer)
        assert isinstance(device, OneWay)
        assert (device.min_voltage, device.max_voltage) == (0.0, 24.0)
        for volts in (24.1, -24.1, math.nan, math.inf):
            with pytest.raises(ValueError, match="within 0 and 24 V"):
                device.command(volts)
        assert peer.heard == []
        with pytest.raises(LinkError, match="gives no negative voltage, and -1 V were commanded: 0 V was sent"):
            device.command(-1.0)
        wait_until(lambda: peer.heard[:2] == STOPPED)
        device.close()


def test_the_first_word_is_zero_and_after_a_silence_again():
    with supply() as peer:
        device = opened(peer, watchdog_timeout=0.05, protection_clear="OUTP:PROT:CLE")
        with pytest.raises(LinkError, match="command 0 V before 5 V: 0 V was sent"):
            device.command(5.0)
        wait_until(lambda: peer.heard[:3] == [*STOPPED, b"OUTP:PROT:CLE"])
        device.command(5.0)
        threading.Event().wait(0.06)
        with pytest.raises(LinkError, match="longer than its watchdog"):
            device.command(5.0)
        wait_until(lambda: peer.heard[-3:] == [*STOPPED, b"OUTP:PROT:CLE"])
        device.close()


def test_the_watchdog_is_what_the_bench_says():
    assert ScpiSupply("m", options(watchdog_timeout=None)).watchdog.timeout_s is None
    watchdog = ScpiSupply("m", options()).watchdog
    assert (watchdog.timeout_s, watchdog.action, watchdog.resumes_by_itself) == (0.5, "coast", False)


@pytest.mark.parametrize(
    ("question", "answer", "sentence"),
    [
        ("SYST:ERR?", '-240,"Hardware error"', r"motor reports error -240 \(Hardware error\): clear its cause"),
        ("OUTP?", "0", "has switched its output off"),
        ("MEAS:VOLT?", "0.02", r"gives 0\.02 V, where 12 V were commanded \(a protection that has switched"),
    ],
)
def test_trouble_is_a_fault(question, answer, sentence):
    with supply() as peer:
        device = opened(peer)
        device.command(0.0)
        peer.table[question] = answer
        with pytest.raises(AssertionError, match=sentence):
            turned(device, 12.0, lambda _: _alive(device))
        device.close()


def _alive(device):
    assert device.health().error is None, device.health().error
    return False


def test_answers_that_never_come_are_told():
    with supply() as peer:
        device = opened(peer, timeout=0.03)
        device.command(0.0)
        del peer.table["MEAS:CURR?"], peer.table["MEAS:VOLT?"]
        with pytest.raises(AssertionError, match="does not answer any more"):
            turned(device, 12.0, lambda _: _alive(device))
        assert "no answer to MEAS:VOLT?" in device.health().first_bad
        device.close()


@pytest.mark.parametrize(
    ("answers", "sentence"),
    [
        ({"*IDN": "hello"}, r"no SCPI supply answers on .* 115200 baud 8N1 \('\*IDN\?' expected .*, came 'hello'\)"),
        ({"CURR": "4.0"}, r"was told 'CURR 5' and answers '4\.0' to 'CURR\?'"),
        ({"OUTP": "1"}, r"was told 'OUTP OFF' and answers '1'"),
        ({"SYST_ERR": '-113,"Undefined header"'}, r"'SYST:ERR\?' expected 0, came \(-113, 'Undefined header'\)"),
        ({"MEAS_VOLT": "?"}, r"'MEAS:VOLT\?' expected a number, came '\?'"),
    ],
)
def test_what_is_refused_at_opening(answers, sentence):
    with supply(**answers) as peer:
        device = ScpiSupply("motor", options(peer.port))
        with pytest.raises(DeviceError, match=sentence):
            device.open()
        assert not device.health().alive


def test_a_pulled_cable_and_silence():
    with supply() as peer:
        device = opened(peer)
        peer.unplug()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        with pytest.raises(LinkError):
            device.command(0.0)
        device.close()
        device.close()
    with Peer(quiet) as peer, pytest.raises(DeviceError, match="came None"):
        ScpiSupply("motor", options(peer.port, timeout=0.05)).open()
