"""Keys that come in one burst do what they would have done one by one.

Textual hands a key to the focused widget, and what it is bound to is done only when it has come back up to the
application. A letter behind it is typed before that: of `Ctrl+U 1 2` in one burst the field is emptied last, and of
`1 Tab 2` both numbers go into the first field. What a key opens or closes takes a moment more: of `n k e l p` the `k`
would come to the page, where it is a key of its own. Here a key waits until the one before it has done all it does.
The console's stop key never comes here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Final

from textual import events
from textual.app import App
from textual.message_pump import MessagePump
from textual.screen import Screen
from textual.widgets import Input

LONGEST: Final = 1.0
"""s that a key is waited for: its widget may be gone before it has come to it."""
Press = events.Key | events.Paste
Pass = Callable[[events.Event], Awaitable[None]]


class KeysInOrder:
    """Stands before the application's own handling of events."""

    def __init__(self, app: App[None]) -> None:
        self._app = app
        self._waiting: deque[Press] = deque()
        self._under_way: Press | None = None
        self._target: MessagePump | None = None
        """To which the key under way was given."""
        self._next: Press | None = None
        """Posted anew, and not yet here."""

    async def handle(self, event: events.Event, pass_on: Pass) -> None:
        """`pass_on` is what the application does with an event."""
        if not isinstance(event, events.Key | events.Paste):
            await pass_on(event)
        elif event.is_forwarded:  # no widget has used it, and now its binding is looked for
            await pass_on(event)
            self._rise(self._target, event)
        elif event is not self._next and (self._under_way is not None or self._next is not None):
            self._waiting.append(event)
        else:
            self._next = None
            await self._begin(event, pass_on)

    async def _begin(self, event: Press, pass_on: Pass) -> None:
        self._under_way = event
        target = self._target = next((screen.focused or screen for screen in self._app.screen_stack[-1:]), None)
        await pass_on(event)
        if not event.is_forwarded:  # bound with priority, or nobody there
            self._rise(target, event)
            return
        if isinstance(target, Input) and (isinstance(event, events.Paste) or event.is_printable):
            target.call_later(partial(self._done, event))  # typed into it, and it ends there
        self._app.set_timer(LONGEST, partial(self._done, event))

    def _rise(self, at: MessagePump | None, event: Press) -> None:
        """What the key has posted comes up from its widget to the screen, and behind it this; then a screen that was
        opened or uncovered takes up its work."""
        if isinstance(at, Screen) or at is None:
            top = self._app.screen_stack[-1:]  # empty while the application closes
            waits = top != [at] and any(screen.call_later(partial(self._done, event)) for screen in top)
        else:
            waits = at.call_later(partial(self._rise, at._parent, event))
        if not waits:  # nothing is to be waited for, or who would say so is gone
            self._done(event)

    def _done(self, event: Press) -> None:
        """The key under way has done all it does, if it is still `event`: the next one's turn."""
        if event is not self._under_way:
            return
        self._under_way = self._target = None
        if self._waiting:
            self._next = self._waiting.popleft()
            self._app.post_message(self._next)
