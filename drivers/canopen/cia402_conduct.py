"""Which controlword goes with a set-point, and what a CiA 402 drive tells that must end a run. Pure: time is given.

A set-point other than 0 is the only thing that enables the drive. It is refused, and 0 goes in its place, while the
drive is not switched on, after a silence as long as its watchdog, and once it has had a fault.
"""

from __future__ import annotations

from typing import NamedTuple

from drivers.canopen.cia402_options import Options
from drivers.canopen.frames import BOOTED, HEARTBEAT_LOST, NMT_STATES, OPERATIONAL, Emergency
from drivers.canopen.state402 import DISABLE_VOLTAGE, FAULT_RESET, QUICK_STOP, State, next_controlword, state_of

ENABLE_TIME = 0.5
"""s for the drive to enable its operation, from the first set-point other than 0; `canopen` allows 0.8 s."""
RECOVERY_TIME = 2.0
"""s of commands of 0 after a silence in which the drive must be switched on again."""
OBEY_TIME = 0.3
"""s after a quick stop in which the drive must have left "operation enabled": its state comes in each TPDO 1."""
OLD_STATE = 0.1
"""s after a silence in which the state that is known may be that from before it."""
LOST_HEARTBEATS = 3.5
"""Periods without a heartbeat of the drive after which it is dead."""
SILENT = 0.9
"""Of the watchdog's time: a drive that stopped after so much silence did so for it."""


class Decision(NamedTuple):
    """What goes out with a set-point: the controlword, our heartbeat or not; and why the set-point is 0 instead."""

    word: int
    feeds: bool
    refusal: str | None


