"""What can alarm on a clean recording, at which nominal rate, and what that adds up to."""

from __future__ import annotations

from dataclasses import dataclass

from identification.mismatch.policy import answer, faults, locate, periodic, select

SLOW_KINDS = 3
"""Kinds of slow change that are looked at: of the zero, of the gain, and of the gain more quickly."""


@dataclass(frozen=True, slots=True)
class Alarm:
    """One test that may call a clean recording something else."""

    name: str
    rate: float
    """Nominal probability, on one clean recording."""
    of: str
    """What it is the rate of."""
    counted: bool = True
    """Whether it belongs to the sum for a clean recording that is diagnosed without a twin."""


def false_alarms() -> tuple[Alarm, ...]:
    """Every test, the largest first; those that are not counted last."""
    line = float(periodic.LINE_FALSE_ALARM)
    return (
        Alarm("search for effects", float(select.SCREENING_FALSE_ALARM), "the largest of all trials, family-wise"),
        Alarm("line of one frequency", line, "the highest of all frequencies, family-wise"),
        Alarm("residual structure", float(locate.RESIDUAL_FALSE_ALARM), "the smallest p-value of all covariates"),
        Alarm("line locked to the rotor", periodic.LOCKED_LINE_SHARE * line, "the highest of all ratios, family-wise"),
        Alarm("hidden drift", float(select.STEADY_TERM_FALSE_ALARM), "its gain beside noise estimated anew"),
        Alarm("slow change", SLOW_KINDS * locate.SLOW_CHANGE_FALSE_ALARM, "the gain of any of three kinds"),
        Alarm("jump, pulses", 2 * locate.PLAIN_STRUCTURE_P, "the likeliest instant, the likeliest train"),
        Alarm("channel fault", float(faults.CHANNEL_FALSE_ALARM), "each test of each channel", counted=False),
        Alarm("thrust constant", float(answer.CHANGED_CONSTANT_FALSE_ALARM), "against a twin only", counted=False),
    )


def nominal() -> float:
    """The sum of what is counted: no clean recording should be called something else more often than this."""
    return sum(each.rate for each in false_alarms() if each.counted)
