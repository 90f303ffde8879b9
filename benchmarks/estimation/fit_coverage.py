"""Monte Carlo figures of `rig fit`: does the 95 % interval of C cover, how often is a true model called underfitted?

    python benchmarks/estimation/fit_coverage.py [RUNS]

Beside it the coverage of the plain alternative (s / sqrt(n) per hold, `numpy.linalg.lstsq`) and the CPU time of a fit.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from identification.recording import Recording
from identification.thruster.thrust import ThrustFit, fit_thrust
from tests.identification.thrust_runs import ar1, flicker, level_table, sine, staircase, white

LEVELS = (0.0, 9.0, -9.0, 18.0, -18.0, 0.0, 13.0, -13.0)
TRUTH = 0.4


def naive_covers(run: Recording) -> bool:
    """Means of whole holds with s / sqrt(n) as if samples were independent, 1.96 sigma."""
    cell = run.channels[1]
    means, errors = [], []
    for step in run.steps:
        _, value = cell.window(step.t_start, step.t_end)
        means.append(value.mean())
        errors.append(value.std(ddof=1) / np.sqrt(value.size))
    V = np.array([step.command_voltage for step in run.steps])
    W = 1 / np.array(errors)
    A = np.column_stack([V * np.abs(V), np.ones(V.size)]) * W[:, None]
    theta, *_ = np.linalg.lstsq(A, np.array(means) * W, rcond=None)
    return bool(abs(theta[0] - TRUTH) <= 1.96 * np.sqrt(np.linalg.inv(A.T @ A)[0, 0]))


def row(name: str, make: Callable[[np.random.Generator], Recording], runs: int) -> None:
    rng = np.random.default_rng(2024)
    covered, naive, underfitted, spent = 0, 0, 0, 0.0
    std, error = [], []
    for _ in range(runs):
        run = make(rng)
        start = process_time()
        fit = fit_thrust([run])
        spent += process_time() - start
        assert isinstance(fit, ThrustFit)
        p = fit.parameters["C"]
        covered += p.low <= TRUTH <= p.high
        std.append(p.std)
        error.append(p.value - TRUTH)
        underfitted += fit.estimate.underfit is not None and fit.estimate.underfit.underfitted
        naive += naive_covers(run) if run.steps else 0
    plain = f"{naive / runs:6.3f}" if run.steps else "     -"
    ratio = np.median(std) / np.std(error)
    print(
        f"{name:34s}{covered / runs:8.3f}{plain:>10s}{ratio:10.2f}{underfitted / runs:11.3f}{1e3 * spent / runs:10.1f}"
    )


def levels(rng: np.random.Generator) -> Recording:
    V = np.array(LEVELS * 2)
    return level_table(V, TRUTH * V * np.abs(V) + 1.5 + 0.3 * rng.standard_normal(V.size))


def main(runs: int) -> None:
    print(f"{runs} runs each{'':25s}covered  1.96 sem  std/true underfit  CPU ms")
    for name, noise in (("white", white), ("AR(1) 0.9", ar1(0.9)), ("1/f to 10 holds", flicker(10 / 8))):
        for hold in (1.0, 4.0):
            make = partial(staircase, noise=noise, hold=hold, rate=100.0, levels=LEVELS)
            row(f"{name}, holds of {round(100 * hold)} samples", lambda r, make=make: make(rng=r), runs)
    row("settling 0.15 s, white", lambda r: staircase(tau=0.15, hold=3.0, rate=100.0, levels=LEVELS, rng=r), runs)
    row("sine, AR(1) 0.9", lambda r: sine(noise=ar1(0.9), rng=r), runs)
    row("level table, 16 rows", levels, runs)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
