"""Motor controller VESC on a serial port, UART or USB: asked for its values, commanded by duty.

What the device does when nobody commands it (util/timeout.c, firmware 7.01): it releases the motor after its own
timeout and obeys the next SET_* packet; reading feeds nothing. Its voltage reference is the nominal bus voltage, as
over CAN (over_can.py). It answers with means of its currents since the last answer: nobody else may read it.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass

from drivers.errors import DeviceError, LinkError
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import check_line_rate, line_time
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import Channel, LinkHealth, Sample, Stream, Watchdog
from drivers.vesc.can_frames import FAULTS
from drivers.vesc.uart_packets import (
    OVERHEAD,
    VALUES_BYTES,
    Decoder,
    Firmware,
    Record,
    Unreadable,
    Values,
    ask_firmware,
    ask_values,
    set_current,
    set_duty,
)

MAX_DUTY = 0.95
"""motor/mcconf_default.h, MCCONF_L_MAX_DUTY: the firmware clips a larger duty without saying so."""
PATIENCE_NS = 100_000_000
"""After which an answer is given up."""
EARLY = 4
"""A turn that comes by this part of a period too early is one in time."""


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind vesc_uart."""

    port: str
    pole_pairs: int
    nominal_bus_voltage: float
    """V; duty = volts / this."""
    watchdog_timeout: float
    """s, as set in VESC Tool (App Settings > General > Timeout); nothing on this wire tells."""
    max_voltage: float | None = None
    """V; None: 0.95 of the nominal bus voltage, where the firmware clips."""
    baud: int = 115200
    rate: float = 50.0
    """Rows/s; one a turn of the control loop at most."""
    timeout: float = 1.0
    """s for an answer at opening."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud)
        check_line_rate("vesc_uart", self.rate, self.baud, "8N1", VALUES_BYTES + OVERHEAD)
        if self.pole_pairs < 1:
            raise ValueError(f"vesc_uart pole_pairs must be at least 1, not {self.pole_pairs}")
        for key, value in (
            ("nominal_bus_voltage", self.nominal_bus_voltage),
            ("watchdog_timeout", self.watchdog_timeout),
            ("timeout", self.timeout),
        ):
            if not 0.0 < value < math.inf:
                raise ValueError(f"vesc_uart {key} must be positive, not {value}")
        if self.max_voltage is not None and not 0.0 < self.max_voltage <= MAX_DUTY * self.nominal_bus_voltage:
            raise ValueError(
                f"vesc_uart max_voltage must be above 0 and at most {MAX_DUTY * self.nominal_bus_voltage:g} V"
                f" (0.95 of the bus voltage, where the firmware clips), not {self.max_voltage}"
            )


class VescUart:
    """A motor controller: stream `<name>`, one row an answer."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        self._settings = SerialSettings(options.port, options.baud, capture=options.capture)
        self._port: SerialPort[Record] = SerialPort(name, self._settings, Decoder().feed, wire)
        self._reset()

    def _reset(self) -> None:
        self._bad = BadRecords()
        self._fault: str | None = None
        self._next_ns = self._asked_ns = 0
        self._waiting = False

    @property
    def streams(self) -> tuple[Stream, ...]:
        return _streams(self.name, self._options)

    @property
    def watchdog(self) -> Watchdog:
        """util/timeout.c: any SET_* feeds it; on expiry the motor is released and obeys the next SET_*."""
        return Watchdog(self._options.watchdog_timeout, fed_by="SET_* commands", action="coast", resumes_by_itself=True)

    @property
    def max_voltage(self) -> float:
        limit = self._options.max_voltage
        return MAX_DUTY * self._options.nominal_bus_voltage if limit is None else limit

    def open(self) -> str:
        """Asks for firmware and values, which moves nothing and feeds no timeout. Raises LinkError, DeviceError."""
        self._reset()
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self._port.close)
            firmware = self._identify()
            self._require_values()
            undo.pop_all()
        serial = f", {firmware.uuid}" if firmware.uuid else ""
        return f"VESC {firmware.hardware}, firmware {firmware.major}.{firmware.minor:02d}{serial}"

    def drain(self) -> list[Sample]:
        samples: list[Sample] = []
        for t_ns, record in self._port.inbox.take_all():
            match record:
                case Values():
                    self._waiting = False
                    self._note_fault(record.fault)
                    samples.append(self._row(t_ns, record))
                case Unreadable(data):
                    self._bad.add(data[:20].hex(" "))
        self._poll()
        return samples

    def health(self) -> LinkHealth:
        error, inbox = self._fault or self._port.error, self._port.inbox
        alive = self._port.alive and error is None
        return LinkHealth(alive, inbox.received, self._bad.count, self._bad.first, error, inbox.dropped)

    def command(self, volts: float) -> None:
        """SET_DUTY volts / nominal bus voltage, once. Raises ValueError beyond max_voltage, LinkError from the wire."""
        if not abs(volts) <= self.max_voltage:
            raise ValueError(f"{self.name}: command must be within +-{self.max_voltage:g} V, not {volts}")
        self._port.write(set_duty(volts / self._options.nominal_bus_voltage))

    def release(self) -> None:
        """Current 0: the motor coasts, whatever the duty controller was doing. Raises LinkError."""
        self._port.write(set_current(0.0))

    def close(self) -> None:
        """Current 0, and let the port go."""
        if self._port.alive:
            with contextlib.suppress(LinkError):  # the wire is gone; the device stops by its own timeout
                self.release()
        self._port.close()

    def _poll(self) -> None:
        if not self._port.alive:
            return
        now_ns, period = self._port.now_ns(), round(1e9 / self._options.rate)
        waits = self._waiting and now_ns - self._asked_ns < PATIENCE_NS
        if waits or now_ns < self._next_ns - period // EARLY:
            return
        behind = now_ns - self._next_ns >= period
        self._next_ns = (now_ns if behind else self._next_ns) + period
        self._asked_ns, self._waiting = now_ns, True
        with contextlib.suppress(LinkError):  # health says why the port is gone
            self._port.write(ask_values())

    def _row(self, t_ns: int, v: Values) -> Sample:
        rotation = v.erpm / (60.0 * self._options.pole_pairs)
        told = (v.bus_voltage, v.input_current, v.motor_temperature, v.fet_temperature, float(v.fault))
        return Sample(self.name, t_ns, (rotation, v.current, v.duty, v.duty * v.bus_voltage, *told))

    def _note_fault(self, code: int) -> None:
        meaning = FAULTS.get(code, "see mc_fault_code in datatypes.h")
        self._fault = (
            f"{self.name} reports fault {code} ({meaning}): clear its cause, then open again" if code else None
        )

    def _identify(self) -> Firmware:
        """Asked twice: the first may meet half a packet of a program that was cut off."""
        o = self._options
        for _ in range(2):
            record = self._port.ask(ask_firmware(), lambda r: isinstance(r, Firmware), o.timeout)
            if isinstance(record, Firmware):
                return record
        raise DeviceError(
            f"{self.name}: no VESC answers FW_VERSION on {o.port} at {o.baud} baud: check port, baud and power, and"
            " that App Settings > General > App to use has the UART (over USB it always answers)"
        )

    def _require_values(self) -> None:
        o = self._options
        record = self._port.ask(ask_values(), lambda r: isinstance(r, Values), o.timeout)
        if not isinstance(record, Values):
            raise DeviceError(
                f"{self.name}: the VESC does not answer GET_VALUES_SELECTIVE within {o.timeout:g} s: its firmware is"
                " older than 3.40; update it in VESC Tool"
            )
        self._note_fault(record.fault)
        if self._fault is not None:
            raise DeviceError(self._fault)
        self._port.inbox.take_all()


