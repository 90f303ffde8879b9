"""A diagnosis that is interrupted answers with the model that it has, and says what it did not ask."""

from __future__ import annotations

import pytest

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.observer import Interrupted
from identification.mismatch.pipeline import diagnose
from tests.identification.diagnosed_runs import dead_band, run

NOT_ALL, NO_RIVALS = "whether more is left out", "whether another effect would do as well"


class Ends:
    """An observer that ends the search where what is tried begins so, and ever after."""

    def __init__(self, at: str | None) -> None:
        self.at, self.ended = at, False
        self.stages: list[str] = []
        self.tried: list[str] = []

    def stage(self, name: str) -> None:
        self.stages.append(name)

    def trying(self, what: str) -> None:
        self.tried.append(what)
        self.ended = self.ended or (self.at is not None and what.startswith(self.at))
        if self.ended:
            raise Interrupted


@pytest.fixture(scope="module")
def recording():
    return run(volts=dead_band(1.2), seconds=80.0, rate=8.0)


def answered(recording, at: str | None) -> tuple[Diagnosis, Ends]:
    watch = Ends(at)
    found = diagnose([recording], watch=watch)
    assert isinstance(found, Diagnosis), found
    return found, watch


def test_who_watches_is_told_each_stage_and_what_is_tried_and_changes_nothing(recording) -> None:
    found, watch = answered(recording, None)
    assert watch.stages[0] == "reading the runs"
    assert watch.stages[-1] == "judging by what was not fitted"
    assert any("dead_band beside the baseline" in each for each in watch.tried)
    alone = diagnose([recording])
    assert (alone.verdict, dict(alone.model)) == (found.verdict, dict(found.model))
    assert not any(note.startswith("Interrupted") for note in found.notes)


def test_interrupted_at_once_it_has_no_term_and_says_that_none_was_looked_for(recording) -> None:
    found, watch = answered(recording, "all of the catalogue")
    assert found.model_terms == ()
    assert found.verdict == "unexplained", "what is left is seen all the same"
    assert NOT_ALL in found.notes[0]
    assert "periodic" in found.notes[0]
    assert len(watch.tried) == 1


def test_interrupted_among_rivals_it_has_its_terms_and_says_that_no_rival_was_asked(recording) -> None:
    found, _ = answered(recording, "rivals of")
    assert "dead_band" in found.model_terms
    assert not any(finding.rivals for finding in found.findings)
    assert NO_RIVALS in found.notes[0]
    assert NOT_ALL not in found.notes[0]
