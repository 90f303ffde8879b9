"""The page of a diagnosis, made of answers written by hand: what each verdict shows, and that nothing breaks it."""

from dataclasses import replace

import numpy as np
import pytest

from identification.flexible_terms.flexible import MULTIPLIERS, WORDS
from identification.mismatch.diagnosis import (
    Curves,
    HeldOutRmse,
)
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.unexplained import FlexibleShape, Spline
from identification.mismatch.value import Value, Where
from identification.mismatch.verdict_clauses import NOT_WHITE
from identification.recording import Channel, Recording
from rig.diagnose.report.page import diagnosis_page, write
from rig.diagnose.text import diagnosis_text
from rig.report.page import html
from rig.report.style import svg
from tests.rig.diagnose.page.written_answers import (
    HIGH,
    HOLD,
    LAGS,
    LEVELS,
    NAME,
    NEXT,
    ODD,
    C,
    answer,
    lagging,
)
from tests.rig.report_reading import open_fonts, read


@pytest.fixture(scope="module", autouse=True)
def fonts():
    open_fonts()


def titles(page):
    return {s.title: [p.title for p in s.parts if p.kind == "picture"] for s in page.sections}


def cells(page, section):
    return [row for s in page.sections if s.title == section for p in s.parts if p.kind == "table" for row in p.rows]


def test_page_says_everything_and_is_self_contained(tmp_path):
    out = tmp_path / "new" / "page.html"
    write(answer(), out)
    found = read(out.read_text(encoding="utf-8"))
    assert found.text.count(NAME) >= 2
    for said in (
        "time since step 0 to 1 s. (p",
        "p = 3·10⁻⁷",
        "5 to 0.11 N, 98 % less; the noise alone is 0.1 N",
        "0.3000 ± 0.0010",
        "0.2980 to 0.3020",
        "heating (name not earned)",
        "2.7 : 1",
        "a delay keeps the shape of the step",
        "expected power 0.97",
        "ab" * 32,
        "Separates motor lag from time skew",
        "temperature was not recorded",
    ):
        assert said.replace(". (p", " (p") in found.text
    assert "motor_lag" not in found.text


def test_each_section_has_its_figures():
    page = diagnosis_page(answer())
    assert titles(page) == {
        "In short": [],
        "Where C V|V| fails": [
            *("Residual of the baseline", "Size of the residual over time since step"),
            "Size of the residual over command voltage",
        ],
        "What was left out": ["Motor lag"],
        "Before and after": ["Prediction and residual"],
        "Parameters": [],
        "Rivals": [],
        "The next experiment": ["The next sweep"],
        "Notes": [],
        "Provenance": [],
    }
    where = page.sections[1].parts[1].plot
    assert "The region command voltage 8 to 30 V is outlined." in where.alt
    assert cells(page, "Before and after")[2][:3] == ("not fitted, noise taken out", "5", "0.0458")
    sweep = page.sections[6].parts[1].plot
    assert "flow" in svg(sweep)


def test_headings_name_a_twin_and_leave_what_it_holds_to_the_statement():
    told = answer(baseline_model="the twin t.json (C V|V| with dead_band)")
    assert "Where the twin t.json fails" in titles(diagnosis_page(told))
    assert "\nWhere the twin t.json fails:\n" in diagnosis_text(told)


def test_what_is_outlined_tells_more_than_nearly_all_of_the_run():
    always = replace(HIGH, where=Where("time", 0.0, 19.0, "s"), share=0.95)
    where = diagnosis_page(answer(mismatch=(always, HIGH))).sections[1].parts[1].plot
    assert "The region command voltage 8 to 30 V is outlined." in where.alt


def test_unexplained_shows_shapes_and_what_it_resembles():
    page = diagnosis_page(answer(unexplained=ODD, findings=(), experiment=None))
    assert titles(page)["What is not explained"] == [
        *("What is left over time", "Left out over time since step", "Left out over command voltage")
    ]
    section = next(s for s in page.sections if s.title == "What is not explained")
    assert [r.tone for r in section.parts[0].remarks] == [
        "bad",
        "doubt",
        "doubt",
    ]  # what it resembles; no free curve
    assert "located here" in svg(section.parts[1].plot)
    assert page.lead.startswith("Something is left at time 5 to 20 s. Error on data that were not fitted: 5 N before, ")


@pytest.mark.parametrize("times", MULTIPLIERS)
def test_a_flexible_term_of_each_kind_is_drawn(times):
    """A run that was diagnosed had neither page nor text where the kind had no label."""
    at = np.linspace(0.0, 3.0, 5)
    spline = Spline(times, WORDS[times], "1", at, 0.1 * at, 0.01 + 0.0 * at, ((0.5, 0.05, 0.04, 0.01),))
    found = FlexibleShape("time_since_step", "s", (0.0, 1.0, 3.0), 1, 0.0, 0.0, {}, (spline,), "A free curve.")
    page = diagnosis_page(answer(unexplained=replace(ODD, flexible=(found,)), findings=()))
    assert f"Free curve over time since step: {times}" in titles(page)["What is not explained"]


