"""Two files into one recording: declared, by stamps, from a quantity in both; refused where they share no time."""

import numpy as np
import pytest

from rig.errors import ConfigError, RecordingError
from rig.hdf5 import load
from rig.importing.mapping import build_map
from rig.importing.one_file import Beside, import_file
from rig.importing.timing.two_clocks import offset_asked


def plan_of(quantity, given_in, stream="s", **time):
    channel = {"quantity": quantity, "unit": given_in, "column": "x"}
    text = {"about": "t", "time": {"column": "t", **time}, "streams": {stream: {"channels": {quantity: channel}}}}
    return build_map(text, str(text), "test")


FORCE, VOLTS = plan_of("thrust", "N"), plan_of("command_voltage", "V")


def lines(time, value):
    return "t,x\n" + "".join(f"{t},{v:.6g}\n" for t, v in zip(time, value, strict=True))


def both(tmp_path, first, second, plans=(FORCE, VOLTS), offset="auto"):
    (tmp_path / "a.csv").write_text(first)
    (tmp_path / "b.csv").write_text(second)
    out = tmp_path / "out.h5"
    out.unlink(missing_ok=True)
    summary = import_file(tmp_path / "a.csv", plans[0], out, beside=Beside(tmp_path / "b.csv", plans[1], offset))
    return summary, load(out)


T = np.arange(0.0, 20.0, 0.5)
A, B = lines(T, T), lines(T + 100, np.where(T < 10, 0.0, 5.0))


@pytest.mark.parametrize(("seconds", "thrust", "command"), [(2.5, 0.0, 2.5), (-2.5, 2.5, 0.0)])
def test_a_declared_offset_is_from_first_row_to_first_row(tmp_path, seconds, thrust, command):
    summary, recording = both(tmp_path, A, B, offset=seconds)
    assert recording.first_of("thrust").time[0] == thrust
    assert recording.first_of("command_voltage").time[0] == command
    assert f"clocks: b.csv begins {seconds:+g} s from the first row" in summary.sentences[0]
    assert {channel.stream for channel in recording.channels} == {"s", "s_2"}


def test_stamps_of_one_clock_tell_the_offset(tmp_path):
    summary, recording = both(tmp_path, lines(T + 90.0, T), B, offset="clock")
    assert recording.first_of("command_voltage").time[0] == pytest.approx(10.0)
    assert "+10 s by the time stamps of both files" in summary.sentences[0]
    dated = lines([f"2026-03-01T10:00:{int(t):02d}Z" for t in T[::2]], T[::2])
    with pytest.raises(RecordingError, match="needs times of one clock in both files"):
        both(tmp_path, dated, B, (plan_of("thrust", "N", format="iso"), VOLTS), "clock")


def test_a_quantity_in_both_files_tells_the_offset(tmp_path):
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 80.0, 0.1)
    rate = np.interp(t, np.arange(0, 81, 4.0), rng.uniform(0, 50, 21))
    first = lines(t, rate + rng.normal(0, 0.3, t.size))
    second = lines(1000 * (t[100:] + 55.0), 60 * rate[100:] + rng.normal(0, 20, t.size - 100))
    plans = plan_of("rotation_rate", "rev/s"), plan_of("rotation_rate", "rpm", stream="esc", unit="ms")
    summary, recording = both(tmp_path, first, second, plans)
    assert "estimated from rotation_rate in both" in summary.sentences[0]
    esc = next(channel for channel in recording.channels if channel.stream == "esc")
    assert esc.time[0] == pytest.approx(10.0, abs=0.1)
    assert any("rotation_rate is in both files; that of a.csv stands first" in text for text in summary.sentences)


def test_files_with_nothing_in_common_are_refused_and_leave_nothing(tmp_path):
    with pytest.raises(
        RecordingError, match="no quantity is in both, and no command in one with a thrust in the other"
    ):
        both(tmp_path, A, B, (FORCE, plan_of("current", "A")))
    with pytest.raises(RecordingError, match="share no stretch of time"):
        both(tmp_path, A, B, offset=500.0)
    assert not (tmp_path / "out.h5").exists()


def test_an_offset_is_a_number_or_one_of_two_words():
    assert [offset_asked(text) for text in ("auto", "clock", "3", "-1e-1")] == ["auto", "clock", 3.0, -0.1]
    for text in ("soon", "nan", "inf", ""):
        with pytest.raises(ConfigError, match="expected auto, clock, or the seconds"):
            offset_asked(text)
