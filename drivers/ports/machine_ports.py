"""Which serial ports this machine has; none of them is opened."""

from __future__ import annotations

from typing import NamedTuple

from serial.tools import list_ports


class MachinePort(NamedTuple):
    """A serial port that the operating system knows."""

    path: str
    description: str
    """Of the adapter, as it says it itself; empty: it says nothing."""


def machine_ports() -> list[MachinePort]:
    """Sorted by path."""
    found = [(str(port.device), str(port.description or "")) for port in list_ports.comports()]
    return sorted(MachinePort(path, "" if text == "n/a" else text) for path, text in found)
