"""A PWM speed controller (ESC) behind a Pololu Maestro: pulses out, and nothing known of the motor.

What the device does when nobody commands it (0J40, 4.b and 5.a): its serial timeout, **off as delivered**, sets an
error bit and sends every channel to what it does "on startup or error". It is fed by any valid serial command, also by
a question. So this driver asks nothing by itself: questions go out with a set-point, and a loop that commands nothing
feeds nothing. Timeout and what the channel does then are measured at opening, inside the ESC's dead zone, where nothing
turns.
"""

from __future__ import annotations

import contextlib
from collections import deque

from drivers.errors import DeviceError, LinkError
from drivers.pololu.asking import Asking
from drivers.pololu.maestro_options import MICROSECOND, QUARTERS, TIMEOUT_FLAG, Options, flags, streams
from drivers.pololu.packets import Answer, Record, seven_bits
from drivers.ports.inbox import BadRecords
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import LinkHealth, Sample, Stream, Watchdog

SET_TARGET, SET_SPEED, SET_ACCELERATION = 0x84, 0x87, 0x89
GET_POSITION, GET_ERRORS, GO_HOME = 0x90, 0xA1, 0xA2
"""Compact protocol (0J40, 5.e)."""
ANSWER_BYTES = 4
"""Position and errors."""
RECENT_NS = 150_000_000
"""A pulse is one that was asked for so lately: the Maestro changes it at its next period (20 ms as delivered)."""
ASTRAY = 5
"""Rows in a row with another pulse than any that was asked for."""
DISOBEYED = 10
"""The same where neutral alone was asked for: whatever is sent feeds the timeout, so silence is what is left."""
EARLY, LATE = 0.6, 1.5
"""Of the stated timeout: it must not have come, it must have come."""
EXPECTED = 0.8
"""Of the stated timeout: after a silence of ours that is longer, the timeout's flag is no surprise."""


