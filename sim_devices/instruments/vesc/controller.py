"""Device side of a VESC on CAN: what it obeys, when it lets go, what it tells.

Source: github.com/vedderb/bldc: comm/comm_can.c (decode_msg, send thread), timeout.c, appconf_default.h; bytes are in
codec.py. The motor is released when no SET_* command came for `timeout` (firmware default 1000 ms, brake current
0): it coasts. The next command is obeyed as if nothing had been: a VESC resumes by itself.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import copysign, inf

from sim_devices.instruments.vesc import codec
from sim_devices.instruments.vesc.codec import Telemetry
from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

BROADCAST = 255
FAULT_ABS_OVER_CURRENT, FAULT_OVER_TEMP_MOTOR = 4, 6
"""mc_fault_code, datatypes.h."""
FAULT_STOP_TIME = 0.5
"""s the motor stays off after a fault (m_fault_stop_time_ms = 500, mcconf_default.h)."""
BOOT_TIME = 1.0
"""s."""
MAX_DUTY = 0.95
"""l_max_duty, mcconf_default.h."""
SENDERS = {"STATUS": codec.status, "STATUS_4": codec.status_4, "STATUS_5": codec.status_5}
MODES = {
    codec.SET_DUTY: ("duty", 1e5),
    codec.SET_CURRENT: ("current", 1e3),
    codec.SET_CURRENT_BRAKE: ("brake", 1e3),
    codec.SET_RPM: ("rpm", 1.0),
    codec.SET_CURRENT_REL: ("current", 1e5),
    codec.SET_CURRENT_BRAKE_REL: ("brake", 1e5),
}
"""CAN command -> (mode, scale); the REL commands are fractions of max_current."""
COMM_TO_CAN = {
    codec.COMM_SET_DUTY: codec.SET_DUTY,
    codec.COMM_SET_CURRENT: codec.SET_CURRENT,
    codec.COMM_SET_CURRENT_BRAKE: codec.SET_CURRENT_BRAKE,
    codec.COMM_SET_RPM: codec.SET_RPM,
}


@dataclass(frozen=True, slots=True)
class VescOptions:
    """`[devices.<name>]` of kind vesc."""

    kind: str
    vesc_id: int = 23
    pole_pairs: int = 7
    timeout: float = 1.0
    """s; 0 disables the watchdog."""
    brake_current: float = 0.0
    """A after the timeout; 0: coasts."""
    broken_watchdog: bool = False
    """The timeout is configured and never fires."""
    max_current: float = 60.0
    """A."""
    rate_1: float = 50.0
    """Hz of `messages_1` (factory: 50 Hz)."""
    messages_1: tuple[str, ...] = ()
    """Status messages; the factory sends none."""
    rate_2: float = 5.0
    messages_2: tuple[str, ...] = ()
    uuid: str = "53494d2d564553432d303031"
    """12 bytes, hexadecimal."""

    def __post_init__(self) -> None:
        wrong = set(self.messages_1 + self.messages_2) - set(SENDERS)
        if wrong:
            raise ValueError(f"status messages must be among {', '.join(SENDERS)}, got {', '.join(sorted(wrong))}")
        if not 0 <= self.vesc_id <= 253 or len(bytes.fromhex(self.uuid)) != 12:
            raise ValueError("vesc_id must be 0..253 and uuid 12 bytes")


Log = Callable[..., None]
"""log(event, **fields): the truth log."""


class Vesc:
    """One controller. `measure` gives its telemetry in the world now; `log` writes what happened to the truth."""

    faults = ("frozen", "silent", "broken_watchdog", "over_current", "over_temperature", "reboot", "ignores_commands",
              "backwards", "redrives", "rate_factor", "current_factor")  # fmt: skip

    def __init__(self, options: VescOptions, nominal_bus: float, measure: Callable[[], Telemetry], log: Log) -> None:
        """`nominal_bus`: V that duty 1 stands for in the world's `volts`."""
        self._options, self._bus, self._measure, self._log = options, nominal_bus, measure, log
        self._mode, self._target = "current", 0.0
        self._last_command = -inf
        self._timed_out = True
        self._next = [0.0 if options.messages_1 else inf, 0.0 if options.messages_2 else inf]
        self._fault, self._amount = "", DEFAULT_AMOUNT
        self._code = 0
        self._faulted_until = -inf
        self._boots_at = inf
        self._integral = 0.0
        self._frozen = Telemetry()
        self._sums = [0.0] * 4
        self._steps = 0

    # -- the motor ---------------------------------------------------------------------------------------------------

    @property
    def duty(self) -> float:
        """Duty it applies now; 0 in the current modes (the telemetry shows the back-EMF's)."""
        return self._target if self._mode == "duty" else 0.0

    @property
    def timed_out(self) -> bool:
        return self._timed_out

    @property
    def code(self) -> int:
        return self._code

    def drive(self, n: float, dt: float) -> tuple[float | None, float]:
        """(volts, amps) for one world step at n rev/s: volts None means that the windings carry amps."""
        if self._fault == "redrives":
            return self._amount * self._bus, 0.0
        if self._mode == "duty":
            return self._target * (-self._bus if self._fault == "backwards" else self._bus), 0.0
        if self._mode == "rpm":
            return None, self._speed_loop(n, dt)
        if self._mode == "brake":
            # the brake pulls against the rotation and lets go at standstill
            return None, -copysign(min(abs(self._target), 10.0 * abs(n)), n)
        return None, self._target

    def _speed_loop(self, n: float, dt: float) -> float:
        """The PI of s_pid (gains 0.004 per 20 ERPM-normalised unit, mcconf_default.h), output as current."""
        error = (self._target - n * 60.0 * self._options.pole_pairs) / 20.0
        self._integral = min(max(self._integral + 0.004 * error * dt * 20.0, -1.0), 1.0)
        share = min(max(0.004 * error + self._integral, -1.0), 1.0)
        return share * self._options.max_current

    def average(self, current: float, input_current: float, i_q: float, v_q: float) -> None:
        """One world step for the averages that GET_VALUES gives and resets."""
        sums = self._sums
        sums[0] += current
        sums[1] += input_current
        sums[2] += i_q
        sums[3] += v_q
        self._steps += 1

    # -- time --------------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        if self._boots_at < inf:
            return self._boots_at
        return min(self._expiry(), *self._next)

    def _expiry(self) -> float:
        o = self._options
        broken = o.broken_watchdog or self._fault == "broken_watchdog"
        return inf if self._timed_out or broken or o.timeout <= 0 else self._last_command + o.timeout

    def tick(self, t: float) -> list[CanFrame]:
        """Everything it does by itself until t: the watchdog first, then status messages."""
        if self._boots_at < inf:
            if t < self._boots_at:
                return []
            self._boots_at = inf
        if t >= self._expiry():
            self._release(t)
        frames: list[CanFrame] = []
        o = self._options
        for group, (rate, names) in enumerate(((o.rate_1, o.messages_1), (o.rate_2, o.messages_2))):
            while self._next[group] <= t:
                late = t - self._next[group] > 1.0  # s: switched off meanwhile, nothing to catch up
                self._next[group] = (t if late else self._next[group]) + 1.0 / rate
                frames += [SENDERS[name](self._telemetry(), o.vesc_id) for name in names]
        return [] if self._fault == "silent" else frames

    def _release(self, t: float) -> None:
        self._timed_out = True
        self._mode, self._target = ("brake", self._options.brake_current)
        self._log("timeout", volts=0.0, after=t - self._last_command, brake_current=self._options.brake_current)

    # -- the bus -----------------------------------------------------------------------------------------------------

    def receive(self, frame: CanFrame, t: float) -> list[CanFrame]:
        """A frame from the bus; returns the answers."""
        command, to = frame.id >> 8, frame.id & 0xFF
        if not frame.extended or frame.remote or self._boots_at < inf or self._fault == "silent":
            return []
        if to not in (self._options.vesc_id, BROADCAST):
            return []
        if command in MODES and len(frame.data) >= 4:
            self._set(command, frame.data, t)
            return []
        if command == codec.PING and frame.data:
            answer = bytes((self._options.vesc_id, codec.HARDWARE_TYPE_VESC))
            return [CanFrame(codec.PONG << 8 | frame.data[0], answer)]
        if command == codec.PROCESS_SHORT_BUFFER and len(frame.data) >= 3:
            reply = self.answer(frame.data[2:], t)
            return codec.buffer_frames(reply, frame.data[0], self._options.vesc_id) if reply else []
        return []

    def answer(self, payload: bytes, t: float) -> bytes:
        """A payload of comm/commands.c, over whatever wire; returns the reply's, empty where it has none."""
        reply = b""
        if self._boots_at < inf or self._fault == "silent":
            return reply
        match payload[0]:
            case codec.COMM_FW_VERSION:
                reply = codec.firmware_version(bytes.fromhex(self._options.uuid))
            case codec.COMM_GET_VALUES:
                reply = bytes((codec.COMM_GET_VALUES,)) + codec.values(self._averaged())
            case codec.COMM_GET_VALUES_SELECTIVE if len(payload) >= 5:
                mask = int.from_bytes(payload[1:5], "big")
                reply = payload[:5] + codec.values(self._averaged(), mask)
            case codec.COMM_ALIVE:
                self._feed(t)
            case comm if comm in COMM_TO_CAN and len(payload) >= 5:
                self._set(COMM_TO_CAN[comm], payload[1:5], t)
        return reply

    def _feed(self, t: float) -> None:
        self._last_command = t
        self._timed_out = False

    def _set(self, command: int, data: bytes, t: float) -> None:
        mode, scale = MODES[command]
        if command == codec.SET_CURRENT and len(data) >= 6:
            data = data[2:]  # comm_can.c takes an off-delay from the first two bytes of a long frame
        value = struct.unpack(">i", data[:4])[0] / scale
        if command in (codec.SET_CURRENT_REL, codec.SET_CURRENT_BRAKE_REL):
            value *= self._options.max_current
        if self._fault == "ignores_commands":
            return
        self._feed(t)
        if t < self._faulted_until:
            return
        self._code = 0
        self._obey(mode, self._clipped(mode, value))

    def _clipped(self, mode: str, value: float) -> float:
        limit = {"duty": MAX_DUTY, "rpm": 1e5}.get(mode, self._options.max_current)
        return min(max(value, -limit), limit)

    def _obey(self, mode: str, target: float) -> None:
        if (mode, target) == (self._mode, self._target):
            return
        if mode != self._mode:
            self._integral = 0.0
        self._mode, self._target = mode, target
        volts = target * self._bus if mode == "duty" else 0.0 if target == 0.0 else None
        self._log("command", mode=mode, value=target, volts=volts)

    # -- telemetry ---------------------------------------------------------------------------------------------------

    def _telemetry(self) -> Telemetry:
        if self._fault != "frozen":
            self._frozen = self._measure()
        match self._fault:
            case "rate_factor":
                return replace(self._frozen, erpm=self._frozen.erpm * self._amount)
            case "current_factor":
                return replace(self._frozen, current=self._frozen.current * self._amount)
            case _:
                return self._frozen

    def _averaged(self) -> Telemetry:
        """With the averages since the previous read, which this read resets (mc_interface_read_reset_avg_*)."""
        now = self._telemetry()
        if not self._steps:
            return now
        current, input_current, i_q, v_q = (total / self._steps for total in self._sums)
        self._sums, self._steps = [0.0] * 4, 0
        return replace(now, current=current, input_current=input_current, i_q=i_q, v_q=v_q)

    # -- faults ------------------------------------------------------------------------------------------------------

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        """Have one of `faults`. Over-current and over-temperature stop the motor, as the firmware does."""
        if name not in self.faults:
            raise ValueError(f"motor: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "reboot":
            self._mode, self._target, self._timed_out = "current", 0.0, True
            self._boots_at, self._code = t + BOOT_TIME, 0
        elif name in ("over_current", "over_temperature"):
            self._code = FAULT_ABS_OVER_CURRENT if name == "over_current" else FAULT_OVER_TEMP_MOTOR
            self._mode, self._target = "current", 0.0
            self._faulted_until = t + FAULT_STOP_TIME if name == "over_current" else inf
        else:
            self._fault, self._amount = name, amount

    def clear(self, _t: float) -> None:
        self._fault, self._code, self._faulted_until = "", 0, -inf
