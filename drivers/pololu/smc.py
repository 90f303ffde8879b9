"""A brushed motor on a Pololu Simple Motor Controller G2: commanded in open loop; no rotation rate.

What the device does when nobody commands it (0J77, 3.3 and 6.1): its command timeout, **off as delivered**, is an
error: the motor stops, and with safe-start it stays so until it is told `exit safe start`. Any valid command feeds it,
also a question, so that questions go out with set-points alone. The timeout is measured at opening, with the motor
stopped. Safe-start is left with a command of 0 only.
"""

from __future__ import annotations

import contextlib

from drivers.errors import DeviceError, LinkError
from drivers.pololu.asking import Asking
from drivers.pololu.packets import Answer, Record
from drivers.pololu.smc_options import COMMAND_TIMEOUT, FULL, SAFE_START, Options, errors, signed, streams
from drivers.ports.inbox import BadRecords
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import LinkHealth, Sample, Stream, Watchdog

EXIT_SAFE_START, FORWARD, REVERSE, GET_VARIABLE, GET_FIRMWARE, STOP = 0x83, 0x85, 0x86, 0xA1, 0xC2, 0xE0
"""Compact protocol (0J77, 6.2.1)."""
FIRMWARE_BYTES = 4
EARLY, LATE = 0.6, 1.5
"""Of the stated timeout: it must not have come, it must have come."""
EXPECTED = 0.8
"""Of the stated timeout: after a silence of ours that is longer, its error is no surprise."""


