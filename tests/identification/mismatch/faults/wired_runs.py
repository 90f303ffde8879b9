"""Runs of one thruster made by hand for the tests of the wiring: steps of the command and all that follows them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from identification.recording import Channel, Floats, Recording


def wired_run(
    seed: int,
    top: float = 12.0,
    gain: float = 1.0,
    drive: float = 1.0,
    bus: float = 24.0,
    seconds: float = 120.0,
    *,
    sag: float = 0.001,
    forward: bool = False,
) -> Recording:
    """Levels of 3 s within +-`top` V, 20 samples a second; a dead band, weak reverse thrust, a zero, noise of 0.5 %.

    `gain`: of the thrust; `drive`: of the command, what drives; `bus` V of the supply, less `sag` n^2; `forward`: no
    level is below zero.
    """
    rng = np.random.default_rng([seed, 5])
    t = np.arange(0.0, seconds, 0.05)
    start = np.arange(0.0, seconds, 3.0)
    level = np.round(top * rng.uniform(0.05 if forward else -1, 1, start.size), 2)
    volts = drive * level[(t / 3.0).astype(int)]
    n = 1.6 * np.sign(volts) * np.maximum(np.abs(volts) - 0.4, 0.0)
    thrust = 0.2 * gain * n * np.abs(n) * np.where(n < 0, 0.8, 1.0)
    made = (
        channel("command_voltage", "V", start, level),
        channel("thrust", "N", t, thrust + rng.normal(0.0, 0.3, t.size) + 0.7),
        channel("rotation_rate", "rev/s", t, n + rng.normal(0.0, 0.02, t.size)),
        channel("current", "A", t, 0.04 * n * np.abs(n) + rng.normal(0.0, 0.05, t.size)),
        channel("bus_voltage", "V", t, bus - sag * n**2 + rng.normal(0.0, 0.02, t.size)),
    )
    return Recording(f"id-{seed}", "T", made, source=f"run{seed}.csv")


def channel(quantity: str, unit: str, time: Floats, value: Floats) -> Channel:
    return Channel(quantity, quantity, quantity, unit, time, value)


def edited(recording: Recording, quantity: str, change: Callable[[Floats], Floats]) -> Recording:
    return replace(
        recording,
        channels=tuple(replace(c, value=change(c.value)) if c.quantity == quantity else c for c in recording.channels),
    )


def only(recording: Recording, *quantities: str) -> Recording:
    return replace(recording, channels=tuple(c for c in recording.channels if c.quantity in quantities))


def values(recording: Recording, quantity: str) -> Floats:
    found = recording.first_of(quantity)
    assert found is not None
    return found.value
