import hashlib
import json

import numpy as np
import pytest
from click.testing import CliRunner
from test_fit import write

from identification.recording import Channel, Recording, Step
from rig.fit.answer import fit_recordings
from rig.fit.as_json import answer_json
from rig.fit.command import fit_command
from rig.fit.comparison import changed
from rig.fit.report.page import fit_page
from rig.report.normal_plot import normal_order
from rig.report.page import html
from rig.report.provenance import Source, sha256
from rig.report.style import svg
from tests.rig.report_reading import open_fonts, read

LEVELS = (0.0, 5.0, -5.0, 10.0, -10.0, 15.0, -15.0, 0.0)
NAME = "T<1> & 'co'"


@pytest.fixture(scope="module", autouse=True)
def fonts():
    open_fonts()


def recording(name="a", thruster=NAME, C=0.4, bend=1.0, rate=False, seed=1, sine=False):
    """Holds of 4 s at 50 Hz, or a slow sine without holds; `bend`: share of C at negative voltage."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 4.0 * len(LEVELS), 0.02)
    V = 15 * np.sin(t / 3) if sine else np.repeat(LEVELS, 200)
    F = C * V * np.abs(V) * np.where(V < 0, bend, 1.0) + 1.5 + rng.normal(0, 0.1, t.size)
    steps = tuple(Step(i, "hold", V, 4.0 * i, 4.0 * i + 4.0) for i, V in enumerate(LEVELS))
    unit, quantity = ("rev/s", "rotation_rate") if rate else ("V", "command_voltage")
    channels = (
        Channel("u", "motor", quantity, unit, t, V),
        Channel("f", "cell", "thrust", "N", t, F, calibration={"gain_std": 0.001}),
    )
    return Recording(name, thruster, channels, () if sine or rate else steps)


def page_of(*recordings, **options):
    return fit_page(fit_recordings(recordings, **options))


def titles(page):
    return [part.title for section in page.sections for part in section.parts if part.kind == "picture"]


def test_page_of_one_thruster():
    page = page_of(recording())
    text = html(page)
    found = read(text)
    assert text == html(page_of(recording()))
    assert found.text.count(NAME) >= 3
    assert "T<1>" not in text
    assert page.lead.startswith(f"{NAME}: thrust = C V|V| with C = 0.")
    assert titles(page) == [
        "Measured and fitted thrust",
        "Residuals over what explains the thrust",
        "Residuals in the order of measurement",
        "Normal plot",
        "Singular values of the regressor",
    ]
    assert "All 8 points" in found.text
    assert "Models side by side" in found.text
    assert found.tags.count("svg") == 6, "five figures, one of them at two widths"
    assert found.labels.count(found.labels[0]) == 1
    assert not page.contents


def test_several_thrusters_are_compared():
    page = page_of(recording(), recording("b", "T2", C=0.3, seed=2), recording("c", "T2", C=0.3, seed=3))
    assert [section.title for section in page.sections] == ["All thrusters", NAME, "T2", "Provenance"]
    assert "2 thrusters were fitted" in page.lead
    assert page.sections[0].parts[-1].title == "Thrusters side by side"
    assert "differ" in page.sections[0].parts[1].items[0]
    labels = [row[0] for row in page.sections[2].parts[0].rows]
    assert labels[:3] == ["C", "tare 1", "tare 2"]


def test_each_direction_has_its_part_of_the_curve():
    page = page_of(recording(bend=0.8), model="C+/C-")
    assert [row[0] for row in page.sections[0].parts[0].rows[:3]] == ["C+", "C−", "tare"]
    assert "the directions are not alike" in repr(page.sections)
    assert "C+/C-" in svg(page.sections[0].parts[2].plot)


def test_samples_by_voltage_and_points_by_rate():
    sine = page_of(recording(sine=True))
    assert "over 1600 samples" in sine.lead
    assert "One sample in 2 is drawn." in sine.sections[0].parts[2].caption
    assert "no more than are worth independent ones" in next(
        part.caption for part in sine.sections[0].parts if part.kind == "picture" and part.title == "Normal plot"
    )
    rate = svg(page_of(recording(rate=True)).sections[0].parts[4].plot)
    assert "number of the sample, in order" in rate
    assert "N·s²/rev²" in repr(page_of(recording(rate=True)).sections)


def test_one_direction_only_leaves_a_dash():
    one = recording(sine=True)
    u, f = one.channels
    up = Channel("u", "motor", "command_voltage", "V", u.time, np.abs(u.value))
    push = Channel("f", "cell", "thrust", "N", f.time, np.abs(f.value))
    page = page_of(Recording("up", "T1", (up, push)))
    (others,) = [part for part in page.sections[0].parts if part.kind == "table" and "other models" in part.caption]
    assert ("C−", "C+/C-", "–", "–") in [row[:4] for row in others.rows]


def test_a_phone_shows_the_first_curve_behind_the_parameters_of_one_model():
    parts = page_of(recording(rate=False)).sections[0].parts
    before = [part for part in parts[: [part.kind for part in parts].index("picture")] if part.kind == "table"]
    assert [row[0] for part in before for row in part.rows] == ["C", "tare"]
    assert [part.folded for part in parts if part.kind == "table" and "other models" in part.caption] == [True]


def test_few_points_have_no_normal_plot():
    t = np.arange(3.0)
    channels = (Channel("u", "m", "command_voltage", "V", t, t), Channel("f", "c", "thrust", "N", t, t * t + 0.1 * t))
    answers = fit_recordings([Recording("few", "", channels)])
    assert normal_order(answers[0].fit.estimate) is None
    assert "Normal plot" not in titles(fit_page(answers))


def test_envelope_holds_normal_residuals_and_not_others():
    outside = []
    for seed in range(10):
        order = normal_order(fit_recordings([recording(seed=seed)])[0].fit.estimate)
        assert order is not None
        assert np.all(order.low < order.high)
        outside.append(order.outside)
    assert np.mean(outside) < 0.15 * 8


def test_provenance_names_files_and_hashes(tmp_path):
    path = tmp_path / "<a>.h5"
    path.write_bytes(b"x" * 3_000_000)
    assert sha256(path) == hashlib.sha256(path.read_bytes()).hexdigest()
    source = Source(path.name, "a", NAME, "2026-01-01T00:00:00Z", "completed", sha256(path))
    assert fit_page(fit_recordings([recording()]), (source,)).sections[-1].parts[0].rows[0] == (
        *("<a>.h5", NAME, "2026-01-01T00:00:00Z", "completed", "a"),
        sha256(path),
    )


def test_command_writes_the_page(tmp_path):
    files = [write(tmp_path / "a.h5"), write(tmp_path / "b.h5", seed=1)]
    out = tmp_path / "pages" / "fit.html"
    done = CliRunner().invoke(fit_command, [*map(str, files), "--report", str(out)])
    assert done.exit_code == 0, done.output
    found = read(out.read_text(encoding="utf-8"))
    assert "T3: thrust = C V|V|" in found.text
    assert sha256(files[1]) in found.text


def test_change_since_an_earlier_fit_is_drawn(tmp_path):
    earlier = tmp_path / "old.json"
    earlier.write_text(json.dumps(answer_json(fit_recordings([recording("old", seed=7)]))), encoding="utf-8")
    answers = fit_recordings([recording("new", C=0.5)])
    page = fit_page(answers, (), [changed(answers, earlier)])
    section = page.sections[1]
    assert section.title == f"Compared with {earlier}"
    assert f"{NAME} has changed" in section.parts[0].items[0]
    assert section.parts[1].plot.alt.startswith("change / % with 95 % intervals")
