"""One sitting at the console: run it, mind the signals, and always let the controller see the end of file."""

from __future__ import annotations

import asyncio
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import FrameType

from rig.console.app import ConsoleApp
from rig.console.feed import Feed
from rig.console.interpreter import SETTLED, settle
from rig.console.next_run import NextRun
from rig.console.stop_at_once import OperatorDriver
from rig.console.view_model.view import View
from rig.link.front_end_messages import Snapshot

COMPLETED, NOT_COMPLETED = 0, 1
LAST_WORD = 2
"""s that the screen gets to restore the terminal after SIGHUP or SIGTERM; then SIGALRM ends the process. A terminal
that is gone or does not read can hold the screen's writer for ever, and this process must let go of its socket."""


@dataclass(frozen=True, slots=True)
class Sitting:
    """How a sitting ended."""

    status: int
    """Exit status: 0 campaign completed, or detached while it goes on; 1 it was stopped, tripped, or the controller or
    the screen was lost; 128 + n after signal n."""
    last: Snapshot | None
    """The newest snapshot that came; None: none ever did."""
    detached: bool
    """True: the operator left on purpose and the controller did not refuse."""
    next_run: NextRun | None = None
    """The campaign that the operator has asked for at its end."""


def run_console(feed: Feed, clock: Callable[[], float] = time.monotonic, again: str = "rig console") -> int:
    """Run the console until the operator leaves; the exit status of `Sitting`."""
    return attend(feed, clock, again).status


def attend(
    feed: Feed,
    clock: Callable[[], float] = time.monotonic,
    again: str = "rig console",
    *,
    silent: bool = False,
    colors: str = "full",
    browser: bool = False,
    looks_on: bool = False,
    begins: bool = False,
    earlier: Sequence[str] = (),
    folder: str = "",
) -> Sitting:
    """Run the console until the operator leaves. `clock` gives s and never goes back; `again` is the command line that
    attaches once more, shown before detaching; `silent`: no bell; `colors`: `full`, `16` or `none`. `browser`: keys
    come over a pipe from one; then, and with `looks_on`, it looks on until `l`. `begins`: the caller runs what
    `next_run` names; `earlier`: recordings that each of this campaign is diagnosed with; `folder`: where it records.
    Closes `feed`."""
    app = ConsoleApp(
        feed,
        clock,
        again,
        silent=silent,
        colors=colors,
        looks_on=browser or looks_on,
        begins=begins,
        earlier=tuple(earlier),
        folder=folder,
    )
    return asyncio.run(_sit(app, browser))


async def _sit(app: ConsoleApp, browser: bool) -> Sitting:
    feed = app.feed
    if not browser:
        app.driver_class = OperatorDriver
    loop = asyncio.get_running_loop()
    loop.call_later(SETTLED, settle)
    caught: list[int] = []

    def leave() -> None:
        feed.close()
        app.exit()

    def on_signal(number: int, _: FrameType | None) -> None:
        signal.alarm(LAST_WORD)  # at once and by the kernel: the event loop may be stuck in a write
        caught.append(number)
        loop.call_soon_threadsafe(leave)

    before = {number: signal.signal(number, on_signal) for number in (signal.SIGHUP, signal.SIGTERM)}
    threading.Thread(target=_tell_of_hang_up, args=(browser,), name="hang-up", daemon=True).start()
    loop.add_signal_handler(signal.SIGINT, app.action_stop)
    try:
        await app.run_async()
    finally:
        feed.close()
        loop.remove_signal_handler(signal.SIGINT)
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.alarm(0)
    detached = _goes_on(app)
    status = 128 + caught[0] if caught else max(app.return_code or 0, exit_status(app.state, detached))
    return Sitting(status, app.state.snapshot, detached and not caught, None if caught else app.next_run)


def _goes_on(app: ConsoleApp) -> bool:
    """Whether the operator has left a campaign that goes on: detached from it, or looked on only."""
    if app.parting is not None:
        return app.parting.kind == "detach"
    view = app.state
    return (
        not app.return_code
        and view.looks_on
        and view.connected
        and view.snapshot is not None
        and view.snapshot.state != "done"
    )


def _tell_of_hang_up(pipe: bool) -> None:
    """SIGHUP to this process once its terminal, or the `pipe` that brings its keys, is gone, if the kernel has not sent
    it: it does so to the leader of a terminal's session alone. Without it the reader of keys would find an end of file
    for ever, and the screen's writer nobody."""
    terminal = sys.stdin.fileno() if pipe or sys.stdin.isatty() else None
    if terminal is None:
        return
    gone = select.poll()
    gone.register(terminal, 0)  # POLLHUP is always told
    gone.poll()
    os.kill(os.getpid(), signal.SIGHUP)


def exit_status(view: View, detached: bool) -> int:
    """0 when the campaign completed, or goes on and its console left on purpose; else 1."""
    if detached:
        return COMPLETED
    snapshot = view.snapshot
    return COMPLETED if snapshot is not None and snapshot.outcome == "completed" else NOT_COMPLETED
