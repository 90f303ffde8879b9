"""The stop key leaves for the controller in the thread that reads the keys, while the screen's own loop may be drawing.

`ConsoleApp.post_message` takes the key as well, once the loop comes to it: it sends again, which harms nothing, shows
what was asked, and says so when it could not be sent.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from textual import events
from textual.drivers.linux_driver import LinuxDriver
from textual.message import Message

from rig.console.app import STOP_KEYS, ConsoleApp
from rig.errors import LinkError
from rig.link.front_end_messages import Request


class OperatorDriver(LinuxDriver):
    """Textual's own for a terminal, which looks at each key in the thread that reads it."""

    def send_message(self, message: Message) -> None:
        stop_at_once(self._app, message)
        LinuxDriver.send_message(self, message)


def stop_at_once(app: Any, message: Message) -> None:
    """Send the stop if `message` is its key; from any thread. Raises nothing: the application tries again and tells."""
    if isinstance(message, events.Key) and message.key in STOP_KEYS and isinstance(app, ConsoleApp):
        with suppress(LinkError):
            app.feed.send_from_thread(Request("stop", "console"))
