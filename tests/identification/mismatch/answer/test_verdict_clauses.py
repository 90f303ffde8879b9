"""What a verdict's sentence says of rivals, of what would tell them, and of what was tried and refused."""

from dataclasses import replace

import pytest

from identification.mismatch.diagnosis import (
    Adequate,
    Diagnosis,
    Explained,
    HeldOutRmse,
    NextExperiment,
    PlanStep,
    Rmse,
    Unexplained,
)
from identification.mismatch.locate.places import Place, says
from identification.mismatch.unexplained import FlexibleShape
from identification.mismatch.value import Where
from identification.mismatch.verdict_clauses import errors, missing, named_share, refused, to_settle
from tests.identification.mismatch.answer.answered import LEFT, finding


def test_the_next_experiment_is_told_with_what_it_separates():
    steps = (PlanStep(5.4, 3.0), PlanStep(-5.4, 4.0))
    found = to_settle(NextExperiment("separates exponent from dead_band: levels of 5.4 V; exponent stays", steps, 0.9))
    assert found.endswith("2 steps, 7 s in all: it separates exponent from dead band: levels of 5.4 V.")


def test_where_no_sweep_settles_it_that_is_said():
    assert "No sweep settles it: no sweep" in to_settle(
        NextExperiment("no sweep, but dead weights on the cell", (), 0.0)
    )
    assert to_settle(None) == "Run the next experiment."


def test_each_name_that_was_refused_has_its_own_reason():
    tried = [
        ("dead_band", "too wide"),
        ("exponent", "two values"),
        ("heating", "no"),
        ("motor_lag", "late"),
        ("x", "y"),
    ]
    assert refused(tried[:1]) == "Tried for it and refused: dead band (too wide)."
    assert refused(tried).endswith("dead band (too wide); exponent (two values); heating (no); and 2 more.")


HELD = HeldOutRmse(24.5, 0.457, 0.305, "every fourth of the levels")
BENT = replace(finding(), heldout=(25.2, 1.47), share=1.0)


def test_errors_on_what_was_not_fitted_are_one_chain():
    """An engineer had five figures for one recording, and none of them said which was his."""
    told = errors([BENT, BENT], HELD, "N", "a free curve, which is no physics")
    assert told == (
        "Error on data that were not fitted: 24.5 N before, 1.47 N with these, 0.457 N with a free curve, which is no "
        "physics; noise alone gives 0.305 N."
    )
    assert ": 24.5 N before, 0.457 N with a curve; " in errors([], HELD, "N", "a curve")


def test_the_chain_ends_with_the_error_of_the_model_that_is_told():
    """With names alone it is theirs, whatever they did beside terms that have gone; with more it is told, too, where
    it is worse than the names by themselves."""
    assert ": 24.5 N before, 0.457 N with it; " in errors([BENT], HELD, "N")
    worse = replace(BENT, heldout=(24.5, 0.3))
    assert ": 24.5 N before, 0.3 N with it, 0.457 N with terms; " in errors([worse], HELD, "N", "terms")


def test_names_that_predict_no_better_than_none_are_said_to():
    """0.362, 0.399 and 0.311 N were read as a fall by one of three, and as a contradiction by two."""
    held, worse = HeldOutRmse(0.362, 0.311, 0.358, "blocks"), replace(BENT, heldout=(0.37, 0.399))
    assert errors([worse, worse], held, "N", "a free curve") == (
        "Error on data that were not fitted: 0.362 N before, 0.399 N with these alone, which predict no better than "
        "without, 0.311 N with a free curve; 0.311 N is no more than the noise of the data that were fitted (0.358 N)."
    )


def test_a_model_that_does_no_better_has_no_chain():
    assert errors([BENT], replace(HELD, after=24.6), "N") == ""


def test_a_covariate_that_is_a_sign_is_told_as_a_side():
    rising = Where("direction_of_change", 0.5, 1.5, "1")
    assert says(Place(rising, 0.94, 0.3, (), "up and down differ")) == (
        "94 % of the residual lies where the driver rises, with 30 % of the samples: up and down differ."
    )

    def told(quantity, low, high):
        return says(Place(Where(quantity, low, high, "1"), 0.5, 1.0, (), "it differs"))

    assert "lies in reverse:" in told("direction", -1.5, -0.5)
    assert "lies both ways:" in told("direction", -1.5, 1.5)
    assert "at command_voltage -0.5 to 1:" in told("command_voltage", -0.5, 1.0)


BAND = finding()
CREEP = replace(finding("load_cell_creep", statement="Creep."), in_measurement=True)


def test_what_the_stand_adds_stands_apart_from_the_thruster():
    told = [(CREEP, "Creep."), (BAND, "Dead band.")]
    assert missing(told) == [
        "Missing from the model:",
        "Dead band.",
        "In the measurement, not in the thruster:",
        "Creep.",
    ]
    assert missing(told[:1]) == ["In the measurement, not in the thruster:", "Creep."]
    assert missing(told[1:]) == ["Missing from the model:", "Dead band."]


def test_the_share_that_has_names_is_of_the_error_beyond_the_noise():
    """sqrt(24.5^2 - 0.305^2) = 24.498 before, sqrt(1.47^2 - 0.305^2) = 1.438 with the names: 94.13 % is gone."""
    assert named_share([BENT], HELD, "a free curve") == pytest.approx(0.9413, abs=1e-4)
    assert named_share([BENT], HELD, "") == pytest.approx(0.9861, abs=1e-4)
    assert named_share([BENT], replace(HELD, after=0.2), "") == 1.0
    quiet = HeldOutRmse(1.819, 1.019, 1.22, "another run, quieter than those fitted")
    assert named_share([replace(BENT, heldout=(1.9, 1.07))], quiet, "a free curve") == pytest.approx(0.783, abs=1e-3)


def test_no_share_is_told_where_nothing_is_named_or_nothing_was_wrong():
    assert named_share([], HELD, "") is None
    assert named_share([finding()], HELD, "a free curve") is None
    assert named_share([BENT], replace(HELD, before=0.3, after=0.3), "") is None
    assert named_share([replace(BENT, heldout=(25.0, 30.0))], HELD, "a free curve") == 0.0


@pytest.mark.parametrize(
    ("findings", "headline"),
    [
        ((), "unexplained"),
        ((BENT,), "unexplained in part: what has a name takes off 94 % of the error beyond the noise"),
        ((replace(BENT, heldout=(24.5, 24.0)),), "unexplained"),
    ],
)
def test_the_headline_tells_how_much_has_names(findings, headline):
    left = replace(LEFT, flexible=(FREE,))
    d = diagnosis(Unexplained(findings, left, None), HELD)
    assert (d.verdict, d.headline) == ("unexplained", headline)
    assert diagnosis(Unexplained(findings, replace(left, unpredictive=True), None), HELD).headline == "unexplained"


def test_a_verdict_that_leaves_nothing_is_its_own_headline():
    assert diagnosis(Explained((BENT,)), HELD).headline == "explained"
    assert diagnosis(Adequate(), HELD).headline == "adequate"


FREE = FlexibleShape("thrust", "N", (0.0, 1.0), 3, 0.0, 0.0, {}, (), "A free curve.")


def diagnosis(answer, held):
    return Diagnosis(
        *(("r",), "T1", answer, "C V|V|", {}, (), (), {}, Rmse(1.0, 0.5)),
        heldout=held,
        chi2_per_dof=1.0,
        whiteness_p=0.5,
    )
