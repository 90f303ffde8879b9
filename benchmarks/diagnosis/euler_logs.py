"""Logs of simulators that make one step of Euler a row, and what `rig diagnose` says of them.

    python benchmarks/diagnosis/euler_logs.py [CASE ...] [--seed 3]

So a simulation is written in ten lines: x += dt / tau (u - x), then the row. The rotor of a row has already done what
the row's command says, a step of the log before its time, and a step that is no small part of the lag makes it a lag
of -dt / ln(1 - dt / tau). A rotor of n' = (V|V| - n|n|) / ... by such steps is none of the catalogue. One line for each
run: CPU seconds, the verdict, the names with their values, the error on what was not fitted; `ok` where the names are
what was concealed (and the row's own delay), all of it and no more.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from time import process_time

import numpy as np

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from identification.recording import Channel, Floats, Recording

TOP, C, RATE, TARE, HOLD = 12.0, 0.25, 1.3, 0.2, 5.0


@dataclass(frozen=True)
class World:
    """Sizes of what C V|V| leaves out; 0: absent."""

    step: float = 0.02
    """s, of the simulation and of the log."""
    lag: float = 0.15
    """s."""
    squared: bool = False
    """V|V| turns the rotor against n|n|."""
    dead_band: float = 0.0
    """V."""
    reverse: float = 1.0
    """Thrust in reverse, of that forward."""
    inflow: float = 0.0
    """Share, with 0.6 s."""
    after: bool = True
    """The row is written after the step that its command makes."""
    measured: bool = True
    """With the rate of rotation."""
    sine: bool = False


def turned(world: World, volts: Floats) -> tuple[Floats, Floats]:
    """(N,) rate in volts, and what the water follows of it."""
    drive = np.sign(volts) * np.maximum(np.abs(volts) - world.dead_band, 0.0)
    x = water = 0.0
    out = np.empty((2, volts.size))
    for i, v in enumerate(drive.tolist()):
        out[:, i] = x, water
        push = (v * abs(v) - x * abs(x)) / TOP if world.squared else v - x
        x = x + world.step / world.lag * push if world.lag else v
        water += world.step / 0.6 * (x - water)
        if world.after or not world.lag:
            out[:, i] = x, water
    return out[0], out[1]


def logged(world: World, seed: int) -> Recording:
    """Two minutes of it."""
    rng = np.random.default_rng(seed)
    t = world.step * np.arange(round(120.0 / world.step))
    levels = rng.uniform(-TOP, TOP, 25).round(1)
    levels[0] = 0.0
    volts = TOP * np.sin(2 * np.pi * t / 30) if world.sine else levels[(t / HOLD + 1e-9).astype(int)]
    x, water = turned(world, volts)
    force = C * x * np.abs(x) * np.where(x < 0, world.reverse, 1.0) + world.inflow * C * np.abs(x) * (x - water)
    channels = [
        Channel("command_voltage", "command", "command_voltage", "V", t, volts),
        Channel("thrust", "cell", "thrust", "N", t, force + TARE + rng.normal(0.0, 0.1, t.size)),
    ]
    if world.measured:
        rate = RATE * x + rng.normal(0.0, 0.02, t.size)
        channels.append(Channel("rotation_rate", "tachometer", "rotation_rate", "rev/s", t, rate))
    return Recording(f"euler-{seed}", "T", tuple(channels), source=f"euler-{seed}.h5")


LAG = ("motor_lag",)
BOTH = {"dead_band": 0.8, "reverse": 0.8}
NAMES = ("motor_lag", "dead_band", "asymmetry")
CASES: dict[str, tuple[World, tuple[str, ...]]] = {
    "lag": (World(), LAG),
    "lag, row first": (World(after=False), LAG),
    "dead band": (World(dead_band=0.8), ("motor_lag", "dead_band")),
    "both": (World(**BOTH), NAMES),
    "both, no rate": (World(**BOTH, measured=False), NAMES),
    "both, 20 Hz": (World(**BOTH, step=0.05), NAMES),
    "both, 20 Hz, no rate": (World(**BOTH, step=0.05, measured=False), NAMES),
    "both, 100 Hz": (World(**BOTH, step=0.01), NAMES),
    "both, sine": (World(**BOTH, sine=True), NAMES),
    "inflow": (World(inflow=0.3), ("motor_lag", "inflow_dynamics")),
    "inflow, no rate": (World(inflow=0.3, measured=False), ("motor_lag", "inflow_dynamics")),
    "no lag": (World(lag=0.0, dead_band=0.8), ("dead_band",)),
    "squared": (World(squared=True), LAG),
    "squared, dead band": (World(squared=True, dead_band=0.8), ("motor_lag", "dead_band")),
}


def asked(name: str, world: World, wanted: tuple[str, ...], seed: int) -> int:
    """1 where it is as concealed; prints the line."""
    recording, before = logged(world, seed), process_time()
    found = diagnose([recording])
    assert isinstance(found, Diagnosis), found
    ok = found.unexplained is None and {f.effect for f in found.findings} - {"time_skew"} == set(wanted)
    named = "; ".join(
        f"{f.effect} {' '.join(f'{k}={v.value:.4g}' for k, v in f.parameters.items())}" for f in found.findings
    )
    errors = f"{found.heldout.before:.3g} -> {found.heldout.after:.3g} N"
    spent = process_time() - before
    print(f"{'ok' if ok else 'no'} {spent:5.1f} s  {name}: {found.verdict}: {named}; {errors}", flush=True)
    return int(ok)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE", help="names that begin so")
    parser.add_argument("--seed", type=int, default=3)
    told = parser.parse_args()
    chosen = {k: v for k, v in CASES.items() if not told.cases or k.startswith(tuple(told.cases))}
    right = sum(asked(name, world, wanted, told.seed) for name, (world, wanted) in chosen.items())
    print(f"{right} of {len(chosen)} as concealed")


if __name__ == "__main__":
    main()
