"""Device side of a Mettler-Toledo weigh module: MT-SICS over a serial line.

Source: Mettler-Toledo MT-SICS reference manuals 11780711 and 11781363: reply `ID SP status SP value(10 characters,
right aligned) SP unit CRLF`; I4 on power-up and after @; S waits for stability (balance time-out 30 s), then `S I`;
SI answers under the identifier S. Line: 18 characters of 10 bits, 213 lines/s at 38400 baud.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from math import inf, isnan

from sim_devices.instruments.lies import LIES, Lying
from sim_devices.instruments.serial_lines.mt_sics_options import UNITS, MtSicsOptions, line, shown
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

BALANCE_TIMEOUT = 30.0
"""s a command waits for stability."""
BOOT_TIME = 2.0
"""s from power-up to the first word."""
STABLE_WINDOW = 0.5
"""s over which a stable reading may not move by more than `stable_band`."""
INTERNAL_ERROR = "Error 10b"
"""EEPROM error, from the electronics (manual, internal faults)."""
RATE_FAULTS = {"fast": 10.0, "hasty": 2.3, "slow": 0.1}
"""readings come this many times as often as they should; hasty: as often as a line of 38400 baud carries them."""
ERRORS = {"transmission_error": "ET", "logical_error": "EL"}
COMMANDS = ("@", "I0", "I1", "I2", "I3", "I4", "I10", "I11", "S", "SI", "SIR", "Z", "ZI", "T", "TA", "TAC", "TI", "UPD")
LEVEL_1 = ("T", "TA", "TAC", "TI")
LEVEL_2 = ("UPD", "I10", "I11")


class MtSics:
    """One weigh module. `read` gives the force on the cell in N (NaN: the electronics have no number)."""

    faults = (
        "frozen",
        "overload",
        "underload",
        "no_value",
        "internal_error",
        "wrong_unit",
        "fast",
        "hasty",
        "slow",
        "reboot",
        "silent",
        "transmission_error",
        "logical_error",
        *LIES,
    )

    def __init__(self, options: MtSicsOptions, read: Callable[[], float]) -> None:
        self._options = options
        self._read = self._lying = Lying(read, options.digit * UNITS[options.unit])
        self._buffer = b""
        self._zero = self._tare = 0.0
        self._value = read()
        self._conversions: list[float] = []
        self._rate = options.rate
        self._next = 0.0
        self._streaming = False
        self._pending: tuple[str, float] | None = None
        self._boots_at = inf
        self._fault = ""
        self._unit = options.unit
        self._recent: deque[float] = deque(maxlen=max(round(STABLE_WINDOW * self._rate), 2))
        self._sample()

    @property
    def due(self) -> float:
        return self._boots_at if self._boots_at < inf else self._next

    def feed(self, data: bytes, t: float) -> bytes:
        if self._boots_at < inf or self._fault == "silent":
            return b""
        self._buffer += data
        out = b""
        while (end := self._buffer.find(b"\n")) >= 0:
            request, self._buffer = self._buffer[:end], self._buffer[end + 1 :]
            out += self._answer(request.strip(b"\r "), t)
        return out

    def tick(self, t: float) -> bytes:
        if self._boots_at < inf:
            if t < self._boots_at:
                return b""
            self._boots_at, self._next = inf, t
            return self._identity()
        out = b""
        while self._next <= t:
            each = self._options.average
            ticks = self._rate * RATE_FAULTS.get(self._fault, 1.0) * each * (1.0 + self._options.clock_error)
            self._next += 1.0 / ticks
            self._conversions.append(self._read())
            if len(self._conversions) >= each:
                self._sample()
                out += self._on_reading(t)
        return b"" if self._fault == "silent" else out

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"load cell: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "reboot":
            self._reset()
            self._buffer, self._zero, self._tare = b"", 0.0, 0.0
            self._rate = self._options.rate
            self._boots_at = t + BOOT_TIME
            return
        self._fault = name
        self._lying.begin(name if name in LIES else "", amount)
        if name == "wrong_unit":
            self._unit = "kg" if self._options.unit == "N" else "N"

    def clear(self, t: float) -> None:
        self._fault = ""
        self._lying.begin("", DEFAULT_AMOUNT)
        self._unit = self._options.unit
        self._next = max(self._next, t)

    # -- readings ---------------------------------------------------------------------------------------------------

    def _sample(self) -> None:
        """The mean of the conversions since the last reading."""
        conversions, self._conversions = self._conversions or [self._read()], []
        if self._fault != "frozen":
            self._value = sum(conversions) / len(conversions)
            self._recent.append(self._value)

    @property
    def _stable(self) -> bool:
        recent = self._recent
        if len(recent) < (recent.maxlen or 0) or any(isnan(v) for v in recent):
            return False
        return max(recent) - min(recent) <= self._options.stable_band

    def _refusal(self) -> str:
        """Why there is no value: `+` overload, `-` underload, `I` not now; empty: there is one."""
        if self._fault == "overload" or self._value > self._options.capacity:
            return "+"
        if self._fault == "underload" or self._value < -self._options.capacity:
            return "-"
        return "I" if isnan(self._value) or self._fault == "no_value" else ""

    def _shown(self, newtons: float) -> str:
        return shown(newtons, self._unit, self._options.digit)

    def _weight(self, identifier: str) -> bytes:
        if self._fault == "internal_error":
            return line(f"S S {INTERNAL_ERROR}")
        why = self._refusal()
        if why:
            return line(f"{identifier} {why}")
        status = "S" if self._stable else "D"
        return line(f"{identifier} {status} {self._shown(self._value - self._zero - self._tare)}")

    def _on_reading(self, t: float) -> bytes:
        out = self._weight("S") if self._streaming else b""
        if self._pending is None:
            return out
        command, since = self._pending
        if self._stable or self._refusal() in ("+", "-"):
            self._pending = None
            return out + self._when_stable(command)
        if t - since > BALANCE_TIMEOUT:
            self._pending = None
            return out + line(f"{command} I")
        return out

    # -- commands ---------------------------------------------------------------------------------------------------

    def _answer(self, request: bytes, t: float) -> bytes:
        if self._fault in ERRORS or not request.isascii():
            return line(ERRORS.get(self._fault, "ET"))
        words = request.decode("ascii").split()
        if not words:
            return b""
        command, arguments = words[0], words[1:]
        if command not in COMMANDS:
            return line("ES")
        if arguments and command not in ("TA", "UPD"):
            return line("EL")
        return self._execute(command, arguments, t)

    def _execute(self, command: str, arguments: list[str], t: float) -> bytes:
        match command:
            case "@":
                self._reset()
                return self._identity()
            case "I0" | "I1" | "I2" | "I3" | "I4" | "I10" | "I11":
                return self._information(command)
            case "SI":
                self._streaming = False
                return self._weight("S")
            case "SIR":
                self._streaming = True
                return b""
            case "S" | "T" | "Z":
                self._streaming = self._streaming and command != "S"
                self._pending = (command, t)
                return self._on_pending()
            case "ZI":
                return self._zero_now()
            case "TI":
                return self._tare_now()
            case "TAC":
                self._tare = 0.0
                return line("TAC A")
            case "TA":
                return self._preset_tare(arguments)
            case _:
                return self._update_rate(arguments)

    def _on_pending(self) -> bytes:
        if self._pending is not None and (self._stable or self._refusal() in ("+", "-")):
            command, _ = self._pending
            self._pending = None
            return self._when_stable(command)
        return b""

    def _when_stable(self, command: str) -> bytes:
        why = self._refusal()
        if command == "S" or why:
            return self._weight("S") if command == "S" else line(f"{command} {why}")
        if command == "Z":
            self._zero, self._tare = self._value, 0.0
            return line("Z A")
        self._tare = self._value - self._zero
        return line(f"T S {self._shown(self._tare)}")

    def _zero_now(self) -> bytes:
        why = self._refusal()
        if why:
            return line(f"ZI {why}")
        self._zero, self._tare = self._value, 0.0
        return line(f"ZI {'S' if self._stable else 'D'}")

    def _tare_now(self) -> bytes:
        why = self._refusal()
        if why:
            return line(f"TI {why}")
        self._tare = self._value - self._zero
        return line(f"TI {'S' if self._stable else 'D'} {self._shown(self._tare)}")

    def _preset_tare(self, arguments: list[str]) -> bytes:
        if not arguments:
            return line(f"TA A {self._shown(self._tare)}")
        try:
            value, unit = float(arguments[0]), arguments[1]
            newtons = value * UNITS[unit]
        except (ValueError, IndexError, KeyError):
            return line("TA L")
        self._tare = newtons
        return line(f"TA A {self._shown(self._tare)}")

    def _update_rate(self, arguments: list[str]) -> bytes:
        if not arguments:
            return line(f"UPD A {self._rate:.3f}")
        try:
            rate = float(arguments[0])
        except ValueError:
            return line("UPD L")
        if len(arguments) > 1 or not 0.1 <= rate <= self._options.max_rate:
            return line("UPD L")
        self._rate = rate
        self._recent = deque(self._recent, maxlen=max(round(STABLE_WINDOW * rate), 2))
        return line("UPD A")

    def _information(self, command: str) -> bytes:
        o = self._options
        if command == "I0":
            last = COMMANDS[-1]
            return b"".join(line(f'I0 {"A" if c == last else "B"} {_level(c)} "{c}"') for c in COMMANDS)
        texts = {
            "I1": '"012" "2.00" "2.20" "1.00"',
            "I2": f'"{o.model} {o.capacity / UNITS[o.unit]:.0f} {o.unit}"',
            "I3": '"1.00 0.0.0.0"',
            "I4": f'"{o.serial}"',
            "I10": '"SIM"',
            "I11": f'"{o.model}"',
        }
        return line(f"{command} A {texts[command]}")

    def _identity(self) -> bytes:
        return self._information("I4")

    def _reset(self) -> None:
        """What @ does: as after power-up, but without a new zero."""
        self._streaming, self._pending = False, None


def _level(command: str) -> int:
    return 1 if command in LEVEL_1 else 2 if command in LEVEL_2 else 0
