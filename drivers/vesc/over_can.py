"""Motor controller VESC over CAN: rotation rate, current, duty, voltages, temperatures; commanded by duty.

What the device does when nobody commands it (util/timeout.c, firmware 7.01): it releases the motor after its own
timeout and obeys the next SET_* frame. Its voltage reference is the nominal bus voltage, a constant of the bench file:
duty from the *measured* bus voltage would put a 0.1 V quantised, late measurement inside the command and turn a sagging
supply into a constant-power load. What the motor really got is the channel `motor_voltage` = duty x measured V_in.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass

from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords, Inbox
from drivers.protocols import QUARTZ, Channel, LinkHealth, Sample, Stream, Watchdog
from drivers.vesc.can_frames import (
    FAULTS,
    PONG,
    PROCESS_SHORT_BUFFER,
    STATUS,
    STATUS_4,
    STATUS_5,
    FaultCode,
    NotUnderstood,
    Pong,
    Status,
    Status4,
    Status5,
    ask_fault,
    decode,
    ping,
    set_current,
    set_duty,
)

MAX_DUTY = 0.95
"""motor/mcconf_default.h, MCCONF_L_MAX_DUTY: the firmware clips a larger duty without saying so."""
REPLY_TIMEOUT = 1.0
"""s for PONG, and then for each status message (slowest factory rate 5 Hz)."""
FAULT_PERIOD_NS = 200_000_000
"""ns between two questions for the fault code; the firmware keeps a motor with a fault off for 0.5 s at least
(m_fault_stop_time_ms, mcconf_default.h), so that none is missed."""
HARDWARE = {0: "VESC", 1: "VESC battery management", 2: "VESC custom hardware", None: "VESC"}
"""comm_can.h, HW_TYPE."""
_FROM_VESC = frozenset((STATUS, STATUS_4, STATUS_5, PONG, PROCESS_SHORT_BUFFER))


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind vesc_can."""

    bus: str
    """Name of the bus in the bench file."""
    vesc_id: int
    pole_pairs: int
    """Of the motor; a wrong one scales rotation_rate and nothing on the wire tells."""
    nominal_bus_voltage: float
    """V; duty = volts / this."""
    watchdog_timeout: float
    """s, as set in VESC Tool (App Settings > General > Timeout); the device cannot be asked over CAN."""
    max_voltage: float | None = None
    """V; None: 0.95 of the nominal bus voltage, where the firmware clips."""
    host_id: int = 250
    """Our own identifier on the bus; 254 is VESC Tool's."""
    rate: float = 50.0
    """STATUS messages/s (VESC Tool: CAN Status Rate 1)."""
    supply_rate: float = 50.0
    """STATUS_5 messages/s; 0: not sent, then there is no motor voltage."""
    thermal_rate: float = 5.0
    """STATUS_4 messages/s (CAN Status Rate 2, factory 5 Hz); 0: not sent."""
    fault_every: int = 0
    """Ask for the fault code with every n-th command and record the answers; 0: five times a second, not recorded."""

    def __post_init__(self) -> None:
        for field, value in (("vesc_id", self.vesc_id), ("host_id", self.host_id)):
            if not 0 <= value <= 254:
                raise ValueError(f"vesc_can {field} must be 0 to 254, not {value}")
        if self.vesc_id == self.host_id:
            raise ValueError(f"vesc_can host_id must differ from vesc_id, both are {self.vesc_id}")
        if self.pole_pairs < 1:
            raise ValueError(f"vesc_can pole_pairs must be at least 1, not {self.pole_pairs}")
        for field, volts in (
            ("nominal_bus_voltage", self.nominal_bus_voltage),
            ("watchdog_timeout", self.watchdog_timeout),
        ):
            if not 0.0 < volts < math.inf:
                raise ValueError(f"vesc_can {field} must be positive, not {volts}")
        if self.max_voltage is not None and not 0.0 < self.max_voltage <= MAX_DUTY * self.nominal_bus_voltage:
            raise ValueError(
                f"vesc_can max_voltage must be above 0 and at most {MAX_DUTY * self.nominal_bus_voltage:g} V"
                f" (0.95 of the bus voltage, where the firmware clips), not {self.max_voltage}"
            )
        if not 0.0 < self.rate <= 1000.0 or min(self.supply_rate, self.thermal_rate) < 0.0 or self.fault_every < 0:
            raise ValueError("vesc_can rate must be 0 to 1000 messages/s, and no rate may be negative")


