"""Rates with Wilson's intervals, goals, and whether they are met. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import sqrt
from typing import Literal

Z = 1.959964
"""Of a 95 % interval."""
Met = Literal["yes", "reached", "open", "no", ""]
"""yes: the whole interval lies within the goal; reached: the figure does; open: the interval still touches it; no: all
of it lies outside. Empty: a figure without a goal, or nothing was measured."""


def wilson(p: float, n: float) -> tuple[float, float]:
    """95 % interval of a share `p` seen in `n` (Wilson 1927), which holds near 0 and 1 too.

    >>> [round(x, 3) for x in wilson(0.95, 20)]
    [0.764, 0.991]
    """
    if not n:
        return 0.0, 1.0
    weight = Z**2 / n
    middle = (p + weight / 2) / (1 + weight)
    half = Z / (1 + weight) * sqrt(p * (1 - p) / n + weight / (4 * n))
    return max(middle - half, 0.0), min(middle + half, 1.0)


@dataclass(frozen=True, slots=True)
class Rate:
    """`hits` of `n`, with its interval."""

    hits: int
    n: int

    @property
    def value(self) -> float:
        return self.hits / self.n if self.n else float("nan")

    @property
    def low(self) -> float:
        return wilson(self.value, self.n)[0]

    @property
    def high(self) -> float:
        return wilson(self.value, self.n)[1]

    @property
    def told(self) -> str:
        """Empty when nothing was counted.

        >>> Rate(3, 4).told, Rate(0, 0).told
        ('3 of 4', '')
        """
        return f"{self.hits} of {self.n}" if self.n else ""

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
        if not self.n or not self.wanted:
            return ""
        if self.least <= self.value <= self.most:
            return "yes" if self.least <= self.low and self.high <= self.most else "reached"
        return "open" if self.high >= self.least and self.low <= self.most else "no"

    @property
    def wanted(self) -> str:
        """
        >>> of_rate("names", Rate(9, 10), least=0.92).wanted, of_rate("alarms", Rate(9, 10), 0.003, 0.02).wanted
        ('≥ 92 %', '0.3 to 2 %')
        """
        low, high = (f"{100 * x:.3g}" if self.percent else f"{x:.3g}" for x in (self.least, self.most))
        unit, bound = (" %", 1.0) if self.percent else ("", float("inf"))
        if self.least > 0.0 and self.most < bound:
            return f"{low} to {high}{unit}"
        if self.least <= 0.0 and self.most >= bound:
            return ""
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


def of_groups(what: str, groups: Iterable[Iterable[bool]], least: float = 0.0, most: float = 1.0) -> Goal:
    """A rate of what comes in groups (parameters of one run) that are right or wrong together: a wider interval.

    The interval is Wilson's for as many independent ones as have the variance that the groups show (Rao and Scott
    1992, A simple method for the analysis of clustered binary data, Biometrics 48).

    >>> one, many = of_groups("", [[True]] * 30 + [[False]] * 10), of_groups("", [[True] * 3] * 30 + [[False] * 3] * 10)
    >>> many.n, round(many.high - many.low, 2) == round(one.high - one.low, 2)
    (120, True)
    """
    seen = [list(group) for group in groups if group]
    found = rate(hit for group in seen for hit in group)
    p, n, m = found.value, found.n, len(seen)
    alone = p * (1.0 - p) * n
    together = sum((sum(group) - p * len(group)) ** 2 for group in seen) * m / (m - 1) if m > 1 else alone
    low, high = wilson(p, n / max(together / alone, 1.0) if alone > 0.0 else n)
    return Goal(what, least, most, p, low, high, n)


def of_rate(what: str, found: Rate, least: float = 0.0, most: float = 1.0) -> Goal:
    """A goal that a rate be between `least` and `most`, shares of 1."""
    return Goal(what, least, most, found.value, found.low, found.high, found.n)
