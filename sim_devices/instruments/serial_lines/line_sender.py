"""Device side of an amplifier that says one integer a line: an HX711 on a small computer, a load-cell display.

Written after the sketches that such devices run (bogde/HX711, `Serial.println(raw)`): counts of the converter, mean of
the conversions since the last line, CR LF. It sends by itself, takes no command, and has no name to give.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isnan

from sim_devices.instruments.lies import LIES, Lying
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

WIDTH = 9
"""Characters of a number: padded, so that every line is as long as the next."""
FULL_SCALE = 2**23 - 1
"""Counts: the converter has 24 bits and stays at its end beyond it."""


@dataclass(frozen=True, slots=True)
class LineOptions:
    """`[devices.<name>]` of kind line."""

    kind: str
    port: str
    baud: int = 115200
    rate: float = 80.0
    """lines/s (HX711: 10 or 80 by a pin)."""
    newtons_per_count: float = 0.001
    average: int = 1
    """Conversions, evenly spread over the time between two lines, of which a line is the mean."""
    clock_error: float = 0.0
    """relative: its clock runs faster by so much."""

    def __post_init__(self) -> None:
        if self.average < 1:
            raise ValueError(f"average must be at least 1, got {self.average}")
        if not (self.rate > 0 and self.newtons_per_count > 0):
            raise ValueError("rate and newtons_per_count must be above 0")


class LineSender:
    """One amplifier. `read` gives the force on the cell in N (NaN: nothing is said)."""

    faults = ("frozen", "silent", *LIES)

    def __init__(self, options: LineOptions, read: Callable[[], float]) -> None:
        self._options, self._read = options, Lying(read, options.newtons_per_count)
        self._period = 1.0 / (options.rate * options.average * (1.0 + options.clock_error))
        self._next = self._period
        self._conversions: list[float] = []
        self._last = b""
        self._fault = ""

    @property
    def due(self) -> float:
        return inf if self._fault == "silent" else self._next

    def feed(self, _data: bytes, _t: float) -> bytes:
        return b""

    def tick(self, t: float) -> bytes:
        out = b""
        while self._next <= t:
            self._next += self._period
            self._conversions.append(self._read())
            if len(self._conversions) >= self._options.average:
                out += self._line()
        return out

    def _line(self) -> bytes:
        conversions, self._conversions = self._conversions, []
        value = sum(conversions) / len(conversions)
        if self._fault != "frozen":
            counts = 0 if isnan(value) else round(value / self._options.newtons_per_count)
            counts = min(max(counts, -FULL_SCALE - 1), FULL_SCALE)
            self._last = b"" if isnan(value) else f"{counts:{WIDTH}d}\r\n".encode("ascii")
        return self._last

    def fault(self, name: str, _t: float, amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"amplifier: expected one of {', '.join(self.faults)}, got {name!r}")
        self._fault = name
        self._read.begin(name if name in LIES else "", amount)

    def clear(self, t: float) -> None:
        self._fault = ""
        self._read.begin("", DEFAULT_AMOUNT)
        self._next = max(self._next, t)
