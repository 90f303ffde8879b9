"""Thresholds: when a command moves within its ticks."""

from __future__ import annotations

from identification.mismatch.policy.threshold import Threshold

TICK_INTERVAL = Threshold(
    0.2,
    unit="s",
    reason=(
        "A command that is written more seldom moves in steps, which are edges of intervals, and not in ticks "
        "within them."
    ),
)
TICK_DELAY = Threshold(
    0.02,
    unit="share of a tick",
    reason="A shorter delay leaves what the driver does within its ticks where it was, and is not worked out.",
)
