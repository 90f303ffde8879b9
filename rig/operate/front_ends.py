"""What may attend a run in this terminal, progress bar or console, and how it ended."""

from __future__ import annotations

import sys
import termios
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.link.front_end_messages import Request, Snapshot
from rig.link.sockets import Peer
from rig.operate.headless import Headless, operator_terminal
from rig.operate.narration import narration_of
from rig.screen_options import USUAL, Look

if TYPE_CHECKING:
    from rig.console.next_run import NextRun


@dataclass(frozen=True, slots=True)
class Left:
    """How a front end ended."""

    last: Snapshot | None
    """The newest snapshot that came; None: none ever did."""
    detached: bool = False
    """The operator left on purpose, and the run goes on."""
    signal: int = 0
    """The signal that ended it; 0: none did."""
    next_run: NextRun | None = None
    """The campaign that the operator asked for at its end."""


AGAIN = "rig console "
"""What stands before the run's folder in the command line that attaches once more."""
FrontEnd = Callable[[Peer, str], Left]
"""Takes the link and the command line that attaches once more."""


def progress_bar(*, start: bool, look: Look = USUAL) -> FrontEnd:
    """Nobody can detach here; `start` starts the run when the preflight has passed."""
    return lambda peer, _: Left(Headless(peer, narration_of(look), operator_terminal()).follow(start))


def console_screen(
    look: Look = USUAL,
    *,
    browser: bool = False,
    begins: bool = False,
    earlier: Sequence[str] = (),
    looks_on: bool = False,
) -> FrontEnd:
    """Imported before a controller is started: Ctrl+C in that second leaves nothing behind. `browser` and
    `looks_on`: it looks on.

    `begins`: whoever takes its `Left` runs the `next_run`; `earlier`: recordings that are diagnosed with the new ones.
    """
    from rig.console import SocketFeed, attend

    def front(peer: Peer, again: str) -> Left:
        if browser or looks_on:
            peer.send(Request("watch"))  # before the screen comes up: until then it would count as attending
        sitting = attend(
            SocketFeed(peer), again=again, silent=not look.bell, colors=look.colors, browser=browser,
            looks_on=looks_on, begins=begins, earlier=earlier, folder=again.removeprefix(AGAIN),
        )  # fmt: skip
        return Left(sitting.last, sitting.detached, max(sitting.status - 128, 0), sitting.next_run)

    return front


class Console:
    """The console in this terminal, for one campaign after the other: it remembers the sweep asked for last."""

    def __init__(self, look: Look) -> None:
        self.look = look
        self.asked: NextRun | None = None

    def front(self, earlier: Sequence[str] = ()) -> FrontEnd:
        """`earlier`: recordings that what is recorded now is diagnosed with."""
        screen = console_screen(self.look, begins=True, earlier=earlier)

        def front(peer: Peer, again: str) -> Left:
            left = screen(peer, again)
            self.asked = left.next_run
            return left

        return front


def forget_keys() -> None:
    """What was typed while no console was there is for none: an F5 of then must not start a motor now."""
    if sys.stdin.isatty():
        termios.tcflush(sys.stdin, termios.TCIFLUSH)
