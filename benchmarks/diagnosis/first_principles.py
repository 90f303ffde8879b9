"""A thruster from first principles, by integrators that are no one else's here, and what `rig diagnose` says of it.

    python benchmarks/diagnosis/first_principles.py [CASE ...] [--plan steps] [--plan stairs] [--seed 0]
    python benchmarks/diagnosis/first_principles.py --again    the first five effects as a twin, then one thing changed

Nothing of sim_devices/concealed is in it: rotor, water, stand and cell are differential equations of 1 ms, forces are
interpolated at scattered sample times, and noise is white unless a case says otherwise. One line for each run: seconds,
what was concealed, the verdict, and the names with their values; `ok` where the names are what was concealed, all of
it and no more (of what no catalogue has: where something is left and nothing but the rest has a name).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from time import process_time

import numpy as np
from scipy.signal import lsim

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from identification.recording import Channel, Floats, Recording
from identification.twin import Twin

STEP, TICK, DURATION, TOP = 0.001, 0.02, 90.0, 12.0
C, RATE, TARE = 0.25, 1.3, 0.3
PLANS = ("steps", "stairs", "sine", "ramp")


@dataclass(frozen=True)
class World:
    """Sizes of what C V|V| leaves out; 0: absent."""

    lag: float = 0.0
    """s, of tau n' = V - n - a n|n|."""
    loss: float = 0.0
    """Share of the largest voltage that the winding takes: a n|n| there."""
    dead_band: float = 0.0
    """V."""
    drive_limit: float = 0.0
    """Of the largest voltage."""
    asymmetry: float = 0.0
    exponent: float = 2.0
    linear: float = 0.0
    inflow: tuple[float, float] = (0.0, 1.0)
    """Share, and s until the water has followed."""
    cavitation: tuple[float, float] = (0.0, 0.0)
    """Onset as a share of the largest rate, and loss for each further share."""
    stand: tuple[float, float] = (0.0, 0.0)
    """Hz, damping."""
    creep: tuple[float, float] = (0.0, 1.0)
    """Share, s."""
    even: float = 0.0
    """Of the largest force, as F^2."""
    cubic: float = 0.0
    hysteresis: float = 0.0
    """Half width, of the largest force."""
    stop: float = 0.0
    """Force at which the cell meets its stop, of the largest; its zero is set behind it."""
    jump: tuple[float, float] = (0.0, 0.0)
    """Of the zero: of the largest force, when as a share of the run."""
    late: float = 0.0
    """s by which the force is stamped."""
    low_pass: float = 0.0
    """s, which the recording does not say."""
    correlated: float = 0.0
    """s, time constant of half of the noise."""
    heavy: bool = False
    """Noise of Student's law with three degrees of freedom."""
    quantum: float = 0.0
    """N."""
    hum: float = 0.0
    """Hz, as large as the noise."""
    noise: float = 0.002
    """Of the largest force."""


def commanded(plan: str, rng: np.random.Generator) -> Floats:
    """(K,) V, one each TICK."""
    t = np.arange(0.0, DURATION, TICK)
    if plan == "steps":
        hold = rng.uniform(1.5, 4.0)
        levels = rng.uniform(-1.0, 1.0, int(DURATION / hold) + 2)
        levels[:5] = 0.0, 0.03, -0.07, 0.1, -0.03  # on either side of a dead band, in every run
        return np.asarray(TOP * levels[(t / hold).astype(int)])
    if plan == "stairs":
        up = np.linspace(-1.0, 1.0, 9)
        levels = np.concatenate([[0.0], up[4:], up[::-1], up])
        return np.asarray(TOP * levels[np.minimum((t * levels.size / DURATION).astype(int), levels.size - 1)])
    period = rng.uniform(10.0, 25.0)
    wave = np.sin(2 * np.pi * t / period)
    return np.asarray(TOP * (wave * np.minimum(1.0, t / 5.0) if plan == "sine" else 2 / np.pi * np.arcsin(wave)))


def turned(world: World, volts: Floats) -> Floats:
    """(N,) rate in volts of the steady state, by Runge and Kutta."""
    a = world.loss / ((1 - world.loss) ** 2 * TOP)
    if not world.lag:
        size = np.abs(volts)
        return np.sign(volts) * (size if not a else (np.sqrt(1 + 4 * a * size) - 1) / (2 * a))
    out, n = np.empty(volts.size), 0.0
    for i, v in enumerate(volts.tolist()):
        out[i] = n

        def slope(x: float, v: float = v) -> float:
            return (v - x - a * x * abs(x)) / world.lag

        one = slope(n)
        two = slope(n + 0.5 * STEP * one)
        three = slope(n + 0.5 * STEP * two)
        n += STEP / 6 * (one + 2 * two + 2 * three + slope(n + STEP * three))
    return out


