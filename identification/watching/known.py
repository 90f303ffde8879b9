"""What a twin gives once it has settled: the model that a run is watched with when one is known before it."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite, sqrt

import numpy as np

from identification.mismatch.compare.simulation import Drive, simulate
from identification.mismatch.prepare.preparing import Refusal
from identification.twin import Twin
from identification.watching.stretches import Expected

SETTLED = 5.0
"""s under one command after which a twin counts as settled. What it remembers for longer (heat, creep) stays out."""
STEP = 0.02
"""s between the samples of that."""
ROUNDED = 3
"""Digits of command and channels to which predictions are kept: a millivolt, a millimetre per second."""
MOST = 20_000
"""Predictions kept."""


def expected_of(twin: Twin, nominal_bus: float = float("nan")) -> Expected | Refusal:
    """(V, bus V, flow m/s, rev/s) -> N, without a tare. `nominal_bus`: V, taken while the bus is not measured.

    A refusal where a term needs what a watch is not given.
    """
    needs = {need for term in twin.terms for need in term.term.needs}
    lacking = sorted(needs - {"bus_voltage", "flow_speed"})
    if lacking:
        return Refusal(f"the twin needs {', '.join(lacking)}, which a running campaign does not feed to the watch")
    if twin.driver_quantity not in ("command_voltage", "rotation_rate"):
        return Refusal(f"the twin is driven by {twin.driver_quantity}; expected command_voltage or rotation_rate")
    kept: dict[tuple[float, ...], float] = {}

    def expected(volts: float, bus: float, flow: float, rate: float) -> float:
        drive = volts if twin.driver_quantity == "command_voltage" else rate
        drive = drive if isfinite(drive) else volts / (twin.rate_per_driver or 1.0)
        bus = bus if isfinite(bus) else nominal_bus
        key = tuple(round(each, ROUNDED) for each in (drive, bus if "bus_voltage" in needs else 0.0, flow))
        if key not in kept:
            if len(kept) >= MOST:
                kept.clear()
            kept[key] = _settled(twin, *key)
        return kept[key]

    return expected


def _settled(twin: Twin, drive: float, bus: float, flow: float) -> float:
    times = np.arange(0.0, SETTLED, STEP)
    ends = np.array([0.0, SETTLED])
    others = {"flow_speed": (ends, np.full(2, flow)), "bus_voltage": (ends, np.full(2, bus))}
    steady = replace(twin, lines=())  # a wave is no part of a hold's mean
    found = simulate(steady, Drive(np.array([0.0]), np.array([drive]), others=others), times)
    assert not isinstance(found, Refusal)  # what it needs was looked at before
    return float(found.thrust[-1])


def gain_std(twin: Twin) -> float:
    """Relative standard deviation of C."""
    return sqrt(max(twin.covariance[0][0], 0.0)) / abs(twin.C) if twin.C else 0.0
