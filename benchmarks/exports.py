"""What each consumer of a twin loses: `rig export TWIN --to ...` for every word, compared at 200 commands.

    python benchmarks/exports.py TWIN.json

Printed: rms and worst in N and per cent of the largest thrust, whether the lag is carried, and beside it what the best
fit of that form leaves of Blue Robotics' published T200 table at 18 V (201 rows, 59 N): a shape with a wide dead band
and unequal directions.
"""

from __future__ import annotations

import time
from pathlib import Path

import click

from rig.errors import RigError
from rig.exporting.targets import TARGETS, TWIN
from rig.exporting.twins.curve import curve_of
from rig.exporting.twins.written import Asked, loss_of
from rig.twin.reading import read_twin
from rig.workers.called import called

PUBLISHED = {
    "table": "41 points: 0.2 %",
    "c-header": "41 points: 0.2 %",
    "stonefish": "41 points: 0.2 %",
    "uuv": "41 points: 0.2 %; Bessa 2.1 %, C u|u| 6.3 %",
    "gz-sim-rate": "C n|n|: 5.0 %",
    "auv-polynomial": "degree 5: 3.2 % (of the pulse), 3: 5.7 %",
    "ardusub": "expo, start, each way: 0.8 %; released firmware: 9.4 %",
    "px4": "f u^2 + (1-f) u: 5.3 %",
    "mss": "C+- n|n|: 1.0 %",
    "pvs": "C+- n|n|: 1.0 %",
    "holoocean": "clipped at 28.75 N",
}


@click.command(context_settings={"help_option_names": ["-h", "--help"]}, help=__doc__)
@click.argument("path", type=click.Path(path_type=Path), metavar="TWIN")
def main(path: Path) -> None:
    begun = time.perf_counter()
    twin = read_twin(path)
    asked = Asked(twin, curve_of(twin), path.name)
    curve = asked.curve
    print(f"{curve.thruster}: {curve.quantity}, sampled in {time.perf_counter() - begun:.2f} s; lag {curve.lag:.3g} s")
    print(f"{'--to':18}{'rms / N':>9}{'%':>7}{'worst / N':>11}  {'lag':5}published table, best fit of the form")
    for word, target in TARGETS.items():
        if target.of != TWIN:
            continue
        try:
            carried = called(target.carried)(asked)
            loss = loss_of(carried, curve)
        except RigError as error:
            print(f"{word:18}{error}")
            continue
        lag = "yes" if carried.lag else "no"
        beside = PUBLISHED.get(word, "")
        print(f"{word:18}{loss.rms:9.3g}{100 * loss.share:7.2g}{loss.worst:11.3g}  {lag:5}{beside}")


if __name__ == "__main__":
    main()