def behind(value: Floats, tau: float) -> Floats:
    return np.asarray(lsim(([1.0], [tau, 1.0]), value, STEP * np.arange(value.size))[1])


def pushed(world: World, n: Floats) -> Floats:
    """(N,) N of the water."""
    size = np.abs(n)
    force = C * np.sign(n) * size**world.exponent * TOP ** (2 - world.exponent) + world.linear * C * TOP * n
    force = np.where(n < 0, (1 - world.asymmetry) * force, force)
    share, tau = world.inflow
    force = force + (share * C * size * (n - behind(n, tau)) if share else 0.0)
    onset, lost = world.cavitation
    return np.asarray(force * (1 - np.clip(lost * (size / TOP - onset), 0.0, 0.9)))


def shown(world: World, force: Floats) -> Floats:
    """(N,) N of stand and cell."""
    largest, time = float(np.max(np.abs(force))), STEP * np.arange(force.size)
    if world.stand[0]:
        w, z = 2 * np.pi * world.stand[0], world.stand[1]
        force = np.asarray(lsim(([w * w], [1.0, 2 * z * w, w * w]), force, time)[1])
    force = force + (world.creep[0] * behind(force, world.creep[1]) if world.creep[0] else 0.0)
    force = force + largest * (world.even * (force / largest) ** 2 + world.cubic * (force / largest) ** 3)
    if world.hysteresis:
        y, half, out = 0.0, world.hysteresis * largest, []
        for f in force.tolist():
            y = min(max(y, f - half), f + half)
            out.append(y)
        force = np.array(out)
    if world.stop:
        force = np.clip(force, -world.stop * largest, world.stop * largest)
    force = force + world.jump[0] * largest * (time > world.jump[1] * DURATION)
    return behind(force, world.low_pass) if world.low_pass else force


def noise(world: World, time: Floats, rng: np.random.Generator) -> Floats:
    """(K,) of unit size."""
    out = rng.standard_t(3, time.size) / np.sqrt(3) if world.heavy else rng.standard_normal(time.size)
    if world.correlated:
        keep, slow = np.exp(-np.diff(time, prepend=time[0]) / world.correlated), [0.0]
        for k, e in zip(keep[1:].tolist(), rng.standard_normal(time.size - 1).tolist(), strict=True):
            slow.append(k * slow[-1] + np.sqrt(1 - k * k) * e)
        out = np.sqrt(0.5) * (out + np.array(slow))
    return np.asarray(out + (np.sin(2 * np.pi * world.hum * time) if world.hum else 0.0))


def recording(world: World, plan: str, seed: int, *, measured: bool = True) -> Recording:
    """Ninety seconds of it; `measured`: with the rate of rotation."""
    rng = np.random.default_rng(seed)
    volts = commanded(plan, rng)
    time = STEP * np.arange(round(DURATION / STEP))
    reached = volts[np.minimum(((time + 1e-9) / TICK).astype(int), volts.size - 1)]
    reached = np.where(np.abs(reached) < world.dead_band, 0.0, reached)
    if world.drive_limit:
        reached = np.clip(reached, -world.drive_limit * TOP, world.drive_limit * TOP)
    n = turned(world, reached)
    force = shown(world, pushed(world, n))
    at = np.arange(0.0137, DURATION - 0.05, 0.01)
    at = at + rng.normal(0.0, 2e-4, at.size)
    read = np.interp(at - world.late, time, force) + TARE
    read = read + world.noise * float(np.max(np.abs(force))) * noise(world, at, rng)
    if world.quantum:
        read = np.round(read / world.quantum) * world.quantum
    channels = [
        Channel("command_voltage", "command", "command_voltage", "V", TICK * np.arange(volts.size), volts),
        Channel("thrust", "cell", "thrust", "N", at, read),
    ]
    if measured:
        told = np.arange(0.031, DURATION - 0.05, 0.02)
        rate = RATE * np.interp(told, time, n) + 0.02 * rng.standard_normal(told.size)
        channels.append(Channel("rotation_rate", "tachometer", "rotation_rate", "rev/s", told, rate))
    return Recording(f"{plan}-{seed}", "T", tuple(channels), source=f"{plan}-{seed}.h5")


