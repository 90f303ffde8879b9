"""One calibration from its first load to its last: hang, wait, read, compare, and again where it does not fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Literal

import numpy as np

from identification.calibration.loads import Load, force_of
from identification.calibration.steps import Steps, joined_steps, windows_of
from identification.calibration.wrong_weight import WrongStep, doubtful_steps, sentence
from identification.recording import Floats
from rig.calibrate.listening import Listener
from rig.calibrate.loads_file import LoadsPlan
from rig.calibrate.operator import Answer, Back, Hung, Operator
from rig.calibrate.settling import Settling
from rig.errors import DeviceError

Phase = Literal["hang", "settle", "read", "doubt", "done"]
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
    skipped: set[int] = field(default_factory=set)
    """Indices of steps that the operator left out."""
    hung: dict[int, Load] = field(default_factory=dict)
    """By the index of a step: what hung in it, where that is other than the plan has it."""
    at: int = 0
    """Index of the step that is hung or read now."""
    phase: Phase = "hang"
    seen: Callable[[Session], None] | None = None
    """Called after each look at the cell."""
    doubted: WrongStep | None = None
    """What is asked about now."""

    def run(self) -> tuple[Taken, ...]:
        """All steps in order of time. Raises StoppedError, LinkError or DeviceError."""
        self.operator.begin(self)
        at = 0
        while at < len(self.plan.loads):
            answer = self._hang(at)
            if answer == "again":
                answer = Back(at - 1)
            if isinstance(answer, Back):
                if self._is_taken(answer.index):
                    self._again(answer.index)
                continue
            if answer == "skip":
                self.skipped.add(at)
                self.listener.say(f"step {at + 1}: {self.load(at).said}: left out by the operator", "warning")
            else:
                self._take(at)
                self._judge()
            at += 1
        self.phase = "done"
        return tuple(self.taken)

    def load(self, at: int) -> Load:
        """What hangs in a step, or will."""
        return self.hung.get(at, self.plan.loads[at])

    def _is_taken(self, index: int) -> bool:
        return any(step.index == index for step in self.taken)

    def turn(self) -> None:
        """One look at the cell."""
        self.listener.turn()
        if self.seen is not None:
            self.seen(self)

    def _hang(self, at: int) -> Answer | Back:
        """Asked until something hangs or is not to; what hangs instead of the plan's load is noted."""
        self.at, self.phase = at, "hang"
        self.hung.pop(at, None)
        answer = self._asked(at)
        if isinstance(answer, Hung):
            self.hung[at] = answer.load
            self.listener.say(
                f"step {at + 1}: {answer.load.said} hangs where the plan has {self.plan.loads[at].said} (the operator)"
            )
            return "go"
        return answer

    def _asked(self, at: int) -> Answer | Back | Hung:
        load, force = self.plan.loads[at], self._force(at)
        if load.weights == () and at == 0:
            prompt = "take all weights off"
        else:
            prompt = f"hang {load.said} ({force:.5g} N)" if load.weights else "take all weights off (0 N)"
        prompt += ", only to load the cell" if at in self.plan.unread else ""
        return self.operator.hang(f"step {at + 1} of {len(self.plan.loads)}: {prompt}", load, force, self.turn)

    def _force(self, at: int) -> float:
        return force_of(self.load(at), self.plan.weights, self.plan.place)

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
        self.phase = "settle"
        settling = Settling(listener.now, pace.settle, pace.steady)
        listener.heard = settling.add
        while not (settled := settling.settled(listener.now)) and listener.now - settling.hung < pace.patience:
            self.turn()
        listener.heard = None
        return settling.hung, settled

    def _read(self, at: int, hung: float, *, settled: bool) -> None:
        pace, listener, force = self.plan.pace, self.listener, self._force(at)
        start = listener.now
        rows: list[tuple[float, float]] = []
        listener.heard = lambda time, value: rows.append((time, value))
        self.phase, end = "read", start + pace.hold
        while listener.now < end:
            self.turn()
        listener.heard = None
        try:
            table = np.array(rows).reshape(-1, 2)
            times, readings = windows_of(table[:, 0], table[:, 1], start, WINDOWS)
        except ValueError as error:
            raise DeviceError(f"{listener.device}: step {at + 1}: {error}; look at its rate") from None
        listener.step(at, start, listener.now)
        load = self.load(at)
        found = (hung, start, listener.now, times, readings, listener.temperature, settled)
        self.taken.append(Taken(at, load, force, *found))
        self._tell(self.taken[-1])

    def _tell(self, step: Taken) -> None:
        expected = expected_of(self.taken[:-1], step.force)
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
            self.at, self.phase, self.doubted = step.index, "doubt", wrong[0]
            answer = self.operator.doubt(text, self.turn)
            self.doubted = None
            if answer == "probable" and wrong[0].probable is not None:
                self._restate(wrong[0].step, wrong[0].probable)
            elif answer == "again":
                self._again(step.index)
            else:
                self.kept.add(step.index)

    def _restate(self, place: int, load: Load) -> None:
        """Another load hung in a step than was stated; its reading stands."""
        step = self.taken[place]
        self.hung[step.index] = load
        self.taken[place] = replace(step, load=load, force=self._force(step.index))
        text = f"step {step.index + 1}: it was {load.said}, not {step.load.said} (the operator)"
        self.operator.tell(f"  {text}")
        self.listener.say(text)

    def _again(self, index: int) -> None:
        for step in [each for each in self.taken if each.index == index]:
            self.listener.step(step.index, step.start, step.end, "void")
            self.taken.remove(step)
        self.kept.discard(index)
        while (answer := self._hang(index)) not in ("go", "skip"):
            pass  # it is the one before that is asked for already
        if answer == "skip":
            self.skipped.add(index)
        else:
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


def expected_of(before: Sequence[Taken], force: float) -> float:
    """N that the steps so far let one expect: a line through them, of the slope 1 while there is but one load."""
    if not before:
        return force
    forces, readings = np.array([each.force for each in before]), np.array([each.reading for each in before])
    if np.ptp(forces) == 0.0:
        return float(readings.mean() + force - forces.mean())
    slope, zero = np.polyfit(forces, readings, 1)
    return float(zero + slope * force)
