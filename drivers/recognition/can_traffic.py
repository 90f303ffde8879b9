"""Recognition on a CAN bus: what was heard, and questions that are only asked where nobody of another kind speaks."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.recognition.found import Found

PAUSE = 0.002
"""s between two questions: at 500 kbit/s a tenth of the bus."""


class Traffic:
    """An open bus whose every frame is heard."""

    def __init__(self, bus: CanBus) -> None:
        self._bus = bus
        self._inbox = bus.subscribe(lambda _: True)
        self.frames: tuple[tuple[int, Frame], ...] = ()
        """(ns of arrival, frame) heard without asking."""
        self.heard_for = 0.0
        """s"""
        self.named = False
        """The operator has named the kind that asks now: he knows what is on the bus."""

    def listen(self, seconds: float) -> None:
        """Ends early when the bus is lost."""
        begun = time.monotonic()
        self._inbox.wait_for(lambda _: False, seconds)
        self.heard_for += time.monotonic() - begun
        self.frames += tuple(self._inbox.take_all())

    def ask(self, requests: Sequence[Frame], timeout: float = 0.3) -> tuple[Frame, ...]:
        """What came while the requests went out one by one, and for `timeout` s after. Raises LinkError."""
        for request in requests:
            self._bus.send(request)
            self._inbox.wait_for(lambda _: False, PAUSE)
        self._inbox.wait_for(lambda _: False, timeout)
        return tuple(frame for _, frame in self._inbox.take_all())

    def close(self) -> None:
        self._bus.unsubscribe(self._inbox)


@dataclass(frozen=True, slots=True)
class CanProbe:
    """How one kind is recognised on a CAN bus."""

    asks: str
    """What it is sent, in words."""
    owns: Callable[[Frame], bool]
    """Whether a frame may be of this kind; where others are heard too, nothing is asked."""
    hear: Callable[[Traffic], list[Found]]
    ask: Callable[[Traffic], list[Found]] | None = None
