"""Answers of a diagnosis written by hand: what pages and texts are made of."""

from dataclasses import replace

import numpy as np

from identification.mismatch.answer.verdict import decided
from identification.mismatch.diagnosis import (
    Curves,
    Diagnosis,
    Finding,
    HeldOutRmse,
    Mismatch,
    NextExperiment,
    PlanStep,
    RivalFinding,
    Rmse,
)
from identification.mismatch.unexplained import Remainder
from identification.mismatch.value import Value, Where
from identification.physics.term import Scale
from identification.twin import Source, Twin, TwinNoise, TwinTerm

LEVELS = np.array([0.0, 8.0, -8.0, 2.0, 16.0, -16.0, -2.0, 0.0])
HOLD, RATE = 5.0, 20.0
NAME = "T<1> & 'co'"
C, LAG = 0.4, 0.3


def lagging(name="a", seed=0):
    """Curves of a run in which thrust follows its command with a lag."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, HOLD * LEVELS.size, 1 / RATE) + 0.5 / RATE
    V = LEVELS[(t / HOLD).astype(int)]
    x = np.zeros(t.size)
    for i in range(1, t.size):
        x[i] = x[i - 1] + (V[i] - x[i - 1]) / (1 + LAG * RATE)
    model = C * x * np.abs(x) + 1.0
    return Curves(name, t, V, model + rng.normal(0, 0.1, t.size), C * V * np.abs(V) + 1.0, model)


def twin():
    scale = Scale(16.0, "V", 102.4, 40.0, 0.05)
    term = TwinTerm("motor_lag", "first_order", {"time_constant": LAG}, scale)
    sources = (Source("a", "ab" * 32),)
    names = ("C", "motor_lag.time_constant")
    return Twin(
        NAME, "command_voltage", C, (term,), names, ((1e-8, 0.0), (0.0, 1e-6)), TwinNoise(0.01, 0), sources, 0.05, 16
    )


LATE = Mismatch("thrust", Where("time_since_step", 0.0, 1.0, "s"), 0.9, 1e-20, "90 % at time_since_step 0 to 1 s.")
HIGH = Mismatch("thrust", Where("command_voltage", 8.0, 30.0, "V"), 0.7, 3e-7, "70 % at command_voltage 8 to 30 V.")
SKEW = RivalFinding("time_skew", "", {"delay": Value(0.2, 0.01, "s")}, 2.0, "Time skew: 0.2 s.")
LAGS = Finding(
    *("motor_lag", "first_order", "Motor lag: time constant 0.3 s."),
    *({"time_constant": Value(LAG, 0.001, "s")}, 0.0, 5000.0, 0.7, (SKEW,)),
)
HELD = HeldOutRmse(5.0, 0.11, 0.1, "every fourth block of time")
NEXT = NextExperiment("separates motor_lag from time_skew", (PlanStep(2.0, 4.0), PlanStep(-9.0, 3.0, 0.5)), 0.97)
ODD = Remainder(
    *(Where("time", 5.0, 20.0, "s"), 0.3, 1e-5, ((2.0, 0.1, 0.02), (8.0, -0.3, 0.03), (20.0, np.nan, np.nan))),
    *("Something is left at time 5 to 20 s.", ("heating: it would take values that are not possible",)),
)


def answer(findings=(LAGS,), unexplained=None, experiment=NEXT, **changes):
    base = {"C": Value(0.39, 0.001, "N/V^2"), "tare": Value(1.0, 0.01, "N")}
    d = Diagnosis(
        *(
            ("a",),
            NAME,
            decided(tuple(findings), unexplained, experiment, HELD),
            "C V|V|",
            base,
            (LATE, HIGH),
            ("motor_lag",),
        ),
        {**base, "motor_lag.time_constant": Value(LAG, 0.001, "s"), "heating.loss": Value(0.1, np.nan, "1")},
        *(Rmse(5.0, 0.1), HELD, 1.02, 0.4),
        *(("the motor's temperature was not recorded",), (lagging(),), twin()),
    )
    return replace(d, **changes)