def _streams(name: str, options: Options) -> tuple[Stream, ...]:
    """The firmware casts each value to an integer (commands.c): it is cut toward zero."""
    per_erpm, cut = 1.0 / (60.0 * options.pole_pairs), "toward_zero"
    late = line_time(options.baud, "8N1", VALUES_BYTES + OVERHEAD)
    mean = 1.0 / options.rate
    channels = (
        Channel("rotation_rate", "rotation_rate", "rev/s", quantum=per_erpm, rounding=cut, delay=late),
        Channel("current", "current", "A", quantum=0.01, rounding=cut, delay=late, window=mean),
        Channel("duty", None, "1", quantum=0.001, rounding=cut, delay=late),
        Channel("motor_voltage", "motor_voltage", "V", delay=late, description="duty x measured bus voltage"),
        Channel("bus_voltage", "bus_voltage", "V", quantum=0.1, rounding=cut, delay=late),
        Channel("input_current", None, "A", quantum=0.01, rounding=cut, delay=late, window=mean),
        Channel("motor_temperature", "motor_temperature", "degC", quantum=0.1, rounding=cut),
        Channel("fet_temperature", None, "degC", quantum=0.1, rounding=cut),
        Channel("fault_code", None, "1", integer=True, description="mc_fault_code, 0 is none"),
    )
    return (Stream(name, "vesc_uart", channels, 1.0 / options.rate),)
