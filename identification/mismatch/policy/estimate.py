"""Thresholds: when a fitted parameter is not believed."""

from __future__ import annotations

from identification.mismatch.policy.threshold import Threshold

PRESSED_AT_BOUND_SIGMA = Threshold(
    2.5,
    unit="sigma",
    reason=(
        "A parameter at the end of what is possible that asks for more by so much is pressed there: its name "
        "is not earned, and rivals go before it."
    ),
)
DOUBTFUL_CLOCK_SHIFT = Threshold(
    0.2,
    unit="share of the most that clocks may differ by",
    reason=(
        "Beside a term that delays, a shift of the clocks larger than this may be the term's own delay: the "
        "fit is tried without one too."
    ),
)
