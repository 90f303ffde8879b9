"""Motor controller ODrive on CAN: rotation rate, current, supply; commanded in velocity or torque.

An axis closes a loop around speed or torque and has no command in volts: a command of the rig is turned into rev/s or
N.m by a factor of the bench file. When nobody talks to the axis for its watchdog's time it goes idle with an error and
stays so: a set-point is not enough to turn it again, errors have to be cleared and the closed loop asked for anew. That
is done here only after a command of 0 (0.5: Firmware/MotorControl/axis.cpp, watchdog_check; any frame to the axis feeds
it, can_simple.cpp).
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable

from drivers.errors import DeviceError, LinkError
from drivers.odrive.can_frames import (
    CLOSED_LOOP,
    IDLE,
    PASSTHROUGH,
    STATES,
    TORQUE_CONTROL,
    VELOCITY_CONTROL,
    WATCHDOG,
    Bus,
    Encoder,
    Heartbeat,
    Iq,
    NotUnderstood,
    Record,
    Temperature,
    clear_errors,
    decode,
    errors,
    set_mode,
    set_state,
    set_torque,
    set_velocity,
)
from drivers.odrive.options import Options, streams
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords, Inbox
from drivers.protocols import LinkHealth, Sample, Stream, Watchdog

PATIENCE = 0.5
"""s for the axis to be in the state that was asked for; a heartbeat of 10/s tells it 0.1 s late."""
SILENT = 0.5
"""Of the watchdog's time without a frame of ours: an end of the watchdog after that is no surprise."""
LEAST_WAIT = 1.0
"""s for the first message of a kind."""


