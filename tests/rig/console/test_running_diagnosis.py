"""What stands beside the running fit: fits so far, or where, how much, since when and what to do."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rig.console.panels import StandingPanel
from rig.console.view_model.running_diagnosis import standing
from rig.console.view_model.running_fit import in_words, running_fit, v_abs_v
from rig.console.view_model.view import View, absorb
from rig.control.status import Held, Status
from rig.link.front_end_messages import Snapshot, Watching
from rig.link.watch_messages import Judged
from rig.link.watch_messages import Standing as Mismatched
from rig.stages.watching import shown
from tests.rig.console.feeds import points, running, snapshot
from tests.rig.console.scenes import BENT, DEVIATES
from tests.rig.console.sitting import sitting


def said(seen: Snapshot, width: int = 78) -> tuple[str, ...]:
    found = standing(absorb(View(), seen, 0.0), width)
    return found.lines if found is not None else ()


def test_a_run_that_fits():
    (line,) = said(running())
    assert line.startswith("C = 0.40")
    assert "(k = 2, n = 11), chi²/dof " in line
    assert line.endswith(": fits so far")
    assert len(line) <= 78


@pytest.mark.parametrize(
    ("watch", "end"),
    [
        (Watching("learning"), ": too early to say"),
        (Watching("off"), ": not watched"),
        (Watching("failed", "its link is gone"), ": not watched: its link is gone"),
    ],
)
def test_it_never_says_that_a_run_fits_which_nobody_has_judged(watch, end):
    (line,) = said(running(watch=watch))
    assert line.endswith(end)
    assert "fits" not in line


def test_nothing_is_said_before_there_is_anything():
    assert said(snapshot("preflight")) == ()
    assert said(running("tare", points=(), watch=Watching("learning"))) == ()
    assert said(running("tare", points=(), watch=Watching("fits"))) == (
        "no fit yet: two levels are needed; fits so far",
    )


def test_a_mismatch_from_which_step_at_which_levels_how_much_since_when_how_sure_and_what_to_do():
    first, second = said(running(watch=DEVIATES))
    assert first == "DOES NOT FIT from step 12, -20 … +20 V: thrust -2.6 % since 32 s, 14 sigma"
    assert len(first) <= 78
    assert "C = 0.40" in second
    assert second.endswith("; look at the propeller")
    assert len(second) <= 78
    assert ": thrust -2.6 % (-4.3 N) since" in said(running(watch=DEVIATES), width=200)[0]
    assert said(running(watch=DEVIATES), width=200)[1].endswith(DEVIATES.advice)


def test_one_level_a_start_and_a_step_that_is_not_known():
    one = replace(DEVIATES, low=4.0, high=4.0, from_start=True)
    assert said(running(watch=one))[0].startswith("DOES NOT FIT from step 12, +4 V: thrust")
    assert " from the start, " in said(running(watch=one))[0]
    assert said(running(watch=replace(DEVIATES, step=None, low=None, high=None)))[0].startswith("DOES NOT FIT: thrust")


def test_holds_that_a_square_law_does_not_fit_are_said_with_the_worst_of_them():
    first, second = said(running(points=BENT))
    fit = running_fit(BENT)
    assert fit is not None
    off = {point.step + 1: (point.thrust - fit.predict(v_abs_v(point))) / point.std_error for point in BENT}
    worst = max(off, key=lambda step: abs(off[step]))
    assert f"most at step {worst}, " in first
    assert first.endswith(f"{abs(off[worst]):.2g} sigma")
    assert first.startswith("C V|V| DOES NOT FIT, most at ")
    assert len(first) <= 78
    assert f"chi²/dof {fit.per_dof:.2g}; " in second
    assert second.endswith("next: rig diagnose")


def test_the_words_of_a_fit_have_two_standard_deviations_and_chi_square():
    fit = running_fit(points("T1", 11))
    assert fit is not None
    assert fit.per_dof is not None
    words = in_words(fit)
    assert f"± {2 * fit.C_std:.5f} N/V² (k = 2, n = 11)" in words
    assert words.endswith(f"chi²/dof {fit.per_dof:.2g}")


HELD = [Held(1, 0.0, 0.0, 4.0), Held(3, 8.0, 4.0, 9.0), Held(5, -8.0, 9.0, 14.0), Held(7, 4.0, 14.0, 19.0),
        Held(9, 0.0, 19.0, 24.0), Held(11, 6.0, 24.0, 29.0)]  # fmt: skip


def mismatched(place: str, began: float) -> Judged:
    return Judged(0, 9, True, Mismatched(place, "thrust -3 %", "", began, False, 4.1, "look", "look well"))


@pytest.mark.parametrize(
    ("place", "began", "expected"),
    [
        ("forward", 8.9, (7, 4.0, 6.0)),
        ("reverse", 8.9, (5, -8.0, -8.0)),
        ("running", 8.9, (5, -8.0, 6.0)),
        ("zero", 18.9, (9, 0.0, 6.0)),
        ("high", 13.0, (7, 4.0, 6.0)),
        ("bus", 28.9, (None, None, None)),
    ],
)
def test_from_which_step_on_and_at_which_levels(tmp_path, place, began, expected):
    status = Status.__new__(Status)
    status.held = HELD
    found = shown(mismatched(place, began), status)
    assert (found.step, found.low, found.high) == expected
    assert (found.state, found.sigma, found.advice) == ("mismatch", 4.1, "look well")


def test_the_watch_is_learning_until_it_can_say_something():
    status = Status.__new__(Status)
    status.held = []
    assert shown(Judged(0, 3, False, None), status).state == "learning"
    assert shown(Judged(0, 30, True, None), status).state == "fits"


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)])
async def test_it_is_on_the_main_page_and_beside_the_fit_and_elsewhere_when_something_is_wrong(size):
    async with sitting(running(), size=size) as desk:
        panel = desk.app.query_one(StandingPanel)
        for page, there in (("1", True), ("2", True), ("3", False), ("4", False)):
            await desk.press(page)
            await desk.draw()
            assert (panel.size.height == 1) == there
        await desk.play(running(t=48.0, watch=DEVIATES))
        for page in "1234":
            await desk.press(page)
            await desk.draw()
            assert panel.size.height == 2
            assert "DOES NOT FIT from step 12, -20 … +20 V: thrust -2.6 %" in desk.text(StandingPanel)
            assert "look at the propeller" in desk.text(StandingPanel)
