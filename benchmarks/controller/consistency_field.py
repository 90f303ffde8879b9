"""Does the check of command against rotation, current and thrust let sound thrusters run? Worlds of the field's ranges.

    python benchmarks/controller/consistency_field.py [WORLDS [FIRST]]

Each world has some or all of the effects of a test stand (dead band to 10 %, asymmetry to 40 %, winding loss to 35 %,
lag to 0.3 s, inflow, heating and recirculation to 8 %), a drawn thruster, bench, noise and plan, and is run whole over
real bytes in virtual time. Printed are what was drawn, the outcome, and at the end how many tripped.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from rig.cli import record_in_virtual_time
from sim_devices.bench.virtual import VirtualBench
from sim_devices.concealed.cases.field_size import FIELD, of_field_size
from sim_devices.recorded.benches import BENCHES
from sim_devices.recorded.draw import PLANS, Drawn, drawn
from sim_devices.recorded.run import run

SEED = 1923


def world(number: int, duration: float = 0.0) -> Drawn:
    """Every third has all effects, every second a rotor with inertia of its own; `duration` s, 0: drawn."""
    rng = np.random.default_rng([SEED, number])
    on, plan = tuple(BENCHES)[number % len(BENCHES)], PLANS[number // len(BENCHES) % len(PLANS)]
    made = drawn(rng, on, plan=plan, duration=duration)
    case = made.case
    if number % 2:
        case = replace(case, thruster=replace(case.thruster, rotor="servo"))
    effects = [effect for effect in FIELD if number % 3 == 0 or rng.random() < 0.5]
    return replace(made, case=replace(case, effects=of_field_size(effects, case, rng)))


def checked(campaign: Path, folder: Path, bench: VirtualBench, stamp: tuple[str, str]) -> tuple[Path, int]:
    """`record`, with the check that a concealed case leaves out."""
    file = campaign.parent / "bench.toml"
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    file.write_text("".join(line for line in lines if "consistency" not in line), encoding="utf-8")
    return record_in_virtual_time(campaign, folder, bench, stamp)


def outcome(made: Drawn, folder: Path) -> str:
    """Empty, or why the run did not complete."""
    try:
        run(made, folder, checked)
    except RuntimeError as error:
        return str(error)
    return ""


def main(worlds: int = 40, first: int = 0) -> None:
    tripped = 0
    for number in range(first, first + worlds):
        made = world(number)
        amounts = ", ".join(f"{each.shape.effect} {each.amount:.3g}" for each in made.case.effects)
        with TemporaryDirectory() as folder:
            cause = outcome(made, Path(folder) / "run")
        tripped += bool(cause)
        print(f"{number:4d} {made.bench.name} {made.campaign.plan}: {amounts}: {cause or 'completed'}", flush=True)
    print(f"{worlds} worlds of the field's ranges, {tripped} tripped")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
