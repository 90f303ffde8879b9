"""Cells of known curves under a set of weights, read in numpy: another sum than the one that is fitted."""

from __future__ import annotations

import numpy as np

from identification.calibration.loads import Load, Place, Weight, force_of
from identification.calibration.steps import Steps

SET = {
    name: Weight(name, mass, mass * 8e-6, 7950.0, 70.0)
    for name, mass in (("1", 1.0), ("2", 2.0), ("2*", 2.0), ("5", 5.0), ("10", 10.0))
}
PLACE = Place(9.8055, 3e-5, 1.18, 0.03, 1.0, 5e-5)
LADDER = ((), ("2",), ("5",), ("10",), ("10", "5"), ("10", "5", "2", "2*", "1"))
APART = 25.0
"""s between two loadings."""


def loads(directions=(1, -1), repetitions=2, ladder=LADDER):
    course = []
    for way in directions * repetitions:
        up = [Load(names, way) for names in ladder]
        course += [*up, *up[-2::-1]]
    return course


def forces(course, true=SET, place=PLACE):
    return np.array([force_of(load, true, place) for load in course])


def read(rng, force, *, gain=1.003, even=0.0, odd=0.0, cubic=0.0, zero=0.6, noise=0.004, creep=(0.0, 12.0), lag=0.0):
    """Steps with two windows each; `creep`: share and time constant, `lag`: N of a loop that closes at its ends."""
    n = force.size
    hung = APART * np.arange(n)
    time = hung[:, None] + np.array([[10.0, 18.0]])
    value = zero + gain * force + even * force**2 + odd * force * np.abs(force) + cubic * force**3
    if lag:
        top = np.abs(force).max()
        way = np.sign(np.diff(force, prepend=0.0))
        value = value - way * lag * 4.0 * np.abs(force) / top * (1.0 - np.abs(force) / top)
    slow, held = np.zeros((n, 2)), 0.0
    for k in range(n):
        slow[k] = force[k] + (held - force[k]) * np.exp(-(time[k] - hung[k]) / creep[1])
        held = force[k] + (held - force[k]) * np.exp(-APART / creep[1])
    read = value[:, None] + creep[0] * slow + noise * rng.standard_normal((n, 1))
    read = read + 0.3 * noise * rng.standard_normal((n, 2))
    return Steps(force, hung, time, read, np.full(n, np.nan))
