"""A bench supply that speaks SCPI, as the voltage source of a brushed motor: one direction, no rotation rate.

Questions are asked behind set-points alone: where a supply has a watchdog, any word feeds it, and a program whose loop
stands still must be silent. Answers have no name, so that there is one question at a time.
"""

from __future__ import annotations

import contextlib
import math

from drivers.errors import DeviceError, LinkError
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import LineCutter, printable
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import LinkHealth, Sample, Stream, Watchdog
from drivers.scpi.lines import encode, error, number, setting
from drivers.scpi.options import Options, stream

VOLTAGE, CURRENT, ERROR, OUTPUT = "MEAS:VOLT?", "MEAS:CURR?", "SYST:ERR?", "OUTP?"
ROUNDS = 5
"""Rows between two looks at errors and output."""
UNANSWERED = 2
"""Questions in a row without an answer that are no lost line any more."""
LEAST, DEAD, DEAD_ROWS = 1.0, 0.1, 3
"""V of a set-point, share of it, rows in a row: less is no output."""
READ_BACK = 0.01
"""Relative: a setting that is read back further off was not taken."""
ZERO_BEFORE_ON, ON = "VOLT 0", "OUTP ON"
OFF = "OUTP OFF"
EARLY = 0.25
"""Of the time between two set-points: so much before its time one may go out, the next waits for longer. A loop of the
same rate is never quite punctual."""