class ODriveCan:
    """A motor controller: streams `<name>` (encoder), `_current`, `_supply`, `_thermal` and `_state` (heartbeat)."""

    def __init__(self, name: str, options: Options, bus: CanBus) -> None:
        self.name = name
        self._options, self._bus = options, bus
        self._inbox: Inbox[Frame] = Inbox(1)
        self._open = False
        self._reset()

    def _reset(self) -> None:
        self._bad = BadRecords()
        self._fault: str | None = None
        self._fed_ns = 0
        self._asked_ns: int | None = None
        """When closed loop control was asked for; None: the axis shall be idle."""
        self._lapsed = True
        """Our own silence, or that before us, has let the watchdog expire: its error is none of the motor's."""

    @property
    def streams(self) -> tuple[Stream, ...]:
        return streams(self.name, self._options)

    @property
    def watchdog(self) -> Watchdog:
        """axis.cpp, can_simple.cpp of 0.5: the axis goes idle, and stays there until its errors are cleared."""
        return Watchdog(
            self._options.watchdog_timeout, fed_by="frames to the axis", action="coast", resumes_by_itself=False
        )

    @property
    def max_voltage(self) -> float:
        return self._options.max_voltage

    def open(self) -> str:
        """Needs the bus open. Sends nothing, but `idle` to an axis that somebody left in another state."""
        self.close()
        self._reset()
        self._inbox = self._bus.subscribe(self._is_ours)
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._require_idle(self._first(Heartbeat, self._options.heartbeat_rate, "heartbeat_msg_rate_ms"))
            self._require_messages()
            undo.pop_all()
        self._open = True
        return f"ODrive axis, node {self._options.node_id}, firmware {self._options.firmware} (not asked)"

    def drain(self) -> list[Sample]:
        samples, o = [], self._options
        for t_ns, frame in self._inbox.take_all():
            match decode(frame):
                case Encoder(position, velocity):
                    samples.append(Sample(self.name, t_ns, (velocity, position)))
                case Iq(setpoint, measured) if o.current_rate:
                    samples.append(Sample(f"{self.name}_current", t_ns, (measured, setpoint)))
                case Bus(voltage, current) if o.supply_rate:
                    samples.append(Sample(f"{self.name}_supply", t_ns, (voltage, current)))
                case Temperature(fet, motor) if o.thermal_rate:
                    samples.append(Sample(f"{self.name}_thermal", t_ns, (fet, motor)))
                case Heartbeat() as heartbeat:
                    self._judge(heartbeat)
                    values = (float(heartbeat.error), float(heartbeat.state))
                    samples.append(Sample(f"{self.name}_state", t_ns, values))
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
        """Velocity or torque of so many volts, once. The first that is not 0 asks for closed loop control before.

        Raises ValueError beyond max_voltage; LinkError from the bus, and for a set-point after a silence in which the
        watchdog ended: 0 is sent in its place.
        """
        if not abs(volts) <= self.max_voltage:
            raise ValueError(f"{self.name}: command must be within +-{self.max_voltage:g} V, not {volts}")
        now_ns = self._bus.now_ns()
        silence = (now_ns - self._fed_ns) * 1e-9
        if silence >= self._options.watchdog_timeout:
            self._lapsed, self._asked_ns = True, None
        refused = volts != 0.0 and self._lapsed
        if volts == 0.0 and self._lapsed:
            self._send(set_state(self._options.node_id, IDLE), clear_errors(self._options.node_id))
            self._lapsed = False
        elif volts != 0.0 and not refused and self._asked_ns is None:
            self._close_the_loop(now_ns)
        self._send(self._set_point(0.0 if refused else volts))
        if refused:
            raise LinkError(
                f"{self.name}: nothing was commanded for longer than the watchdog of"
                f" {self._options.watchdog_timeout:g} s: 0 was sent in the place of {volts:g} V; command 0 V first"
            )

    def release(self) -> None:
        """Idle: no current, the propeller coasts. Raises LinkError."""
        self._asked_ns = None
        self._send(set_state(self._options.node_id, IDLE))

    def close(self) -> None:
        """Leave the axis idle, and the bus; the bus itself belongs to whoever opened it."""
        if self._open and self._bus.alive:
            with contextlib.suppress(LinkError):  # the bus is lost; the axis stops by its own watchdog
                self.release()
        self._bus.unsubscribe(self._inbox)
        self._open = False

    # -- what is sent ------------------------------------------------------------------------------------------------

    def _send(self, *frames: Frame) -> None:
        for frame in frames:
            self._bus.send(frame)
        self._fed_ns = self._bus.now_ns()

    def _set_point(self, volts: float) -> Frame:
        o = self._options
        make = set_velocity if o.mode == "velocity" else set_torque
        return make(o.node_id, volts * o.per_volt)

    def _close_the_loop(self, now_ns: int) -> None:
        """Mode, a set-point of 0, closed loop: in this order the axis has nothing old to go on with."""
        node = self._options.node_id
        control = VELOCITY_CONTROL if self._options.mode == "velocity" else TORQUE_CONTROL
        self._send(set_mode(node, control, PASSTHROUGH), self._set_point(0.0), set_state(node, CLOSED_LOOP))
        self._asked_ns = now_ns

    # -- what comes --------------------------------------------------------------------------------------------------

    def _is_ours(self, frame: Frame) -> bool:
        return not frame.extended and frame.id >> 5 == self._options.node_id

    def _judge(self, heartbeat: Heartbeat) -> None:
        """A fault of the link until it is gone: an error, or a loop that is not closed when it was asked for."""
        if self._is_our_silence(heartbeat):
            self._lapsed, self._asked_ns = True, None
        trouble = self._trouble(heartbeat)
        if trouble:
            self._fault = f"{self.name} reports {trouble}: clear its cause, then open again"
        elif self._asked_ns is None or heartbeat.state == CLOSED_LOOP:
            self._fault = None
        elif (self._bus.now_ns() - self._asked_ns) * 1e-9 > PATIENCE:
            state = STATES.get(heartbeat.state, str(heartbeat.state))
            self._fault = f"{self.name} is {state} and not in closed loop control: is it calibrated?"

    def _is_our_silence(self, heartbeat: Heartbeat) -> bool:
        """The watchdog has ended, and nothing or little was said to the axis."""
        silence = (self._bus.now_ns() - self._fed_ns) * 1e-9 >= SILENT * self._options.watchdog_timeout
        idle = self._lapsed or silence or self._asked_ns is None
        return idle and heartbeat.error == WATCHDOG[self._options.firmware]

    def _trouble(self, heartbeat: Heartbeat) -> str:
        """Errors but that of a watchdog which our own silence let expire."""
        known = heartbeat._replace(error=0) if self._is_our_silence(heartbeat) else heartbeat
        return errors(known, self._options.firmware)

    # -- opening -----------------------------------------------------------------------------------------------------

    def _first(self, kind: type[Record], rate: float, setting: str) -> Record:
        frame = self._await(lambda frame: isinstance(decode(frame), kind), max(LEAST_WAIT, 3.0 / rate))
        if frame is None:
            raise DeviceError(
                f"{self.name}: no {kind.__name__.lower()} message of node {self._options.node_id} came: check node_id,"
                f" bit rate and power, and set axis0.config.can.{setting} to {1e3 / rate:g} (0: never sent)"
            )
        return decode(frame)

    def _await(self, match: Callable[[Frame], bool], timeout: float) -> Frame | None:
        frame = self._inbox.wait_for(match, timeout, take=False)
        if frame is None and not self._bus.alive:
            raise LinkError(f"{self.name}: {self._bus.error or 'its CAN bus was closed'}")
        return frame

    def _require_messages(self) -> None:
        o = self._options
        wanted: tuple[tuple[type[Record], float, str], ...] = (
            (Encoder, o.rate, "encoder_msg_rate_ms"),
            (Iq, o.current_rate, "iq_msg_rate_ms"),
            (Bus, o.supply_rate, "bus_voltage_msg_rate_ms"),
            (Temperature, o.thermal_rate, "temperature_msg_rate_ms"),
        )
        for kind, rate, setting in wanted:
            if rate:
                self._first(kind, rate, setting)

    def _require_idle(self, first: Record) -> None:
        """An axis that somebody left driving is made idle; one with an error is refused."""
        assert isinstance(first, Heartbeat)
        if first.state != IDLE:
            self._bus.send(set_state(self._options.node_id, IDLE))
            self._inbox.take_all()
            again = self._await(self._is_idle, LEAST_WAIT)
            if again is None:
                state = STATES.get(first.state, str(first.state))
                raise DeviceError(f"{self.name} was {state} and does not become idle: switch it off and on")
        if trouble := self._trouble(first):
            raise DeviceError(f"{self.name} reports {trouble}: clear its cause (odrivetool: odrv0.clear_errors())")

    @staticmethod
    def _is_idle(frame: Frame) -> bool:
        heartbeat = decode(frame)
        return isinstance(heartbeat, Heartbeat) and heartbeat.state == IDLE
