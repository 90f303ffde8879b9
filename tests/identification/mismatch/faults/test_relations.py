"""Curves of one channel over another, the factor between two runs, and its p-value under run-to-run variation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from identification.mismatch import policy
from identification.mismatch.faults.comparison_of_runs import relations_of
from identification.mismatch.faults.relations import (
    curves_of,
    lawless,
    relation,
    strange_p,
    table_of,
    varied_p,
)
from identification.recording import Recording
from tests.identification.mismatch.faults.wired_runs import edited, only, wired_run


def table(recording: Recording):
    found = table_of(recording)
    assert found is not None
    return found


def test_a_factor_is_recovered_whatever_the_curve():
    sound = curves_of(table(wired_run(1)))
    other = table(edited(wired_run(2, 8.0), "thrust", lambda v: 0.5 * v))
    for a in ("command_voltage", "rotation_rate", "current"):
        found = relation(other, sound, a, "thrust")
        assert found is not None
        assert found.factor == pytest.approx(0.5, rel=0.03)
        assert found.explained > 0.97
        assert found.p_value < 1e-4


def test_relations_of_a_sound_run_are_one_within_what_is_stated():
    sound = curves_of(table(wired_run(1)))
    seen = [one for seed in range(2, 12) for one in relations_of(table(wired_run(seed, 9.0)), sound).values()]
    assert len(seen) == 10 * 12
    assert max(abs(one.log) for one in seen) < 0.06
    assert np.mean([one.p_value < 0.05 for one in seen]) < 0.05


def test_runs_that_share_no_values_say_nothing():
    sound = curves_of(table(only(wired_run(1), "thrust", "rotation_rate")))
    far = table(only(edited(wired_run(2), "rotation_rate", lambda v: v + 500.0), "thrust", "rotation_rate"))
    assert relation(far, sound, "rotation_rate", "thrust") is None
    assert table_of(only(wired_run(1), "command_voltage")) is None


def test_p_values_are_those_of_the_laws_they_name():
    assert varied_p(4.0) == pytest.approx(2 * stats.t.sf(4.0, policy.faults.RUN_TO_RUN_DEGREES))
    z = (np.arctanh(np.sqrt(0.9)) - np.arctanh(np.sqrt(0.26))) * np.sqrt(13)
    assert strange_p(0.26, 0.9) == pytest.approx(stats.norm.sf(z))
    assert strange_p(0.9, 0.9) == pytest.approx(0.5)


def test_a_run_whose_channels_are_not_what_they_say_breaks_their_laws():
    run = wired_run(1)
    rate, current = run.first_of("rotation_rate"), run.first_of("current")
    assert rate is not None
    assert current is not None
    wrong = edited(edited(run, "rotation_rate", lambda _: current.value), "current", lambda _: rate.value)
    assert lawless(table(wrong)) > lawless(table(run)) + 0.5
