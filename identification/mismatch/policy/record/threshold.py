"""A number that decides what is claimed, doubted, kept, dropped or refused; it behaves as the number everywhere.

>>> level = Threshold(0.01, unit="probability", reason="Noise does it once in a hundred.")
>>> 0.5 * level, level < 0.02, f"{level:g}", level.unit
(0.005, True, '0.01', 'probability')
"""

from __future__ import annotations

from typing import Any, NoReturn, Self, final


@final
class Threshold(float):
    """A figure that decides. What is computed with it is a plain number."""

    unit: str
    """What it is a number of: sigma, BIC, s, a share of something."""
    reason: str
    """One sentence: why there is a threshold, and why about there."""
    evidence: str
    """A figure of a benchmark of this repository with its file, or a citation; empty where there is none yet."""

    def __new__(cls, value: float, *, unit: str, reason: str, evidence: str = "") -> Self:
        made = float.__new__(cls, value)
        vars(made).update(unit=unit, reason=reason, evidence=evidence)
        return made

    def __getnewargs_ex__(self) -> tuple[tuple[float], dict[str, Any]]:
        return (float(self),), dict(vars(self))

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(_frozen(name))

    def moved(self, value: float) -> Self:
        """The same threshold elsewhere: for a run that asks what depends on it."""
        return type(self)(value, **vars(self))


@final
class Count(int):
    """The same where a whole number decides."""

    unit: str
    reason: str
    evidence: str

    def __new__(cls, value: int, *, unit: str, reason: str, evidence: str = "") -> Self:
        made = int.__new__(cls, value)
        vars(made).update(unit=unit, reason=reason, evidence=evidence)
        return made

    def __getnewargs_ex__(self) -> tuple[tuple[int], dict[str, Any]]:
        return (int(self),), dict(vars(self))

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(_frozen(name))

    def moved(self, value: float) -> Self:
        """The same elsewhere, at the nearest whole number, at least 1: of 0.5 there is no count."""
        return type(self)(max(round(value), 1), **vars(self))


def _frozen(name: str) -> str:
    return f"{name} of a threshold cannot be set; what decides is written down once, in identification/mismatch/policy"