class VescCan:
    """A motor controller: streams `<name>` (STATUS), `<name>_supply` (STATUS_5), `<name>_thermal` (STATUS_4)."""

    def __init__(self, name: str, options: Options, bus: CanBus) -> None:
        self.name = name
        self._options = options
        self._bus = bus
        self._inbox: Inbox[Frame] = Inbox(1)
        self._bad = BadRecords()
        self._open = False
        self._supply: tuple[int, float] | None = None
        self._fault: str | None = None
        self._commands = 0
        self._asked_ns: int | None = None

    @property
    def streams(self) -> tuple[Stream, ...]:
        return _streams(self.name, self._options)

    @property
    def watchdog(self) -> Watchdog:
        """comm_can.c, util/timeout.c: any SET_* feeds it; on expiry the motor is released and obeys the next SET_*."""
        return Watchdog(self._options.watchdog_timeout, fed_by="SET_* commands", action="coast", resumes_by_itself=True)

    @property
    def max_voltage(self) -> float:
        limit = self._options.max_voltage
        return MAX_DUTY * self._options.nominal_bus_voltage if limit is None else limit

    def open(self) -> str:
        """Needs the bus open. Sends only PING, which moves nothing and feeds no timeout."""
        self.close()
        self._inbox = self._bus.subscribe(self._is_ours)
        self._bad, self._supply, self._fault, self._commands = BadRecords(), None, None, 0
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            pong = self._ping()
            self._require_status()
            undo.pop_all()
        self._open = True
        return f"{HARDWARE.get(pong.hardware, 'VESC')}, CAN id {pong.vesc_id}"

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, frame in self._inbox.take_all():
            match decode(frame):
                case Status() as status:
                    samples.append(self._motor_sample(t_ns, status))
                case Status5(tachometer, bus_voltage):
                    self._supply = (t_ns, bus_voltage)
                    if self._options.supply_rate:
                        samples.append(Sample(f"{self.name}_supply", t_ns, (bus_voltage, float(tachometer))))
                case Status4(fet, motor, current, _) if self._options.thermal_rate:
                    samples.append(Sample(f"{self.name}_thermal", t_ns, (motor, fet, current)))
                case FaultCode(_, code):
                    self._note_fault(code)
                    if self._options.fault_every:
                        samples.append(Sample(f"{self.name}_fault", t_ns, (float(code),)))
                case NotUnderstood():
                    self._bad.add(str(frame))
        return samples

    def health(self) -> LinkHealth:
        bus = self._bus.health()
        error = self._fault or bus.error
        return LinkHealth(
            alive=self._open and bus.alive and error is None,
            received=self._inbox.received,
            bad=bus.bad + self._bad.count,
            first_bad=(*self._bad.first, *bus.first_bad)[:5],
            error=error,
            dropped=self._inbox.dropped,
        )

    def command(self, volts: float) -> None:
        """SET_DUTY volts / nominal bus voltage, once. Raises ValueError beyond max_voltage, LinkError from the bus."""
        if not abs(volts) <= self.max_voltage:
            raise ValueError(f"{self.name}: command must be within +-{self.max_voltage:g} V, not {volts}")
        self._bus.send(set_duty(self._options.vesc_id, volts / self._options.nominal_bus_voltage))
        self._commands += 1
        if self._fault_is_due():
            self._bus.send(ask_fault(self._options.vesc_id, self._options.host_id))

    def _fault_is_due(self) -> bool:
        if self._options.fault_every:
            return self._commands % self._options.fault_every == 0
        now_ns = self._bus.now_ns()
        due = self._asked_ns is None or now_ns - self._asked_ns >= FAULT_PERIOD_NS
        self._asked_ns = now_ns if due else self._asked_ns
        return due

    def release(self) -> None:
        """Current 0: the motor coasts, whatever the duty controller was doing. Raises LinkError."""
        self._bus.send(set_current(self._options.vesc_id, 0.0))

    def close(self) -> None:
        """Leave the bus; the bus itself belongs to whoever opened it. The device then stops by its own timeout."""
        self._bus.unsubscribe(self._inbox)
        self._open = False

    def _is_ours(self, frame: Frame) -> bool:
        sender_or_target = (
            self._options.vesc_id if frame.id >> 8 in (STATUS, STATUS_4, STATUS_5) else self._options.host_id
        )
        return frame.extended and frame.id & 0xFF == sender_or_target and frame.id >> 8 in _FROM_VESC

    def _motor_sample(self, t_ns: int, status: Status) -> Sample:
        rotation_rate = status.erpm / (60.0 * self._options.pole_pairs)
        return Sample(
            self.name, t_ns, (rotation_rate, status.current, status.duty, status.duty * self._bus_voltage(t_ns))
        )

    def _bus_voltage(self, t_ns: int) -> float:
        """V; NaN until known, and again when STATUS_5 has not come for three of its periods (at least 1 s)."""
        if self._supply is None:
            return math.nan
        known_at, volts = self._supply
        limit = max(1.0, 3.0 / self._options.supply_rate) if self._options.supply_rate else 1.0
        return volts if (t_ns - known_at) * 1e-9 <= limit else math.nan

    def _note_fault(self, code: int) -> None:
        meaning = FAULTS.get(code, "see mc_fault_code in datatypes.h")
        self._fault = (
            f"{self.name} reports fault {code} ({meaning}): clear its cause, then open again" if code else None
        )

    def _await(self, match: Callable[[Frame], bool], *, take: bool) -> Frame | None:
        frame = self._inbox.wait_for(match, REPLY_TIMEOUT, take=take)
        if frame is None and not self._bus.alive:
            raise LinkError(f"{self.name}: {self._bus.error or 'its CAN bus was closed'}")
        return frame

    def _ping(self) -> Pong:
        vesc_id = self._options.vesc_id
        self._bus.send(ping(vesc_id, self._options.host_id))
        answer = self._await(lambda frame: frame.id >> 8 == PONG and frame.data[:1] == bytes([vesc_id]), take=True)
        pong = decode(answer) if answer is not None else None
        if not isinstance(pong, Pong):
            raise DeviceError(
                f"{self.name}: VESC {vesc_id} does not answer PING within {REPLY_TIMEOUT:g} s: check vesc_id,"
                " bit rate, power, and that App Settings > General > CAN Mode is VESC"
            )
        return pong

    def _require_status(self) -> None:
        options = self._options
        rates = {STATUS: options.rate, STATUS_5: options.supply_rate, STATUS_4: options.thermal_rate}
        labels = {STATUS: 1, STATUS_5: 5, STATUS_4: 4}
        for number in (number for number, rate in rates.items() if rate):
            if self._await(_numbered(number), take=False) is None:
                raise DeviceError(
                    f"{self.name}: VESC {options.vesc_id} answers PING but sends no STATUS {labels[number]} message"
                    f" within {REPLY_TIMEOUT:g} s: in VESC Tool set App Settings > General > CAN Status Rate 1 to"
                    f" {rates[number]:g} Hz and tick CAN Status Message {labels[number]} (factory default: all off)"
                )


