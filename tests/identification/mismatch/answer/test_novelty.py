"""What is told of findings that are new, that may be, and that are not."""

from __future__ import annotations

from identification.mismatch.answer.against_twin import told_new
from identification.mismatch.compare.earlier_recordings import Novelty
from tests.identification.mismatch.answer.answered import BAND, UNEVEN, finding


def test_what_is_not_new_is_no_finding_and_what_may_be_says_so():
    found = {BAND: finding(), UNEVEN: finding("asymmetry")}
    both = told_new(found, {BAND: Novelty("there before", -34.0), UNEVEN: Novelty("not shown before", 2.0)}, None)
    assert [f.effect for f in both.findings] == ["asymmetry"]
    assert both.findings[0].since == "not shown before"
    assert "could not have shown it" in both.findings[0].statement
    assert both.not_new == (found[BAND].statement,)
    assert "chi-square of both -34" in both.notes[0]


def test_what_is_new_says_so_and_what_nobody_asked_stays_as_it_is():
    found = {BAND: finding(), UNEVEN: finding("asymmetry")}
    told = told_new(found, {BAND: Novelty("changed", 80.0)}, None)
    assert [f.since for f in told.findings] == ["changed", ""]
    says = " That is new: the recordings behind the twin speak against it."
    assert [f.statement for f in told.findings] == [found[BAND].statement + says, found[UNEVEN].statement]
    assert (told.not_new, told.notes) == ((), ())
