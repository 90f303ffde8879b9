"""The console's screen and keys over pipes, for a browser: Textual's own driver, less its hold on the signals."""

from __future__ import annotations

import asyncio
import signal

from textual.drivers.web_driver import WebDriver

from rig.console.app import ConsoleApp


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