def _numbered(number: int) -> Callable[[Frame], bool]:
    return lambda frame: frame.id >> 8 == number


def _streams(name: str, options: Options) -> tuple[Stream, ...]:
    """The firmware casts each value to an integer (comm_can.c, (int32_t) and (int16_t)): it is cut toward zero."""
    per_erpm, cut = 1.0 / (60.0 * options.pole_pairs), "toward_zero"
    description = "duty x measured bus voltage; its error is about 0.1 V x duty + 0.001 x bus voltage"
    motor = (
        Channel(
            "rotation_rate",
            "rotation_rate",
            "rev/s",
            quantum=per_erpm,
            rounding=cut,
            description="ERPM / pole pairs / 60",
        ),
        Channel("current", "current", "A", quantum=0.1, rounding=cut),
        Channel("duty", None, "1", quantum=0.001, rounding=cut),
        Channel("motor_voltage", "motor_voltage", "V", description=description),
    )
    supply = (
        Channel("bus_voltage", "bus_voltage", "V", quantum=0.1, rounding=cut),
        Channel("tachometer", None, "1", integer=True, description="counts, 6 per electrical revolution"),
    )
    thermal = (
        Channel("motor_temperature", "motor_temperature", "degC", quantum=0.1, rounding=cut),
        Channel("fet_temperature", None, "degC", quantum=0.1, rounding=cut),
        Channel("input_current", None, "A", quantum=0.1, rounding=cut),
    )
    parts = [
        ("", options.rate, motor),
        ("_supply", options.supply_rate, supply),
        ("_thermal", options.thermal_rate, thermal),
    ]
    if options.fault_every:
        # commands come at the loop's rate, which a driver does not know; 50 Hz is the loop's default
        fault = (Channel("fault_code", None, "1", integer=True, description="mc_fault_code, 0 is none"),)
        parts.append(("_fault", 50.0 / options.fault_every, fault))
    return tuple(
        Stream(name + part, "vesc_can", channels, 1.0 / rate, QUARTZ) for part, rate, channels in parts if rate
    )
