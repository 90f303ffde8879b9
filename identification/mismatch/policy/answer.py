"""Thresholds: what an answer says beside its findings, and what of a twin has changed."""

from __future__ import annotations

from identification.mismatch.policy.record.threshold import Threshold

WHITE_P = Threshold(
    0.01,
    unit="probability of whiteness",
    reason=(
        "Below it what remains is called not white, and intervals and p-values are said to rest on a noise "
        "model that does not describe all of it."
    ),
)
UNIFORM_ERROR = Threshold(
    0.2887,
    unit="share of what a value could be at all",
    reason=(
        "A number of which only its ends a and b are known has standard error (b - a)/sqrt(12): with a larger one "
        "nothing was learnt of it, and it is called not determined."
    ),
)
LOST_ERRORS = Threshold(
    10.0,
    unit="standard errors in units of the value",
    reason=(
        "Of a value that cannot change its sign, or of which no bounds are known, an error of ten times itself leaves "
        "not even the order of magnitude: it is called not determined."
    ),
)
SURE_SIGMA = Threshold(
    3.0,
    unit="standard errors",
    reason=(
        "What a row of a shape's table is sure of: the largest such value is the size of the shape, and rows that are "
        "less sure than that tell nothing of it."
    ),
)
LEAST_SHARE_TOLD = Threshold(
    0.05,
    unit="share of the error beyond the noise",
    reason=(
        "An answer that leaves something unexplained says in its headline how much of the error has names, unless it "
        "is so little that it is none of what a reader would act on."
    ),
)
LINE_KNOWN_SIGMA = Threshold(
    4.0,
    unit="sigma",
    reason=(
        "A line within so many standard errors of a twin's frequency or ratio is the twin's line: both were "
        "estimated, and one of several might be meant."
    ),
)
LINE_KNOWN_RATIO = Threshold(
    0.01,
    unit="share of the ratio",
    reason=(
        "How well one run's turns are those of another: the scale of a measured rate, or of the volts in the "
        "place of it."
    ),
)
LINE_CHANGED_SIGMA = Threshold(
    3.3,
    unit="sigma",
    reason=(
        "By so many standard errors an amplitude must differ from the twin's to be a finding: noise does it "
        "once in a thousand."
    ),
    evidence="Two-sided normal tail at 3.3: 0.00097.",
)
CHANGED_CONSTANT_FALSE_ALARM = Threshold(
    0.01,
    unit="probability",
    reason=(
        "A thrust constant that differs from the twin's by less than noise would make it in one comparison of "
        "a hundred is the same."
    ),
)
CONSTANT_MOVED = Threshold(
    0.02,
    unit="share of C",
    reason=(
        "Where another effect was found, C may move by this much with what that effect refers to (a highest "
        "bus voltage, say), and is no finding of its own."
    ),
)
