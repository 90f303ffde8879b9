"""Names that are mostly right, and what each effect is of what any shape could explain."""

import numpy as np
import pytest

from identification.mismatch.unnamed.shares import share
from identification.mismatch.validate.held_out import Score
from tests.identification.diagnosed_runs import dead_band, run
from tests.identification.mismatch.pipeline.whole_diagnoses import diagnosed


def lumpy(_t, V, F):
    """Beside whatever else: a twentieth of a tent between 5 and 9 V, in one direction, which no textbook has."""
    return F + 1.2 * np.maximum(1 - np.abs(V - 7.0) / 2.0, 0.0)


@pytest.mark.parametrize(
    ("without", "with_it", "least", "expected"),
    [(2.0, 1.0, 1.0, 1.0), (2.0, 2.0, 1.0, 0.0), (2.0, 2.5, 1.0, 0.0), (1.0, 1.0, 1.0, 0.0), (5.0, 4.0, 3.0, 9 / 16)],
)
def test_a_share_is_of_the_squared_error_that_could_be_taken_off(without, with_it, least, expected):
    assert share(Score(without, 0.0), Score(with_it, 0.0), least) == pytest.approx(expected)


def test_what_is_explained_whole_is_all_of_it():
    found = diagnosed(run(volts=dead_band(1.0)))
    (one,) = found.findings
    assert (one.effect, one.grade, one.doubts) == ("dead_band", "all", ())
    without, with_it = one.heldout
    assert with_it < without
    assert one.share == pytest.approx(1.0)


def test_a_name_beside_a_lump_is_said_and_what_is_left_stands_beside_it():
    found = diagnosed(run(change=lumpy, volts=dead_band(1.2)))
    assert found.verdict == "unexplained"
    (band,) = [f for f in found.findings if f.effect == "dead_band"]
    assert band.parameters["half_width"].value == pytest.approx(1.2, abs=0.12)
    assert 0.8 < band.share <= 1.0
    assert found.unexplained is not None
    assert found.heldout.after < 0.5 * found.heldout.before