class Conduct:
    """From the opening of a drive to its closing. Times in ns of one clock."""

    def __init__(self, name: str, options: Options, now_ns: int) -> None:
        self._name, self._options = name, options
        self.fault: str | None = None
        """The first since it was opened, as one sentence."""
        self._state: State | None = None
        self._fed_ns: int | None = None
        """When our heartbeat went out last."""
        self._heard_ns = now_ns
        """When the drive's came last."""
        self._turning = self._enabled = False
        """A set-point other than 0 was sent since the drive was let go; the drive has said that it is enabled."""
        self._zero_since_ns: int | None = None
        """When commands of 0 began."""
        self._wanted_ns = self._let_go_ns = now_ns
        """When `_turning` began, or the recovery from a silence; when the drive was let go."""
        self._lapsed = self._own_emergency = self._reset_bit = False
        """The drive stopped for our silence and is not up again; it told so (0x8130); the last word reset a fault."""

    # -- what is sent ------------------------------------------------------------------------------------------------

    def decide(self, volts: float, now_ns: int) -> Decision:
        """For a command that is sent now."""
        if self._silent(now_ns, 1.0):
            self._begin_lapse(now_ns)
        self._note_rest(volts, now_ns)
        refusal = self._refusal() if volts else None
        if volts and refusal is None and not self._turning:
            self._turning, self._wanted_ns = True, now_ns
        decision = Decision(self._word(), self._obeys(now_ns), refusal)
        self._fed_ns = now_ns
        self._judge_progress(now_ns)
        return decision

    def let_go(self, now_ns: int) -> None:
        """It is told to stop: nothing enables it before the next set-point other than 0."""
        self._turning = self._enabled = False
        self._let_go_ns = now_ns

    def _note_rest(self, volts: float, now_ns: int) -> None:
        """After `idle_time` of 0 V the motor gets no torque, so that hands may be at the propeller."""
        if volts:
            self._zero_since_ns = None
        elif self._zero_since_ns is None:
            self._zero_since_ns = now_ns
        elif self._turning and (now_ns - self._zero_since_ns) * 1e-9 > self._options.idle_time:
            self.let_go(now_ns)

    def _refusal(self) -> str | None:
        """Why a set-point other than 0 cannot be sent now."""
        if self.fault is not None:
            return self.fault.removeprefix(f"{self._name} ")
        if self._lapsed:
            limit = self._options.watchdog_timeout
            return f"nothing was commanded for longer than the watchdog of {limit:g} s, and the drive has stopped"
        if self._state not in (State.SWITCHED_ON, State.OPERATION_ENABLED):
            return f"the drive is not switched on, its state is {_shown(self._state)}"
        return None

    def _word(self) -> int:
        """A drive with a fault is stopped, and not enabled again."""
        if self.fault is not None:
            driven = self._state in (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
            return QUICK_STOP if driven else DISABLE_VOLTAGE
        if not self._lapsed or self._state is not State.FAULT or not self._own_emergency:
            return next_controlword(self._state, turning=self._turning)
        self._reset_bit = not self._reset_bit  # its rising edge resets the fault that is our silence's
        return FAULT_RESET if self._reset_bit else DISABLE_VOLTAGE

    def _obeys(self, now_ns: int) -> bool:
        """False: the drive was let go and still turns the motor. Then our heartbeat is withheld, so that its watchdog
        does what its controlword does not."""
        left = (now_ns - self._let_go_ns) * 1e-9
        if self._turning or self._state is not State.OPERATION_ENABLED or left <= OBEY_TIME:
            return True
        self._trip(f"does not obey a quick stop within {OBEY_TIME:g} s; our heartbeat is withheld", now_ns)
        return False

    def _silent(self, now_ns: int, share: float) -> bool:
        """Was nothing sent for that share of the watchdog's time?"""
        return self._fed_ns is not None and (now_ns - self._fed_ns) * 1e-9 >= share * self._options.watchdog_timeout

    def _begin_lapse(self, now_ns: int) -> None:
        self._lapsed, self._wanted_ns = True, now_ns
        self.let_go(now_ns)

    def _judge_progress(self, now_ns: int) -> None:
        waited = (now_ns - self._wanted_ns) * 1e-9
        if self._lapsed and self._state is State.SWITCHED_ON and waited > OLD_STATE:
            self._lapsed = self._own_emergency = False
        elif self._lapsed and waited > RECOVERY_TIME:
            self._trip(f"does not come up again after a silence, its state is {_shown(self._state)}", now_ns)
        elif self._turning and not self._enabled and waited > ENABLE_TIME:
            told = f"its state is {_shown(self._state)}"
            self._trip(f"does not enable its operation within {ENABLE_TIME:g} s, {told}", now_ns)

    # -- what the drive tells ----------------------------------------------------------------------------------------

    def note_state(self, t_ns: int, statusword: int) -> None:
        state = self._state = state_of(statusword)
        if state is State.OPERATION_ENABLED:
            self._enabled = self._turning
            return
        if self._silent(t_ns, SILENT) and not self._lapsed:
            self._begin_lapse(t_ns)
        faulty = state in (State.FAULT, State.FAULT_REACTION)
        if faulty and not self._lapsed:
            self._trip(f"has a fault: statusword 0x{statusword:04X}", t_ns)
        elif self._enabled and not self._lapsed:
            self._trip(f"stopped by itself: its state is {_shown(state)}, statusword 0x{statusword:04X}", t_ns)

    def note_mode(self, t_ns: int, shown: int, wanted: int) -> None:
        if shown != wanted:
            self._trip(f"left its mode: 0x6061 is {shown}, expected {wanted} ({self._options.mode})", t_ns)

    def note_emergency(self, t_ns: int, told: Emergency) -> None:
        if told.code == HEARTBEAT_LOST and (self._lapsed or self._silent(t_ns, SILENT)):
            self._own_emergency = True
            if not self._lapsed:
                self._begin_lapse(t_ns)
        elif told.code & 0xFF00:
            self._trip(f"reports emergency {told}", t_ns)

    def note_heartbeat(self, t_ns: int, state: int) -> None:
        self._heard_ns = t_ns
        if state == BOOTED:
            self._trip("has started anew: it lost its supply or was reset, and its settings with it", t_ns)
        elif state != OPERATIONAL:
            self._trip(f"is {NMT_STATES.get(state, 'in an unknown state')}, no longer operational", t_ns)

    def judge_silence(self, now_ns: int) -> None:
        """The drive's own heartbeat must go on."""
        silence = (now_ns - self._heard_ns) * 1e-9
        limit = LOST_HEARTBEATS * 1e-3 * self._options.state_period_ms
        if silence > limit:
            self._trip(f"is silent: its last heartbeat is {silence:.2f} s old, {limit:.2f} s are allowed", now_ns)

    def _trip(self, what: str, now_ns: int) -> None:
        """The first fault is the one that is told."""
        if self.fault is None:
            self.fault = f"{self._name} {what}: clear its cause, then open again"
            self.let_go(now_ns)


def _shown(state: State | None) -> str:
    return "unknown" if state is None else str(state)
