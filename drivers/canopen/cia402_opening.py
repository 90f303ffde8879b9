"""What is asked of and written to a CiA 402 drive before its first set-point. Every setting is read back."""

from __future__ import annotations

from collections.abc import Callable

from drivers.canopen.cia402_options import (
    CONTROLWORD,
    MODES,
    ON_SILENCE,
    STATUSWORD,
    TARGET_TORQUE,
    TARGET_VELOCITY,
    Options,
)
from drivers.canopen.frames import HEARTBEAT, HEARTBEAT_LOST, OPERATIONAL, SEND_PDO, Emergency, Field
from drivers.canopen.node import CanopenNode
from drivers.canopen.state402 import DISABLE_VOLTAGE, FAULT_RESET, State, state_of
from drivers.errors import DeviceError
from drivers.ports.can_frame import Frame

PROFILE = 402
ENTERS_AT_ONCE = 20
"""Times that mode or state are asked for before the drive is said not to take it."""
REV_PER_MINUTE = 0x00B44700
"""0x60A9 without its prefix: revolutions per minute (CiA 303-2: B4 revolution, 47 minute)."""
COMMUNICATION = 0x11
"""Bits of the error register that a lost heartbeat of ours leaves behind: generic, communication."""
UNITS_TOLERANCE = 1e-6
RATED_TOLERANCE = 2e-3
"""Relative: 0x6075 and 0x6076 are whole mA and mN.m."""


def prepare(name: str, node: CanopenNode, o: Options) -> str:
    """Leave the drive operational with its power stage off; returns who it is. Raises DeviceError, LinkError."""
    node.hold()
    node.require_profile(PROFILE)
    node.write(CONTROLWORD, DISABLE_VOLTAGE, "controlword, power stage off")
    identity = node.identity()
    _require_units(name, node, o)
    _require_range(name, node, o)
    _set_watchdog(node, o)
    _set_ramps(node, o)
    _clear_fault(name, node, o)
    _set_mode(name, node, o)
    node.lay_out_received(1, (CONTROLWORD, TARGET_VELOCITY if o.mode == "velocity" else TARGET_TORQUE))
    node.lay_out_sent(1, o.motor_fields, o.period_ms)
    node.lay_out_sent(2, o.state_fields, o.state_period_ms)
    node.start()
    _require_frames(node, o)
    return identity


def _require_units(name: str, node: CanopenNode, o: Options) -> None:
    """Scales that the drive can tell are those of the bench file."""
    unit = node.number_if_there(0x60A9)
    if unit is not None and unit & 0x00FFFFFF == REV_PER_MINUTE:
        power = unit >> 24
        scale = 10.0 ** (power - 256 if power > 127 else power)
        if abs(scale / o.velocity_unit - 1.0) > UNITS_TOLERANCE:
            raise DeviceError(
                f"{name}: the drive counts velocity in {scale:g} rev/min (0x60A9 is 0x{unit:08X}), the bench file says"
                f" {o.velocity_unit:g} (velocity_unit): change one of them"
            )
    for key, index, rated, words in (
        ("rated_current", 0x6075, o.rated_current, "A"),
        ("rated_torque", 0x6076, o.rated_torque, "N.m"),
    ):
        if rated is None:
            continue
        found = 1e-3 * node.number(index)
        if abs(found - rated) > RATED_TOLERANCE * rated:
            raise DeviceError(
                f"{name}: the drive has {found:g} {words} (0x{index:04X}), the bench file says {rated:g} {words}"
                f" ({key}): what it measures in thousandths of it would be wrong by their ratio; change one of them"
            )


def _require_range(name: str, node: CanopenNode, o: Options) -> None:
    """A drive clips a set-point beyond its own limits and tells nothing."""
    modes = node.number_if_there(0x6502)
    if modes is not None and not modes >> MODES[o.mode] - 1 & 1:
        raise DeviceError(
            f"{name}: the drive has no mode profile {o.mode} (0x6502 is 0x{modes:X}): choose another mode"
        )
    largest = abs(o.counts(o.max_voltage))
    limits = ((0x607F, "max profile velocity"),) if o.mode == "velocity" else ((0x6072, "max torque"),)
    for index, words in limits:
        limit = node.number_if_there(index)
        if limit is not None and limit < largest:
            raise DeviceError(
                f"{name}: the drive clips set-points at {limit} counts ({words}, 0x{index:04X}), but max_voltage of"
                f" {o.max_voltage:g} V is {largest}: raise that limit, or lower max_voltage"
            )


