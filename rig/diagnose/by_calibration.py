"""What the errors of a model do not hold: the calibration of the load cell."""

from __future__ import annotations

from identification.mismatch.diagnosis import Diagnosis


def by_calibration(d: Diagnosis) -> str:
    """What the errors of the model do not hold, as a clause."""
    if not d.gain_std:
        return ""
    return f". The load cell's calibration leaves C, and every thrust, another +- {100 * d.gain_std:.2g} % (1 sigma)"
