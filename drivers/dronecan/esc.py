"""Motor controller: a DroneCAN (UAVCAN v0) ESC, commanded by RawCommand, measured by esc.Status.

A command of the rig in volts is the fraction of `full_voltage` that the ESC shall give. Only a RawCommand (or
RPMCommand) keeps an ESC going; how long after the last one it stops is a setting of the ESC that the protocol cannot
ask (Sapog: cmd_ttl_ms, 200 ms as delivered; a RawCommand or RPMCommand too short to have its index stops it at once,
firmware/src/uavcan_node/esc_controller.cpp). It then obeys the next RawCommand: after a silence 0 goes first.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

from drivers.dronecan.options import Options, streams
from drivers.dronecan.transfers import (
    GET_NODE_INFO,
    NODE_STATUS,
    RAW_COMMAND,
    RPM_COMMAND,
    STATUS,
    Assembler,
    NotUnderstood,
    Received,
    Sender,
    is_anonymous,
    is_answer,
    is_message,
    text,
)
from drivers.dronecan.watching import Watching
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords, Inbox
from drivers.protocols import LinkHealth, Sample, Stream, Watchdog, measured

FULL = 8191
"""RawCommand of all that the ESC gives (1030.RawCommand.uavcan, int14)."""
STATE_EVERY = 0.5
"""s between two NodeStatus of ours, and ArmingStatus: at least one a second is asked for, and a tick may be late."""
LEAST_WAIT = 1.0
"""s for the first message of a kind."""
ANSWER_TIME = 0.5
"""s for an answer to GetNodeInfo; asked twice."""
KELVIN = 273.15


class DronecanEsc:
    """A motor controller of streams `<name>` (esc.Status) and `<name>_state` (NodeStatus)."""

    def __init__(self, name: str, options: Options, bus: CanBus) -> None:
        self.name = name
        self._options, self._bus = options, bus
        self._inbox: Inbox[Frame] = Inbox(1)
        self._open = False
        self._reset()

    def _reset(self) -> None:
        self._bad = BadRecords()
        self._assembler = Assembler()
        self._sender = Sender(self._options.own_node_id)
        self._watching = Watching(self.name, self._options)
        self._anonymous = False
        self._others: set[tuple[int, int]] = set()
        self._fed_ns = 0
        self._told_ns: int | None = None
        self._opened_ns = 0
        self._lapsed = True

    @property
    def streams(self) -> tuple[Stream, ...]:
        return streams(self.name, self._options)

    @property
    def watchdog(self) -> Watchdog:
        """As stated by the bench file; the next RawCommand turns the motor again."""
        return Watchdog(self._options.watchdog_timeout, fed_by="RawCommand", action="coast", resumes_by_itself=True)

    @property
    def max_voltage(self) -> float:
        return self._options.max_voltage

    @property
    def min_voltage(self) -> float:
        """V: 0 for an ESC of one direction."""
        return -self.max_voltage if self._options.reversible else 0.0

    def open(self) -> str:
        """Needs the bus open. Sends no set-point: a question of its identity, and a stop to an ESC that turns."""
        self.close()
        self._reset()
        self._inbox = self._bus.subscribe(self._is_ours)
        self._opened_ns = self._bus.now_ns()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._require(NODE_STATUS, self._options.state_rate)
            status = self._require(STATUS, self._options.rate)
            if status.value.rpm:
                self._let_go()
            identity = self._identity()
            if self._watching.fault:
                raise DeviceError(self._watching.fault)
            undo.pop_all()
        self._open = True
        return identity + (", a node without identifier asks for one on this bus" if self._anonymous else "")

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, frame in self._inbox.take_all():
            transfer = self._take(frame)
            if transfer is not None and (row := self._row(t_ns, transfer)):
                samples.append(row)
        return samples

    def health(self) -> LinkHealth:
        bus = self._bus.health()
        error = self._watching.fault or bus.error
        return LinkHealth(
            alive=self._open and bus.alive and error is None,
            received=self._inbox.received,
            bad=bus.bad + self._bad.count,
            first_bad=(*self._bad.first, *bus.first_bad)[:5],
            error=error,
            dropped=self._inbox.dropped,
        )

    def told(self, volts: float) -> float:
        return self._raw(volts) * self._options.full_voltage / FULL

    def _raw(self, volts: float) -> int:
        return round(volts / self._options.full_voltage * FULL)

    def command(self, volts: float) -> None:
        """RawCommand of so many volts, once; NodeStatus (and ArmingStatus) of ours twice a second with it.

        Raises ValueError beyond max_voltage; LinkError from the bus, for a negative voltage of an ESC of one direction,
        and for a set-point after a silence in which the watchdog ended: 0 is sent in their place.
        """
        if not abs(volts) <= self.max_voltage:
            raise ValueError(f"{self.name}: command must be within +-{self.max_voltage:g} V, not {volts}")
        now_ns, timeout = self._bus.now_ns(), self._options.watchdog_timeout
        self._lapsed = self._lapsed or (now_ns - self._fed_ns) * 1e-9 >= timeout
        why = ""
        if volts < 0.0 and not self._options.reversible:
            why = "an ESC of one direction (reversible is false) gives no negative voltage"
        elif volts and self._lapsed:
            why = f"nothing was commanded for longer than the watchdog of {timeout:g} s, command 0 V first"
        self._tell_state(now_ns)
        self._set(0.0 if why else volts)
        if volts == 0.0:
            self._lapsed = False
        if why:
            raise LinkError(f"{self.name}: {why}: 0 was sent in the place of {volts:g} V")

    def release(self) -> None:
        """No set-point for anybody, in two ways, and disarmed: the propeller coasts. Raises LinkError."""
        self._let_go()

    def close(self) -> None:
        """Let go of the motor, and leave the bus; the bus itself belongs to whoever opened it."""
        if self._open and self._bus.alive:
            with contextlib.suppress(LinkError):  # the bus is lost; the ESC stops by its own watchdog
                self._let_go()
        self._bus.unsubscribe(self._inbox)
        self._open = False

    # -- what is sent ------------------------------------------------------------------------------------------------

    def _send(self, frames: list[Frame]) -> None:
        for frame in frames:
            self._bus.send(frame)

    def _set(self, volts: float) -> None:
        """The places before ours get 0: another ESC of this bus stands still."""
        self._send(self._sender.raw_command([0] * self._options.esc_index + [self._raw(volts)]))
        self._fed_ns = self._bus.now_ns()

    def _tell_state(self, now_ns: int) -> None:
        if self._told_ns is not None and (now_ns - self._told_ns) * 1e-9 < STATE_EVERY:
            return
        self._told_ns = now_ns
        self._send(self._sender.node_status(round((now_ns - self._opened_ns) * 1e-9)))
        if self._options.arming:
            self._send(self._sender.arming_status(armed=True))

    def _let_go(self) -> None:
        self._told_ns, self._lapsed = None, True
        self._send(self._sender.rpm_command([0] * (self._options.esc_index + 1)))
        self._send(self._sender.raw_command([]))
        if self._options.arming:
            self._send(self._sender.arming_status(armed=False))

    # -- what comes --------------------------------------------------------------------------------------------------

    def _is_ours(self, frame: Frame) -> bool:
        o = self._options
        return (
            is_message(frame, NODE_STATUS, STATUS, RAW_COMMAND, RPM_COMMAND)
            or is_answer(frame, GET_NODE_INFO, o.node_id, o.own_node_id)
            or is_anonymous(frame)
        )

    def _take(self, frame: Frame) -> Received | None:
        """The transfer that a frame completes, once it was judged."""
        if is_anonymous(frame):
            self._anonymous = True
            return None
        match self._assembler.feed(frame):
            case Received() as transfer:
                if not transfer.service:
                    self._watching.take(transfer)
                    self._note_other(transfer)
                return transfer
            case NotUnderstood(bad, why):
                self._bad.add(f"{bad} ({why})")
        return None

    def _note_other(self, transfer: Received) -> None:
        """ESCs that are there, for the sentence of one that is not."""
        if transfer.data_type == STATUS:
            self._others.add((transfer.source, int(transfer.value.esc_index)))

    def _is_status(self, transfer: Received, kind: int) -> bool:
        if transfer.service or transfer.data_type != kind or transfer.source != self._options.node_id:
            return False
        return kind != STATUS or transfer.value.esc_index == self._options.esc_index

    def _row(self, t_ns: int, transfer: Received) -> Sample | None:
        value = transfer.value
        if self._is_status(transfer, STATUS):
            return Sample(self.name, t_ns, row_of(value))
        if self._is_status(transfer, NODE_STATUS):
            state = (value.health, value.mode, value.uptime_sec, value.vendor_specific_status_code)
            return Sample(f"{self.name}_state", t_ns, tuple(float(each) for each in state))
        return None

    # -- opening -----------------------------------------------------------------------------------------------------

    def _await(self, match: Callable[[Received], bool], timeout: float) -> Received | None:
        """The first transfer that matches; those before it are judged, and their rows lost."""
        end = self._bus.now_ns() + round(timeout * 1e9)
        while (left := (end - self._bus.now_ns()) * 1e-9) > 0.0:
            frame = self._inbox.wait_for(lambda _frame: True, left)
            if frame is None:
                break
            transfer = self._take(frame)
            if transfer is not None and match(transfer):
                return transfer
        if not self._bus.alive:
            raise LinkError(f"{self.name}: {self._bus.error or 'its CAN bus was closed'}")
        return None

    def _require(self, kind: int, rate: float) -> Received:
        found = self._await(lambda transfer: self._is_status(transfer, kind), max(LEAST_WAIT, 3.0 / rate))
        if found is None:
            raise DeviceError(f"{self.name}: {self._what_is_missing(kind)}")
        return found

    def _what_is_missing(self, kind: int) -> str:
        o = self._options
        if kind == STATUS:
            sentence = f"node {o.node_id} is there, but sends no esc.Status of ESC {o.esc_index}: check esc_index"
            sentence += " and the ESC's telemetry rate"
        else:
            sentence = f"no NodeStatus of node {o.node_id} came: check node_id, bit rate and power"
        if self._others:
            heard = ", ".join(f"node {node} as ESC {index}" for node, index in sorted(self._others))
            sentence += f"; heard: {heard}"
        if self._anonymous:
            sentence += "; a node without identifier asks for one: set a fixed node ID in it"
        return sentence

    def _identity(self) -> str:
        """By GetNodeInfo. An ESC that does not answer is used all the same, and it is said."""
        for _ in range(2):
            self._send(self._sender.ask_node_info(self._options.node_id))
            found = self._await(lambda transfer: transfer.service, ANSWER_TIME)
            if found is not None:
                return self._identity_of(found)
        return f"DroneCAN ESC, node {self._options.node_id}, which does not say who it is (GetNodeInfo)"

    def _identity_of(self, found: Received) -> str:
        software, hardware = found.value.software_version, found.value.hardware_version
        unique = bytes(hardware.unique_id).hex()
        return (
            f"{text(found.value.name)}, node {found.source}, hardware {hardware.major}.{hardware.minor},"
            f" software {software.major}.{software.minor}, serial {unique}"
        )


def row_of(status: Any) -> tuple[float, ...]:
    """rev/s, V, A, degC, share of the power, errors: of esc.Status."""
    return (
        status.rpm / 60.0, measured(status.voltage), measured(status.current), measured(status.temperature - KELVIN),
        status.power_rating_pct / 100.0, float(status.error_count),
    )  # fmt: skip
