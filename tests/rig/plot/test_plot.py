"""`rig plot`: each figure as each kind of file, the same bytes each time; what can't be drawn is a sentence."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from identification.recording import Channel, Recording
from rig.plot.command import plot_command
from rig.plot.series import named, over_time, shown
from rig.report.style import standalone
from tests.rig.fit.test_fit import write
from tests.rig.report_reading import open_fonts

BEGINS = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


@pytest.fixture(scope="module", autouse=True)
def fonts():
    open_fonts()


def run(*words):
    return CliRunner().invoke(plot_command, [str(word) for word in words])


@pytest.mark.parametrize("ending", BEGINS)
@pytest.mark.parametrize("what", ["thrust", "residuals", "timeseries", "load_cell.thrust"])
def test_each_figure_as_each_file(tmp_path, what, ending):
    source = write(tmp_path / "T1.h5")
    words = (source, "--what", what, "-o")
    one, two = tmp_path / f"one{ending}", tmp_path / f"two{ending}"
    for path in (one, two):
        ran = run(*words, path)
        assert ran.exit_code == 0, ran.output
    assert one.read_bytes().startswith(BEGINS[ending])
    assert one.read_bytes() == two.read_bytes()
    if ending == ".svg":
        assert " / N" in one.read_text(encoding="utf-8"), "the unit is on the axis"


def test_several_channels_stand_above_one_another(tmp_path):
    source = write(tmp_path / "T1.h5")
    out = tmp_path / "figure.svg"
    assert run(source, "--what", "load_cell.thrust", "command_voltage", "-o", out).exit_code == 0
    text = out.read_text(encoding="utf-8")
    assert "command voltage / V" in text
    assert "thrust / N" in text
    assert "time since the recording began / s" in text


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--what", "thrst", "-o", "x.png"), "there is no channel 'thrst' with values in it; did you mean thrust"),
        (("--what", "thrust", "residuals", "-o", "x.png"), "--what thrust is a figure of its own"),
        (("-o", "x.jpeg"), "expected a name that ends in .png, .svg, .pdf, came '.jpeg'"),
        (("-o", "no/such/folder/x.png"), "No such file or directory"),
    ],
)
def test_what_can_not_be_drawn_is_a_sentence(tmp_path, monkeypatch, words, told):
    source = write(tmp_path / "T1.h5")
    monkeypatch.chdir(tmp_path)
    ran = run(source, *words)
    assert ran.exit_code == 2
    assert told in ran.output


def test_recordings_of_two_thrusters_are_two_figures(tmp_path):
    files = [write(tmp_path / f"{name}.h5", thruster=name) for name in ("T1", "T2")]
    ran = run(*files, "-o", tmp_path / "x.png")
    assert ran.exit_code == 2
    assert "these are of T1, T2; give one at once" in ran.output


def test_a_command_holds_to_the_end_and_recordings_differ_without_colour():
    t = np.arange(100.0)
    slow = Channel("u", "rig", "command_voltage", "V", np.array([0.0, 1.0]), np.array([0.0, 5.0]))
    force = Channel("f", "cell", "thrust", "N", t, t)
    runs = [Recording(name, "T1", (slow, force)) for name in "ab"]
    text = standalone(over_time(shown(runs)))
    assert text.count("stroke-dasharray") > 0
    assert "thrust / N from 0 to 99" in over_time(shown(runs)).alt
    assert named("cell/f", runs).channels == (force, force)


def test_the_endings_are_those_that_are_told():
    from rig.report.image_files import ENDINGS

    assert set(ENDINGS) == set(BEGINS)
    assert Path("a.png").suffix in ENDINGS