class ScpiSupply:
    """A motor controller: stream `<name>` with `motor_voltage` and `current`."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        settings = SerialSettings(options.port, options.baud, options.framing, options.capture)
        self._port: SerialPort[bytes] = SerialPort(name, settings, LineCutter().feed, wire)
        self._reset()

    def _reset(self) -> None:
        self._bad = BadRecords()
        self._fault: str | None = None
        self._told = math.nan
        """V that were sent last."""
        self._fed_ns = self._due_ns = self._asked_ns = self._next_ns = 0
        self._asked = ""
        self._quiet_ns = self._unanswered = self._dead = 0
        self._row: float | None = None
        self._rows = 0
        self._on = False
        self._lapsed = True

    @property
    def streams(self) -> tuple[Stream, ...]:
        return (stream(self.name, self._options),)

    @property
    def watchdog(self) -> Watchdog:
        """Most supplies have none. One that has (Keysight N6900/N7900 operating and service guide, p. 252:
        OUTP:PROT:WDOG) is fed by any SCPI word, and latches its output off until the protection is cleared."""
        return Watchdog(self._options.watchdog_timeout, fed_by="any SCPI word", action="coast", resumes_by_itself=False)

    @property
    def max_voltage(self) -> float:
        return self._options.max_voltage

    @property
    def min_voltage(self) -> float:
        """V: the least command; a supply of one quadrant gives nothing below 0."""
        return 0.0

    def open(self) -> str:
        """Output off and 0 V before anything else, then identity and settings, each read back."""
        self._reset()
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            identity = self._identify()
            self._configure()
            undo.pop_all()
        return identity

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, line in self._port.inbox.take_all():
            text = printable(line)
            asked, self._asked, self._unanswered = self._asked, "", 0
            if not asked or not self._take(asked, text):
                self._bad.add(text)
            elif asked == CURRENT and self._row is not None:
                samples.append(Sample(self.name, t_ns, (self._row, number(text) or 0.0)))
                self._row, self._rows = None, self._rows + 1
        return samples

    def health(self) -> LinkHealth:
        inbox, problem = self._port.inbox, self._fault or self._port.error
        alive = self._port.alive and problem is None
        return LinkHealth(alive, inbox.received, self._bad.count, self._bad.first, problem, inbox.dropped)

    def told(self, volts: float) -> float:
        return round(volts / self._options.resolution) * self._options.resolution

    @property
    def holds(self) -> float:
        """V of the last `VOLT`; of what `command` was given since, nothing went out."""
        return self._told

    def command(self, volts: float) -> None:
        """`VOLT`, at most `command_rate` times a second, 0 at once; the first that is not 0 switches the output on.

        Raises ValueError beyond max_voltage. Raises LinkError from the wire, for a negative voltage, and for a
        set-point after a silence in which the watchdog ended: 0 V is sent in their place.
        """
        if not abs(volts) <= self.max_voltage:
            raise ValueError(f"{self.name}: command must be within 0 and {self.max_voltage:g} V, not {volts}")
        timeout, now_ns = self._options.watchdog_timeout, self._port.now_ns()
        silence = (now_ns - self._fed_ns) * 1e-9
        self._lapsed = self._lapsed or (timeout is not None and silence >= timeout)
        why = ""
        if volts < 0.0:
            why = f"a supply gives no negative voltage, and {volts:g} V were commanded"
        elif volts and self._lapsed:
            why = f"nothing was commanded for longer than its watchdog: command 0 V before {volts:g} V"
        self._set(0.0 if why else volts, now_ns)
        if why:
            raise LinkError(f"{self.name}: {why}: 0 V was sent")
        self._question(now_ns)

    def release(self) -> None:
        """Output off: the motor coasts. Raises LinkError."""
        self._on = False
        self._say(OFF)

    def close(self) -> None:
        """0 V, output off, and let the port go."""
        if self._port.alive:
            with contextlib.suppress(LinkError):  # the wire is gone, and nothing can be told any more
                self._say(ZERO_BEFORE_ON, OFF)
        self._port.close()

    # -- what goes ---------------------------------------------------------------------------------------------------

    def _say(self, *commands: str) -> None:
        self._port.write(b"".join(encode(command) for command in commands))
        self._fed_ns = self._port.now_ns()

    def _set(self, volts: float, now_ns: int) -> None:
        level, period_ns = self.told(volts), round(1e9 / self._options.command_rate)
        if level == 0.0 and self._lapsed:
            clear = (self._options.protection_clear,) if self._options.protection_clear else ()
            self._say(ZERO_BEFORE_ON, OFF, *clear)
            self._lapsed, self._on, self._told = False, False, 0.0
        elif level and not self._on:
            self._say(ZERO_BEFORE_ON, ON, f"VOLT {level:.6g}")
            self._on, self._told = True, level
        elif (level == 0.0 and self._told != 0.0) or now_ns >= self._due_ns - EARLY * period_ns:
            self._say(f"VOLT {level:.6g}")
            self._told = level
        else:
            return
        self._due_ns = max(self._due_ns, now_ns) + period_ns

    def _question(self, now_ns: int) -> None:
        """The next one, when the last was answered or given up."""
        if self._asked:
            if now_ns - self._asked_ns < 1e9 * self._options.timeout:
                return
            self._bad.add(f"no answer to {self._asked}")
            self._asked, self._row, self._unanswered = "", None, self._unanswered + 1
            if self._unanswered >= UNANSWERED:
                self._fault = f"{self.name} does not answer any more: check its power and its cable"
            self._quiet_ns = now_ns + round(1e9 * self._options.timeout)
        if now_ns < self._quiet_ns:  # what comes late must not be taken for the next answer
            return
        question = self._next_question(now_ns)
        if question:
            self._asked, self._asked_ns = question, now_ns
            self._say(question)

    def _next_question(self, now_ns: int) -> str:
        if self._row is not None:
            return CURRENT
        if self._rows >= ROUNDS:
            self._rows = -1
            return ERROR
        if self._rows < 0:
            self._rows = 0
            return OUTPUT
        if now_ns < self._next_ns:
            return ""
        self._next_ns = max(self._next_ns + round(1e9 / self._options.rate), now_ns)
        return VOLTAGE

    # -- what comes --------------------------------------------------------------------------------------------------

    def _take(self, asked: str, text: str) -> bool:
        """Whether it is an answer to that question."""
        if asked == ERROR:
            found = error(text)
            if found is not None and found[0] != 0:
                self._fault = f"{self.name} reports error {found[0]} ({found[1]}): clear its cause, then open again"
            return found is not None
        value = number(text)
        if value is None:
            return False
        if asked == OUTPUT and self._on and value == 0.0:
            self._fault = (
                f"{self.name} has switched its output off (over-voltage, over-current, over-temperature, or by hand):"
                " clear its cause, then open again"
            )
        if asked == VOLTAGE:
            self._row = value
            self._judge_voltage(value)
        return True

    def _judge_voltage(self, volts: float) -> None:
        """A latched protection shows in the voltage alone: OUTP? tells what was programmed (N7900, p. 251)."""
        dead = self._on and self._told >= LEAST and volts < DEAD * self._told
        self._dead = self._dead + 1 if dead else 0
        if self._dead >= DEAD_ROWS:
            self._fault = (
                f"{self.name} gives {volts:g} V, where {self._told:g} V were commanded (a protection that has switched"
                " its output off, or its current limit): clear the cause, then open again"
            )

    # -- opening -----------------------------------------------------------------------------------------------------

    def _identify(self) -> str:
        """Stopped twice, for the first line may meet half a line of whoever was cut off."""
        o = self._options
        self._say(*((o.remote,) if o.remote else ()), ZERO_BEFORE_ON, OFF, ZERO_BEFORE_ON, OFF, "*CLS")
        identity = self._ask("*IDN?") or self._ask("*IDN?")
        if identity is None or identity.count(",") < 2:
            raise DeviceError(
                f"{self.name}: no SCPI supply answers on {o.port} at {o.baud} baud {o.framing} ('*IDN?' expected"
                f" 'maker,model,serial,firmware', came {identity!r}): check baud, framing, the end of line (LF), and"
                " whether it needs a command of its own for remote control (remote)"
            )
        return identity

    def _configure(self) -> None:
        o = self._options
        settings = [f"CURR {o.current_limit:g}", OFF]
        settings += [] if o.over_voltage is None else [f"VOLT:PROT {o.over_voltage:g}"]
        for command in (*settings, *o.watchdog_settings):
            self._say(command)
            question, expected = setting(command)
            answer = self._ask(question)
            value = None if answer is None else number(answer)
            if value is None or abs(value - expected) > READ_BACK * max(abs(expected), o.resolution):
                raise DeviceError(f"{self.name} was told '{command}' and answers {answer!r} to '{question}'")
        trouble = error(self._ask(ERROR) or "")
        if trouble is None or trouble[0] != 0:
            raise DeviceError(f"{self.name}: '{ERROR}' expected 0, came {trouble}: does it know CURR, VOLT and OUTP?")
        for question in (VOLTAGE, CURRENT):
            answer = self._ask(question)
            if answer is None or number(answer) is None:
                raise DeviceError(f"{self.name}: '{question}' expected a number, came {answer!r}")

    def _ask(self, question: str) -> str | None:
        self._port.inbox.take_all()
        line = self._port.ask(encode(question), lambda _: True, self._options.timeout)
        self._fed_ns = self._port.now_ns()
        return None if line is None else printable(line)
