"""What the screen of a calibration shows, made without a widget."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import Final, Literal

State = Literal["waiting", "now", "read", "doubted", "kept", "left out", "only loaded"]
MARKS: Final[dict[State, str]] = {
    "waiting": " ",
    "now": ">",
    "read": "+",
    "doubted": "!",
    "kept": "k",
    "left out": "-",
    "only loaded": ".",
}
"""So that a screen without colour tells them apart."""


@dataclass(frozen=True, slots=True)
class StepLine:
    """One step of the plan."""

    number: int
    """From 1."""
    load: str
    force: float
    """N"""
    state: State
    reading: float = nan
    """N"""
    off: float = nan
    """N, of the reading from a straight line through all steps."""


@dataclass(frozen=True, slots=True)
class Weighing:
    """One moment of a calibration."""

    title: str
    steps: tuple[StepLine, ...] = ()
    at: int = 0
    """Which of them."""
    asks: str = ""
    """What the operator is to do; empty while the cell is read."""
    doubt: str = ""
    """A step that does not go with the others, as a sentence."""
    probable: str = ""
    """What hung in it, where something of the set fits."""
    doing: str = ""
    """What goes on while nobody is asked."""
    reading: float = nan
    """N, mean of the newest second."""
    scatter: float = nan
    """N, of its samples."""
    temperature: float = nan
    """degC"""
    weights: tuple[str, ...] = ()
    """Names of the set."""
    said: tuple[str, ...] = ()
    """What was told, the newest last."""
    result: tuple[str, ...] = ()
    """At the end: what came of it."""
    ended: bool = False
    failed: bool = False
    leaves: bool = False
    """Nothing was begun, and there is nothing to be seen: the screen goes by itself."""


def instruction(now: Weighing) -> str:
    """The one sentence of the screen."""
    if now.ended:
        return "Calibration failed." if now.failed else "Calibration done."
    if now.doubt:
        return f"{now.doubt[:1].upper()}{now.doubt[1:]}"
    if now.asks:
        return f"{now.asks[:1].upper()}{now.asks[1:]}, then Enter."
    return now.doing or "Opening the load cell ..."


def keys_of(now: Weighing) -> str:
    """What can be pressed at this moment."""
    if now.ended:
        return "Up, Down scroll   q leave"
    if now.doubt:
        probable = f"o it was {now.probable}   " if now.probable else ""
        return f"r hang and read again   {probable}k keep it   q end   ? keys"
    if now.asks:
        return "Enter it hangs   e other weights   r the last again   b back to a step   s leave out   q end   ? keys"
    return "q end   ? keys"


def live(now: Weighing) -> str:
    """What the cell reads."""
    if not isfinite(now.reading):
        return "the cell reads: nothing yet"
    warm = f"   {now.temperature:.2f} degC" if isfinite(now.temperature) else ""
    return f"the cell reads {now.reading:10.4f} N   scatter {now.scatter:.2g} N{warm}"


def table(now: Weighing, rows: int) -> tuple[str, ...]:
    """Lines of the steps, at most so many, the current one among them."""
    first = max(min(now.at - rows // 2, len(now.steps) - rows), 0)
    return tuple(_line(step) for step in now.steps[first : first + rows])


HEAD: Final = "     step  load                        N     reads / N    off / N"


def _line(step: StepLine) -> str:
    load = step.load if len(step.load) <= 20 else step.load[:19] + "…"
    text = f"  {MARKS[step.state]}  {step.number:4d}  {load:<20} {step.force:8.3f}"
    if isfinite(step.reading):
        text += f"  {step.reading:12.4f}"
    if isfinite(step.off):
        text += f"  {step.off:+9.4f}"
    return f"{text}  {step.state}" if step.state in ("doubted", "kept", "left out", "only loaded") else text


def progress(steps: Sequence[StepLine]) -> str:
    """How far it is."""
    done = sum(step.state not in ("waiting", "now") for step in steps)
    return f"{done} of {len(steps)} steps"
