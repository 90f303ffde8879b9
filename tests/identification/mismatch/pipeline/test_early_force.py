"""A log in which the force comes before its command, as a simulation by steps as long as its rows writes it."""

from __future__ import annotations

import pytest

from benchmarks.diagnosis.euler_logs import BOTH, NAMES, World, logged
from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose


def test_what_a_rotor_does_before_its_command_is_no_loss_at_reversals():
    """On intervals that were long before steps: `reversal_loss` beside it, `unexplained`, and a delay of -33 ms."""
    found = diagnose([logged(World(**BOTH, step=0.05), seed=3)])
    assert isinstance(found, Diagnosis)
    assert found.verdict == "explained"
    named = {f.effect: f for f in found.findings}
    assert set(named) == {*NAMES, "time_skew"}
    assert named["time_skew"].parameters["delay"].value == pytest.approx(-0.05, abs=0.006)
    assert named["asymmetry"].parameters["ratio"].value == pytest.approx(0.8, abs=0.002)
    assert named["dead_band"].parameters["half_width"].value == pytest.approx(0.8, abs=0.01)
