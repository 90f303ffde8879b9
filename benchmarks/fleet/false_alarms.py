"""How often control charts of a sound production alarm, and where they see the beginning of a drift: on figures alone.

    python benchmarks/fleet/false_alarms.py [--fleets 200] [--units 2000]

Each fleet has a spread of 1.5 %, eight calibrations that share an error of 0.5 %, and a scatter of its own. Then one
unit is 12 % off and a tenth of the production falls by 5 % over its length.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from identification.control_charts.charts import chart, limit_for

SPREAD, SHARED, OWN, CALIBRATIONS = 0.015, 0.005, 0.0025, 8
ODD, FALL, FIRST, LAST = 0.12, -0.05, 0.6, 0.7
"""Shares; the last two of the production, where the stretch begins and ends."""


def main() -> None:
    known = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    known.add_argument("--fleets", type=int, default=200)
    known.add_argument("--units", type=int, default=2000)
    asked = known.parse_args()
    n, limit = asked.units, limit_for(asked.units, 2)
    first, last = round(FIRST * n), round(LAST * n)
    alarms, odd, begun, false = 0, 0, [], 0
    for seed in range(asked.fleets):
        rng = np.random.default_rng(seed)
        group = np.arange(n) * CALIBRATIONS // n
        value = 1.0 + SPREAD * rng.standard_normal(n) + SHARED * rng.standard_normal(CALIBRATIONS)[group]
        value += OWN * rng.standard_normal(n)
        rest = (np.full(n, OWN), group.astype(float), np.full(n, SHARED), limit)
        sound = chart(value, *rest)
        alarms += bool(sound.outside.any() or sound.stretches)
        value[n // 20] += ODD
        value[first:last] += FALL * np.linspace(0.0, 1.0, last - first)
        found = chart(value, *rest)
        odd += bool(found.outside[n // 20])
        hit = [s for s in found.stretches if s.first < last and s.last >= first]
        begun += [s.first - first for s in hit[:1]]
        false += len(found.stretches) - len(hit)
    print(f"sound fleets of {n} units that alarm: {alarms} of {asked.fleets} (5 % allowed)")
    print(f"the odd unit is outside in {odd} of {asked.fleets}; the drift is seen in {len(begun)}, others in {false}")
    off, most = np.median(begun), np.quantile(np.abs(begun), 0.9)
    print(f"its beginning is told off by {off:+.0f} units (median), {most:.0f} (90 %)")


if __name__ == "__main__":
    main()
