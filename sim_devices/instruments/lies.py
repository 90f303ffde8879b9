"""What a force sensor may say in the place of the truth while its electronics, its line and its clock are in order.

Between the converter and the display: a number comes as often as it should, is well formed, and is wrong.
"""

from __future__ import annotations

import random
from collections.abc import Callable

from sim_devices.wires.serial_line import DEFAULT_AMOUNT

LIES = ("factor", "sign", "stuck_noise", "one_digit", "zero_noise", "coarse_digit")
"""times `amount`; the other sign; the last value with noise of `amount` N; the last value or one digit beside it; none
but noise of `amount` N; whole steps of `amount` N alone."""


class Lying:
    """Stands before `read` (N); `digit` N is the display's."""

    def __init__(self, read: Callable[[], float], digit: float) -> None:
        self._read, self._digit = read, digit
        self._chance = random.Random(7)  # noqa: S311  # noise of a simulated sensor, the same in every run
        self._lie, self._amount, self._stuck = "", DEFAULT_AMOUNT, 0.0

    def begin(self, lie: str, amount: float) -> None:
        """One of LIES from now on; empty: the truth."""
        self._lie, self._amount, self._stuck = lie, amount, self._read()

    def __call__(self) -> float:
        """N, as the display will show it."""
        value = self._read()
        match self._lie:
            case "factor":
                return value * self._amount
            case "sign":
                return -value
            case "stuck_noise":
                return self._stuck + self._chance.gauss(0.0, self._amount)
            case "one_digit":
                return self._stuck + self._chance.choice((-1, 0, 0, 1)) * self._digit
            case "zero_noise":
                return self._chance.gauss(0.0, self._amount)
            case "coarse_digit":
                return round(value / self._amount) * self._amount
            case _:
                return value
