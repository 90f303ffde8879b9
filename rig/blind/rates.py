"""Rates with Wilson's intervals, goals, and whether they are met. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import sqrt
from typing import Literal

Z = 1.959964
"""Of a 95 % interval."""
Met = Literal["yes", "no", "open"]
"""open: missed, but the interval still holds the goal; or nothing was measured."""


@dataclass(frozen=True, slots=True)
class Rate:
    """`hits` of `n`; interval of Wilson (1927), which holds near 0 and 1 too.

    >>> r = Rate(19, 20)
    >>> round(r.value, 3), round(r.low, 3), round(r.high, 3)
    (0.95, 0.764, 0.991)
    """

    hits: int
    n: int

    @property
    def value(self) -> float:
        return self.hits / self.n if self.n else float("nan")

    @property
    def low(self) -> float:
        return self._bounds()[0]

    @property
    def high(self) -> float:
        return self._bounds()[1]

    def _bounds(self) -> tuple[float, float]:
        if not self.n:
            return 0.0, 1.0
        p, weight = self.value, Z**2 / self.n
        middle = (p + weight / 2) / (1 + weight)
        half = Z / (1 + weight) * sqrt(p * (1 - p) / self.n + weight / (4 * self.n))
        return max(middle - half, 0.0), min(middle + half, 1.0)

    @property
    def told(self) -> str:
        """Empty when nothing was counted.

        >>> Rate(3, 4).told, Rate(0, 0).told
        ('75 % of 4', '')
        """
        return f"{100 * self.value:.0f} % of {self.n}" if self.n else ""

    def json(self) -> dict[str, float | int | None]:
        return {
            "hits": self.hits,
            "n": self.n,
            "rate": self.value if self.n else None,
            "low": self.low,
            "high": self.high,
        }


def rate(hits: Iterable[bool]) -> Rate:
    """Of truths.

    >>> rate([True, False, True]).hits
    2
    """
    seen = list(hits)
    return Rate(sum(seen), len(seen))


@dataclass(frozen=True, slots=True)
class Goal:
    """A figure that is to lie within `least` .. `most`."""

    what: str
    least: float
    most: float
    value: float
    low: float
    high: float
    n: int
    percent: bool = True

    @property
    def met(self) -> Met:
        if not self.n:
            return "open"
        if self.least <= self.value <= self.most:
            return "yes"
        return "open" if self.high >= self.least and self.low <= self.most else "no"

    @property
    def wanted(self) -> str:
        """
        >>> of_rate("names", Rate(9, 10), least=0.92).wanted, of_rate("alarms", Rate(9, 10), 0.003, 0.02).wanted
        ('≥ 92 %', '0.3 to 2 %')
        """
        low, high = (f"{100 * x:.3g}" if self.percent else f"{x:.3g}" for x in (self.least, self.most))
        unit = " %" if self.percent else ""
        if self.least > 0.0 and self.most < (1.0 if self.percent else float("inf")):
            return f"{low} to {high}{unit}"
        return f"≥ {low}{unit}" if self.least > 0.0 else f"≤ {high}{unit}"

    @property
    def measured(self) -> str:
        if not self.n:
            return "not measured"
        return f"{100 * self.value:.1f} %" if self.percent else f"{self.value:.3f}"

    @property
    def interval(self) -> str:
        if not self.n or not self.percent:
            return ""
        return f"{100 * self.low:.1f} to {100 * self.high:.1f} %"


def of_rate(what: str, found: Rate, least: float = 0.0, most: float = 1.0) -> Goal:
    return Goal(what, least, most, found.value, found.low, found.high, found.n)
