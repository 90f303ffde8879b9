"""Effects that stand in no catalogue: located, shape shown, fit improved on held-out data, no wrong name.

    python benchmarks/diagnosis/uncatalogued.py [SEED [SIGMA [EFFECT ...]]]    # 5, 40, all eleven

Each effect is concealed in a recording drawn at random (sim_devices.concealed: thruster, plan, sampling, noise and
channels), as strong as an oracle sees it at so many sigma that knows its shape. For each: the truth, the verdict, names
given, where, what the model failed_checks, held-out error of C V|V|, of the model of named terms and of the model with
flexible terms, beside the noise's own; the shape of the flexible terms; the formula if there is one. Last, a table.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import sys
from collections.abc import Iterator
from math import isfinite
from pathlib import Path
from time import process_time

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
import numpy as np

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.preparing import Refusal
from rig.diagnose.text import diagnosis_text
from sim_devices import concealed
from sim_devices.world.effects.uncatalogued import UNCATALOGUED
from tests.concealed.recordings import recordings


def told(effect: str, truth: str, found: Diagnosis, seconds: float) -> Iterator[str]:
    """The whole answer to one effect."""
    yield f"\n{'=' * 100}\nconcealed: {effect} ({truth}); {seconds:.0f} s of processor\n"
    yield diagnosis_text(found)


HEAD = ("concealed", "verdict", "where", "C V|V|", "named", "flexible", "noise")


def cells(effect: str, verdict: str, where: str, *numbers: float) -> str:
    """One line of the table; what is not there is a dash."""
    shown = (f"{x:>9.4g}" if isfinite(x) else f"{'-':>9}" for x in numbers)
    return f"{effect:<21}{verdict:<13}{where:<19}{''.join(shown)}"


def row(effect: str, found: Diagnosis) -> str:
    """One line, and a second one for names, shape and formula."""
    names = ", ".join(f.effect for f in found.findings) or "none"
    u, held, none = found.unexplained, found.heldout, float("nan")
    if u is None:
        line = cells(effect, found.verdict, "-", held.before, held.after, none, held.noise)
        return f"{line}\n    names given: {names}"
    named = held.after if u.heldout_without is None else u.heldout_without
    free = held.after if u.flexible else none
    line = cells(effect, found.verdict, u.where.quantity, held.before, named, free, held.noise)
    shapes = "; ".join(
        f"{f.covariate} ({' and '.join(s.times for s in f.splines)}, {len(f.knots)} knots)" for f in u.flexible
    )
    formula = "none" if u.formula is None else u.formula.text
    return f"{line}\n    names given: {names}; shape: {shapes or 'none'}; formula: {formula}"


def main(seed: int, sigma: float, effects: list[str]) -> None:
    rows = []
    for effect in effects:
        case = concealed.case(np.random.default_rng(seed), [effect], sigma)
        (hidden,) = case.effects
        numbers = hidden.shape.parameters(hidden.amount).items()
        truth = ", ".join(f"{k} {v:.4g}" for k, v in numbers if isinstance(v, int | float) and isfinite(v))
        begun = process_time()
        found = diagnose(recordings(case))
        if isinstance(found, Refusal):
            rows.append(f"{effect:<21}refused: {found.reason}")
            continue
        print("\n".join(told(effect, f"{truth}; noise {case.noise_kind}", found, process_time() - begun)), flush=True)
        rows.append(row(effect, found))
    print(f"\n{'=' * 100}\nRMSE per sample on data that were not fitted, N; seed {seed}, {sigma:g} sigma")
    print(f"{HEAD[0]:<21}{HEAD[1]:<13}{HEAD[2]:<19}{''.join(f'{name:>9}' for name in HEAD[3:])}")
    print("\n".join(rows))


if __name__ == "__main__":
    given = sys.argv[1:]
    main(
        int(given[0]) if given else 5,
        float(given[1]) if len(given) > 1 else 40.0,
        given[2:] or list(UNCATALOGUED),
    )