class SmcG2:
    """A motor controller: stream `<name>`, one row an answer."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        self._packets = options.packets
        self._asking = Asking(options.rate)
        settings = SerialSettings(options.port, options.baud, capture=options.capture)
        self._port: SerialPort[Record] = SerialPort(name, settings, self._asking.feed, wire)
        self._reset()

    def _reset(self) -> None:
        self._bad = BadRecords()
        self._fault: str | None = None
        self._fed_ns = 0
        self._asking.reset()

    @property
    def streams(self) -> tuple[Stream, ...]:
        return streams(self.name, self._options)

    @property
    def watchdog(self) -> Watchdog:
        """0J77, 3.3: an error; the motor stays stopped until safe-start is left, which a command of 0 does."""
        o = self._options
        return Watchdog(o.watchdog_timeout, fed_by="set-points", action=o.at_zero, resumes_by_itself=False)

    @property
    def max_voltage(self) -> float:
        limit = self._options.max_voltage
        return self._options.nominal_bus_voltage if limit is None else limit

    def open(self) -> str:
        """Stops the motor before anything else, measures the command timeout, and leaves safe-start at speed 0."""
        self._reset()
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            identity = self._identify()
            self._require_timeout()
            self._require_no_errors()
            undo.pop_all()
        return identity

    def drain(self) -> list[Sample]:
        samples: list[Sample] = []
        for t_ns, record in self._port.inbox.take_all():
            if isinstance(record, Answer):
                samples.append(self._row(t_ns, record.words))
            else:
                self._bad.add(f"bytes that answer nothing: {record.data.hex(' ')}")
        return samples

    def health(self) -> LinkHealth:
        error, inbox = self._fault or self._port.error, self._port.inbox
        alive = self._port.alive and error is None
        return LinkHealth(alive, inbox.received, self._bad.count, self._bad.first, error, inbox.dropped)

    def told(self, volts: float) -> float:
        return self._speed_of(volts) * self._options.nominal_bus_voltage / FULL

    def _speed_of(self, volts: float) -> int:
        return round(FULL * volts / self._options.nominal_bus_voltage)

    def command(self, volts: float) -> None:
        """Speed 3200 volts / nominal bus voltage, once, and at `rate` the questions of a row behind it. A command of 0
        leaves safe-start as well.

        Raises ValueError beyond max_voltage; LinkError from the wire, and for a set-point after a silence in which the
        watchdog ended: 0 is sent in its place."""
        if not abs(volts) <= self.max_voltage:
            raise ValueError(f"{self.name}: command must be within +-{self.max_voltage:g} V, not {volts}")
        now_ns = self._port.now_ns()
        silence, stated = (now_ns - self._fed_ns) * 1e-9, self._options.watchdog_timeout
        if silence >= EXPECTED * stated:
            self._asking.excuse(COMMAND_TIMEOUT | SAFE_START)
        refused = volts != 0.0 and silence >= stated
        self._send(0.0 if refused else volts, now_ns)
        if refused:
            raise LinkError(
                f"{self.name}: nothing was commanded for {silence:.2f} s, longer than the watchdog of {stated:g} s: 0 V"
                f" was sent in the place of {volts:g} V; command 0 V first"
            )

    def release(self) -> None:
        """Stop motor, which also enters safe-start. Raises LinkError."""
        self._asking.excuse(SAFE_START)
        self._port.write(self._packets.encode(STOP))

    def close(self) -> None:
        """Stop motor, and let the port go."""
        if self._port.alive:
            with contextlib.suppress(LinkError):  # the wire is gone; the controller stops by its own timeout
                self.release()
        self._port.close()

    # -- what goes ---------------------------------------------------------------------------------------------------

    def _send(self, volts: float, now_ns: int) -> None:
        speed = self._speed_of(volts)
        begun, given_up = self._asking.begin(now_ns, 2 * len(self._options.variables))
        if given_up:
            self._bad.add(given_up)
        if self._asking.gone:
            self._fault = f"{self.name} does not answer any more: check its power and its cable"
        arm = self._packets.encode(EXIT_SAFE_START) if volts == 0.0 else b""
        self._port.write(self._speed(speed) + arm + (self._questions() if begun else b""))
        self._fed_ns = self._port.now_ns()

    def _speed(self, speed: int) -> bytes:
        size = abs(speed)
        return self._packets.encode(FORWARD if speed >= 0 else REVERSE, size & 0x1F, size >> 5)

    def _questions(self) -> bytes:
        return b"".join(self._packets.encode(GET_VARIABLE, number) for number in self._options.variables)

    # -- what comes --------------------------------------------------------------------------------------------------

    def _row(self, t_ns: int, words: tuple[int, ...]) -> Sample:
        speed, millivolts, temperature, *current, status, occurred = words
        self._judge((status | occurred) & ~self._asking.answered())
        share, volts = signed(speed) / FULL, millivolts / 1e3
        amps = (float(current[0]) / 1e3,) if current else ()
        return Sample(self.name, t_ns, (share, share * volts, volts, *amps, temperature / 10.0, float(status)))

    def _judge(self, unexpected: int) -> None:
        """An error stops the motor, and the next command of 0 would let it go on: that is no run."""
        if unexpected:
            self._fault = (
                f"{self.name} reports {errors(unexpected)}, and has stopped the motor for it: clear its cause, then"
                " open again"
            )

    # -- opening -----------------------------------------------------------------------------------------------------

    def _ask(self, request: bytes, length: int) -> tuple[int, ...] | None:
        self._asking.expect(length)
        record = self._port.ask(request, lambda r: isinstance(r, Answer), self._options.timeout)
        self._asking.expect(0)
        self._fed_ns = self._port.now_ns()
        return record.words if isinstance(record, Answer) else None

    def _identify(self) -> str:
        """Stop twice, for the first may meet half a packet of a program that was cut off."""
        stop, firmware = self._packets.encode(STOP), self._packets.encode(GET_FIRMWARE)
        self._port.write(stop + stop)
        words = self._ask(firmware, FIRMWARE_BYTES) or self._ask(firmware, FIRMWARE_BYTES)
        if words is None:
            o = self._options
            how = f"{o.protocol} protocol, CRC {'on' if o.crc else 'off'}, {o.baud} baud"
            raise DeviceError(
                f"{self.name}: no Simple Motor Controller answers on {o.port} ({how}): check port, power, and that its"
                " input mode is Serial/USB in binary with this protocol, device number and CRC"
            )
        product, version = words
        return f"Pololu Simple Motor Controller, product {product}, firmware {version >> 8:x}.{version & 0xFF:02x}"

    def _require_timeout(self) -> None:
        """Two silences with the motor stopped: in the shorter no timeout may occur, in the longer it must."""
        o = self._options
        self._row_of_opening()
        if self._after_silence(EARLY) & COMMAND_TIMEOUT:
            raise DeviceError(
                f"{self.name}: the controller's command timeout comes within {EARLY * o.watchdog_timeout:.2f} s, the"
                f" bench file says {o.watchdog_timeout:g} s (watchdog_timeout): change one of them"
            )
        if not self._after_silence(LATE) & COMMAND_TIMEOUT:
            raise DeviceError(
                f"{self.name}: the controller's command timeout did not come in {LATE * o.watchdog_timeout:.2f} s"
                " without a command: it is off as delivered, and a motor nobody commands would turn for ever. Set it"
                f" to {o.watchdog_timeout:g} s in the Simple Motor Control Center G2 (Advanced settings), apply, then"
                " open again"
            )

    def _after_silence(self, share: float) -> int:
        """Errors that occurred since the last question."""
        self._port.inbox.wait_for(lambda _: False, share * self._options.watchdog_timeout)
        return self._row_of_opening()[-1]

    def _require_no_errors(self) -> None:
        """At speed 0 and out of safe-start nothing may stop the motor."""
        self._port.write(self._speed(0) + self._packets.encode(EXIT_SAFE_START))
        self._row_of_opening()
        status = self._row_of_opening()[-2]
        if status:
            raise DeviceError(f"{self.name} reports {errors(status)}: clear its cause, then open again")
        self._port.inbox.take_all()

    def _row_of_opening(self) -> tuple[int, ...]:
        words = self._ask(self._questions(), 2 * len(self._options.variables))
        if words is None:
            raise DeviceError(
                f"{self.name}: the controller does not answer each of the variables"
                f" {', '.join(map(str, self._options.variables))} within {self._options.timeout:g} s: is"
                " current_variable one that this model has?"
            )
        return words
