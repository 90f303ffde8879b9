"""When an analogue output on CANopen may be given a voltage, and what it tells that must end a run. Pure.

A voltage other than 0 is refused, and 0 goes in its place, while the module is not operational, after a silence as long
as its watchdog, and once it has had a fault.
"""

from __future__ import annotations

from typing import NamedTuple

from drivers.canopen.frames import BOOTED, HEARTBEAT_LOST, NMT_STATES, OPERATIONAL, Emergency

START_TIME = 1.0
"""s after it is started anew in which its heartbeat must say that it is operational."""
LOST_HEARTBEATS = 3.5
"""Periods without a heartbeat of the module after which it is dead."""
SILENT = 0.9
"""Of the watchdog's time: a module that stopped after so much silence did so for it."""


class Decision(NamedTuple):
    """Whether the module is started first, and why the set-point is 0 instead."""

    starts: bool
    refusal: str | None


class Conduct:
    """From the opening of a module to its closing. Times in ns of one clock."""

    def __init__(self, name: str, watchdog: float, heartbeat: float, now_ns: int) -> None:
        """`watchdog`: s without our heartbeat after which it stops; `heartbeat`: s between two of its own."""
        self._name, self._watchdog, self._heartbeat = name, watchdog, heartbeat
        self.fault: str | None = None
        """The first since it was opened, as one sentence."""
        self._heard_ns = now_ns
        self._fed_ns: int | None = None
        self._stopped = False
        """By our silence, or by us: it must be started before it obeys."""
        self._started_ns: int | None = None
        """When it was started anew, until it says that it is operational."""

    def decide(self, volts: float, now_ns: int) -> Decision:
        """For a command that is sent now."""
        if self._silent(now_ns, 1.0):
            self._stopped = True
        refusal = self._refusal() if volts else None
        starts = self._stopped and self.fault is None
        if starts:
            self._stopped, self._started_ns = False, now_ns
        self._fed_ns = now_ns
        if self._started_ns is not None and (now_ns - self._started_ns) * 1e-9 > START_TIME:
            self._trip("does not become operational again after it was stopped")
        return Decision(starts, refusal)

    def stopped(self) -> None:
        """It was told to stop."""
        self._stopped, self._started_ns = True, None

    def _refusal(self) -> str | None:
        """Why a set-point other than 0 cannot be sent now."""
        if self.fault is not None:
            return self.fault.removeprefix(f"{self._name} ")
        if self._stopped or self._started_ns is not None:
            return (
                f"the module was stopped, or nothing was commanded for longer than its watchdog of {self._watchdog:g} s"
            )
        return None

    def _silent(self, now_ns: int, share: float) -> bool:
        return self._fed_ns is not None and (now_ns - self._fed_ns) * 1e-9 >= share * self._watchdog

    def note_heartbeat(self, t_ns: int, state: int) -> None:
        self._heard_ns = t_ns
        if state == OPERATIONAL:
            self._started_ns = None
        elif state == BOOTED:
            self._trip("has started anew: it lost its supply or was reset, and its settings with it")
        elif self._silent(t_ns, SILENT):
            self._stopped = True
        elif not self._stopped and self._started_ns is None:
            self._trip(f"is {NMT_STATES.get(state, 'in an unknown state')}, no longer operational")

    def note_emergency(self, t_ns: int, told: Emergency) -> None:
        ours = told.code == HEARTBEAT_LOST and (self._stopped or self._silent(t_ns, SILENT))
        if told.code & 0xFF00 and not ours:
            self._trip(f"reports emergency {told}")

    def judge_silence(self, now_ns: int) -> None:
        silence = (now_ns - self._heard_ns) * 1e-9
        if silence > LOST_HEARTBEATS * self._heartbeat:
            self._trip(f"is silent: its last heartbeat is {silence:.2f} s old")

    def _trip(self, what: str) -> None:
        self.fault = self.fault or f"{self._name} {what}: clear its cause, then open again"
