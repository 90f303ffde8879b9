"""Device side of a Loadstar DI-1000UHS-1K: a load cell's converter that speaks when asked, or streams.

Source: Loadstar Sensors, DI-100U/DI-1000U command set, DI-1000UHS-1K output formats: commands in either case, ended by
CR; answers ended by CR LF. Empty: `A`, and no more stream. MODEL, ID, UNIT(S), LC, TARE or CT0 -> `Tared`, W one
value, WC values as `%12.4f`, H counts (sign or blank, six hexadecimal digits, CR), SWC weight per count. Else `E`. Now
and then the count is -1 and means nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isnan

from sim_devices.instruments.lies import LIES, Lying
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

NEWTONS = {"N": 1.0, "Kg": 9.80665, "LB": 9.80665 * 0.45359237}
FULL_SCALE = 2**23 - 1
"""Counts of the converter."""
BUFFER = 64
"""Characters of a command."""


@dataclass(frozen=True, slots=True)
class LoadstarOptions:
    """`[devices.<name>]` of kind loadstar."""

    kind: str
    port: str
    baud: int = 230400
    unit: str = "LB"
    """Or `Kg`, `N`."""
    capacity: float = 500.0
    """N"""
    newtons_per_count: float = 0.0001
    rate: float = 575.0
    """Values/s of `WC`."""
    fast_rate: float = 1000.0
    """Counts/s of `H`; 0: a model without it."""
    odd: int = 0
    """Every so many counts one is -1; 0: none."""
    model: str = "FCM DI-1000"
    serial: str = "F1234-5678"
    clock_error: float = 0.0
    """relative: its clock runs faster by so much."""

    def __post_init__(self) -> None:
        if self.unit not in NEWTONS:
            raise ValueError(f"unit must be one of {', '.join(NEWTONS)}, got {self.unit!r}")
        if not (self.rate > 0 and self.fast_rate >= 0 and self.newtons_per_count > 0 and self.odd >= 0):
            raise ValueError("rate and newtons_per_count must be above 0, fast_rate and odd not below")


class Loadstar:
    """One interface. `read` gives the force on the cell in N (NaN: the converter has no number)."""

    faults = ("frozen", "silent", "reboot", "wrong_unit", *LIES)

    def __init__(self, options: LoadstarOptions, read: Callable[[], float]) -> None:
        self._options = options
        self._read = Lying(read, options.newtons_per_count)
        self._unit = options.unit
        self._buffer = b""
        self._mode = ""
        """`WC`, `H`; empty: it does not stream."""
        self._next = inf
        self._period = inf
        self._zero = 0.0
        """N"""
        self._sent = 0
        self._fault = ""
        self._last: bytes | None = None

    @property
    def due(self) -> float:
        return inf if self._fault == "silent" else self._next

    def tick(self, t: float) -> bytes:
        out = b""
        while self._next <= t:
            self._next += self._period
            if self._fault != "frozen" or self._last is None:
                self._last = self._shown()
            out += self._last
        return out

    def _shown(self) -> bytes:
        force = self._read() - self._zero
        if isnan(force):
            return b""
        self._sent += 1
        counts = min(max(round(force / self._options.newtons_per_count), -FULL_SCALE), FULL_SCALE)
        if self._mode == "H":
            if self._options.odd and self._sent % self._options.odd == 0:
                counts = -1
            return f"{'-' if counts < 0 else ' '}{abs(counts):06X}\r".encode("ascii")
        return f"{counts * self._per_count:12.4f}\r\n".encode("ascii")

    @property
    def _per_count(self) -> float:
        """Of the unit that is set."""
        return self._options.newtons_per_count / NEWTONS[self._unit]

    def feed(self, data: bytes, t: float) -> bytes:
        out = self.tick(t)
        if self._fault == "silent":
            return out
        for code in data:
            if code == 0x0D:
                words, self._buffer = self._buffer.decode("ascii", "replace").strip().upper(), b""
                out += self._execute(words, t)
            else:
                self._buffer = (self._buffer + bytes((code,)))[-BUFFER:]
        return out

    def _execute(self, words: str, t: float) -> bytes:
        self._mode, self._next = "", inf
        o = self._options
        match words.split():
            case []:
                return b"A\r\n"
            case ["WC"]:
                return self._begin("WC", o.rate, t)
            case ["H"] if o.fast_rate:
                return self._begin("H", o.fast_rate, t)
            case ["TARE" | "CT0"]:
                self._zero = self._read()
                return b"Tared\r\n"
            case ["W"]:
                return self._shown()
            case ["UNIT" | "UNITS", unit] if unit in {name.upper() for name in NEWTONS}:
                self._unit = next(name for name in NEWTONS if name.upper() == unit)
                return self._said(self._unit)
            case [asked]:
                return self._said(self._answers().get(asked, "E"))
        return b"E\r\n"

    def _answers(self) -> dict[str, str]:
        o = self._options
        capacity = f"{o.capacity / NEWTONS[self._unit]:.2f}"
        answers = {"MODEL": o.model, "ID": o.serial, "UNIT": self._unit, "UNITS": self._unit, "LC": capacity}
        return answers | ({"SWC": f"{self._per_count:.10f}"} if o.fast_rate else {})

    @staticmethod
    def _said(words: str) -> bytes:
        return f"{words}\r\n".encode("ascii")

    def _begin(self, mode: str, rate: float, t: float) -> bytes:
        self._mode, self._period = mode, 1.0 / (rate * (1.0 + self._options.clock_error))
        self._next = t + self._period
        return b""

    def fault(self, name: str, _t: float, amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"load cell: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "reboot":
            self._mode, self._next, self._zero, self._unit = "", inf, 0.0, self._options.unit
            return
        if name == "wrong_unit":
            self._unit = "N" if self._options.unit != "N" else "Kg"
        self._fault, self._last = name, None
        self._read.begin(name if name in LIES else "", amount)

    def clear(self, t: float) -> None:
        self._fault, self._unit = "", self._options.unit
        self._read.begin("", DEFAULT_AMOUNT)
        self._next = max(self._next, t)
