"""A recording into the console: snapshots as they would have been, in time; nothing that is asked reaches a motor."""

from __future__ import annotations

import math
import threading

import h5py
import numpy as np
import pytest

from identification.recording import Channel, Event, Recording, Step
from rig.cli import main
from rig.link.front_end_messages import Request, Snapshot
from rig.link.sockets import Peer, pair
from rig.replay.player import play, playing
from rig.replay.recorded import COMMAND, Frames
from tests.rig.console.terminal import on_terminal


def recording(outcome: str = "completed") -> Recording:
    """2 s of tare at 0.75 N, a ramp of 1 s to 6 V, a hold of 3 s at 14.4 N more, back to 0 in 1 s."""
    time = np.arange(0.0, 7.0, 0.02)
    volts = np.interp(time, [2.0, 3.0, 6.0, 7.0], [0.0, 6.0, 6.0, 0.0])
    noise = 0.05 * np.random.default_rng(2).standard_normal(time.size)
    thrust = Channel("thrust", "load_cell", "thrust", "N", time, 0.75 + 0.4 * volts**2 + noise)
    odd = np.arange(0.0, 7.0, 0.25)
    heat = Channel("fet", "state", None, "degC", odd, np.where(odd < 1.0, np.nan, 30.0))
    moves = np.flatnonzero(np.diff(volts, prepend=-1.0))
    command = Channel("command_voltage", "command", COMMAND, "V", time[moves], volts[moves])
    steps = (
        Step(0, "tare", 0.0, 0.0, 2.0), Step(1, "ramp", 6.0, 2.0, 3.0), Step(2, "hold", 6.0, 3.0, 6.0),
        Step(3, "ramp", 0.0, 6.0, 7.0),
    )  # fmt: skip
    events = (Event(-1.0, "info", "before"), Event(2.0, "warning", "a doubt"), Event(6.5, "odd level", "late"))
    attributes = {"campaign": "autumn"}
    return Recording(
        "id", "T1", (thrust, heat, command), steps, events, outcome=outcome, cause="", attributes=attributes
    )


def test_states_command_and_readings_follow_the_time():
    frames = Frames(recording(), "T1.h5")
    seen = {t: frames.snapshot(t) for t in (1.0, 2.5, 4.0, 6.5, 7.5)}
    assert [each.state for each in seen.values()] == ["tare", "ramp", "hold", "ramp", "done"]
    assert [round(each.command, 1) for each in seen.values()][:4] == [0.0, 3.0, 6.0, 3.0]
    assert seen[4.0].readings[0].channel == "load_cell.thrust"
    assert seen[4.0].readings[0].value == pytest.approx(15.15, abs=0.3)
    assert 0.0 <= seen[4.0].readings[0].age < 0.02
    assert seen[4.0].campaign == "REPLAY autumn"
    assert [each.outcome for each in seen.values()] == ["running"] * 4 + ["completed"]
    assert [len(each.log) for each in seen.values()] == [1, 2, 2, 3, 3]
    assert seen[7.5].log[-1].level == "info"
    assert not any(each.attended for each in seen.values())


def test_a_point_is_there_when_its_hold_is_over():
    frames = Frames(recording(), "T1.h5")
    assert frames.snapshot(5.9).points == ()
    (point,) = frames.snapshot(6.1).points
    assert (point.voltage, point.step, point.thruster) == (6.0, 2, "T1")
    assert point.thrust == pytest.approx(14.4, abs=4 * point.std_error)
    assert 0.0 < point.std_error < 0.05


@pytest.mark.parametrize("step", [0.1, 0.37, 2.0, 50.0])
def test_no_tenth_of_a_second_is_lost_or_shown_twice_at_any_speed(step):
    frames = Frames(recording(), "T1.h5")
    rows = [row for t in np.arange(0.0, 60.0, step) for row in frames.snapshot(min(t, frames.end)).trace]
    assert [round(row[0] * 100) for row in rows] == [5 + 10 * n for n in range(len(rows))]
    assert len(rows) == int(frames.end / 0.1)
    command, thrust, heat = (np.array([row[1 + 2 * n : 3 + 2 * n] for row in rows]) for n in range(3))
    assert not np.isnan(command).any(), "a command holds between its rows"
    assert command[45].tolist() == [6.0, 6.0]
    assert (thrust[:, 0] <= thrust[:, 1]).all()
    assert thrust.max() == recording().channels[0].value[: len(rows) * 5].max()
    assert math.isnan(heat[0, 0])
    assert heat[25, 0] == 30.0


