"""Thresholds: which sweep is proposed, and when none is."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

LEVELS_APART_CHI2 = Threshold(
    20.0,
    unit="chi-square",
    reason=(
        "The sweep of two levels is long enough where the wrong kind of line is expected to lose so much: a "
        "right decision is then about 0.95 probable."
    ),
    evidence="A chi-square apart is normal with twice the root of its mean: P((20 - 4) / (2 sqrt 20)) = 0.963.",
)
SWEEP_DECIDES = Threshold(
    0.95,
    unit="probability of a right decision",
    reason="At this a sweep is long enough: a longer one costs water time and warms the motor.",
    evidence="docs/howto/settle.md: fifty ambiguous designs on the simulated bench (benchmarks/experiments/settle.py).",
)
PAIR_HARDLY_TOLD = Threshold(
    0.5,
    unit="probability of a right decision",
    reason="Below it a pair is said to be hardly told apart by the sweep, and what else it takes is told.",
)
RIVALS_STAY_ALIKE = Threshold(
    4.0,
    unit="chi-square",
    reason=(
        "Two rivals that the whole bench tells apart by less stay alike: the sweep may still tell the answer from both."
    ),
)
PAIR_DECIDED_CHI2 = Threshold(
    18.0,
    unit="chi-square",
    reason=(
        "So far apart a right decision is about SWEEP_DECIDES probable, so how long a sweep would have to be "
        "follows from it."
    ),
    evidence="A chi-square apart is normal with twice the root of its mean: P((18 - 4) / (2 sqrt 18)) = 0.951.",
)
SWEEP_GAIN = Threshold(
    0.01,
    unit="share of what can be gained",
    reason="When the whole time that is left would give less, the sweep ends.",
)
LONGEST_SWEEP = Threshold(
    12.0,
    unit="times the budget",
    reason="A sweep that would have to be longer than an hour of the usual five minutes is none: other means are told.",
)
SAME_DOUBT_ROUNDS = Count(
    2,
    unit="rounds",
    reason="Rounds that one doubt may survive: a third of the same kind would not settle it either.",
    evidence="docs/howto/settle.md: fifty ambiguous designs on the simulated bench (benchmarks/experiments/settle.py).",
)
HOPELESS_POWER = Threshold(
    0.05,
    unit="probability of a right decision",
    reason="Below it a sweep is not worth the water: the doubt needs other means.",
)
SHORTEST_SWEEP = Threshold(
    20.0,
    unit="s",
    reason="No sweep is shorter, so no diagnosis is asked for a shorter one.",
)
