"""Ten simulated vehicles, parameters drawn at random, identified from their recordings alone.

    python benchmarks/estimation/blind_vehicle.py [VEHICLES [SEED]]

z = (estimate - truth) / stated standard deviation. Parameters of one fit are correlated, so the sum that has a
chi-square law is the squared Mahalanobis distance of a fit; axes of one vehicle share thrusters and the gain of the
tunnel's cell, so it is summed over vehicles axis by axis. `--comparators` adds the other
ways to the inertia of surge: Savitzky and Golay, Kalman filter, simulated annealing.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import process_time

import numpy as np
from scipy.stats import chi2

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.identification.vehicle.vehicle_world import AXES, DRAWN, compared, distance, drawn, identify, truth_of

SHOWN = ("m", "k", "k2", "eta_hull", "eta_pair", "current_north", "current_east", "buoyancy[heave-1]")


def table(vehicles: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    print(f"{'':12s}{'':7s}{'parameter':20s}{'truth':>10s}{'estimate':>10s}{'std':>9s}{'z':>7s}")
    total, dof = dict.fromkeys(AXES, 0.0), dict.fromkeys(AXES, 0)
    zs, spent = [], 0.0
    for number in range(vehicles):
        hull, vehicle = drawn(rng, number)
        begin = process_time()
        found = identify(hull, vehicle, rng)
        spent += process_time() - begin
        for axis in AXES:
            both = found.inertia[axis].estimate
            wanted = [name for name in SHOWN if name in both.names]
            part, truth = both.select(wanted), truth_of(hull, axis, wanted)
            std = np.sqrt(np.diag(part.cov))
            for name, true, value, s in zip(wanted, truth, part.mean, std, strict=True):
                z = (value - true) / s
                zs.append(z)
                print(f"vehicle {number + 1:<4d}{axis:7s}{name:20s}{true:10.4g}{value:10.4g}{s:9.2g}{z:7.2f}")
            own = found.own(axis)
            total[axis] += distance(own, truth_of(hull, axis, own.names))
            dof[axis] += len(own.names)
    print(f"{len(zs)} z: mean {np.mean(zs):.2f}, standard deviation {np.std(zs):.2f}, largest {np.abs(zs).max():.2f}")
    for axis in AXES:
        p = chi2.sf(total[axis], dof[axis])
        print(f"{axis:7s}chi-square {total[axis]:.1f} with {dof[axis]} degrees of freedom, p = {p:.3f}")
    print(f"CPU time {spent / vehicles:.1f} s a vehicle, simulation included")


def comparators(seed: int) -> None:
    print(f"{'inertia of surge by':36s}{'m':>9s}{'std':>8s}{'truth':>9s}{'rmse m':>9s}{'CPU s':>8s}")
    for name, fit, truth, seconds in compared(np.random.default_rng(seed)):
        rmse = float(np.sqrt(np.mean([v.rmse**2 for v in fit.validation])))
        m, std = fit.estimate["m"], fit.estimate.std_of("m")
        print(f"{name:36s}{m:9.1f}{std:8.1f}{truth:9.1f}{rmse:9.4f}{seconds:8.1f}")


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[1:] if text.isdigit()]
    table(numbers[0] if numbers else DRAWN, numbers[1] if len(numbers) > 1 else 2024)
    if "--comparators" in sys.argv:
        comparators(numbers[1] if len(numbers) > 1 else 2024)
