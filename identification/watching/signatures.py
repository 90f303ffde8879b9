"""How a change may look in stretch means: one column per shape, zero before it begins, in N per unit of its size."""

from __future__ import annotations

from math import isfinite
from typing import Final, Literal

import numpy as np

from identification.recording import Floats
from identification.watching.stretches import FEATURES, Stretch

Place = Literal["zero", "running", "forward", "reverse", "high", "bus"]
"""Where a change shows: in the zero, rest and running alike; in proportion to thrust in both directions; in one
direction; more than in proportion at high levels; along with the bus voltage."""

SIGNATURES: Final[tuple[tuple[str, Place], ...]] = (
    ("zero step", "zero"),
    ("zero ramp", "zero"),
    ("gain step", "running"),
    ("gain ramp", "running"),
    ("forward step", "forward"),
    ("reverse step", "reverse"),
    ("forward ramp", "forward"),
    ("reverse ramp", "reverse"),
    ("high step", "high"),
    ("friction step", "running"),
    ("even step", "running"),
    ("bus", "bus"),
)
RAMP: Final = 60.0
"""s in which a ramp of size 1 grows by 1."""
BUS: Final = 10.0
"""A bus signature of size 1 is 1 N at the highest command for a bus that is a tenth lower."""
STATIC: Final = ("zero", "x", "abs_x", "v", "abs_v", "lag", "flow_slope", "flow_drag")
"""Columns that are no mismatch of the running kind: the static curve, and what flow does to it."""


def static_row(s: Stretch) -> Floats:
    """(len(STATIC),): a tare, v|v|, v^2, v and |v| (asymmetry, dead band), a delay in sweeps, flow."""
    x, abs_x, v, sign, _, _ = s.features
    return np.array([1.0, x, abs_x, v, v * sign, s.slope, abs(v) * s.flow, s.flow * abs(s.flow)])


def signature_row(s: Stretch, x: float, bus0: float) -> Floats:
    """(len(SIGNATURES),) at full size; ramps per RAMP s and still to be multiplied by the time since they began.

    `x`: prediction of the reference over that at the highest command (v|v| where there is none). `bus0`: V at first.
    """
    _, abs_x, _, sign, running, x_abs_x = s.features
    size = abs(x) if abs_x > 0 else 0.0
    forward, reverse = (size + x) / 2, (x - size) / 2
    bus = BUS * x * (s.bus / bus0 - 1.0) if isfinite(s.bus) and isfinite(bus0) and bus0 > 0 else 0.0
    return np.array([1.0, 1.0, x, x, forward, reverse, forward, reverse, x_abs_x, sign, running, bus])


RAMPS: Final = np.array([name.endswith("ramp") for name, _ in SIGNATURES])
"""Which of SIGNATURES grow with time."""
assert len(FEATURES) == 6
