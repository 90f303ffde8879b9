"""The hysteresis of a load cell's steel and glue: play operators of many widths (Prandtl-Ishlinskii; Visintin,
Differential Models of Hysteresis, 1994, III.2). Its loops close at both ends of a range and bulge between them."""

from __future__ import annotations

PLAYS = 12


class Plays:
    """`follow` takes the force and gives the part of the reading that lags behind, N."""

    def __init__(self, half_width: float, reach: float) -> None:
        """`half_width` N in the middle of a loop from nothing to `reach` N and back."""
        self._half = [0.5 * reach * (i + 0.5) / PLAYS for i in range(PLAYS)]
        self._held = [0.0] * PLAYS
        # in the middle of the loop a play is behind by its own half width, or by what was gone since the turn
        middle = sum(min(2.0 * half, 0.5 * reach) - half for half in self._half)
        self._share = half_width / middle

    def follow(self, force: float) -> float:
        """N, to be added to the force."""
        held = self._held
        for i, half in enumerate(self._half):
            held[i] = max(force - half, min(force + half, held[i]))
        return self._share * (sum(held) - PLAYS * force)