def test_a_run_that_was_cut_ends_as_it_did():
    cut = recording("tripped")
    assert Frames(cut, "x").snapshot(99.0).outcome == "tripped"
    assert Frames(recording(""), "x").snapshot(99.0).outcome == "aborted"


class Clock:
    """Every look is a fiftieth of a second later."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        self.now += 0.02
        return self.now


def played(asked: list[Request], speed: float, looks: int) -> list[Snapshot]:
    ours, theirs = pair("replay")
    far, left = Peer(theirs, "console"), iter(range(looks))
    for each in asked:
        ours.send(each)
    play(Frames(recording(), "T1.h5"), far, speed, lambda: next(left, None) is None, Clock())
    snapshots = [each for each in ours.receive() if isinstance(each, Snapshot)]
    ours.close()
    far.close()
    return snapshots


def test_only_a_stop_is_obeyed_and_it_goes_to_the_end():
    asked = [Request(kind) for kind in ("start", "pause", "skip", "lease", "watch", "bad")]
    assert [each.state for each in played(asked, 1.0, 5)] == ["tare"] * 5
    assert [each.state for each in played([*asked, Request("stop", "console")], 1.0, 3)][-1] == "done"


def test_twice_the_speed_is_half_the_looks():
    slow = [each.time for each in played([], 1.0, 9)]
    fast = [each.time for each in played([], 2.0, 9)]
    assert np.diff(fast) == pytest.approx(2.0 * np.diff(slow))


def test_the_link_ends_with_the_block():
    before = threading.active_count()
    with playing(Frames(recording(), "T1.h5"), 1000.0) as peer:
        assert not peer.closed
    assert threading.active_count() == before


@pytest.fixture
def file(tmp_path):
    path, run = tmp_path / "T1.h5", recording()
    with h5py.File(path, "w") as out:
        out.attrs.update({"format": "thruster-rig-recording", "format_version": 1, "thruster": "T1"})
        out.attrs.update({"campaign": "autumn", "outcome": "completed"})
        for channel in run.channels:
            group = out.require_group(f"streams/{channel.stream}")
            group["time"], group[channel.name] = channel.time, channel.value
            attributes = {"unit": channel.unit} | ({"quantity": channel.quantity} if channel.quantity else {})
            group[channel.name].attrs.update(attributes)
    return path


def test_as_lines_without_a_terminal(file, capsys):
    assert main(["replay", str(file)]) == 2
    assert "needs a terminal; use --headless there" in capsys.readouterr().err
    assert main(["replay", str(file), "--headless", "--speed", "0"]) == 2
    assert "at a speed above 0" in capsys.readouterr().err
    assert main(["replay", str(file), "--rows", "x"]) == 2
    assert "--rows is for captures" in capsys.readouterr().err
    assert main(["replay", str(file), "--headless", "--speed", "100"]) == 0
    assert main(["replay", str(file.with_name("none.h5")), "--headless"]) == 2
    assert "none.h5" in capsys.readouterr().err


def test_in_the_console_until_its_end(file):
    call = "import sys; from rig.cli import main; sys.exit(main(sys.argv[1:]))"
    with on_terminal(call, "replay", str(file), "--speed", "20", size=(120, 40)) as (process, terminal):
        terminal.until(b"REPLAY autumn")
        terminal.until(b"REPLAY of a recording, nothing turns")
        terminal.until(b"COMPLETED. Press d to leave.")
        terminal.press(b"l")
        terminal.until(b"there is nothing to attend")
        terminal.press(b"d")
        assert process.wait(20.0) == 0
