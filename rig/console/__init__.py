"""The operator's console: a front end that asks and never acts. The command line needs `run_console` or `attend`."""

from __future__ import annotations

from rig.console.feed import Feed, SocketFeed
from rig.console.session import Sitting, attend, run_console

__all__ = ["Feed", "Sitting", "SocketFeed", "attend", "run_console"]
