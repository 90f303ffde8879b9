"""Every number that decides, once: in go reasons and evidence, out come thresholds by room, and what they add up to."""

from __future__ import annotations

from identification.mismatch.policy import (
    answer,
    compare,
    estimate,
    faults,
    locate,
    name,
    next_experiment,
    periodic,
    prepare,
    select,
    unnamed,
    validate,
    vehicle,
)
from identification.mismatch.policy.record.budget import Alarm, false_alarms, nominal
from identification.mismatch.policy.record.every import overridden, thresholds
from identification.mismatch.policy.record.threshold import Count, Threshold

__all__ = [
    "Alarm",
    "Count",
    "Threshold",
    "answer",
    "compare",
    "estimate",
    "false_alarms",
    "faults",
    "locate",
    "name",
    "next_experiment",
    "nominal",
    "overridden",
    "periodic",
    "prepare",
    "select",
    "thresholds",
    "unnamed",
    "validate",
    "vehicle",
]
