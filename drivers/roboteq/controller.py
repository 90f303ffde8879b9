"""Motor controller Roboteq on a serial port: rotation rate, current, power, supply voltage; commanded in open loop.

What the device does when nobody commands it (manual V2.1, serial watchdog, `^RWD`): after its timeout the motor stops,
and **the next valid `!` command lets it go on at the speed it had before**. So the first words to it are always a
command of 0: at opening, before anything else is asked, and after a silence longer than the watchdog, where a set-point
other than 0 is refused. `!EX` is not used: it latches an emergency stop that only `!MG` or the power switch ends, and
the next campaign would find a controller with a fault.
"""

from __future__ import annotations

import contextlib

from drivers.errors import DeviceError, LinkError
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import printable
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import LinkHealth, Sample, Stream, Watchdog
from drivers.roboteq.lines import (
    FAULTS,
    FULL,
    MOTOR_FLAGS,
    OPEN_LOOP,
    STATUS_FLAGS,
    Accepted,
    Answer,
    Decoder,
    Record,
    Refused,
    Text,
    Unreadable,
    encode,
    flags,
    go,
    of_channel,
)
from drivers.roboteq.options import Options, streams
from drivers.roboteq.polling import Round, motor_queries, state_queries

REFUSALS = 3
"""Refused commands in a row, none accepted between, that are no spoilt line any more."""


