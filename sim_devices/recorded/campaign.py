"""A campaign of a few minutes for one thruster: the two files that the rig reads, and about what it will command."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim_devices.concealed.cases.knob import Scale
from sim_devices.concealed.cases.plans import Profile, Writer
from sim_devices.recorded.benches import BUS, CELL, FLOW, MOTOR, Bench, toml

Rng = np.random.Generator

PLANS = ("staircase", "interleaved", "random", "sine")
TARE, REST = 2.0, 2.0
"""s of a tare, and of the rest before it."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """A campaign for one thruster as it was drawn: its levels, and how it comes to each."""

    plan: str
    slew: float
    """V/s"""
    dwell: float
    """s"""
    levels: tuple[float, ...]
    """V, in order; of a sine none."""
    zero_every: int
    frequencies: tuple[float, ...] = ()
    """Hz, of sines at full command."""
    cycles: int = 1


def campaign(plan: str, top: float, duration: float, rng: Rng) -> Campaign:
    """About `duration` s at up to `top` V. Raises ValueError for a plan that is not of PLANS."""
    slew = top / float(rng.uniform(0.3, 2.0))
    count = int(rng.integers(4, 9))
    up = np.round(np.linspace(top / count, top, count), 2)
    match plan:
        case "staircase":
            once = np.concatenate([up, up[-2::-1], -up, -up[-2::-1]])
        case "interleaved":
            once = np.stack([up, -up], axis=1).ravel()
        case "random":
            once = rng.permutation(np.concatenate([up, -up]))
        case "sine":
            slowest = 1.2 * 2.0 * np.pi * top / slew  # s: no faster than the slew
            frequencies = tuple(round(1.0 / float(p), 4) for p in slowest + rng.uniform(6.0, 30.0, 3))
            cycles = max(round(duration / sum(1.0 / f for f in frequencies)), 1)
            return Campaign(plan, slew, 1.0, (), 1, frequencies, cycles)
        case _:
            raise ValueError(f"plan must be one of {', '.join(PLANS)}, got {plan!r}")
    dwell = float(rng.uniform(1.5, 5.0))
    rounds = max(round(duration / (once.size * (dwell + 0.5))), 1)
    levels = tuple(float(v) for v in np.tile(once, rounds))
    return Campaign(plan, slew, round(dwell, 2), levels, int(rng.integers(4, 13)))


def expected(made: Campaign, top: float, loop_rate: float, dt: float) -> Profile:
    """About the command that the rig will give, on a grid of `dt` s: what strengths are searched by."""
    w = Writer(1.0 / loop_rate, made.slew, dt)
    w.hold(0.0, TARE, "tare")
    for i, volts in enumerate(made.levels, 1):
        w.hold(volts, made.dwell)
        if i % made.zero_every == 0 or i == len(made.levels):
            w.hold(0.0, REST + TARE, "rest")
    for frequency in made.frequencies:
        turn = 2.0 * np.pi * frequency * w.tick
        w.follow(top * np.sin(turn * np.arange(int(made.cycles / frequency / w.tick))), "sine")
        w.hold(0.0, REST + TARE, "rest")
    return w.profile(made.plan)


def bench_file(bench: Bench, scale: Scale) -> str:
    """What the rig is told of the bench. Limits are far out: nothing that is concealed shall end a run."""
    facts = {"name": bench.name, "facility": "simulated", "motor": MOTOR, "force": CELL, "water_density": 1000.0}
    facts |= {"max_voltage": scale.voltage, "slew": 10.0 * scale.voltage, "loop_rate": bench.loop_rate}
    facts |= {"rest_rate": max(0.5, 0.05 * scale.rate), "coast_time": 15.0, "proof_voltage": 0.2 * scale.voltage}
    limit = toml({"min": -10.0 * scale.thrust, "max": 10.0 * scale.thrust})
    parts = [
        "[bench]\n" + toml(facts) + "consistency = false\n",
        f"[can.{BUS}]\n" + toml({"interface": "slcan", "channel": "can0", "bitrate": 500000}),
        f"[devices.{CELL}]\n{bench.cell.told}",
        f"[devices.{MOTOR}]\n{bench.motor}",
        *([f"[devices.{FLOW}]\n{bench.flow}"] if bench.flow else []),
        f'[limits."{CELL}.thrust"]\n{limit}max_frozen = inf\n',
        f'[limits."{MOTOR}.current"]\nmax = {10.0 * scale.current}\n',
        f'[overrides]\n"limits.{CELL}.thrust.max_frozen" = "a world without noise may stand still"\n'
        '"bench.consistency" = "what is concealed may contradict"\n',
    ]
    return "\n".join(parts)


def campaign_file(made: Campaign, thruster: str, scale: Scale, bench: str = "bench.toml") -> str:
    """What the rig is asked for."""
    facts = {"name": made.plan, "bench": bench, "output": "recordings", "operator": "nobody"}
    switches = f"thrusters = ['{thruster}']\nunattended = true\nprove_watchdog = false\n"
    tare = {"duration": TARE, "max_std_error": scale.thrust, "max_drift": scale.thrust}
    plan: dict[str, object] = {"slew": made.slew, "rest": REST, "zero_every": made.zero_every}
    if made.plan == "sine":
        plan |= {"kind": "sine", "amplitude": scale.voltage, "frequencies": list(made.frequencies)}
        plan |= {"cycles": made.cycles}
    else:
        plan |= {"kind": "levels", "voltages": list(made.levels)}
    dwell = toml({"kind": "fixed", "duration": made.dwell, "settle": 0.5})
    return "\n".join(
        [
            "[campaign]\n" + toml(facts) + switches,
            "[watch]\noff = true\n",
            "[tare]\n" + toml(tare),
            "[plan]\n" + toml(plan) + "[plan.dwell]\n" + dwell,
            '[overrides]\n"campaign.prove_watchdog" = "a run is what is asked for"\n',
        ]
    )
