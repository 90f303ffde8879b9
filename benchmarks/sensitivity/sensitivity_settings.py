"""The thresholds of the most consequence, and where each is put: at half and at double, one at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from identification.mismatch import policy

FACTORS = (0.5, 2.0)
AT_VALUE = "at its value"
ASKED = {
    "select.SCREENING_FALSE_ALARM": "what may be found at all",
    "select.KEPT_TERM_FALSE_ALARM": "what stays in the model",
    "select.PLAIN_DIRECTION_SIGMA": "what is no noise when the noise is estimated",
    "select.HIDDEN_TERM_PRICE": "what is told from slow noise",
    "select.HIDDEN_OFFSET_PRICE": "most false alarms are jumps of the zero",
    "select.NEXT_TERM_SHAPE_ERROR": "what a found term leaves for the next",
    "select.SHAPE_ERROR": "what a found term leaves that is called unexplained",
    "select.RIVALS_EQUAL_BIC": "explained or ambiguous",
    "select.RIVAL_STATED_BIC": "which rivals are stated",
    "select.PRESSED_TERM_HANDICAP": "which of two names where one ends at what is possible",
    "estimate.PRESSED_AT_BOUND_SIGMA": "when a value is not possible",
    "locate.RESIDUAL_FALSE_ALARM": "adequate or unexplained",
    "locate.PLAIN_STRUCTURE_P": "jumps and pulses that no smooth shape follows",
    "name.PART_DIFFERENCE": "when a parameter is not the same everywhere",
    "name.INCONSTANT_P": "the same, by chance",
    "name.OWN_COVARIATE_P": "when a shape is not the textbook's",
    "name.REPAIR_SHARE": "when two shapes only repair each other",
    "validate.PREDICTED_WORSE_CHI2": "when prediction doubts a name",
    "periodic.LINE_FALSE_ALARM": "lines that are taken out before all else",
    "estimate.LONGEST_NOISE_SCALE": "what is a drift and no noise",
}
"""The twenty of the most consequence, each with what it decides."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One threshold moved."""

    threshold: str
    factor: float

    @property
    def id(self) -> str:
        return f"{self.threshold} x {self.factor:g}"

    @property
    def value(self) -> float:
        return self.factor * dict(policy.thresholds())[self.threshold]


def settings(only: Sequence[str] = ()) -> list[Setting]:
    """All of them, or those of some thresholds."""
    return [Setting(name, factor) for name in ASKED if not only or name in only for factor in FACTORS]
