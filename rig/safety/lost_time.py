"""Time that was lost: the machine slept, the process was stopped, a tick was held up. Pure: the clocks' readings are
given.

CLOCK_MONOTONIC, by which everything is timed, stands still while the machine sleeps: a controller that looks at it
alone wakes up and believes that its last set-point is 20 ms old.
"""

from __future__ import annotations

from typing import NamedTuple

UTC_STEP = 0.1
"""s within one tick; NTP slews by at most 0.5 ms/s and steps from 0.128 s on (ntpd(8), STEP_THRESHOLD)."""


class HostClocks(NamedTuple):
    """What the machine's other clocks are ahead of CLOCK_MONOTONIC, in ns."""

    slept_ns: int
    """CLOCK_BOOTTIME: grows only while the machine sleeps."""
    utc_ns: int
    """CLOCK_REALTIME less CLOCK_BOOTTIME: jumps when somebody sets the clock."""


STILL = HostClocks(0, 0)


class LostTime:
    """Since when the motor has not been spoken to, on a clock that goes on while the machine sleeps."""

    def __init__(self, allowed_s: float) -> None:
        """`allowed_s`: a set-point may leave only while the one before it is no older than this."""
        self._allowed = allowed_s
        self._told_ns: int | None = None
        self._seen: HostClocks | None = None
        self.slept = 0.0
        """s that the machine slept before the running tick."""
        self.utc_step = 0.0
        """s by which its clock was set before the running tick; 0: by less than `UTC_STEP`."""

    def look(self, host: HostClocks) -> None:
        """A tick begins."""
        before, self._seen = self._seen or host, host
        self.slept = (host.slept_ns - before.slept_ns) * 1e-9
        step = (host.utc_ns - before.utc_ns) * 1e-9
        self.utc_step = step if abs(step) >= UTC_STEP else 0.0

    def told(self, now_ns: int, host: HostClocks) -> None:
        """The motor is being told its set-point, or is left alone on purpose."""
        self._told_ns = now_ns + host.slept_ns

    def lapse(self, now_ns: int, host: HostClocks) -> str:
        """Why no set-point but 0 may leave now: a sentence; empty while the last one is young."""
        gap = 0.0 if self._told_ns is None else (now_ns + host.slept_ns - self._told_ns) * 1e-9
        if gap <= self._allowed:
            return ""
        return (
            f"the motor was not told anything for {gap:.2f} s, {self._allowed:.2f} s are allowed: this process was "
            "stopped or held up, or the machine slept; the set-point was not sent, 0 V was"
        )
