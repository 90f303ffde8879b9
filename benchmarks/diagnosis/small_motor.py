"""A simulator that shares nothing with the simulated world: what the diagnosis says of its CSV files.

    python benchmarks/diagnosis/small_motor.py [CASE ...] [--amplifier-told] [--keep FOLDER]

A small motor on a bench supply, by the equations of its winding, rotor and water, stepped by hand at 1 ms; its log is
written as a laboratory would (100 rows a second, rpm, rounded columns), imported by `rig import` and asked by
`rig diagnose`, each a process of its own. The motor loses six tenths of the largest voltage in its winding, its force
goes through an amplifier of 10 ms that no recording mentions (`--amplifier-told`: the map does), and each case has one
thing or two more. Told: what was put in, what was named, the error on what was not fitted before and after, and the
noise that was put in.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

RIG = (sys.executable, "-c", "from rig.cli import entry; entry()")
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
STEP, EVERY, SECONDS, HOLD, TOP = 1e-3, 10, 300.0, 3.0, 16.0
"""s a step, steps a row, s of a run, s of a level, V."""
AMBIENT = 20.0
MAP = """about = "small motor on a bench supply"
[time]
column = "time_s"
[streams.drive.channels.command_voltage]
quantity = "command_voltage"
unit = "V"
column = "command_V"
[streams.cell.channels.thrust]
quantity = "thrust"
unit = "N"
column = "thrust_N"
"""
TOLD = """low_pass = {seconds:g}
"""
WITH_RATE = """[streams.motor.channels.rotation_rate]
quantity = "rotation_rate"
unit = "rpm"
column = "rpm"
[streams.motor.channels.current]
quantity = "current"
unit = "A"
column = "current_A"
"""


@dataclass(frozen=True)
class Motor:
    """One case; SI. What is 0 or 1 is not there."""

    seed: int
    friction: float = 0.0
    """N m, dry."""
    reverse: float = 1.0
    """Thrust in reverse, of that ahead at the same rate."""
    water: float = 0.0
    """Of the thrust, lost once the water has followed."""
    warming: float = 0.0
    """K/J of the winding, which cools in a minute."""
    jump: tuple[float, float] = (0.0, 0.0)
    """s, N: of the zero."""
    rate: bool = True
    resistance: float = 0.35
    constant: float = 0.018
    inertia: float = 2e-4
    drag: float = 4e-6
    thrust: float = 3.2e-4
    amplifier: float = 0.01
    noise: float = 0.08

    def levels(self) -> Iterator[float]:
        rng = np.random.default_rng([self.seed, 1])
        yield from [0.0, *np.round(rng.uniform(-TOP, TOP, int(SECONDS / HOLD) - 1), 1).tolist()]


CASES = {
    "winding": (Motor(1), "winding_resistance motor_lag"),
    "winding, no rate": (Motor(2, rate=False), "winding_resistance motor_lag"),
    "dry friction": (Motor(3, friction=0.03), "winding_resistance motor_lag dead_band"),
    "reverse, water": (
        Motor(4, reverse=0.8, water=0.25),
        "winding_resistance motor_lag asymmetry inflow_dynamics",
    ),
    "warm winding": (Motor(5, warming=0.01), "winding_resistance motor_lag heating"),
    "reverse, friction, no rate": (
        Motor(6, friction=0.03, reverse=0.85, rate=False),
        "winding_resistance motor_lag dead_band asymmetry",
    ),
    "jump of the zero, no rate": (
        Motor(7, jump=(170.0, 0.25), rate=False),
        "winding_resistance motor_lag zero_offset",
    ),
    "nothing but the drive": (
        Motor(8, resistance=1e-6, inertia=1e-9, amplifier=STEP, rate=False),
        "",
    ),
}
"""Name: what is simulated, and the effects of the catalogue that a person would name."""


def turned(motor: Motor) -> Iterator[tuple[float, float, float, float]]:
    """Command in V, rate in rad/s, current in A and force behind the amplifier in N, every STEP."""
    rate = water = shown = 0.0
    warm = AMBIENT
    for volts in motor.levels():
        for _ in range(int(HOLD / STEP)):
            resistance = motor.resistance * (1 + 0.0039 * (warm - AMBIENT))
            current = (volts - motor.constant * rate) / resistance
            rate = _faster(motor, rate, current, volts)
            water += STEP / 0.5 * (motor.water * rate - water)
            share = (motor.reverse if rate < 0 else 1.0) * (1 - water / rate if abs(rate) > 1 else 1.0)
            shown += STEP / motor.amplifier * (motor.thrust * share * rate * abs(rate) - shown)
            warm += STEP * (motor.warming * current**2 * resistance - (warm - AMBIENT) / 60.0)
            yield volts, rate, current, shown


def _faster(motor: Motor, rate: float, current: float, volts: float) -> float:
    """The rate a step later; one without winding and inertia is where its voltage has it."""
    if motor.resistance < 1e-3:
        return volts / motor.constant
    torque = motor.constant * current - motor.drag * rate * abs(rate)
    if motor.friction and abs(rate) < 0.5 and abs(torque) < motor.friction:
        return 0.0
    way = np.sign(rate if abs(rate) >= 0.5 else torque)
    return rate + STEP * (torque - motor.friction * float(way)) / motor.inertia


def write(motor: Motor, path: Path) -> None:
    """Its log."""
    rng = np.random.default_rng([motor.seed, 2])
    rows = np.array(list(turned(motor)))[::EVERY]
    time = STEP * EVERY * np.arange(len(rows))
    thrust = rows[:, 3] + 0.3 + motor.noise * rng.standard_normal(time.size)
    thrust += motor.jump[1] * (time > motor.jump[0])
    rpm = rows[:, 1] * 30 / np.pi + 3 * rng.standard_normal(time.size)
    current = rows[:, 2] + 0.02 * rng.standard_normal(time.size)
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["time_s", "command_V", "thrust_N", "rpm", "current_A"])
        for t, (volts, *_), F, n, i in zip(time, rows, thrust, rpm, current, strict=True):
            table.writerow([f"{t:.3f}", f"{volts:.1f}", f"{F:.3f}", f"{n:.0f}", f"{i:.2f}"])


def rig(words: Sequence[object]) -> None:
    subprocess.run([*RIG, *map(str, words)], check=True, env={**os.environ, **ONE_THREAD}, stdout=subprocess.DEVNULL)


def asked(name: str, folder: Path, *, told: bool) -> str:
    """A row of the table. `told`: the map says what the amplifier does."""
    motor, truth = CASES[name]
    stem = folder / name.replace(", ", "-").replace(" ", "_")
    write(motor, stem.with_suffix(".csv"))
    stem.with_suffix(".toml").write_text(
        MAP + (TOLD.format(seconds=motor.amplifier) if told else "") + (WITH_RATE if motor.rate else ""),
        encoding="utf-8",
    )
    rig(["import", stem.with_suffix(".csv"), "--map", stem.with_suffix(".toml"), "--thruster", "T1"])
    rig(["diagnose", stem.with_suffix(".h5"), "--json", stem.with_suffix(".json")])
    found = json.loads(stem.with_suffix(".json").read_text(encoding="utf-8"))
    named = [f["effect"] for f in found["findings"]]
    hidden = truth.split()
    more = [n for n in named if n not in hidden]
    missing = [n for n in hidden if n not in named]
    held = found["fit"]["heldout"]
    return (
        f"| {name} | {found['verdict']} | {len(hidden) - len(missing)} of {len(hidden)} | {', '.join(missing)} "
        f"| {', '.join(more)} | {held['rmse_before']:.3g} | {held['rmse_after']:.3g} | {motor.noise:.3g} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of {'; '.join(CASES)}")
    parser.add_argument("--amplifier-told", action="store_true")
    parser.add_argument("--keep", type=Path, metavar="FOLDER")
    wanted = parser.parse_args()
    print("| case | verdict | named | not named | named besides | before / N | after / N | noise put in / N |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = wanted.keep or Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        for case in wanted.cases or CASES:
            print(asked(case, folder, told=wanted.amplifier_told), flush=True)


if __name__ == "__main__":
    main()
