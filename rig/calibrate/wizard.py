"""The operator at the screen: a calibration in a thread of its own, what it shows, and the keys that answer it."""

from __future__ import annotations

import queue
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import isfinite, nan
from statistics import fmean, pstdev
from types import FrameType

import click

from identification.calibration.loads import Load, force_of
from rig.calibrate.loads_file import LoadsPlan
from rig.calibrate.operator import TURN, Answer, Back, Hung, StoppedError
from rig.calibrate.session import Session, expected_of
from rig.console.weighing.shown import State, StepLine, Weighing
from rig.errors import RigError

LOOKED_AT = 1.0
"""s of readings whose mean and scatter are shown."""
MOST_SAID = 200
"""Lines of what was told that are kept for the screen."""
DOING = {
    "settle": "Step {at}: {load} hangs. Waiting until the reading stands still ... do not touch.",
    "read": "Step {at}: {load} hangs. Reading ... do not touch.",
    "done": "Comparing all steps ...",
}
STOPPED = "stopped by the operator; the recording is kept, no calibration was written"


@dataclass
class Wizard:
    """An Operator whose answers are keys. The calibration runs in one thread, the screen in another: what is shown is
    put down whole, and answers come through a queue."""

    title: str
    plan: LoadsPlan
    shown: Weighing = field(init=False)
    answers: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue)
    said: deque[str] = field(default_factory=lambda: deque(maxlen=MOST_SAID))
    result: list[str] = field(default_factory=list)
    session: Session | None = None
    readings: deque[tuple[float, float]] = field(default_factory=deque)
    asks: str = ""
    doubts: str = ""

    def __post_init__(self) -> None:
        self.shown = Weighing(self.title, weights=tuple(self.plan.weights))

    # ---- for the calibration, in its thread

    def begin(self, session: Session) -> None:
        self.session = session
        session.seen = self.look

    def hang(self, prompt: str, load: Load, force: float, turn: TURN) -> Answer | Back | Hung:
        del force
        self.asks = prompt.partition(": ")[2]
        try:
            while True:
                answer = self._answer(turn)
                if answer in ("go", "again", "skip"):
                    return answer  # type: ignore[return-value]
                if answer.startswith("back "):
                    return Back(int(answer.removeprefix("back ")) - 1)
                if answer.startswith("hung "):
                    return Hung(self._load(answer.removeprefix("hung "), load.direction))
        finally:
            self.asks = ""

    def doubt(self, text: str, turn: TURN) -> Answer:
        self.doubts = text
        try:
            while (answer := self._answer(turn)) not in ("again", "keep", "probable"):
                pass
            return answer  # type: ignore[return-value]
        finally:
            self.doubts = ""

    def tell(self, text: str) -> None:
        done = self.session is not None and self.session.phase == "done"
        (self.result if done else self.said).extend(text.splitlines())

    def look(self, session: Session) -> None:
        """Put down what there is to see."""
        self._read(session)
        now = session.listener.now
        values = [value for time, value in self.readings if time > now - LOOKED_AT]
        self.shown = Weighing(
            self.title,
            tuple(self._steps(session)),
            session.at,
            self.asks,
            self.doubts,
            self._probable(session),
            DOING.get(session.phase, "").format(at=session.at + 1, load=session.load(session.at).said),
            fmean(values) if values else nan,
            pstdev(values) if values else nan,
            session.listener.temperature,
            tuple(self.plan.weights),
            tuple(self.said),
        )

    def ended(self, error: str = "", *, failed: bool) -> None:
        """Nothing more comes; `error` where it ended otherwise than planned."""
        lines = [*self.result, *([error] if error else []), *(["", *self.said] if failed else [])]
        steps = self.shown.steps if self.session is None else tuple(self._steps(self.session))
        leaves = self.session is None  # whoever waits for this thread says why
        self.shown = Weighing(
            self.title, steps, self.shown.at, result=tuple(lines), ended=True, failed=failed, leaves=leaves
        )

    def _answer(self, turn: TURN) -> str:
        while not self.answers.empty():
            if self.answers.get() == "stop":  # keys of before are no answer to this question
                raise StoppedError(STOPPED)
        while self.answers.empty():
            turn()
        answer = self.answers.get()
        if answer == "stop":
            raise StoppedError(STOPPED)
        return answer

    def _load(self, typed: str, direction: int) -> Load:
        names = [name.strip() for name in typed.split("+")]
        return Load(() if names == ["-"] else tuple(names), direction)

    def _read(self, session: Session) -> None:
        listener = session.listener
        if isfinite(listener.reading) and (not self.readings or self.readings[-1][0] != listener.last):
            self.readings.append((listener.last, listener.reading))
        while self.readings and self.readings[0][0] < listener.now - LOOKED_AT:
            self.readings.popleft()

    def _probable(self, session: Session) -> str:
        if not self.doubts:
            return ""
        found = session.doubted
        return "" if found is None or found.probable is None else found.probable.said

    def _steps(self, session: Session) -> Iterator[StepLine]:
        taken = {step.index: step for step in session.taken}
        for index in range(len(self.plan.loads)):
            load, step = session.load(index), taken.get(index)
            force = force_of(load, self.plan.weights, self.plan.place)
            state = self._state(session, index, is_taken=step is not None)
            reading = nan if step is None else step.reading
            off = nan if step is None else reading - expected_of(session.taken, force)
            yield StepLine(index + 1, load.said, force, state, reading, off)

    def _state(self, session: Session, index: int, *, is_taken: bool) -> State:
        if index == session.at and session.phase != "done":
            return "doubted" if session.phase == "doubt" else "now"
        if is_taken:
            return "kept" if index in session.kept else "read"
        if index in session.skipped:
            return "left out"
        return "only loaded" if index in self.plan.unread and index < session.at else "waiting"


@dataclass
class Screen:
    """The calibration beside the application that shows it."""

    wizard: Wizard
    work: Callable[[], int]
    status: int = 2
    error: BaseException | None = None

    def run(self, colors: str, *, bell: bool) -> int:
        """The exit status of the calibration. Raises what it raised; it ends when the screen does, however it does."""
        from rig.console.weighing.app import WeighingApp

        thread = threading.Thread(target=self._work, name="calibration")
        app = WeighingApp(lambda: self.wizard.shown, self.wizard.answers.put, colors=colors, bell=bell)
        with _ended_by_signals(lambda: app.call_later(app.exit)):
            thread.start()
            try:
                app.run()
            finally:
                self.wizard.answers.put("stop")
                thread.join()
        if self.error is not None:
            raise self.error
        click.echo("\n".join(self.wizard.result))  # it is still there when the screen has gone
        return self.status

    def _work(self) -> None:
        try:
            self.status = self.work()
            self.wizard.ended(failed=self.status != 0)
        except RigError as error:
            self.error = error
            self.wizard.ended(str(error), failed=True)
        except BaseException as error:  # noqa: BLE001  # raised again in the thread that waits for this one
            self.error = error
            self.wizard.ended(f"{type(error).__name__}: {error}", failed=True)


@contextmanager
def _ended_by_signals(end: Callable[[], object]) -> Iterator[None]:
    """A terminal that closes, and `kill`, end the screen as q does."""

    def heard(number: int, frame: FrameType | None) -> None:
        del number, frame
        end()

    before = {each: signal.signal(each, heard) for each in (signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
