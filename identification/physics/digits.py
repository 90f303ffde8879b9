"""How many digits a sentence needs so that it still says what a number is beside another one."""

from __future__ import annotations

from math import floor, isfinite, log10

MOST = 6
"""Digits behind the point."""


def beside(value: float, neutral: float, least: int = 0) -> str:
    """The value with two significant digits of what it is beside `neutral`, `least` behind the point at least.

    >>> beside(0.93, 1.0), beside(0.99874, 1.0), beside(1.9962, 2.0, 2), beside(1.0, 1.0, 2)
    ('0.930', '0.9987', '1.9962', '1.00')
    """
    off = abs(value - neutral)
    digits = 1 - floor(log10(off)) if off > 0 and isfinite(off) else 0
    return f"{value:.{min(max(digits, least, 0), MOST)}f}"


def percent(share: float) -> str:
    """A share in per cent, of two significant digits.

    >>> percent(0.234), percent(0.0412), percent(0.0004), percent(1.5)
    ('23', '4.1', '0.040', '150')
    """
    return beside(100 * share, 0.0)
