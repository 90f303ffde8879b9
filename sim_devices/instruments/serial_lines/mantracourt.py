"""Device side of a Mantracourt digital strain gauge card that speaks ASCII: converts at its rate, answers questions.

Source: Mantracourt, DCell & DSC user manual (2nd generation), p. 50: frame, form of numbers (sign, DPB digits, point,
DP digits, CR), `?` for what is refused, CR for what is done, station 000 for all and without an answer; DSCUSB user
manual, table of commands. OLDVAL of STAT is set when SYS was read and gone with the next conversion.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from math import isnan

from sim_devices.instruments.lies import LIES, Lying
from sim_devices.instruments.serial_lines.mt_sics_options import UNITS
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

OLDVAL = 1 << 13
STAT_BITS = {"overload": 1 << 9 | 1 << 7, "underload": 1 << 8 | 1 << 6, "integrity": 1 << 11, "shunt": 1 << 12}
REQUEST = re.compile(r"!(\d{3}):([A-Z0-9]{1,4})(\?|=.*)?")
LONGEST = 64
"""Characters without a CR that the card keeps."""


@dataclass(frozen=True, slots=True)
class MantracourtOptions:
    """`[devices.<name>]` of kind mantracourt_dsc."""

    kind: str
    port: str
    baud: int = 115200
    station: int = 1
    rate: float = 100.0
    """conversions/s."""
    unit: str = "N"
    """SYS is calibrated in: N, g or kg."""
    dp: int = 3
    """Digits after the point."""
    dpb: int = 5
    """Digits before it."""
    capacity: float = 500.0
    """N: beyond it the status says that the system is out of range."""
    serial: int = 123456
    turnaround: float = 0.001
    """s from a question to the first character of its answer."""
    clock_error: float = 0.0
    """relative: its clock runs faster by so much."""

    def __post_init__(self) -> None:
        if self.unit not in UNITS:
            raise ValueError(f"unit must be one of {', '.join(UNITS)}, got {self.unit!r}")
        if not (self.rate > 0 and 1 <= self.station <= 999 and 0 <= self.dp <= 7 and 1 <= self.dpb <= 7):
            raise ValueError("rate above 0, station 1 to 999, dp 0 to 7 and dpb 1 to 7 are needed")


class Mantracourt:
    """One card. `read` gives the force on the cell in N (NaN: its converter has no number)."""

    faults = ("frozen", "stopped", "silent", "refuses", "wrong_station", *STAT_BITS, *LIES)

    def __init__(self, options: MantracourtOptions, read: Callable[[], float]) -> None:
        self._options = options
        self._read = self._lying = Lying(read, 10.0**-options.dp * UNITS[options.unit])
        self._fault = ""
        self._buffer = ""
        self._next = 1.0 / options.rate
        self._value, self._old = read(), False

    @property
    def due(self) -> float:
        return self._next

    def tick(self, t: float) -> bytes:
        """Convert; it speaks when it is asked."""
        while self._next <= t:
            self._next += 1.0 / (self._options.rate * (1.0 + self._options.clock_error))
            if self._fault != "stopped":
                self._value, self._old = self._value if self._fault == "frozen" else self._read(), False
        return b""

    def feed(self, data: bytes, t: float) -> bytes:
        self.tick(t)
        self._buffer += data.decode("latin-1")
        *requests, self._buffer = self._buffer.split("\r")
        self._buffer = self._buffer[-LONGEST:]
        return b"".join(self._answer(request) for request in requests)

    def _answer(self, request: str) -> bytes:
        words = REQUEST.fullmatch(request[max(request.rfind("!"), 0) :].upper())
        if words is None or self._fault == "silent":
            return b""
        station = self._options.station + (1 if self._fault == "wrong_station" else 0)
        if int(words[1]) != station:
            return b""
        if self._fault == "refuses":
            return b"?\r"
        if words[3] != "?":
            return b"\r" if words[2] in ("RST", "SNAP", "RSPT", "SZ") else b"?\r"
        value = self._parameter(words[2])
        return b"?\r" if value is None else self._written(value)

    def _parameter(self, name: str) -> float | None:
        o = self._options
        if name in ("SYS", "SOUT"):
            self._old = True
            return 0.0 if isnan(self._value) else self._value / UNITS[o.unit]
        known = {
            "STAT": self._status(),
            "VER": 4 * 256 + 7,
            "SERL": o.serial % 65536,
            "SERH": o.serial // 65536,
            "STN": o.station,
            "DP": o.dp,
            "DPB": o.dpb,
        }
        return known.get(name)

    def _status(self) -> int:
        out = isnan(self._value) or self._value > self._options.capacity
        under = self._value < -self._options.capacity
        bits = STAT_BITS.get(self._fault, 0)
        bits |= STAT_BITS["overload"] if out else STAT_BITS["underload"] if under else 0
        return bits | (OLDVAL if self._old else 0)

    def _written(self, value: float) -> bytes:
        """Cut to DPB digits before the point, as a card with too few of them does."""
        o = self._options
        digits = f"{abs(value):.{o.dp}f}"
        whole, _, part = digits.partition(".")
        sign = "-" if value < 0 else "+"
        return f"{sign}{whole[-o.dpb :].zfill(o.dpb)}.{part}\r".encode("ascii")

    def fault(self, name: str, _t: float, amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"load cell: expected one of {', '.join(self.faults)}, got {name!r}")
        self._fault = name
        self._lying.begin(name if name in LIES else "", amount)

    def clear(self, _t: float) -> None:
        self._fault = ""
        self._lying.begin("", DEFAULT_AMOUNT)
