"""One calibration from its first load to its last: hang, wait, read, compare, and again where it does not fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite

import numpy as np

from identification.calibration.loads import Load, force_of
from identification.calibration.steps import Steps, joined_steps, windows_of
from identification.calibration.wrong_weight import WrongStep, doubtful_steps, sentence
from identification.recording import Floats
from rig.calibrate.listening import Listener
from rig.calibrate.loads_file import LoadsPlan
from rig.calibrate.operator import Operator
from rig.calibrate.settling import Settling
from rig.errors import DeviceError

WINDOWS = 2
"""Parts of a reading: what changes from one to the next is the creep."""
JUDGED = 6
"""Steps from which one can be told to be wrong by the others."""


@dataclass(frozen=True)
class Taken:
    """One step as it was read."""

    index: int
    """Of the plan."""
    load: Load
    force: float
    """N"""
    hung: float
    """s since the recording began, as all times here."""
    start: float
    end: float
    times: Floats
    readings: Floats
    """N, mean of each window."""
    temperature: float
    """degC; NaN: unknown."""
    settled: bool

    @property
    def reading(self) -> float:
        """N"""
        return float(self.readings.mean())


@dataclass
class Session:
    """`run` goes through the plan. What was read again is void: it stays in the recording."""

    plan: LoadsPlan
    listener: Listener
    operator: Operator
    taken: list[Taken] = field(default_factory=list)
    unread: list[tuple[float, float]] = field(default_factory=list)
    """s, N: when what hung that was not read."""
    kept: set[int] = field(default_factory=set)
    """Indices of steps that the operator believes though the others say otherwise."""

    def run(self) -> tuple[Taken, ...]:
        """All steps in order of time. Raises StoppedError, LinkError or DeviceError."""
        at = 0
        while at < len(self.plan.loads):
            if self._hang(at) == "again" and at > 0:
                self._again(at - 1)
                continue
            self._take(at)
            self._judge()
            at += 1
        return tuple(self.taken)

    def _hang(self, at: int) -> str:
        load, force = self.plan.loads[at], self._force(at)
        if load.weights == () and at == 0:
            prompt = "take all weights off"
        else:
            prompt = f"hang {load.said} ({force:.5g} N)" if load.weights else "take all weights off (0 N)"
        prompt += ", only to load the cell" if at in self.plan.unread else ""
        return self.operator.hang(f"step {at + 1} of {len(self.plan.loads)}: {prompt}", load, force, self.listener.turn)

    def _force(self, at: int) -> float:
        return force_of(self.plan.loads[at], self.plan.weights, self.plan.place)

    def _take(self, at: int) -> None:
        """Wait for what hangs, and read it unless the plan only loads the cell with it."""
        hung, settled = self._settle(at)
        if at in self.plan.unread:
            self.unread.append((hung, self._force(at)))
        else:
            self._read(at, hung, settled=settled)

    def _settle(self, at: int) -> tuple[float, bool]:
        """S when it was hung, and whether the reading came to stand still."""
        pace, listener = self.plan.pace, self.listener
        listener.load(at, self._force(at))
        settling = Settling(listener.now, pace.settle, pace.steady)
        listener.heard = settling.add
        while not (settled := settling.settled(listener.now)) and listener.now - settling.hung < pace.patience:
            listener.turn()
        listener.heard = None
        return settling.hung, settled

    def _read(self, at: int, hung: float, *, settled: bool) -> None:
        pace, listener, force = self.plan.pace, self.listener, self._force(at)
        start = listener.now
        rows: list[tuple[float, float]] = []
        listener.heard = lambda time, value: rows.append((time, value))
        listener.turn_for(pace.hold)
        listener.heard = None
        try:
            table = np.array(rows).reshape(-1, 2)
            times, readings = windows_of(table[:, 0], table[:, 1], start, WINDOWS)
        except ValueError as error:
            raise DeviceError(f"{listener.device}: step {at + 1}: {error}; look at its rate") from None
        listener.step(at, start, listener.now)
        load = self.plan.loads[at]
        found = (hung, start, listener.now, times, readings, listener.temperature, settled)
        self.taken.append(Taken(at, load, force, *found))
        self._tell(self.taken[-1])

    def _tell(self, step: Taken) -> None:
        expected = _expected(self.taken[:-1], step.force)
        warm = f", {step.temperature:.2f} degC" if isfinite(step.temperature) else ""
        text = f"  reads {step.reading:.5g} N, expected {expected:.5g} N ({step.reading - expected:+.3g} N){warm}"
        self.operator.tell(text)
        self.listener.say(f"step {step.index + 1}: {step.load.said}:{text}")
        if not step.settled:
            doubt = f"step {step.index + 1} did not settle within {self.plan.pace.patience:g} s: does something touch?"
            self.operator.tell(f"  {doubt}")
            self.listener.say(doubt, "warning")

    def _judge(self) -> None:
        """Whatever does not go with the rest is asked about, before it is believed."""
        while wrong := [each for each in self.doubtful() if self.taken[each.step].index not in self.kept]:
            step = self.taken[wrong[0].step]
            text = sentence(replaced(wrong[0], step.index), step.load)
            self.listener.say(text, "warning")
            if self.operator.doubt(text, self.listener.turn) == "keep":
                self.kept.add(step.index)
            else:
                self._again(step.index)

    def _again(self, index: int) -> None:
        for step in [each for each in self.taken if each.index == index]:
            self.listener.step(step.index, step.start, step.end, "void")
            self.taken.remove(step)
        self._hang(index)
        self._take(index)

    def doubtful(self) -> list[WrongStep]:
        """Of the steps so far, in order of time."""
        return doubtful(self.plan, self.taken, self.unread)


def replaced(wrong: WrongStep, index: int) -> WrongStep:
    """Numbered as the plan has it."""
    return WrongStep(index, wrong.stated, wrong.expected, wrong.std, wrong.p_value, wrong.probable)


def doubtful(plan: LoadsPlan, taken: Sequence[Taken], unread: Sequence[tuple[float, float]]) -> list[WrongStep]:
    """Steps, by their place in `taken`, that the others contradict by more than a share of the smallest weight."""
    if len(taken) < JUDGED or all(step.force == 0.0 for step in taken):
        return []
    loads = [step.load for step in taken]
    try:
        return list(doubtful_steps(steps_of(taken, unread), loads, plan.weights, plan.place))
    except ValueError:
        return []  # so far they tell no gain; the end says so if it stays


def steps_of(taken: Sequence[Taken], unread: Sequence[tuple[float, float]]) -> Steps:
    """For the estimate."""
    parts = [(step.force, step.hung, step.times, step.readings, step.temperature) for step in taken]
    return joined_steps(parts, unread)


def _expected(before: Sequence[Taken], force: float) -> float:
    """N that the steps so far let one expect: a line through them, of the slope 1 while there is but one load."""
    if not before:
        return force
    forces, readings = np.array([each.force for each in before]), np.array([each.reading for each in before])
    if np.ptp(forces) == 0.0:
        return float(readings.mean() + force - forces.mean())
    slope, zero = np.polyfit(forces, readings, 1)
    return float(zero + slope * force)