class Maestro:
    """A motor controller: stream `<name>` with the pulse that the Maestro sends, and its errors."""

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
        self._targets: deque[tuple[int, int]] = deque(maxlen=256)
        """(ns, target) of what was commanded."""
        self._fed_ns = 0
        self._astray = self._disobeyed = 0
        self._asking.reset()

    @property
    def streams(self) -> tuple[Stream, ...]:
        return streams(self.name, self._options)

    @property
    def watchdog(self) -> Watchdog:
        """0J40, 4.b: any valid serial command feeds it, and this driver sends none but with a set-point; after it the
        channel stays at neutral until the next Set Target."""
        o = self._options
        return Watchdog(o.watchdog_timeout, fed_by="set-points", action=o.at_zero, resumes_by_itself=True)

    @property
    def max_voltage(self) -> float:
        return self._options.full_voltage

    def open(self) -> str:
        """Commands neutral before anything else, measures the serial timeout, and holds neutral until the ESC obeys."""
        self._reset()
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            begun_ns = self._port.now_ns()
            self._require_answer()
            self._require_timeout()
            self._arm(begun_ns)
            undo.pop_all()
        o = self._options
        return f"Pololu Maestro on {o.port}, channel {o.channel} (neither it nor the ESC identifies itself)"

    def drain(self) -> list[Sample]:
        samples: list[Sample] = []
        for t_ns, record in self._port.inbox.take_all():
            if isinstance(record, Answer):
                samples.append(self._row(t_ns, *record.words))
            else:
                self._bad.add(f"bytes that answer nothing: {record.data.hex(' ')}")
        return samples

    def health(self) -> LinkHealth:
        error, inbox = self._fault or self._port.error, self._port.inbox
        alive = self._port.alive and error is None
        return LinkHealth(alive, inbox.received, self._bad.count, self._bad.first, error, inbox.dropped)

    def told(self, volts: float) -> float:
        return self._options.volts(self._options.target(volts))

    def command(self, volts: float) -> None:
        """The pulse of `volts` (`Options.target`), once, and at `rate` the question for a row behind it.

        Raises ValueError beyond full_voltage; LinkError from the wire, and for a set-point after a silence in which the
        watchdog ended: neutral is sent in its place."""
        if not abs(volts) <= self.max_voltage:
            raise ValueError(f"{self.name}: command must be within +-{self.max_voltage:g} V, not {volts}")
        self._require_obedience()
        now_ns = self._port.now_ns()
        silence, stated = (now_ns - self._fed_ns) * 1e-9, self._options.watchdog_timeout
        if silence >= EXPECTED * stated:
            self._asking.excuse(TIMEOUT_FLAG)
        refused = volts != 0.0 and silence >= stated
        self._send(0.0 if refused else volts, now_ns)
        if refused:
            raise LinkError(
                f"{self.name}: nothing was commanded for {silence:.2f} s, longer than the watchdog of {stated:g} s:"
                f" neutral was sent in the place of {volts:g} V; command 0 V first"
            )

    def release(self) -> None:
        """Go Home: every channel of the Maestro to what it does on an error. Raises LinkError."""
        self._require_obedience()
        self._port.write(self._packets.encode(GO_HOME))

    def close(self) -> None:
        """Neutral once more, and let the port go; then the Maestro's own timeout."""
        if self._port.alive:
            with contextlib.suppress(LinkError):  # the wire is gone; the Maestro stops by its own timeout
                self._port.write(self._set_target(self._options.neutral_target))
        self._port.close()

    def _require_obedience(self) -> None:
        if self._disobeyed >= DISOBEYED:
            raise LinkError(
                f"{self.name}: the Maestro does not go to neutral: nothing more is sent, so that its own serial timeout"
                " stops it"
            )

    # -- what goes ---------------------------------------------------------------------------------------------------

    def _set_target(self, target: int) -> bytes:
        return self._packets.encode(SET_TARGET, self._options.channel, *seven_bits(target))

    def _question(self) -> bytes:
        return self._packets.encode(GET_POSITION, self._options.channel) + self._packets.encode(GET_ERRORS)

    def _send(self, volts: float, now_ns: int) -> None:
        target = self._options.target(volts)
        asking = self._begin_question(now_ns)
        self._targets.append((now_ns, target))
        self._port.write(self._set_target(target) + (self._question() if asking else b""))
        self._fed_ns = self._port.now_ns()

    def _begin_question(self, now_ns: int) -> bool:
        """Whether it is time for a row, and nothing is still waited for."""
        begun, given_up = self._asking.begin(now_ns, ANSWER_BYTES)
        if given_up:
            self._bad.add(given_up)
        if self._asking.gone:
            self._fault = f"{self.name} does not answer any more: check its power and its USB cable"
        return begun

    # -- what comes --------------------------------------------------------------------------------------------------

    def _row(self, t_ns: int, position: int, errors: int) -> Sample:
        self._judge_errors(errors & ~self._asking.answered())
        self._judge_position(position)
        return Sample(self.name, t_ns, (position / QUARTERS * MICROSECOND, float(errors)))

    def _judge_errors(self, unexpected: int) -> None:
        """Any error sends the channel home, and the next set-point lets it go on: that is no run."""
        if unexpected:
            self._fault = (
                f"{self.name} reports {flags(unexpected)}, and has stopped the motor for it: look at cable, CRC setting"
                " and script, then open again"
            )

    def _judge_position(self, position: int) -> None:
        """The newest target, or one that was it a moment ago."""
        since_ns = self._port.now_ns() - RECENT_NS
        known = [target for sent_ns, target in self._targets if sent_ns >= since_ns] or [self._targets[-1][1]]
        self._astray = 0 if position in known else self._astray + 1
        told_neutral = all(target == self._options.neutral_target for target in known)
        self._disobeyed = self._disobeyed + 1 if told_neutral and position not in (0, *known) else 0
        if self._astray >= ASTRAY:
            self._fault = (
                f"{self.name} sends a pulse of {position / QUARTERS:g} us, where {known[-1] / QUARTERS:g} us were"
                " commanded: look at min, max, speed and acceleration of the channel, and at what else commands it"
            )

    # -- opening -----------------------------------------------------------------------------------------------------

    def _ask(self) -> tuple[int, int] | None:
        """Position and errors, which it forgets by that; None: no answer."""
        self._asking.expect(ANSWER_BYTES)
        record = self._port.ask(self._question(), lambda r: isinstance(r, Answer), self._options.timeout)
        self._asking.expect(0)
        self._fed_ns = self._port.now_ns()
        if not isinstance(record, Answer):
            return None
        position, errors = record.words
        return position, errors

    def _require_answer(self) -> None:
        """Neutral twice, for the first may meet half a packet of a program that was cut off; no limit of speed, that
        would make a stop slow; and what was wrong before is asked away."""
        o = self._options
        neutral = self._set_target(o.neutral_target)
        self._port.write(neutral + neutral)
        for limit in (SET_SPEED, SET_ACCELERATION):
            self._port.write(self._packets.encode(limit, o.channel, 0, 0))
        self._targets.append((self._port.now_ns(), o.neutral_target))
        if self._ask() is None and self._ask() is None:
            how = f"{o.protocol} protocol, CRC {'on' if o.crc else 'off'}"
            raise DeviceError(
                f"{self.name}: no Maestro answers on {o.port} ({how}): it must be its command port, in the mode USB"
                " Dual Port, and protocol, device number and CRC those that are set in it"
            )

    def _require_timeout(self) -> None:
        """Two silences with a pulse that is a quarter of a microsecond beside neutral: the shorter must change nothing,
        the longer must set the timeout's flag and bring the channel to neutral. Off would be a stop as well, but an ESC
        without pulses must be armed anew."""
        o = self._options
        if self._after_silence(EARLY)[1] & TIMEOUT_FLAG:
            raise DeviceError(
                f"{self.name}: the Maestro's serial timeout comes within {EARLY * o.watchdog_timeout:.2f} s, the bench"
                f" file says {o.watchdog_timeout:g} s (watchdog_timeout): change one of them"
            )
        position, errors = self._after_silence(LATE)
        if not errors & TIMEOUT_FLAG:
            raise DeviceError(
                f"{self.name}: the Maestro's serial timeout did not come in {LATE * o.watchdog_timeout:.2f} s without a"
                f" command: it is off as delivered, and a motor nobody commands would turn for ever. Set it to"
                f" {o.watchdog_timeout:g} s in the Maestro Control Center (Serial Settings), apply, and open again"
            )
        if position != o.neutral_target:
            found = f"{position / QUARTERS:g} us" if position else "no pulses"
            raise DeviceError(
                f"{self.name}: after its serial timeout the Maestro gives {found} on channel {o.channel}, not neutral:"
                f" set On startup or error of that channel to Go to {o.neutral:g} us in the Maestro Control Center"
            )

    def _after_silence(self, share: float) -> tuple[int, int]:
        self._port.write(self._set_target(self._options.neutral_target + 1))
        self._pass(share * self._options.watchdog_timeout)
        found = self._ask()
        if found is None:
            raise DeviceError(f"{self.name}: the Maestro stopped answering while its serial timeout was measured")
        return found

    def _arm(self, begun_ns: int) -> None:
        """Neutral without a break until `arming_time` is over."""
        o = self._options
        while True:
            self._port.write(self._set_target(o.neutral_target))
            self._fed_ns = self._port.now_ns()
            self._targets.append((self._fed_ns, o.neutral_target))
            left = o.arming_time - (self._fed_ns - begun_ns) * 1e-9
            if left <= 0.0:
                break
            self._pass(min(left, o.watchdog_timeout / 4))
        self._port.inbox.take_all()

    def _pass(self, seconds: float) -> None:
        """Time passes; nothing is sent."""
        self._port.inbox.wait_for(lambda _: False, seconds)
        if self._port.error is not None:
            raise LinkError(f"{self.name}: {self._port.error}")
