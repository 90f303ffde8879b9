"""Device side of an emergency stop button behind a small computer: a line says what its contact is, 0 or 1, or volts.

A mushroom button has a contact that opens when it is pressed, so that a broken wire is a pressed button. The computer
says the contact by itself, many times a second, CR LF; it takes no command. Whether the button cuts the power as well
is the wiring of the bench, not of this device.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from math import inf

from sim_devices.wires.serial_line import DEFAULT_AMOUNT


@dataclass(frozen=True, slots=True)
class ButtonOptions:
    """`[devices.<name>]` of kind button."""

    kind: str
    port: str
    baud: int = 115200
    rate: float = 50.0
    """lines/s"""
    closed: float = 1.0
    """Said while the contact is closed: not pressed. 24 V of an analogue input, 1 of a digital one."""
    open: float = 0.0
    """Said while it is open: pressed, or its wire broken."""
    noise: float = 0.0
    """Of an analogue input, 1 sigma; 0: whole numbers are said."""

    def __post_init__(self) -> None:
        if not self.rate > 0:
            raise ValueError(f"rate must be above 0, got {self.rate}")
        if self.closed == self.open:
            raise ValueError(f"closed and open must differ, got {self.closed} for both")


class Button:
    """One button; `pressed` is a fault that it is told to have, `clear` pulls it out again."""

    faults = ("pressed", "frozen", "silent")

    def __init__(self, options: ButtonOptions) -> None:
        self._options = options
        self._next = self._period = 1.0 / options.rate
        self._pressed = self._frozen = self._silent = False
        self._chance = random.Random(3)  # noqa: S311  # noise of a simulated input, the same in every run
        self._last = b""

    @property
    def due(self) -> float:
        return inf if self._silent else self._next

    def feed(self, _data: bytes, _t: float) -> bytes:
        return b""

    def tick(self, t: float) -> bytes:
        out = b""
        while self._next <= t:
            self._next += self._period
            out += self._line()
        return out

    def _line(self) -> bytes:
        if not (self._frozen and self._last):
            value = self._options.open if self._pressed else self._options.closed
            noise = self._options.noise
            said = f"{value + self._chance.gauss(0.0, noise):.3f}" if noise else f"{value:g}"
            self._last = f"{said}\r\n".encode("ascii")
        return self._last

    def fault(self, name: str, _t: float, _amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"button: expected one of {', '.join(self.faults)}, got {name!r}")
        self._pressed = self._pressed or name == "pressed"
        self._frozen = self._frozen or name == "frozen"
        self._silent = self._silent or name == "silent"

    def clear(self, t: float) -> None:
        self._pressed = self._frozen = self._silent = False
        self._next = max(self._next, t)