LAGGING = World(lag=0.08)
FIVE = World(lag=0.1, loss=0.15, dead_band=0.5, asymmetry=0.15, inflow=(0.25, 0.6))
REST = None
"""Of a case: what is concealed is in no catalogue, or not said by the recording."""
CASES: dict[str, tuple[World, tuple[str, ...] | None]] = {
    "nothing": (World(), ()),
    "nothing, correlated": (World(correlated=0.3), ()),
    "nothing, heavy tails": (World(heavy=True), ()),
    "nothing, quantised": (World(quantum=0.2), ()),
    "hum": (World(hum=23.7), ("periodic_disturbance",)),
    "lag": (LAGGING, ("motor_lag",)),
    "lag, loss": (replace(LAGGING, loss=0.2), ("motor_lag", "winding_resistance")),
    "inflow": (replace(LAGGING, inflow=(0.3, 0.5)), ("motor_lag", "inflow_dynamics")),
    "dead band": (replace(LAGGING, dead_band=1.0), ("motor_lag", "dead_band")),
    "exponent": (replace(LAGGING, exponent=1.8), ("motor_lag", "exponent")),
    "linear": (replace(LAGGING, linear=0.05), ("motor_lag", "linear_term")),
    "cavitation": (replace(LAGGING, cavitation=(0.8, 0.8)), ("motor_lag", "cavitation")),
    "drive clips": (replace(LAGGING, drive_limit=0.9), ("motor_lag", "command_saturation")),
    "stand of 7 Hz": (replace(LAGGING, stand=(7.0, 0.03)), ("motor_lag", "stand_resonance")),
    "stand of 18 Hz": (replace(LAGGING, stand=(18.0, 0.05)), ("motor_lag", "stand_resonance")),
    "stand of 40 Hz": (World(lag=0.03, stand=(40.0, 0.02)), ("motor_lag", "stand_resonance")),
    "creep": (replace(LAGGING, creep=(0.01, 15.0)), ("motor_lag", "load_cell_creep")),
    "even bend": (replace(LAGGING, even=0.03), ("motor_lag", "load_cell_even_bend")),
    "cubic bend": (replace(LAGGING, cubic=-0.03), ("motor_lag", "load_cell_nonlinearity")),
    "hysteresis": (replace(LAGGING, hysteresis=0.005), ("motor_lag", "hysteresis")),
    "cell on its stop": (replace(LAGGING, stop=0.9), ("motor_lag", "load_cell_saturation")),
    "zero jumps": (replace(LAGGING, jump=(0.02, 0.4)), ("motor_lag", "zero_offset")),
    "late": (replace(LAGGING, late=0.02), ("motor_lag", "time_skew")),
    "low pass, not said": (replace(LAGGING, low_pass=0.03), REST),
    "five": (FIVE, ("motor_lag", "winding_resistance", "dead_band", "asymmetry", "inflow_dynamics")),
}
AGAIN: dict[str, tuple[World, tuple[str, ...]]] = {
    "nothing": (FIVE, ()),
    "asymmetry": (replace(FIVE, asymmetry=0.22), ("asymmetry",)),
    "dead band": (replace(FIVE, dead_band=1.5), ("dead_band",)),
    "stand of 12 Hz": (replace(FIVE, stand=(12.0, 0.06)), ("stand_resonance",)),
    "even bend": (replace(FIVE, even=0.02), ("load_cell_even_bend",)),
    "creep": (replace(FIVE, creep=(0.01, 15.0)), ("load_cell_creep",)),
    "late": (replace(FIVE, late=0.015), ("time_skew",)),
    "drive clips": (replace(FIVE, drive_limit=0.9), ("command_saturation",)),
}


def as_concealed(found: Diagnosis, wanted: tuple[str, ...] | None) -> bool:
    named = {f.effect for f in found.findings}
    if wanted is None:
        return found.unexplained is not None and named <= {"motor_lag", "time_skew"}
    return found.unexplained is None and named == set(wanted)


def asked(
    name: str, plan: str, made: Callable[[], Recording], wanted: tuple[str, ...] | None, twin: Twin | None
) -> int:
    """1 where it is as concealed; prints the line."""
    recorded, before = made(), process_time()
    found = diagnose([recorded], baseline=twin)
    if not isinstance(found, Diagnosis):
        print(f"no {name} {plan}: {found}", flush=True)
        return 0
    ok = as_concealed(found, wanted)
    named = "; ".join(
        f"{f.effect} {' '.join(f'{k}={v.value:.4g}' for k, v in f.parameters.items())}" for f in found.findings
    )
    spent = process_time() - before
    print(f"{'ok' if ok else 'no'} {spent:5.1f} s  {name}, {plan}: {found.verdict}: {named}", flush=True)
    return int(ok)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE", help="names that begin so")
    parser.add_argument("--plan", action="append", choices=PLANS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--again", action="store_true")
    told = parser.parse_args()
    twin = None
    if told.again:
        first = diagnose([recording(FIVE, "steps", told.seed + 1000)])
        assert isinstance(first, Diagnosis)
        twin = first.twin
    right = many = 0
    for i, (name, (world, wanted)) in enumerate((AGAIN if told.again else CASES).items()):
        if told.cases and not name.startswith(tuple(told.cases)):
            continue
        for j, plan in enumerate(told.plan or ["steps"]):
            seed = told.seed + 10 * i + j
            right += asked(name, plan, lambda w=world, p=plan, s=seed: recording(w, p, s), wanted, twin)
            many += 1
    print(f"{right} of {many} as concealed")


if __name__ == "__main__":
    main()
