"""The console's screen and keys over pipes, for a browser: Textual's own driver, less its hold on the signals."""

from __future__ import annotations

import asyncio
import signal

from textual.drivers.web_driver import WebDriver
from textual.message import Message

from rig.console.app import ConsoleApp
from rig.console.stop_at_once import stop_at_once


class BrowserDriver(WebDriver):
    """Textual's leaves the application at SIGINT and SIGTERM. Here the one is the stop key, as on a terminal, and the
    other is what the sitting has made of it."""

    def start_application_mode(self) -> None:
        before = signal.getsignal(signal.SIGTERM)
        WebDriver.start_application_mode(self)
        loop = asyncio.get_running_loop()
        loop.remove_signal_handler(signal.SIGTERM)
        signal.signal(signal.SIGTERM, before)
        if isinstance(self._app, ConsoleApp):
            loop.add_signal_handler(signal.SIGINT, self._app.action_stop)

    def send_message(self, message: Message) -> None:
        stop_at_once(self._app, message)
        WebDriver.send_message(self, message)
