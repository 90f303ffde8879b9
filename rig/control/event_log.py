"""What is said during a campaign: to the front ends, to the controller's log, and into the recording's /events.

What is said before a recording begins (who the devices are, what the preflight found, the mounting) is written into it
with times before 0: an analyst has the file and not the log.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from rig.control.status import Status
from rig.link.front_end_messages import LogLine
from rig.link.recorder_messages import EventRow
from rig.recording.line_writer import LineWriter
from rig.recording.recorder_link import RecorderLink

Level = Literal["info", "warning", "trip", "error"]


class Said(NamedTuple):
    """One sentence and how grave it is, at a monotonic time in ns."""

    t_ns: int
    level: Level
    text: str


class EventLog:
    """One campaign's. Times on the lines for people are s since the controller began, in the recording since its t0."""

    def __init__(self, status: Status, recorder: RecorderLink, log: LineWriter, begun_ns: int) -> None:
        self._status, self._recorder, self._log, self._begun_ns = status, recorder, log, begun_ns
        self._t0_ns: int | None = None
        self._bench: list[Said] = []
        self._waiting: list[Said] = []

    def say(self, t_ns: int, level: Level, text: str, *, of_bench: bool = False) -> None:
        """`of_bench`: true for every recording of this campaign, and written into each."""
        said = Said(t_ns, level, text)
        run = self._status.run if self._status.started is not None else -1
        line = LogLine((t_ns - self._begun_ns) * 1e-9, level, text, run)
        self._status.say(line)
        self._log.write(f"{line.time:10.3f} {level:<7} {text}")
        if of_bench:
            self._bench.append(said)
        if self._t0_ns is not None:
            self._record(said, self._t0_ns)
        elif not of_bench:
            self._waiting.append(said)

    def begin(self, t0_ns: int) -> None:
        """A recording is open: it is given what was said before."""
        self._t0_ns = t0_ns
        for said in sorted((*self._bench, *self._waiting)):
            self._record(said, t0_ns)
        self._waiting.clear()

    def end(self) -> None:
        """The recording takes nothing more."""
        self._t0_ns = None

    def _record(self, said: Said, t0_ns: int) -> None:
        self._recorder.event(EventRow((said.t_ns - t0_ns) * 1e-9, said.level, said.text))
