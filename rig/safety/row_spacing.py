"""Do the rows of a stream come one by one? Rows that are missing, that come twice, that come too fast for long.

Their number alone says little: a tenth of lost rows is within what clocks differ, and doubled ones make up for them.
Judged over whole windows, and by two of them: a machine that stood still hands over rows late and together once. Pure.
"""

from __future__ import annotations

from rig.safety.guard import Trip

Row = tuple[float, ...]

MOST_LOST, MOST_REPEATED = 0.05, 0.05
"""Shares of a window; a sound line has none."""
LEAST = 3
"""Rows; fewer in a window are chance."""
MOST_FAST = 1.5
"""Times the nominal rate over two windows; amplifiers with a clock of their own are off by a tenth."""
NEAR = 0.25
"""Relative distance of the median spacing from the nominal one within which gaps are counted: rows that an adapter
hands over in pairs have no spacing."""
SHORT, LONG = 0.6, 1.6
"""Times the spacing: closer is together with the one before it; wider has lost one between."""
WINDOWS = 2


class RowSpacing:
    """One stream; `window` s."""

    def __init__(self, stream: str, period_s: float, window: float, start: float) -> None:
        self._stream, self._period, self._window, self._start = stream, period_s, window, start
        self._gaps: list[float] = []
        self._last: tuple[float, Row] | None = None
        self._repeated = 0
        self._wrong, self._windows = "", 0
        """What was wrong with the window before (`lost`, `twice`, `fast`), and with how many in a row."""

    def add(self, time: float, values: Row) -> None:
        if self._last is not None:
            gap = time - self._last[0]
            self._gaps.append(gap)
            self._repeated += gap < SHORT * self._period and values == self._last[1]
        self._last = (time, values)

    def advance(self, now: float) -> Trip | None:
        """What two whole windows had wrong; None between the ends of windows."""
        elapsed = now - self._start
        if elapsed < self._window:
            return None
        wrong, cause, value = self._judge(elapsed)
        self._start, self._gaps, self._repeated = now, [], 0
        self._windows = self._windows + 1 if wrong and wrong == self._wrong else bool(wrong)
        self._wrong = wrong
        if self._windows < WINDOWS:
            return None
        return Trip(
            f"{self._stream}: {cause}; check its line, its adapter and its rate", "rate", now, self._stream, value
        )

    def _judge(self, elapsed: float) -> tuple[str, str, float]:
        rows = len(self._gaps)
        if rows / elapsed * self._period > MOST_FAST:
            rate = rows / elapsed
            allowed = MOST_FAST / self._period
            return "fast", f"{rate:.3g} rows/s for {WINDOWS} windows, at most {allowed:.3g} are expected", rate
        if self._repeated >= LEAST and self._repeated > MOST_REPEATED * rows:
            share = self._repeated / rows
            return "twice", f"{share:.0%} of its rows came twice, {MOST_REPEATED:.0%} are allowed", share
        lost = self._lost()
        if lost >= LEAST and lost > MOST_LOST * (rows + lost):
            share = lost / (rows + lost)
            return "lost", f"{share:.0%} of its rows are missing, {MOST_LOST:.0%} are allowed", share
        return "", "", 0.0

    def _lost(self) -> int:
        """Rows that gaps have room for, less those that came together with another."""
        if not self._gaps:
            return 0
        spacing = sorted(self._gaps)[len(self._gaps) // 2]
        if abs(spacing / self._period - 1.0) > NEAR:
            return 0
        missing = sum(round(gap / spacing) - 1 for gap in self._gaps if gap > LONG * spacing)
        return missing - sum(gap < SHORT * spacing for gap in self._gaps)
