"""A person at a terminal, line by line; a command that hangs weights; and when a reading has settled."""

import os
from math import nan

import numpy as np
import pytest

from identification.calibration.loads import Load
from rig.calibrate.loads_file import Hang
from rig.calibrate.operator import Command, StoppedError, Terminal
from rig.calibrate.settling import Settling
from rig.cli import main
from rig.errors import DeviceError
from tests.rig.calibrate.weighing_bench import LOADS, files


@pytest.fixture
def typed():
    """A terminal whose person has typed that, and left."""
    opened = []

    def made(text):
        reader, writer = os.pipe()
        os.write(writer, text.encode())
        os.close(writer)
        opened.append(reader)
        return Terminal(reader)

    yield made
    for each in opened:
        os.close(each)


def nothing():
    pass


def test_line_by_line_however_many_come_at_once(typed, capsys):
    person = typed("\nr\nwhat\nK\n\n")
    assert person.hang("step 1 of 2: hang 2kg", Load(), 0.0, nothing) == "go"
    assert person.hang("step 2 of 2: hang 5kg", Load(), 0.0, nothing) == "again"
    assert person.doubt("step 2: 5kg was stated", nothing) == "keep"
    said = capsys.readouterr().out
    assert "step 1 of 2: hang 2kg: Enter when it hangs free and still" in said
    assert "expected one of r, k, q; came 'what'" in said


def test_readings_go_on_while_somebody_is_waited_for():
    reader, writer = os.pipe()
    turns = []

    def turn():
        turns.append(1)
        if len(turns) == 5:
            os.write(writer, b"\n")

    try:
        assert Terminal(reader).hang("step 1", Load(), 0.0, turn) == "go"
        assert len(turns) >= 5
    finally:
        os.close(reader)
        os.close(writer)


def test_an_operator_who_stops_or_is_not_there(typed):
    with pytest.raises(StoppedError, match="stopped by the operator"):
        typed("q\n").hang("step 1", Load(), 0.0, nothing)
    with pytest.raises(StoppedError, match="nobody is at this terminal"):
        typed("").hang("step 1", Load(), 0.0, nothing)


def test_a_command_hangs_what_its_braces_say(tmp_path):
    words = ("{python}", "-c", "import sys; open(sys.argv[1], 'w').write(' '.join(sys.argv[2:]))",
             "{bench_dir}/hung", "{force}", "{weights}")  # fmt: skip
    ticks = iter(range(10**9))
    hangs = Command(Hang(words), tmp_path, lambda: next(ticks) * 1e-6)
    assert hangs.hang("step 1", Load(("2kg", "1kg"), -1), -29.4, nothing) == "go"
    assert (tmp_path / "hung").read_text() == "-29.4 2kg,1kg"
    assert (hangs.doubt("step 3: x", nothing), hangs.doubt("step 3: x", nothing)) == ("again", "keep")


def test_a_command_that_fails_is_said(tmp_path):
    hangs = Command(Hang(("{python}", "-c", "raise SystemExit('the crane is stuck')")), tmp_path, lambda: 0.0)
    with pytest.raises(DeviceError, match="ended with status 1: the crane is stuck"):
        hangs.hang("step 1", Load(), 0.0, nothing)
    with pytest.raises(DeviceError, match="can't be run"):
        Command(Hang(("/nowhere/crane",)), tmp_path, lambda: 0.0).hang("step 1", Load(), 0.0, nothing)


def settling(shape, look=2.0):
    found = Settling(1.0, look, 0.05)
    for t in np.arange(0.0, 30.0, 0.05):
        found.add(float(t), shape(float(t)))
        if found.settled(float(t)):
            return float(t)
    return None


def test_a_reading_is_waited_for_until_it_stands_still():
    noise = np.random.default_rng(0).normal(0.0, 0.02, 10_000)
    assert settling(lambda t: 5.0) == pytest.approx(3.0, abs=0.11)
    swinging = settling(lambda t: 5.0 + 3.0 * np.exp(-(t - 1.0) / 1.5) + noise[round(t * 20)])
    assert 5.0 < swinging < 9.0
    assert settling(lambda t: 0.1 * t) is None
    assert settling(lambda t: nan) is None


def test_the_command_line_says_what_is_missing(tmp_path, capsys):
    bench, plan = files(tmp_path)
    for words, said in (
        (["calibrate", str(bench)], "give the plan of the weights with --loads"),
        (["calibrate", str(bench), "--loads", str(plan), "--yes"], "--yes needs a [hang] command"),
        (["calibrate", str(tmp_path / "t.csv"), "--loads", str(plan)], "--loads goes with a bench file"),
        (["calibrate", str(bench), "--loads", str(tmp_path / "none.toml")], "there is no such loads file"),
    ):
        assert main(words) == 2
        assert said in capsys.readouterr().err
    assert plan.read_text() == LOADS
