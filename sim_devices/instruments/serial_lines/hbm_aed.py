"""Device side of HBM's AED electronics: converts at its top rate, averages to its output rate, says digits.

Source: HBM, AD104-R2/R5 operating manual (ba_aed104_8): commands p. 14-16 (`;` or LF ends one; answer and CR LF, `0`
done, `?` refused; none to RES, STP, S..), COF p. 21, TEX p. 25, S.. p. 26, MSV and its status p. 38, TAR p. 44. With
`MSV?0` values come until STP or RES, and nothing else is obeyed. CSM as FIT electronics have it: the exclusive or of
the three bytes of value in the place of the status.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isnan

from sim_devices.instruments.lies import LIES, Lying
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

BOOT_TIME = 1.0
"""s"""
STABLE_WINDOW = 0.5
"""s over which a value may not move by more than `stable_band`."""
LARGEST = 2**23 - 1
UNSCALED = {True: 5_120_000, False: 1_000_000}
"""Digits at nominal load while NOV is 0: in four bytes, in text."""
RANGES = {"COF": (0, 12), "ICR": (0, 7), "ASF": (0, 8), "FMD": (0, 1), "TEX": (0, 255), "CSM": (0, 1), "TAS": (0, 1),
          "NOV": (0, LARGEST)}  # fmt: skip
STATUS = {"tare_overflow": 0x01, "overload": 0x04, "incoherent": 0x80}
STANDSTILL = 0x08


@dataclass(frozen=True, slots=True)
class HbmAedOptions:
    """`[devices.<name>]` of kind hbm_aed."""

    kind: str
    port: str
    baud: int = 9600
    address: int = 31
    model: str = "AED104"
    serial: str = "1234"
    top_rate: float = 100.0
    """values/s at ICR 0."""
    nominal_force: float = 500.0
    """N at nominal load."""
    nominal_value: int = 0
    """NOV: digits at nominal load; 0: 5,120,000 in four bytes, 1,000,000 in text."""
    rate_code: int = 2
    """ICR at power-up."""
    output_format: int = 9
    """COF at power-up."""
    checksum: int = 0
    """CSM at power-up; -1: this model has none."""
    stable_band: float = 0.3
    """N."""
    clock_error: float = 0.0
    """relative: its clock runs faster by so much."""

    def __post_init__(self) -> None:
        if not (self.top_rate > 0 and self.nominal_force > 0 and 0 <= self.nominal_value <= LARGEST):
            raise ValueError("top_rate and nominal_force above 0 and 0 <= nominal_value <= 8388607 are needed")
        if not (0 <= self.address <= 31 and 0 <= self.rate_code <= 7):
            raise ValueError("0 <= address <= 31 and 0 <= rate_code <= 7 are needed")


class HbmAed:
    """One transducer. `read` gives the force on the cell in N (NaN: its converter is overdriven)."""

    faults = ("frozen", "silent", "reboot", *STATUS, *LIES)

    def __init__(self, options: HbmAedOptions, read: Callable[[], float]) -> None:
        self._options = options
        self._read = self._lying = Lying(read, options.nominal_force / (options.nominal_value or UNSCALED[True]))
        self._fault = ""
        self._boots_at = inf
        self._next = 1.0 / options.top_rate
        self._value = read()
        self._tare = 0.0
        self._start()

    def _start(self) -> None:
        """As after power-up: settings as stored, silent."""
        o = self._options
        self._set = {"COF": o.output_format, "ICR": o.rate_code, "ASF": 5, "FMD": 0, "TEX": 172, "CSM": o.checksum,
                     "TAS": 1, "NOV": o.nominal_value}  # fmt: skip
        self._buffer = ""
        self._selected, self._left, self._stream = True, 0, False
        self._conversions: list[float] = []
        self._recent: deque[float] = deque(maxlen=max(round(STABLE_WINDOW * o.top_rate / 2**o.rate_code), 2))

    # -- time --------------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        return self._boots_at if self._boots_at < inf else self._next

    def tick(self, t: float) -> bytes:
        if self._boots_at < inf:
            if t >= self._boots_at:
                self._boots_at, self._next = inf, t
            return b""
        said = b""
        while self._next <= t:
            self._next += 1.0 / (self._options.top_rate * (1.0 + self._options.clock_error))
            self._conversions.append(self._read())
            if len(self._conversions) >= 2 ** self._set["ICR"]:
                said += self._new_value()
        return b"" if self._fault == "silent" else said

    def _new_value(self) -> bytes:
        conversions, self._conversions = self._conversions, []
        if self._fault != "frozen":
            self._value = sum(conversions) / len(conversions)
            self._recent.append(self._value)
        if self._stream:
            return self._said()
        if self._left:
            self._left -= 1
            return self._said() if self._left == 0 or self._set["TEX"] >= 128 else self._said(end=False)
        return b""

    # -- values ------------------------------------------------------------------------------------------------------

    def _said(self, *, end: bool = True) -> bytes:
        """A measured value in the format that is set."""
        form, tex = self._set["COF"], self._set["TEX"]
        binary = form % 2 == 0
        digits, status = self._digits(binary), self._status()
        behind = b"\r\n" if end else b""
        if not binary:
            comma = chr(tex % 128)
            parts = [f"{digits:8d}"]
            parts += [f"{self._options.address:02d}"] if form in (1, 5, 9) else []
            parts += [f"{status:03d}"] if form in (9, 11) else []
            return comma.join(parts).encode("ascii") + (behind or comma.encode("ascii"))
        if form in (2, 6):
            short = min(max(digits >> (0 if self._options.nominal_value else 8), -0x8000), 0x7FFF)
            return short.to_bytes(2, "little" if form == 6 else "big", signed=True) + behind
        value = digits.to_bytes(3, "big", signed=True)
        last = 0 if form in (0, 4) else value[0] ^ value[1] ^ value[2] if self._set["CSM"] == 1 else status
        frame = value + bytes((last,))
        return (frame[::-1] if form in (4, 12) else frame) + behind

    def _digits(self, binary: bool) -> int:
        net = self._value - (self._tare if self._set["TAS"] == 0 else 0.0)
        if isnan(net):
            return LARGEST
        full = self._set["NOV"] or UNSCALED[binary]
        return min(max(round(net / self._options.nominal_force * full), -LARGEST - 1), LARGEST)

    def _status(self) -> int:
        recent = self._recent
        still = len(recent) == recent.maxlen and max(recent) - min(recent) <= self._options.stable_band
        over = isnan(self._value) or abs(self._value) > 1.25 * self._options.nominal_force
        return STATUS.get(self._fault, 0) | (STATUS["overload"] if over else 0) | (STANDSTILL if still else 0)

    # -- commands ----------------------------------------------------------------------------------------------------

    def feed(self, data: bytes, t: float) -> bytes:
        if self._boots_at < inf or self._fault == "silent":
            return b""
        self._buffer += data.decode("latin-1")
        *commands, self._buffer = re.split("[;\n]", self._buffer)
        return b"".join(self._obey(command.strip().upper(), t) for command in commands if command.strip())

    def _obey(self, command: str, t: float) -> bytes:
        if command == "RES":
            self._start()
            self._boots_at = t + BOOT_TIME
            return b""
        if command == "STP":
            self._stream, self._left = False, 0
            return b""
        if self._stream:
            return b""
        if select := re.fullmatch(r"S(\d\d)", command):
            self._selected = int(select[1]) == self._options.address
            return b""
        if not self._selected:
            return b""
        answer = self._answer(command)
        return b"" if answer is None else answer.encode("ascii") + b"\r\n"

    def _answer(self, command: str) -> str | None:
        """None: values follow instead."""
        o = self._options
        if values := re.fullmatch(r"MSV\?\s*(\d*)", command):
            count = int(values[1] or 1)
            self._stream, self._left, self._conversions = count == 0, count, []
            return None
        if command == "TAR":
            self._tare, self._set["TAS"] = self._value, 0
            return "0"
        constant = {
            "IDN?": f'HBM, "{o.model}","{o.serial}", P20',
            "ADR?": f"{o.address:02d}",
            "BDR?": f"{o.baud},1",
            "TAV?": f"{round(self._tare / o.nominal_force * (o.nominal_value or UNSCALED[False])):07d}",
        }
        return constant.get(command) or self._setting(command)

    def _setting(self, command: str) -> str:
        parts = re.fullmatch(r"([A-Z]{3})(\?|\s*\+?\d{1,8})", command)
        if parts is None or self._set.get(parts[1], -1) < 0:
            return "?"
        name, value = parts[1], parts[2]
        if value == "?":
            return f"{self._set[name]:02d}"
        low, high = RANGES[name]
        if not low <= int(value) <= high:
            return "?"
        self._set[name] = int(value)
        self._conversions = []
        return "0"

    # -- faults ------------------------------------------------------------------------------------------------------

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"load cell: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "reboot":
            self._start()
            self._boots_at = t + BOOT_TIME
            return
        self._fault = name
        self._lying.begin(name if name in LIES else "", amount)

    def clear(self, t: float) -> None:
        self._fault = ""
        self._lying.begin("", DEFAULT_AMOUNT)
        self._next = max(self._next, t)
