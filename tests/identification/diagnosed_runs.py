"""Runs made by hand for the diagnosis: levels of both signs with rests, 0.5 V|V|, and whatever is put on top."""

import numpy as np

from identification.recording import Channel, Recording

C = 0.5
"""N/V^2."""
NOISE = 0.3
"""N, of one sample, white."""
TOP = 12.0
"""V: full thrust is 72 N."""


def levels(seed, seconds, dwell=3.0):
    """Times and volts of changes."""
    rng = np.random.default_rng([seed, 1])
    sizes = np.array([2.0, 4.0, 6.0, 8.0, 10.0, TOP])
    volts = []
    while len(volts) * dwell < seconds:
        order = rng.permutation(sizes)
        volts += [v for a in order for v in (a, -a, 0.0)]
    number = int(seconds / dwell)
    return dwell * np.arange(number) + 0.0071, np.array([0.0, *volts])[:number]


def run(change=None, seed=0, seconds=150.0, rate=30.0, tare=1.5, thruster="T1", noise=NOISE, volts=None, extra=()):
    """A recording whose thrust is change(t, V, C V|V|) + tare + noise; `volts` alters what the rotor sees."""
    start, level = levels(seed, seconds)
    t = np.arange(0.0, seconds, 1 / rate)
    V = level[np.maximum(np.searchsorted(start, t, side="right") - 1, 0)]
    acting = V if volts is None else volts(V)
    F = C * acting * np.abs(acting)
    F = F if change is None else change(t, V, F)
    value = F + tare + noise * np.random.default_rng([seed, 2]).standard_normal(t.size)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, level),
        Channel("thrust", "cell", "thrust", "N", t, value),
        *extra,
    )
    return Recording(f"run-{thruster}-{seed}", thruster, channels, source=f"run-{seed}.h5")


def dead_band(width):
    return lambda V: np.sign(V) * np.maximum(np.abs(V) - width, 0.0)


def table(change, number=41, seed=0, noise=0.05):
    """Levels of 4 s with one value each."""
    start, volts = 4.0 * np.arange(number), np.linspace(-TOP, TOP, number)
    F = change(volts) + noise * np.random.default_rng(seed).standard_normal(number)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, volts),
        Channel("thrust", "cell", "thrust", "N", start + 2.0, F),
    )
    return Recording(f"table-{seed}", "T1", channels, source="table.csv")