def test_adequate_page_has_little_to_say():
    curves = replace(lagging(), model=lagging().baseline)
    page = diagnosis_page(
        answer(
            **{"mismatch": (), "findings": (), "model_terms": (), "experiment": None},
            **{"notes": (), "twin": None, "curves": (curves,), "heldout": HeldOutRmse(0.1, 0.1, np.nan, "blocks")},
            model={"C": Value(np.nan, np.nan, "N/V^2")},
        )
    )
    assert titles(page)["Where C V|V| fails"] == ["Residual of the baseline"]
    assert "Nowhere" in page.sections[1].parts[0].items[0]
    assert [r.tone for r in page.sections[0].parts[0].remarks] == ["good", ""]
    assert cells(page, "Provenance") == [("a",)]
    assert cells(page, "Parameters")[0][2] == "–"


def test_levels_without_a_course_of_time_are_points():
    V = np.linspace(-10, 10, 21)
    static = Curves("levels", np.arange(21.0), V, C * V * np.abs(V) * 0.9, C * V * np.abs(V), C * V * np.abs(V) * 0.9)
    page = diagnosis_page(answer(curves=(static,), mismatch=(HIGH,)))
    assert titles(page)["Where C V|V| fails"] == ["Residual level by level"]
    assert "located here" in svg(page.sections[1].parts[1].plot)
    after = next(s for s in page.sections if s.title == "Before and after").parts[-1].plot
    assert "command voltage / V" in svg(after)


def test_of_many_runs_the_worst_are_shown():
    runs = tuple(lagging(f"run {i}", i) for i in range(5))
    runs = (*runs[:4], replace(runs[4], baseline=runs[4].baseline + 9.0))
    shown = titles(diagnosis_page(answer(curves=runs, recordings=tuple(r.recording_id for r in runs))))
    assert len(shown["Where C V|V| fails"]) == 2 + 2
    assert shown["Where C V|V| fails"][1].endswith(", run 5 of 5")
    assert len(shown["Before and after"]) == 3
    assert cells(diagnosis_page(answer(recordings=("a", "b"))), "Provenance")[1] == ("b", "–")


def test_effect_is_drawn_by_itself_where_the_recordings_are_at_hand():
    curves = lagging()
    channels = (
        Channel("u", "motor", "command_voltage", "V", HOLD * np.arange(LEVELS.size), LEVELS),
        Channel("f", "cell", "thrust", "N", curves.time, curves.thrust),
    )
    recording = Recording("a", NAME, channels)
    history = history_of(recording)
    t, y = history.sampled[history.rows], history.thrust[history.rows]
    seen = Curves("a", t, history.driver[history.rows], y, np.interp(t, curves.time, curves.baseline), y)
    of_two = answer(model_terms=("motor_lag", "heating"), curves=(seen,))
    alone, together = diagnosis_page(of_two, [recording]), diagnosis_page(of_two)
    assert "and motor lag; largest" in alone.sections[2].parts[0].plot.alt
    assert "and all findings together; largest" in together.sections[2].parts[0].plot.alt


def test_the_next_sweep_is_drawn_in_its_own_unit():
    turning = replace(NEXT, quantity="rotation_rate")
    for n, said, label in (
        (NEXT, "voltage between -9 and 2 V", "voltage / V"),
        (turning, "rotation rate between -9 and 2 rev/s", "rotation rate / (rev/s)"),
    ):
        section = next(s for s in diagnosis_page(answer(experiment=n)).sections if s.title.startswith("The next"))
        assert said in section.parts[1].plot.alt
        assert label in svg(section.parts[1].plot)


def test_finding_without_a_coordinate_is_a_sentence():
    hum = replace(LAGS, effect="periodic_disturbance", statement="A line at 4.2 Hz.", rivals=())
    section = next(s for s in diagnosis_page(answer(findings=(hum,))).sections if s.title == "What was left out")
    assert section.parts[0].items == ("A line at 4.2 Hz. p < 10⁻¹², BIC better by 5000, no rival comes near.",)
    assert len(section.parts) == 1


def test_same_answer_same_bytes():
    few = answer(curves=(), mismatch=(HIGH,), findings=(), unexplained=ODD)
    assert html(diagnosis_page(few)) == html(diagnosis_page(few))


@pytest.mark.parametrize(("p", "says"), [(0.4, "white (p = 0.4)"), (0.01, "white (p = 0.01)")])
def test_text_and_page_call_white_what_is(p, says):
    d = answer(whiteness_p=p)
    for told in (said(d), read(html(diagnosis_page(d))).text):
        assert f"hat remains is {says}" in told
        assert NOT_WHITE not in told


def test_text_and_page_say_that_what_remains_is_not_white_and_what_that_means():
    d = answer(whiteness_p=0.0099)
    assert f"what remains is NOT white (p = 0.0099): {NOT_WHITE}" in said(d)
    page = read(html(diagnosis_page(d))).text
    assert "What remains is not white (p = 0.0099): " in page
    assert NOT_WHITE in page


def said(d):
    return " ".join(diagnosis_text(d).split())
