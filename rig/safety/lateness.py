"""How late the ticks of the control loop were, counted in bins so that a day of them costs nothing to keep."""

from __future__ import annotations

BIN = 1e-4
"""s"""
BINS = 1000
"""The last one holds everything from 0.1 s on."""


class Lateness:
    """Of the ticks since the last `clear`. All in s."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        self.worst, self.ticks, self._counts = 0.0, 0, [0] * BINS

    def add(self, seconds: float) -> None:
        self._counts[min(int(seconds / BIN), BINS - 1)] += 1
        self.ticks += 1
        self.worst = max(self.worst, seconds)

    def quantile(self, share: float) -> float:
        """Upper end of the bin below which `share` of the ticks are; never more than the worst."""
        passed = 0
        for number, count in enumerate(self._counts):
            passed += count
            if passed >= share * self.ticks:
                return min((number + 1) * BIN, self.worst)
        return self.worst

    def __str__(self) -> str:
        p50, p99 = self.quantile(0.5) * 1e3, self.quantile(0.99) * 1e3
        return f"worst lateness {self.worst * 1e3:.2f} ms, p99 {p99:.2f} ms, p50 {p50:.2f} ms of {self.ticks} ticks"
