"""Device side of a bench supply that speaks SCPI on a serial line, with a motor at its terminals.

Source: SCPI-99 volume 1 (long and short headers, error numbers -113 undefined header, -222 data out of range, -104 data
type) and IEEE 488.2. The watchdog is that of Keysight (N6900/N7900 operating and service guide, p. 251, 252; N6700C,
p. 158): OUTP:PROT:WDOG, OUTP:PROT:WDOG:DEL in s; any word feeds it. When it ends the output is latched off, **its
programmed state is not changed**, and OUTP:PROT:CLE brings back what was. One quadrant: nothing below 0 V.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from sim_devices.wires.serial_line import DEFAULT_AMOUNT
from sim_devices.world import World

NO_ERROR = (0, "No error")
BOOT_TIME = 1.0
"""s"""
LONGEST = 256
"""Characters of a line that it keeps."""
LEAST_DELAY, MOST_DELAY = 0.1, 3600.0
"""s of the watchdog."""
Log = Callable[..., None]
"""log(event, **fields): the truth log."""


@dataclass(frozen=True, slots=True)
class ScpiSupplyOptions:
    """`[devices.<name>]` of kind scpi_supply."""

    kind: str
    port: str
    baud: int = 9600
    identity: str = "SIM,PSU-60,1234,1.0"
    max_voltage: float = 60.0
    """V"""
    max_current: float = 50.0
    """A"""
    has_watchdog: bool = True
    broken_watchdog: bool = False
    """The watchdog is set and never ends."""

    def __post_init__(self) -> None:
        if not (self.max_voltage > 0 and self.max_current > 0):
            raise ValueError("max_voltage and max_current must be above 0")


@dataclass(frozen=True, slots=True)
class Measured:
    """V at the terminals, A."""

    voltage: float = 0.0
    current: float = 0.0


def measured(world: World) -> Measured:
    """What the supply measures of the world now."""
    driven = world.state.driven
    return Measured(world.state.terminals if driven else 0.0, world.sample("current") if driven else 0.0)


class ScpiSupply:
    """One supply. `measure` gives what it measures now; `log` writes to the truth."""

    faults = ("frozen", "silent", "broken_watchdog", "output_off", "error", "reboot", "ignores_commands", "redrives",
              "current_factor")  # fmt: skip

    def __init__(self, options: ScpiSupplyOptions, measure: Callable[[], Measured], log: Log) -> None:
        self._options, self._measure, self._log = options, measure, log
        self._fault, self._amount = "", DEFAULT_AMOUNT
        self._frozen: Measured | None = None
        self._boots_at = inf
        self._start()

    def _start(self) -> None:
        """As after power-up."""
        o = self._options
        self._set = {"VOLT": 0.0, "CURR": o.max_current, "VOLT:PROT": 1.1 * o.max_voltage}
        self._on = self._latched = self._guarded = False
        self._delay, self._fed = 60.0, -inf
        self._errors: deque[tuple[int, str]] = deque(maxlen=20)
        self._buffer, self._told = "", 0.0

    # -- the motor ---------------------------------------------------------------------------------------------------

    @property
    def on(self) -> bool:
        """Whether there is a voltage: switched on, and no protection has latched it off."""
        return self._on and not self._latched

    @property
    def voltage(self) -> float:
        """V at the terminals that it keeps; 0 where the output is off."""
        return self._set["VOLT"] if self.on else 0.0

    def drive(self, _n: float, _dt: float) -> tuple[float | None, float]:
        """(volts, amps) for one world step: volts None means that nothing is connected."""
        if self._fault == "redrives":
            return self._amount * self._options.max_voltage, 0.0
        return (self._set["VOLT"], 0.0) if self.on else (None, 0.0)

    # -- time --------------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        if self._boots_at < inf:
            return self._boots_at
        off = self._options.broken_watchdog or self._fault == "broken_watchdog"
        return self._fed + self._delay if self._guarded and self.on and not off else inf

    def tick(self, t: float) -> bytes:
        """Its boot and its watchdog; it says nothing by itself."""
        if t >= self.due:
            if self._boots_at < inf:
                self._boots_at = inf
            else:
                self._log("timeout", volts=0.0, after=t - self._fed)
                self._latched = True
                self._note()
        return b""

    # -- the line ----------------------------------------------------------------------------------------------------

    def feed(self, data: bytes, t: float) -> bytes:
        self.tick(t)
        if self._boots_at < inf or self._fault == "silent":
            return b""
        self._buffer += data.decode("latin-1")
        *lines, self._buffer = self._buffer.split("\n")
        self._buffer = self._buffer[-LONGEST:]
        said = ""
        for line in lines:
            if command := line.strip():
                self._fed = t
                answer = self._execute(command, t)
                said += f"{answer}\r\n" if answer is not None else ""
        return said.encode("ascii", "replace")

    def _execute(self, command: str, t: float) -> str | None:
        header, _, value = command.partition(" ")
        header = _short(header)
        if header.endswith("?"):
            return self._answer(header)
        if self._fault == "ignores_commands":
            return None
        match header:
            case "*CLS":
                self._errors.clear()
            case "*RST":
                self._start()
            case "SYST:REM":
                pass
            case "OUTP":
                self._on = value.upper() in ("ON", "1")
            case "OUTP:PROT:CLE":
                self._latched = False
            case "OUTP:PROT:WDOG" if self._options.has_watchdog:
                self._guarded = value.upper() in ("ON", "1")
            case "OUTP:PROT:WDOG:DEL" if self._options.has_watchdog:
                self._delay = self._number(value, LEAST_DELAY, MOST_DELAY, self._delay)
            case "VOLT" | "CURR" | "VOLT:PROT":
                most = {"CURR": self._options.max_current}.get(header, 1.2 * self._options.max_voltage)
                self._set[header] = self._number(value, 0.0, most, self._set[header])
            case _:
                self._errors.append((-113, "Undefined header"))
        self._fed = t
        self._protect()
        self._note()
        return None

    def _number(self, text: str, low: float, high: float, old: float) -> float:
        try:
            value = float(text)
        except ValueError:
            self._errors.append((-104, "Data type error"))
            return old
        if not low <= value <= high:
            self._errors.append((-222, "Data out of range"))
            return old
        return value

    def _protect(self) -> None:
        if self._on and self._set["VOLT"] > self._set["VOLT:PROT"]:
            self._latched = True

    def _answer(self, header: str) -> str | None:
        now = self._now()
        answers = {
            "*IDN?": self._options.identity,
            "*OPC?": "1",
            "OUTP?": str(int(self._on)),
            "MEAS:VOLT?": f"{now.voltage:.4f}",
            "MEAS:CURR?": f"{now.current:.4f}",
            **{f"{name}?": f"{value:.4f}" for name, value in self._set.items()},
        }
        if self._options.has_watchdog:
            answers |= {"OUTP:PROT:WDOG?": str(int(self._guarded)), "OUTP:PROT:WDOG:DEL?": f"{self._delay:g}"}
        if header == "SYST:ERR?":
            code, words = self._errors.popleft() if self._errors else NO_ERROR
            return f'{code},"{words}"'
        if header not in answers:
            self._errors.append((-113, "Undefined header"))
        return answers.get(header)

    def _now(self) -> Measured:
        if self._fault != "frozen" or self._frozen is None:
            self._frozen = self._measure()
        factor = self._amount if self._fault == "current_factor" else 1.0
        return Measured(self._frozen.voltage, self._frozen.current * factor)

    def _note(self) -> None:
        if self.voltage != self._told:
            self._told = self.voltage
            self._log("command", mode="voltage", value=self._told, volts=self._told)

    # -- faults ------------------------------------------------------------------------------------------------------

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"motor: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "reboot":
            self._start()
            self._boots_at = t + BOOT_TIME
            self._log("command", mode="voltage", value=0.0, volts=0.0)
        elif name == "output_off":
            self._latched = True
            self._note()
        elif name == "error":
            self._errors.append((-240, "Hardware error"))
        else:
            self._fault, self._amount = name, amount

    def clear(self, _t: float) -> None:
        self._fault, self._latched = "", False
        self._errors.clear()


LONG = {"OUTPUT": "OUTP", "VOLTAGE": "VOLT", "CURRENT": "CURR", "MEASURE": "MEAS", "SYSTEM": "SYST", "ERROR": "ERR",
        "PROTECTION": "PROT", "CLEAR": "CLE", "DELAY": "DEL", "REMOTE": "REM", "SOURCE": "SOUR", "STATE": "STAT",
        "LEVEL": "LEV"}  # fmt: skip


def _short(header: str) -> str:
    """A header in short form and capitals: `:SOURce:VOLTage?` is `VOLT?`."""
    asks = header.endswith("?")
    words = [LONG.get(word, word) for word in header.rstrip("?").lstrip(":").upper().split(":")]
    kept = [word for word in words if word not in ("SOUR", "STAT", "LEV")]
    return ":".join(kept) + ("?" if asks else "")
