"""Channels that lie: what a diagnosis must find before it speaks of physics. A lie has no strength."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_devices.world.effects.channel import ChannelFault
from sim_devices.world.history import History, clock

Floats = NDArray[np.float64]
Rng = np.random.Generator

KINDS = ("swapped", "rescaled", "reversed", "frozen", "unsigned")
SIGNED = ("thrust", "rotation_rate", "current")
"""Channels whose sign somebody can get wrong."""
DIRECTED = ("thrust", "rotation_rate")
"""Channels of which the size alone is a lie; of a current many drives tell no more."""
FACTORS = (0.01, 0.1, 0.4536, 2.0, 9.80665, 60.0)
"""Units mixed up: per cent, a digit, pounds, both directions, kilograms, minutes."""


@dataclass(frozen=True, eq=False, slots=True)
class Column:
    """One channel: its stream has one clock for it alone. `time` (n,) s of the recording, `value` (n,) in `unit`."""

    stream: str
    name: str
    quantity: str
    unit: str
    time: Floats
    value: Floats
    thruster: str = ""
    """Of another thruster than the one under test; empty: the one under test."""


def fault(kind: str, quantities: Sequence[str], duration: float, rng: Rng) -> dict[str, Any]:
    """Draw a lie of `kind` about one of the recorded `quantities` (thrust among them). Raises ValueError.

    rescaled and frozen begin within the run: a factor that was always there is a unit nobody can know.
    """
    if kind not in KINDS:
        raise ValueError(f"fault must be one of {', '.join(KINDS)}, got {kind!r}")
    signed = [q for q in quantities if q in SIGNED]
    if kind == "swapped":
        if len(quantities) < 2:
            raise ValueError(f"a swap takes two channels beside the command, got {list(quantities)}")
        one, other = rng.choice(list(quantities), 2, replace=False)
        return {"kind": kind, "channel": str(one), "other": str(other)}
    if kind in ("reversed", "unsigned"):
        known = [q for q in signed if kind == "reversed" or q in DIRECTED]
        return {"kind": kind, "channel": str(rng.choice(known))}
    start = duration * float(rng.uniform(0.2, 0.7))
    found: dict[str, Any] = {"kind": kind, "channel": str(rng.choice(signed)), "start": start}
    return found | ({"factor": float(rng.choice(FACTORS))} if kind == "rescaled" else {})


def lying(columns: Sequence[Column], told: Mapping[str, Any], start: float) -> tuple[Column, ...]:
    """The columns of a run that begins at `start` s of world time, with the lie in them."""
    if told["kind"] == "swapped":
        by_quantity = {c.quantity: c for c in columns}
        pair = {told["channel"]: told["other"], told["other"]: told["channel"]}
        return tuple(
            replace(c, time=by_quantity[pair[c.quantity]].time, value=by_quantity[pair[c.quantity]].value)
            if c.quantity in pair
            else c
            for c in columns
        )
    effect = ChannelFault(**told)
    return tuple(
        replace(c, value=effect.over(c.value, _at(c.time + start))) if c.quantity == effect.channel else c
        for c in columns
    )


def _at(times: Floats) -> History:
    """A history that knows nothing but its times."""
    zero = clock(times.size, 0.0)
    return History(times, 0.0, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero)
