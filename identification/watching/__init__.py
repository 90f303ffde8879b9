"""Watching a run while it is made: settled stretches, their evidence for a change, and where it shows. See `Watch`."""

from identification.watching.alarm import Alarm
from identification.watching.signatures import Place
from identification.watching.watch import Settings, Watch

__all__ = ["Alarm", "Place", "Settings", "Watch"]