def _set_watchdog(node: CanopenNode, o: Options) -> None:
    """What stops the motor when we do not: heartbeats both ways, what follows our silence, how a quick stop ends."""
    silence_ms = round(1e3 * o.watchdog_timeout)
    node.set(Field(0x1016, 1, 32), o.master_id << 16 | silence_ms, "heartbeat that it waits for, node and ms")
    node.set(Field(0x1029, 1, 8), 1, "no change of its NMT state when a heartbeat is lost, so that its PDOs go on")
    node.set(Field(0x6007, 0, 16, True), ON_SILENCE[o.on_silence], "what it does when our heartbeat is lost")
    node.set(Field(0x605A, 0, 16, True), o.quick_stop_option, "how a quick stop ends")
    node.set(Field(0x1017, 0, 16), o.state_period_ms, "its own heartbeat, ms")


def _set_ramps(node: CanopenNode, o: Options) -> None:
    for rate, objects in ((o.acceleration, (0x6083, 0x6084)), (o.quick_stop_deceleration, (0x6085,))):
        if rate is None:
            continue
        for index in objects:
            node.set(Field(index, 0, 32), round(rate / o.rate_per_count), "ramp, counts of velocity per s")


def _clear_fault(name: str, node: CanopenNode, o: Options) -> None:
    """A fault that our own silence left behind is reset; another one only if the bench file says so."""
    if _state(node) in (State.FAULT, State.FAULT_REACTION):
        code = node.number_if_there(0x603F) or 0
        if code != HEARTBEAT_LOST and not o.reset_faults:
            raise DeviceError(
                f"{name} has a fault: 0x603F is {Emergency(code, node.number(0x1001))}: clear its cause and switch the"
                " drive off and on, or let the bench file reset it (reset_faults = true)"
            )
        node.write(CONTROLWORD, FAULT_RESET, "fault reset")
        node.write(CONTROLWORD, DISABLE_VOLTAGE, "controlword, power stage off")
    for _ in range(ENTERS_AT_ONCE):
        state = _state(node)
        if state in (State.SWITCH_ON_DISABLED, State.READY):
            break
    else:
        raise DeviceError(
            f"{name}: the drive does not come to rest with its power stage off, its state is {state}: look at its"
            " enable input and its fault"
        )
    register = node.number(0x1001) & ~COMMUNICATION
    if register:
        raise DeviceError(f"{name} has an error: its error register (0x1001) is 0x{register:02X}: clear its cause")


def _set_mode(name: str, node: CanopenNode, o: Options) -> None:
    """The mode is in force when 0x6061 shows it, not when 0x6060 is written."""
    target = TARGET_VELOCITY if o.mode == "velocity" else TARGET_TORQUE
    node.set(target, 0, "set-point")
    node.write(Field(0x6060, 0, 8, True), MODES[o.mode], "mode")
    for _ in range(ENTERS_AT_ONCE):
        shown = node.number(0x6061, signed=True)
        if shown == MODES[o.mode]:
            return
    raise DeviceError(f"{name}: the drive does not enter mode {MODES[o.mode]} (profile {o.mode}), 0x6061 stays {shown}")


def _require_frames(node: CanopenNode, o: Options) -> None:
    for number, fields, period in ((0, o.motor_fields, o.period_ms), (1, o.state_fields, o.state_period_ms)):
        length = sum(field.bits for field in fields) // 8
        node.expect(
            _of_length(SEND_PDO[number] + node.id, length),
            o.timeout + 3e-3 * period,
            f"no TPDO {number + 1} of {length} bytes comes, which was laid out to come every {period} ms (event timer)",
        )
    cob, operational = HEARTBEAT + node.id, bytes((OPERATIONAL,))
    node.expect(
        lambda frame: frame.id == cob and frame.data == operational,
        o.timeout + 3e-3 * o.state_period_ms,
        f"no heartbeat of an operational drive comes, which was set to {o.state_period_ms} ms (0x1017)",
    )
    node.inbox.take_all()  # what it sent while it was being set up


def _of_length(cob: int, length: int) -> Callable[[Frame], bool]:
    return lambda frame: frame.id == cob and len(frame.data) == length


def _state(node: CanopenNode) -> State | None:
    return state_of(node.number(STATUSWORD.index))
