"""What a tick of the sequencer finished: points, rows for `/steps`, events."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from identification.recording import VOID
from identification.recording import Step as StepRow
from rig.campaign.plan import Step
from rig.link.front_end_messages import LogLine, Point, State

PROOF_INDEX = -1
"""Index in `/steps` of the watchdog proof, which is no step of the plan."""


class Journal:
    """Collects during one tick; `clear` at the start of the next."""

    def __init__(self) -> None:
        self._last: StepRow | None = None
        self.clear()

    def clear(self) -> None:
        self.points: list[Point] = []
        self.rows: list[StepRow] = []
        self.events: list[LogLine] = []
        self.given_up: list[int] = []
        """Indices of steps without which a run is whole: an operator wants no data of them."""

    def say(self, time: float, level: Literal["info", "warning", "trip", "error"], text: str) -> None:
        self.events.append(LogLine(time, level, text))

    def row(self, state: State, step: Step, volts: float, start: float, end: float, *, cut: bool = False) -> None:
        """Row of a step that ran from `start` to `end` s; none for an empty one. `volts`: at the end of a ramp.

        A hold, sine or tare that was cut short is `free`, so that nobody takes it for a whole one. Waits, of a
        pause and a stop too, are `rest`.
        """
        if end <= start:
            return
        index, phase, value = step.index, step.phase, step.voltage
        match state:
            case "proving":
                index, phase, value = PROOF_INDEX, "free", volts
            case "paused" | "stopping" | "wait":
                phase, value = "rest", 0.0
            case "ramp":
                phase, value = "ramp", volts
            case _ if cut:
                phase = "free"
        self.rows.append(StepRow(index, phase, value, start, end))
        if phase in ("hold", "sine"):
            self._last = self.rows[-1]
        elif step.swept:  # it is no row of its own that could be marked, and the hold before it is not meant
            self._last = None

    def void_last(self) -> StepRow | None:
        """Mark what was measured last as bad, by a row of its own; returns that row, None where there is none."""
        last, self._last = self._last, None
        if last is not None:
            self.rows.append(replace(last, phase=VOID))
        return last
