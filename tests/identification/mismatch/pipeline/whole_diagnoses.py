"""Whole diagnoses of small runs, and what they found."""

from dataclasses import replace

import numpy as np

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from tests.identification.diagnosed_runs import run


def diagnosed(*runs, **how):
    found = diagnose(runs, **how)
    assert isinstance(found, Diagnosis), found
    return found


def effects(found):
    return {f.effect for f in found.findings}


def value(found, effect, name):
    (finding,) = [f for f in found.findings if f.effect == effect]
    return finding.parameters[name]


def within(estimate, true, sigmas=4.0, rel=0.0):
    assert abs(estimate.value - true) < sigmas * estimate.std + rel * abs(true), (estimate, true)
    assert 0 < estimate.std < 0.3 * abs(true)


KNEE = (0.03, 30.0)
"""1/N, N: bend and onset."""


def bent(*, cell):
    """Levels that a knee compresses by up to a third: of the cell, noise and all, or of what drives the rotor."""

    def compressed(value):
        bend, onset = KNEE
        e = np.clip(np.abs(value) - onset, 0.0, 1 / bend)
        return np.sign(value) * (np.minimum(np.abs(value), onset) + e - 0.5 * bend * e**2)

    runs = run(None if cell else lambda _t, _V, F: compressed(F), seconds=120.0, rate=20.0)
    command, thrust = runs.channels
    return replace(runs, channels=(command, replace(thrust, value=compressed(thrust.value)))) if cell else runs
