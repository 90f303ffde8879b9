"""Device side of a DroneCAN ESC: RawCommand obeyed, timed and forgotten; esc.Status, NodeStatus and GetNodeInfo told.

Source: DSDL of DroneCAN (341.NodeStatus, 1.GetNodeInfo, uavcan/equipment/esc 1030, 1031, 1034, safety 1100); Sapog,
firmware/src/uavcan_node/esc_controller.cpp: an array too short to have its index stops it, a set-point lives for
cmd_ttl_ms, and the next one turns it again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf

from sim_devices.instruments.dronecan.options import DronecanEscOptions, Measured
from sim_devices.instruments.dronecan.wire import (
    ALLOCATION,
    GET_NODE_INFO,
    NODE_STATUS,
    RAW_COMMAND,
    SIGNATURES,
    STATUS,
    Bits,
    Ear,
    Heard,
    answer_id,
    frames,
    message_id,
    signed,
)
from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

FULL = 8191
OK, WARNING, ERROR, CRITICAL = range(4)
OPERATIONAL, MAINTENANCE = 0, 2
BOOT_TIME = 1.0
"""s"""
OTHER = 99
"""Identifier of the other node that some faults bring to the bus."""
HEALTHS = {"warning": WARNING, "over_temperature": ERROR, "over_current": CRITICAL}
KELVIN = 273.15

Log = Callable[..., None]
"""log(event, **fields): the truth log."""


class DronecanEsc:
    """One ESC. `bus`: V of set-point 8191; `gain` gives rev/s of its motor at 1 V; `measure` what it measures now."""

    faults = ("frozen", "silent", "broken_watchdog", "ignores_commands", "backwards", "redrives", "reboot", "desync",
              "maintenance", "rate_factor", "current_factor", "other_esc", "other_master", *HEALTHS)  # fmt: skip

    def __init__(
        self,
        options: DronecanEscOptions,
        bus: float,
        gain: Callable[[], float],
        measure: Callable[[], Measured],
        log: Log,
    ) -> None:
        self._options, self._bus, self._gain, self._measure, self._log = options, bus, gain, measure, log
        self._fault, self._amount = "", DEFAULT_AMOUNT
        self._frozen: Measured | None = None
        self._ear, self._numbers = Ear(), dict[int, int]()
        self._next = {kind: 1.0 / rate if rate else inf for kind, rate in self._rates().items()}
        self._boots_at = inf
        self._told = 0.0
        self._start(0.0)

    def _start(self, t: float) -> None:
        """As after power-up."""
        self._volts, self._fed, self._since = 0.0, inf, t
        self._armed = not self._options.needs_arming
        self._errors = 0

    def _rates(self) -> dict[int, float]:
        o = self._options
        return {NODE_STATUS: o.state_rate, STATUS: o.rate} if o.node_id else {ALLOCATION: 1.0}

    # -- the motor ---------------------------------------------------------------------------------------------------

    @property
    def volts(self) -> float | None:
        """What the motor gets; None: nothing drives it."""
        return self._volts or None

    def drive(self, _n: float, _dt: float) -> tuple[float | None, float]:
        """(volts, amps) for one world step: volts None means that the windings carry amps."""
        if self._fault == "redrives":
            return self._amount * self._bus, 0.0
        if self._volts == 0.0:
            return None, 0.0
        return (-self._volts if self._fault == "backwards" else self._volts), 0.0

    def _settle(self, volts: float) -> None:
        broken = HEALTHS.get(self._fault, OK) >= ERROR or self._fault == "maintenance"
        least = -self._bus if self._options.reversible else 0.0
        self._volts = 0.0 if broken or not self._armed else min(max(volts, least), self._bus)
        if self._volts != self._told:
            self._told = self._volts
            self._log("command", mode="raw", value=round(self._volts / self._bus * FULL), volts=self._volts)

    # -- time --------------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        return self._boots_at if self._boots_at < inf else min(self._expiry(), *self._next.values())

    def _expiry(self) -> float:
        o = self._options
        off = o.broken_watchdog or self._fault == "broken_watchdog" or o.timeout <= 0.0
        return inf if off else self._fed + o.timeout

    def tick(self, t: float) -> list[CanFrame]:
        """Everything it does by itself until t: the timeout first, then its messages."""
        if self._boots_at < inf:
            if t < self._boots_at:
                return []
            self._boots_at = inf
            self._start(t)
        if t >= self._expiry():
            if self._volts:
                self._log("timeout", volts=0.0, after=t - self._fed)
            self._fed = inf
            self._settle(0.0)
        said: list[CanFrame] = []
        for kind, rate in self._rates().items():
            while self._next[kind] <= t:
                late = t - self._next[kind] > 1.0  # s: switched off meanwhile, nothing to catch up
                self._next[kind] = (t if late else self._next[kind]) + 1.0 / rate
                said += self._message(kind, t)
        return [] if self._fault == "silent" else said

    # -- the bus -----------------------------------------------------------------------------------------------------

    def receive(self, frame: CanFrame, t: float) -> list[CanFrame]:
        """A frame from the bus; returns the answers."""
        if self._boots_at < inf or not self._options.node_id or self._fault == "silent":
            return []
        heard = self._ear.hear(frame)
        if heard is None:
            return []
        self.tick(t)
        if heard.destination is not None:
            return self._answer(heard, t)
        if self._fault != "ignores_commands":
            self._obey(heard, t)
        return []

    def _obey(self, heard: Heard, t: float) -> None:
        match heard.data_type:
            case 1030:  # RawCommand
                self._set_point(signed(heard.data, 14), lambda value: value / FULL * self._bus, t)
            case 1031:  # RPMCommand
                self._set_point(signed(heard.data, 18), lambda value: value / 60.0 / self._gain(), t)
            case 1100 if self._options.needs_arming and heard.data:  # ArmingStatus
                self._armed = heard.data[0] == 255
                if not self._armed:
                    self._settle(0.0)

    def _set_point(self, values: list[int], volts: Callable[[int], float], t: float) -> None:
        index = self._options.esc_index
        if index >= len(values):
            self._fed = inf
            self._settle(0.0)
            return
        self._fed = t
        self._settle(volts(values[index]))

    def _answer(self, heard: Heard, t: float) -> list[CanFrame]:
        o = self._options
        if heard.destination != o.node_id or not heard.request or heard.data_type != GET_NODE_INFO or not o.answers:
            return []
        data = self._state(t) + bytes([1, 2, 0]) + bytes(12) + bytes([1, 0]) + bytes.fromhex(o.serial)
        data += b"\0" + o.model.encode("ascii")  # no certificate; the name is the last array, without its length
        identifier = answer_id(GET_NODE_INFO, o.node_id, heard.source)
        return frames(identifier, data, heard.number, SIGNATURES["GetNodeInfo"])

    # -- what it tells -----------------------------------------------------------------------------------------------

    def _message(self, kind: int, t: float) -> list[CanFrame]:
        node = self._options.node_id
        if not node:  # 1.Allocation from nobody: no preference, the first bytes of its serial number
            data = b"\x01" + bytes.fromhex(self._options.serial)[:6]
            return frames(30 << 24 | 0x155 << 10 | ALLOCATION << 8, data, self._number(kind))
        if kind == NODE_STATUS:
            return frames(message_id(NODE_STATUS, node, 24), self._state(t), self._number(kind))
        number, data = self._number(kind), self._status()
        said = frames(message_id(STATUS, node), data, number, SIGNATURES["Status"])
        if self._fault == "other_esc":
            said += frames(message_id(STATUS, OTHER), data, number, SIGNATURES["Status"])
        if self._fault == "other_master":
            said += frames(message_id(RAW_COMMAND, OTHER), b"\0\0", number)
        return said

    def _number(self, kind: int) -> int:
        number = self._numbers.get(kind, 0)
        self._numbers[kind] = (number + 1) % 32
        return number

    def _state(self, t: float) -> bytes:
        mode = MAINTENANCE if self._fault == "maintenance" else OPERATIONAL
        bits = Bits().add(int(t - self._since), 32).add(HEALTHS.get(self._fault, OK), 2).add(mode, 3).add(0, 3)
        return bits.add(0, 16).bytes()

    def _now(self) -> Measured:
        if self._fault != "frozen" or self._frozen is None:
            self._frozen = self._measure()
        now, amount = self._frozen, self._amount
        match self._fault:
            case "rate_factor":
                return replace(now, rotation_rate=now.rotation_rate * amount)
            case "current_factor":
                return replace(now, current=now.current * amount)
            case _:
                return now

    def _status(self) -> bytes:
        now = self._now()
        bits = Bits().add(self._errors, 32).half(now.bus_voltage).half(now.current).half(now.temperature + KELVIN)
        bits.add(round(now.rotation_rate * 60.0), 18).add(round(abs(self._volts) / self._bus * 100.0), 7)
        return bits.add(self._options.esc_index, 5).bytes()

    # -- faults ------------------------------------------------------------------------------------------------------

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        """Have one of `faults`. Those of health and mode stop the motor; `desync` is counted and over."""
        if name not in self.faults:
            raise ValueError(f"motor: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "desync":
            self._errors += 1
            return
        if name == "reboot":
            self._settle(0.0)
            self._boots_at = t + BOOT_TIME
            return
        self._fault, self._amount = name, amount
        if name in HEALTHS or name == "maintenance":
            self._settle(self._volts)

    def clear(self, _t: float) -> None:
        self._fault = ""
