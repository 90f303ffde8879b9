"""Monte Carlo of every estimator: bias, variance over the Cramér-Rao bound, coverage of the 68 and 95 % intervals.

    python benchmarks/estimation/estimators.py [RUNS] [--only NAME] [--noise NAME] [--list] [--markdown] [--stored]

RUNS (2000) data sets each, more where they are cheap. What was drawn is kept in build/estimators, so that a run that
was broken off goes on where it was, and a larger RUNS adds to a smaller one. `--only` takes a part of a name. `var/CRB`
and the coverages are taken from pairs: the estimator beside the one that attains the bound, on the same data
(tests/identification/estimation/monte_carlo.py); `alone` is the ratio without that help. `*` marks what misses the goal
(ratio above 1.02, coverage off by more than one point) by more than two standard errors of the Monte Carlo itself.
"""

from __future__ import annotations

import argparse
import sys
from hashlib import sha256
from pathlib import Path
from time import monotonic

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.identification.estimation.linear_cases import cases as linear_cases
from tests.identification.estimation.monte_carlo import LEVELS, Case, Result, Sample, results, sample
from tests.identification.vehicle.vehicle_cases import cases as vehicle_cases

STORE = Path(__file__).resolve().parents[2] / "build" / "estimators"
BATCH = 100
SEED = 2026
RATIO, OFF = 1.02, 0.01
LOST = 1e4
"""Ratio of variances beyond which some runs ended nowhere near the truth."""


def key(case: Case) -> str:
    """File name of a case: readable, and another one when the case is renamed."""
    text = f"{case.name} {case.noise}"
    plain = "".join(c if c.isalnum() else "-" for c in text)
    return f"{plain}-{sha256(text.encode()).hexdigest()[:6]}.npz"


def drawn(case: Case, runs: int, stored_only: bool = False) -> Sample:
    """What is stored, and what is still missing of `runs`."""
    path = STORE / key(case)
    found = None
    if path.exists():
        with np.load(path) as stored:
            found = Sample(**dict(stored))
    while found is None or (found.runs < runs and not stored_only):
        start = 0 if found is None else found.runs
        more = sample(case, range(start, min(start + max(round(BATCH * case.cheap), 10), runs)), SEED)
        found = more if found is None else found.joined(more)
        STORE.mkdir(parents=True, exist_ok=True)
        np.savez(path, **vars(found))
    return Sample(**{name: array[:runs] for name, array in vars(found).items()})


def flag(found: Result) -> str:
    """`*` where the goal is missed."""
    high = found.ratio - 2 * found.ratio_error > RATIO
    off = any(
        abs(share - level) - 2 * error > OFF for (share, error), level in zip(found.coverage, LEVELS, strict=True)
    )
    return "*" if high or off else ""


def told(ratio: float, error: float, digits: int) -> str:
    """A ratio of variances; one that a few lost runs blow up says no more than that."""
    return f"{ratio:.{digits}f} ± {error:.{digits}f}" if ratio < LOST else f"> {LOST:.0e}"


def line(case: Case, found: Result, markdown: bool) -> str:
    cover = [f"{100 * share:.1f} ± {100 * error:.1f}" for share, error in found.coverage]
    cells = [
        case.name, case.noise, found.parameter, f"{found.runs}", f"{found.bias:+.1f}",
        f"{100 * found.bias_share:+.1f}" if found.ratio < LOST else "",
        told(found.ratio, found.ratio_error, 3), told(found.plain_ratio, found.plain_error, 2), *cover,
        f"{found.width:.2f}", flag(found),
    ]  # fmt: skip
    if markdown:
        return "| " + " | ".join(cells) + " |"
    widths = (34, 10, 9, 6, 6, 6, 16, 13, 11, 11, 6, 2)
    return " ".join(
        cell.ljust(w) if i < 3 else cell.rjust(w) for i, (cell, w) in enumerate(zip(cells, widths, strict=True))
    )


HEAD = (
    "estimator", "noise", "parameter", "runs", "bias/sem", "bias % of std", "var/CRB", "alone", "68 %", "95 %",
    "std/true", "",
)  # fmt: skip


def head(markdown: bool) -> str:
    if markdown:
        return "| " + " | ".join(HEAD) + " |\n|" + "---|" * len(HEAD)
    widths = (34, 10, 9, 6, 6, 6, 16, 13, 11, 11, 6, 2)
    short = (
        "estimator",
        "noise",
        "parameter",
        "runs",
        "bias/s",
        "bias %",
        "var/CRB",
        "alone",
        "68 %",
        "95 %",
        "width",
        "",
    )
    return " ".join(
        cell.ljust(w) if i < 3 else cell.rjust(w) for i, (cell, w) in enumerate(zip(short, widths, strict=True))
    )


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("runs", nargs="?", type=int, default=2000)
    asked.add_argument("--only", default="")
    asked.add_argument("--noise", default="")
    asked.add_argument("--list", action="store_true")
    asked.add_argument("--markdown", action="store_true")
    asked.add_argument("--stored", action="store_true", help="show what is stored, draw nothing")
    args = asked.parse_args()
    print(head(args.markdown))
    for case in (*linear_cases(), *vehicle_cases()):
        if args.only.lower() not in case.name.lower() or args.noise.lower() not in case.noise.lower():
            continue
        if args.stored and not (STORE / key(case)).exists():
            continue
        if args.list:
            print(case.name, case.noise, *case.parameters, sep=" | ")
            continue
        begin = monotonic()
        found = drawn(case, 10**9 if args.stored else round(args.runs * case.cheap), args.stored)
        for one in results(case, found):
            print(line(case, one, args.markdown), flush=True)
        if not args.markdown and monotonic() - begin > 5:
            print(f"    ({monotonic() - begin:.0f} s)  {case.remark}", flush=True)


if __name__ == "__main__":
    main()
