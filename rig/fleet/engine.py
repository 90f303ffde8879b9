"""What an engine is: who carries orders out, here or elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from rig.fleet.question import Question, Row


@dataclass(frozen=True, slots=True)
class Order:
    """One file to be asked, under the key of its answer."""

    key: str
    url: str


@dataclass(frozen=True, slots=True)
class Failed:
    """No answer: the process died or took too long, or the file was not to be had. Nothing about the recording is
    known by it, so it is not kept and is asked again the next time."""

    order: Order
    why: str


Answered: TypeAlias = tuple[Order, Row]


class Engine(Protocol):
    """Carries out orders in any sequence."""

    def carry_out(self, question: Question, orders: Sequence[Order], told: Callable[[Answered | Failed], None]) -> None:
        """`told` of each order once, in this thread."""
