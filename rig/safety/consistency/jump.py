"""A value that jumps while the command stands still: a factor that changed, a sign that flipped, a value that is gone.

Slow changes pass: a warm motor, water that begins to go round, a jet that builds up take seconds, a lie takes one row.
"""

from __future__ import annotations

from collections.abc import Callable

from rig.safety.consistency.look import DIGITS, NAMES, THRUST, UNITS, Means

MOST = (0.25, 0.28, 0.28)
"""Of rotation, current and thrust: relative change within 0.3 s of a settled hold. Thrust is compared per n|n| where
the rotation is known: a supply that sags moves both. An overshoot of half the step that decays within 0.2 s to 1.5 s
moves it by 0.2 at most."""
SIGMAS = 10.0
"""Times the mean step from one block to the next."""
SMALL = 0.1
"""Of the largest thrust so far: what moves by less is no evidence."""
STOOD = 0.6
"""Of the jump: by how much the value may have moved in the time before it. What gathers speed has moved as much."""
BLOCKS = 2
"""In a row that must say so."""


class Jump:
    """Of one run; `largest` thrust in N grows with it."""

    def __init__(self) -> None:
        self._seen = [0, 0, 0]

    def advance(
        self,
        windows: tuple[Means, Means, Means],
        zero: float | None,
        largest: float,
        noise: Callable[[int], float | None],
    ) -> str:
        """One block later; `windows` in a row, newest last. Empty, or what jumped."""
        found = ""
        oldest, old, new = windows
        for i, (first, before, after, most) in enumerate(zip(oldest, old, new, MOST, strict=True)):
            if first is None or after is None or before is None or (i == THRUST and zero is None):
                continue
            base = zero if i == THRUST and zero is not None else 0.0
            expected = (before - base) * (_turned(new, old) if i == THRUST else 1.0)
            least = max(SIGMAS * (noise(i) or 0.0), DIGITS[i], SMALL * largest if i == THRUST else 0.0)
            off = abs(after - base - expected)
            jumped = off > least and off > most * abs(expected) and abs(before - first) < STOOD * off
            self._seen[i] = self._seen[i] + 1 if jumped else 0
            if self._seen[i] >= BLOCKS and not found:
                found = (
                    f"{NAMES[i]} went from {expected:.4g} to {after - base:.4g} {UNITS[i]} while the command stood "
                    f"still, {most:.0%} are allowed{_beside(i, new, old)}"
                )
        return found


def _turned(new: Means, old: Means) -> float:
    """By how much n|n| grew; 1 where it is not known or the propeller hardly turns."""
    if new.rate is None or old.rate is None or abs(old.rate) < 1.0 or new.rate * old.rate <= 0.0:
        return 1.0
    return (new.rate / old.rate) ** 2


def _beside(channel: int, new: Means, old: Means) -> str:
    """What the other channels did meanwhile: who is alone may be the liar."""
    said = [
        f"{NAMES[i]} from {old[i]:.4g} to {new[i]:.4g} {UNITS[i]}"
        for i in range(3)
        if i != channel and new[i] is not None and old[i] is not None
    ]
    return f" (meanwhile {', '.join(said)})" if said else ""
