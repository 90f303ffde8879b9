"""Thresholds: what counts as noise, when a command moves within its ticks, when a fitted parameter is not believed."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Count, Threshold

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
TICK_INTERVAL = Threshold(
    0.2,
    unit="s",
    reason=(
        "A command that is written more seldom moves in steps, which are edges of intervals, and not in ticks "
        "within them."
    ),
)
TICK_DELAY = Threshold(
    0.001,
    unit="share of a tick",
    reason=(
        "A shorter delay leaves what the driver does within its ticks where it was, and is not worked out. A rate that "
        "is read finely shows on which side of a tick each sample is: with 0.02 a motor lag of 0.6 ms was told of a "
        "delay of 0.7 ms."
    ),
)
PRESSED_AT_BOUND_SIGMA = Threshold(
    2.5,
    unit="sigma",
    reason=(
        "A parameter at the end of what is possible that asks for more by so much is pressed there: its name "
        "is not earned, and rivals go before it."
    ),
    evidence="docs/sensitivity.md: of 297 concealed cases none are answered otherwise at half or double of it.",
)
DOUBTFUL_CLOCK_SHIFT = Threshold(
    0.2,
    unit="share of the most that clocks may differ by",
    reason=(
        "Beside a term that delays, a shift of the clocks larger than this may be the term's own delay: the "
        "fit is tried without one too."
    ),
)
CLOCK_HOLLOW_CHI2 = Threshold(
    1.0,
    unit="chi-square",
    reason=(
        "A fit is begun again at another place of the clocks, or of a threshold between levels, only where that is "
        "plainly better to first order."
    ),
)
ROUNDING_UNSEEN = Threshold(
    0.02,
    unit="share of the variance of the mean of all samples of a level",
    reason="What rounding shifts a level by is left aside where even the mean of all of its samples does not show it.",
)
ROUNDED_LEVELS = Count(
    300,
    unit="waves",
    reason="Each has an error of its own, which costs time; those with most samples are the ones that bend a curve.",
)
RATE_LEVELS = Count(
    4,
    unit="levels",
    reason="Fewer levels of a measured rate than this don't tell one static curve from another.",
)
RATE_LEVELS_RATIO = Threshold(
    10.0,
    unit="ratio of squares",
    reason=(
        "What leaves the levels of the measured rate three times as far off as something simpler is not the rotor's, "
        "whatever it does between them. Noise in eight levels makes such a ratio once in 300."
    ),
)
