"""Vehicles with one effect concealed, and clean ones, diagnosed from their recordings alone; truth apart.

    python benchmarks/diagnosis/diagnose_vehicle.py [SEEDS [STRENGTH [EFFECT ...]]]

Each effect once per seed at STRENGTH times its plain strength (tests/concealed/vehicles.py). `named`: among the
findings and no other effect beside it; `with more`: beside others; `rival`: only among the rivals; `wrong`: another
name stands for it; `unexplained`: withheld. `clean`: nothing concealed, `adequate` is right.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.vehicle.diagnose import diagnose_vehicle
from tests.concealed.vehicles import PLAIN, case, recordings, setup


def judged(effect: str, found: Diagnosis) -> str:
    names = [f.effect for f in found.findings]
    rivals = [r.effect for f in found.findings for r in f.rivals]
    if not effect:
        return "adequate" if found.verdict == "adequate" else "false alarm"
    if effect in names:
        return "named" if len(set(names)) == 1 and found.unexplained is None else "with more"
    if effect in rivals:
        return "rival"
    if names:
        return "wrong"
    return "unexplained" if found.verdict == "unexplained" else "missed"


def main(seeds: int, strength: float, effects: list[str]) -> None:
    counts: Counter[str] = Counter()
    for name in effects or [*PLAIN, ""]:
        for seed in range(seeds):
            rng = np.random.default_rng([seed, sum(map(ord, name))])
            one = case(rng, name, strength)
            made, known = recordings(one, rng), setup(one, rng)
            begin = process_time()
            found = diagnose_vehicle(made, setup=known)
            seconds = process_time() - begin
            if not isinstance(found, Diagnosis):
                raise SystemExit(found.reason)
            how = judged(one.effect, found)
            counts[how] += 1
            told = "; ".join(f.statement for f in found.findings) or "-"
            held = found.heldout
            print(
                f"{name or 'clean':32s}{how:12s}{found.verdict:12s} held out {held.before:.3g} -> {held.after:.3g} ",
                end="",
            )
            print(f"({held.noise:.2g} {found.unit})  {seconds:.0f} s  {told}", flush=True)
            for rival in (r for f in found.findings for r in f.rivals):
                print(f"{'':32s}or {rival.effect} ({rival.bic_loss:.1f}): {rival.statement}")
            if found.unexplained is not None:
                print(f"{'':32s}{found.unexplained.statement}")
    print(", ".join(f"{how} {number}" for how, number in counts.most_common()))


if __name__ == "__main__":
    arguments = sys.argv[1:]
    main(
        int(arguments[0]) if arguments else 1,
        float(arguments[1]) if len(arguments) > 1 else 1.0,
        arguments[2:],
    )