class Roboteq:
    """A motor controller: streams `<name>` (motor) and `<name>_state` (faults, temperature, battery current)."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        settings = SerialSettings(options.port, options.baud, capture=options.capture)
        self._port: SerialPort[Record] = SerialPort(name, settings, Decoder().feed, wire)
        self._reset()

    def _reset(self) -> None:
        o = self._options
        self._bad = BadRecords()
        self._fault: str | None = None
        self._refused = 0
        self._fed_ns = 0
        self._motor = Round(motor_queries(o.channel, o.rotation), o.rate, o.baud)
        self._state = Round(state_queries(o.channel), o.state_rate, o.baud)

    @property
    def streams(self) -> tuple[Stream, ...]:
        return streams(self.name, self._options)

    @property
    def watchdog(self) -> Watchdog:
        """Manual V2.1, `^RWD`: fed by real-time commands alone; the next of them resumes what ran before."""
        o = self._options
        return Watchdog(o.watchdog_timeout, fed_by="! commands", action=o.at_zero, resumes_by_itself=True)

    @property
    def max_voltage(self) -> float:
        limit = self._options.max_voltage
        return self._options.nominal_bus_voltage if limit is None else limit

    def open(self) -> str:
        """Commands 0 before anything else, then asks who it is and what it is set to."""
        self._reset()
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            identity = self._identify()
            self._require_obedience()
            self._require_settings()
            self._require_no_fault()
            self._require_answers()
            undo.pop_all()
        return identity

    def drain(self) -> list[Sample]:
        samples: list[Sample] = []
        for t_ns, record in self._port.inbox.take_all():
            match record:
                case Answer(name, values):
                    samples += self._take(t_ns, name, values)
                case Accepted():
                    self._refused = 0
                case Refused():
                    self._note_refusal()
                case Unreadable(line):
                    self._bad.add(printable(line))
        self._poll()
        return samples

    def health(self) -> LinkHealth:
        error = self._fault or self._port.error
        inbox = self._port.inbox
        alive = self._port.alive and error is None
        return LinkHealth(alive, inbox.received, self._bad.count, self._bad.first, error, inbox.dropped)

    def told(self, volts: float) -> float:
        return self._thousandths(volts) * self._options.nominal_bus_voltage / FULL

    def _thousandths(self, volts: float) -> int:
        return round(FULL * volts / self._options.nominal_bus_voltage)

    def command(self, volts: float) -> None:
        """`!G` volts / nominal bus voltage, once, in thousandths. Raises ValueError beyond max_voltage; LinkError from
        the wire, and for a set-point after a silence in which the watchdog ended: 0 is sent in its place."""
        if not abs(volts) <= self.max_voltage:
            raise ValueError(f"{self.name}: command must be within +-{self.max_voltage:g} V, not {volts}")
        silence = (self._port.now_ns() - self._fed_ns) * 1e-9
        lapsed = volts != 0.0 and silence >= self._options.watchdog_timeout
        self._send(go(self._options.channel, 0 if lapsed else self._thousandths(volts)))
        if lapsed:
            raise LinkError(
                f"{self.name}: nothing was commanded for {silence:.2f} s, longer than the watchdog of"
                f" {self._options.watchdog_timeout:g} s, and the controller would go on where it was: 0 V was sent in"
                f" the place of {volts:g} V; command 0 V first"
            )

    def release(self) -> None:
        """`!MS`: stop, in whatever mode the controller is. Raises LinkError."""
        self._send(encode(f"!MS {self._options.channel}"))

    def close(self) -> None:
        """Command 0, so that whoever speaks to the controller next wakes nothing, and let the port go."""
        if self._port.alive:
            with contextlib.suppress(LinkError):  # the wire is gone; the controller stops by its own watchdog
                self._send(go(self._options.channel, 0))
        self._port.close()

    def _send(self, command: bytes) -> None:
        self._port.write(command)
        self._fed_ns = self._port.now_ns()

    # -- what comes --------------------------------------------------------------------------------------------------

    def _poll(self) -> None:
        if not self._port.alive:
            return
        now_ns = self._port.now_ns()
        with contextlib.suppress(LinkError):  # health says why the port is gone
            for queries in (self._motor, self._state):
                if queries.begin(now_ns):
                    self._port.write(queries.request)

    def _take(self, t_ns: int, name: str, values: tuple[int, ...]) -> list[Sample]:
        channel = self._options.channel
        if row := self._motor.take(name, values):
            *speed, current, power, volts = row
            bus_voltage, share = of_channel(volts, 2) / 10.0, of_channel(power, channel) / FULL
            rotation = [of_channel(each, channel) / 60.0 for each in speed]
            amps = of_channel(current, channel) / 10.0
            return [Sample(self.name, t_ns, (*rotation, amps, share, share * bus_voltage, bus_voltage))]
        if state := self._state.take(name, values):
            faults, motor, status, temperature, battery, applied = state
            words = (faults[0], of_channel(motor, channel), status[0])
            self._fault = self._trouble(*words)
            heat_sink, supply = of_channel(temperature, channel + 1), of_channel(battery, channel) / 10.0
            told = (*(float(word) for word in words), float(heat_sink), supply, float(of_channel(applied, channel)))
            return [Sample(f"{self.name}_state", t_ns, told)]
        return []

    def _trouble(self, faults: int, motor: int, status: int) -> str | None:
        told = [flags(faults, FAULTS), flags(motor, MOTOR_FLAGS), flags(status, STATUS_FLAGS)]
        words = ", ".join(each for each in told if each)
        return f"{self.name} reports {words}: clear its cause, then open again" if words else None

    def _note_refusal(self) -> None:
        self._refused += 1
        self._bad.add("-")
        if self._refused >= REFUSALS:
            self._fault = f"{self.name} refuses its commands (answer '-'): look at the controller's configuration"

    # -- opening -----------------------------------------------------------------------------------------------------

    def _identify(self) -> str:
        """A command of 0 twice, for the first may meet half a line of whoever was cut off; then echo off, until the
        controller is switched off."""
        stop = go(self._options.channel, 0)
        self._send(stop + stop + encode("^ECHOF 1"))
        firmware = self._ask("?FID") or self._ask("?FID")
        if not isinstance(firmware, Text):
            raise DeviceError(
                f"{self.name}: no Roboteq controller answers on {self._options.port} at {self._options.baud} baud"
                f" ('?FID' expected 'FID=...', came {_shown(firmware)}): check port, baud and power"
            )
        model = self._ask("?TRN")
        return f"{model.text}, {firmware.text}" if isinstance(model, Text) else firmware.text

    def _require_obedience(self) -> None:
        self._port.inbox.take_all()
        self._fed_ns = self._port.now_ns()
        answer = self._port.ask(
            go(self._options.channel, 0), lambda r: isinstance(r, Accepted | Refused), self._options.timeout
        )
        if not isinstance(answer, Accepted):
            raise DeviceError(
                f"{self.name}: the controller does not accept '!G {self._options.channel} 0' (came {_shown(answer)}):"
                " check channel, and that serial commands are enabled in it"
            )

    def _require_settings(self) -> None:
        o = self._options
        wanted = round(o.watchdog_timeout * 1e3)
        watchdog = self._number("~RWD")
        if watchdog == 0:
            raise DeviceError(
                f"{self.name}: the controller's watchdog is switched off (RWD = 0), and a motor nobody commands would"
                f" turn for ever: set '^RWD {wanted}' and save it with '%EESAV'"
            )
        if watchdog != wanted:
            raise DeviceError(
                f"{self.name}: the controller's watchdog is {watchdog} ms (RWD), the bench file says {wanted} ms"
                " (watchdog_timeout): change one of them"
            )
        mode = self._number(f"~MMOD {o.channel}", o.channel)
        if mode != OPEN_LOOP:
            raise DeviceError(
                f"{self.name}: the controller is in mode {mode} (MMOD), which closes a loop, and its commands are no"
                f" voltages: set '^MMOD {o.channel} 0' (open loop) and save it with '%EESAV'"
            )
        for key, name, expected in (
            ("pole_pairs", "BPOL", o.pole_pairs),
            ("encoder_pulses", "EPPR", o.encoder_pulses),
        ):
            if expected is not None and (found := self._number(f"~{name} {o.channel}", o.channel)) != expected:
                raise DeviceError(
                    f"{self.name}: the controller has {name} = {found}, the bench file says {key} = {expected}: the"
                    " rotation rate would be wrong by their ratio; change one of them"
                )

    def _require_no_fault(self) -> None:
        channel = self._options.channel
        faults, status = self._number("?FF"), self._number("?FS")
        trouble = self._trouble(faults, self._number(f"?FM {channel}", channel), status)
        if trouble:
            raise DeviceError(trouble)

    def _require_answers(self) -> None:
        """Each query of the two streams once: a row that lacks an answer is none, and faults are one of them."""
        o = self._options
        for query in (*motor_queries(o.channel, o.rotation), *state_queries(o.channel)):
            self._number(query.text)

    def _ask(self, query: str) -> Record | None:
        """The answer by the query's name; None when none came in time."""
        name = query[1:].split(maxsplit=1)[0]
        return self._port.ask(
            encode(query), lambda r: isinstance(r, Answer | Text) and r.name == name, self._options.timeout
        )

    def _number(self, query: str, channel: int = 1) -> int:
        answer = self._ask(query)
        if not isinstance(answer, Answer):
            raise DeviceError(
                f"{self.name}: the controller does not answer '{query}' within {self._options.timeout:g} s"
                f" ({self._port.error or 'it answers others'}): are channel and rotation those of this model?"
            )
        return of_channel(answer.values, channel)


def _shown(record: Record | None) -> str:
    return "nothing" if record is None else repr(record)
