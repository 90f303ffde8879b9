"""Units that weighing instruments show, in newtons."""

from __future__ import annotations

STANDARD_GRAVITY = 9.80665
"""m/s^2, exact by definition (BIPM SI brochure, 9th ed., CGPM 1901): what balances are adjusted with."""
POUND = 0.453_592_37
"""kg, exact (international avoirdupois pound)."""
NEWTONS_PER_UNIT = {
    "N": 1.0,
    "mg": 1e-6 * STANDARD_GRAVITY,
    "g": 1e-3 * STANDARD_GRAVITY,
    "kg": STANDARD_GRAVITY,
    "t": 1e3 * STANDARD_GRAVITY,
    "lb": POUND * STANDARD_GRAVITY,
    "oz": POUND / 16.0 * STANDARD_GRAVITY,
}
