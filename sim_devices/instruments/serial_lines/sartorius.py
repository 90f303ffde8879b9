"""Device side of a Sartorius balance that speaks SBI: readings at its own rate, one printed for each ESC P.

Source: Sartorius, Cubis MSE operating instructions and WZA weigh cells, data output: 16 characters, `+  253.50 g  ` CR
LF, or 22 with an identifier before it (`N` net, `Stat` for errors); the unit is blank while the reading moves; `High`
and `Low` beyond the range. ESC x1_, x2_, x3_: model, serial number, version.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from math import isnan

from sim_devices.instruments.lies import LIES, Lying
from sim_devices.instruments.serial_lines.mt_sics_options import UNITS
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

COMMAND = re.compile(r"\x1b([A-Z]|[a-z]{1,2}\d*_)")
WIDTHS = (16, 22)
LONGEST = 20
"""Characters of a command."""


@dataclass(frozen=True, slots=True)
class SartoriusOptions:
    """`[devices.<name>]` of kind sartorius_sbi."""

    kind: str
    port: str
    baud: int = 9600
    model: str = "LA34001S"
    serial: str = "37454321"
    version: str = "00-37-09"
    unit: str = "g"
    """N, g or kg."""
    decimals: int = 1
    """Of the display."""
    capacity: float = 500.0
    """N: beyond it the display says High or Low."""
    rate: float = 20.0
    """readings/s."""
    stable_band: float = 0.3
    """N by which two readings of a stable one differ at most."""
    characters: int = 22
    """Of an answer, 16 or 22."""
    turnaround: float = 0.01
    """s from a question to the first character of its answer."""
    clock_error: float = 0.0
    """relative: its clock runs faster by so much."""

    def __post_init__(self) -> None:
        if self.unit not in UNITS:
            raise ValueError(f"unit must be one of {', '.join(UNITS)}, got {self.unit!r}")
        if self.characters not in WIDTHS or not 0 <= self.decimals <= 6 or self.rate <= 0:
            raise ValueError("characters 16 or 22, decimals 0 to 6 and a rate above 0 are needed")


class Sartorius:
    """One balance. `read` gives the force on it in N (NaN: no reading)."""

    faults = ("frozen", "silent", "overload", "underload", "error", "display_off", *LIES)

    def __init__(self, options: SartoriusOptions, read: Callable[[], float]) -> None:
        self._options = options
        self._read = self._lying = Lying(read, 10.0**-options.decimals * UNITS[options.unit])
        self._fault = ""
        self._buffer = ""
        self._next = 1.0 / options.rate
        self._value, self._stable = read(), True

    @property
    def due(self) -> float:
        return self._next

    def tick(self, t: float) -> bytes:
        """A new reading; it speaks when it is asked."""
        while self._next <= t:
            self._next += 1.0 / (self._options.rate * (1.0 + self._options.clock_error))
            if self._fault != "frozen":
                before, self._value = self._value, self._read()
                self._stable = abs(self._value - before) <= self._options.stable_band
        return b""

    def feed(self, data: bytes, t: float) -> bytes:
        self.tick(t)
        self._buffer += data.decode("latin-1")
        out, end = b"", 0
        for found in COMMAND.finditer(self._buffer):
            out, end = out + self._answer(found[1]), found.end()
        self._buffer = self._buffer[end:][-LONGEST:]
        return b"" if self._fault == "silent" else out

    def _answer(self, command: str) -> bytes:
        o = self._options
        known = {"x1_": o.model, "x2_": o.serial, "x3_": o.version}
        if command == "P":
            return self._printed()
        return self._line("", f"{known[command]:>14}") if command in known else b""

    def _printed(self) -> bytes:
        o = self._options
        if self._fault == "error":
            return self._line("Stat", "   Err  54    ")
        if self._fault == "display_off":
            return self._line("Stat", "     OFF      ")
        if self._fault == "overload" or isnan(self._value) or self._value > o.capacity:
            return self._line("Stat", "     High     ")
        if self._fault == "underload" or self._value < -o.capacity:
            return self._line("Stat", "     Low      ")
        shown = f"{abs(self._value) / UNITS[o.unit]:.{o.decimals}f}"
        sign = "-" if self._value < 0 and float(shown) else "+"
        unit = o.unit if self._stable else ""
        return self._line("N", f"{sign} {shown:>8} {unit:<3}")

    def _line(self, identifier: str, fourteen: str) -> bytes:
        head = f"{identifier:<6}" if self._options.characters == max(WIDTHS) else ""
        return f"{head}{fourteen[:14]}\r\n".encode("ascii")

    def fault(self, name: str, _t: float, amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"balance: expected one of {', '.join(self.faults)}, got {name!r}")
        self._fault = name
        self._lying.begin(name if name in LIES else "", amount)

    def clear(self, _t: float) -> None:
        self._fault = ""
        self._lying.begin("", DEFAULT_AMOUNT)
