"""What a verdict's sentence says of rivals, of what would tell them, and of what was tried and refused."""

from identification.mismatch.diagnosis import NextExperiment, PlanStep
from identification.mismatch.verdict_clauses import refused, to_settle


def test_the_next_experiment_is_told_with_what_it_separates():
    steps = (PlanStep(5.4, 3.0), PlanStep(-5.4, 4.0))
    found = to_settle(NextExperiment("separates exponent from dead_band: levels of 5.4 V; exponent stays", steps, 0.9))
    assert found.endswith("2 steps of 7 s together: it separates exponent from dead_band: levels of 5.4 V.")


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
