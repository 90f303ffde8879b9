"""Text and page say what is not known, how much a finding is, what it was searched among, and of which files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.flexible_terms.flexible import WORDS
from identification.mismatch.diagnosis import HeldOutRmse, Unexplained
from identification.mismatch.unexplained import FlexibleShape, Spline
from identification.mismatch.value import Value
from rig.diagnose.report.page import diagnosis_page
from rig.diagnose.text import diagnosis_text
from rig.report.page import html
from rig.report.style import svg
from tests.rig.diagnose.page.written_answers import LAGS, ODD, answer, lagging
from tests.rig.report_reading import open_fonts, read


@pytest.fixture(scope="module", autouse=True)
def fonts():
    open_fonts()


def said(d):
    return " ".join(diagnosis_text(d).split())


def shown(d, **names):
    return read(html(diagnosis_page(d, **names))).text


LOST = Value(24.0, 5844288569.0, "s", limits=(1.0, 400.0))
TARE = Value(1.0, 20.0, "N", limits=(-15.0, 15.0))


def test_a_value_that_is_not_determined_is_said_to_be_so():
    d = answer(model={"heating.time_constant": LOST, "tare": TARE})
    assert (
        "heating.time_constant not determined (between 1 and 400 s), tare not determined (between -15 and 15 N)"
        in said(d)
    )
    page = shown(d)
    assert "not determined (between 1 and 400)" in page
    assert "not determined (between −15 and 15)" in page
    for told in (said(d), page):
        assert "5844288569" not in told
        assert "20 N" not in told


def test_what_a_free_curve_takes_off_is_not_the_names():
    """11.5 -> 0.638 N looked solved; the one name left 11.5."""
    curve = answer((LAGS,), replace(ODD, flexible=(SHAPE,)))
    page = shown(replace(curve, heldout=HeldOutRmse(11.5, 0.638, 0.498, "levels")))
    assert "from 11.5 to 0.638 N, 94 % less with a free curve, which is no physics; the noise" in page
    assert "94 % less; the noise" in shown(replace(answer(), heldout=HeldOutRmse(11.5, 0.638, 0.498, "levels")))


AT = np.linspace(0.0, 3.0, 5)
TABLE = ((0.5, 0.05, 0.04, 0.01), (1.5, 0.15, 0.16, 0.01), (2.5, 0.25, -44.7, 55.0))
WILD = Spline("gain", WORDS["gain"], "1", AT, 0.1 * AT, np.array([0.01, 0.01, 0.01, 0.02, 40.0]), TABLE)
SHAPE = FlexibleShape("time", "s", (0.0, 3.0), 3, 0.0, 0.0, {}, (WILD,), "A free curve.")


def test_rows_of_a_shape_that_are_not_determined_are_neither_told_nor_drawn():
    left = replace(ODD, flexible=(SHAPE,), shape=((1.0, 0.2, 0.02), (2.0, -0.3, 0.02), (3.0, 90.0, 70.0)))
    d = answer(unexplained=left, findings=(), model={"flexible:time.gain_at_3": Value(-44.7, 55.0, "1")})
    text = said(d)
    assert text.count("not determined") == 2
    assert "-44.7" not in text
    assert "70" not in text.split("Not explained")[1].split("Model:")[0]
    page = diagnosis_page(d)
    pictures = [p for s in page.sections for p in s.parts if p.kind == "picture"]
    drawn = {p.title: p for p in pictures}
    assert "from 0 to 22.5 with its 95 % band" in drawn["Free curve over time: gain"].plot.alt
    assert "1 place is not drawn" in drawn["Free curve over time: gain"].caption
    assert "largest -0.3" in drawn["What is left over time"].plot.alt
    assert "44.7" not in read(html(page)).text, "no spline is among the physics"


def test_an_axis_is_as_high_as_what_is_known():
    """Of the free curve above: 4,000 % where nothing is known, 23 % where something is."""
    d = answer(unexplained=replace(ODD, flexible=(SHAPE,)), findings=())
    (section,) = (s for s in diagnosis_page(d).sections if s.title == "What is not explained")
    plot = next(p.plot for p in section.parts if getattr(p, "title", "") == "Free curve over time: gain")
    ticks = [t for t in read(svg(plot)).text.replace("−", "-").split() if t.lstrip("-").isdigit()]
    assert max(abs(int(t)) for t in ticks) < 100


PARTLY = replace(LAGS, share=0.64, heldout=(0.8276, 0.8091), doubts=("more is left over its own covariate, time",))


def test_share_and_grade_stand_beside_a_findings_sentence():
    for told in (said(answer(findings=(PARTLY,))), shown(answer(findings=(PARTLY,)))):
        assert (
            "artly: not fitted 0.8276 without it, 0.8091 with it, 64 % of what any shape in its place could take off"
            in told
        )
        assert "more is left over its own covariate, time" in told
    hum = replace(PARTLY, effect="periodic_disturbance", statement="A line.", doubts=(), share=0.97, rivals=())
    assert "All: not fitted 0.8276 without it" in shown(answer(findings=(hum,))), "without a picture too"


def test_a_p_value_says_among_how_many_it_was_searched():
    found = replace(LAGS, searched=812, asked=9)
    for told in (said(answer(findings=(found,))), shown(answer(findings=(found,)))):
        assert "the best of 812 alternatives looked at" in told
        assert "70 % of the odds among the 9 effects of the catalogue that were fitted in this place" in told
        assert "how likely physics outside the catalogue is, that does not say" in told
        assert "probability among" not in told
    alone = replace(LAGS, searched=None, rivals=())
    assert "alternatives" not in said(answer(findings=(alone,)))
    assert "odds" not in said(answer(findings=(alone,)))


def test_a_page_tells_recordings_by_their_files():
    d = answer(
        recordings=("7c1e-a", "7c1e-b"),
        curves=(lagging("7c1e-a"), lagging("7c1e-b", 1)),
        model={"C": Value(0.4, 0.1, "N/V^2"), "tare[7c1e-a]": Value(1.0, 0.1, "N")},
        notes=("7c1e-b: current has no sign",),
    )
    page = shown(d, names={"7c1e-a": "april.h5", "7c1e-b": "june.h5"})
    assert "tare[april.h5]" in page
    assert "june.h5: current has no sign" in page
    assert page.count("7c1e-a") == 1, "its id is told once, beside its file"
    assert "7c1e-a" in shown(d).split("Provenance")[-1]


def test_an_answer_that_does_not_predict_is_no_explanation():
    held = HeldOutRmse(1.0, 1.2, 0.2, "every fourth block of time", 0.001)
    left = replace(ODD, shape=(), statement="What was found predicts no others.", unpredictive=True)
    d = replace(answer(heldout=held), answer=Unexplained((), left, None))
    assert "GROWS" in said(d)
    assert "30 % of what the baseline leaves" in said(d)
    page = shown(d)
    assert "Unexplained: what was found does not predict data that were not fitted." in page
    assert "Explained:" not in page


def test_an_error_that_slow_noise_makes_grow_is_no_cross_on_the_page():
    hidden = HeldOutRmse(0.0687, 0.0736, 0.06, "every fourth block of time", 0.14, whitened_fall=49.0)
    page = shown(answer(heldout=hidden))
    assert "from 0.0687 to 0.0736 N; the noise alone is 0.06 N. Slow noise makes most of that error. With slow" in page
    assert "With slow noise taken out the model predicts them better: χ² falls there by 49 more than its price." in page
    assert "not fitted, noise taken out" not in page, "of the white noise it is that, not of the slow"
    plain = shown(answer(heldout=replace(hidden, whitened_fall=0.0)))
    assert "not fitted, noise taken out" in plain
    assert "predicts them better" not in plain
