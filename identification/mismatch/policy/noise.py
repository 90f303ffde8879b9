"""Thresholds: what counts as noise."""

from __future__ import annotations

from identification.mismatch.policy.threshold import Count, Threshold

COLOURED_NOISE_ROWS = Count(
    100,
    unit="rows",
    reason="With fewer rows the noise is taken as white: variances at several time scales would be guesses.",
)
LONGEST_NOISE_SCALE = Threshold(
    0.25,
    unit="share of the longest run",
    reason=(
        "What is slower than a quarter of the run is a drift and no noise: of slower noise one run holds no "
        "sample, so it cannot be told from a mismatch."
    ),
    evidence="docs/proof.md: 6 alarms in 167 clean recordings whose noise is slower than a hold, 4 in 835 others.",
)
