"""Another run with the same thruster and the same concealed effects: what a model that was found has to predict."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim_devices.concealed.cases.definition import Case, Run, history, thrust_of
from sim_devices.concealed.cases.needs import NEEDS_REVERSED_FLOW, NEEDS_SLEW
from sim_devices.concealed.cases.plans import KINDS, profile
from sim_devices.concealed.draw import flow_steps
from sim_devices.concealed.sealing.records import Rows, rows

Floats = NDArray[np.float64]

SHARE, SHORTEST = 0.5, 150.0
"""Of the run that was recorded, and at least this long (s)."""
RATE = 20.0
"""1/s, at most about: samples of the thrust that are compared."""


@dataclass(frozen=True, eq=False, slots=True)
class Another:
    """`drive`: the recording without its thrust. `at` (n,) s, even; `thrust` (n,) N is true, `measured` has noise."""

    drive: Rows
    at: Floats
    thrust: Floats
    measured: Floats


def another(case: Case, rng: np.random.Generator) -> Another:
    """A run of another plan, begun at time 0 of a world of its own, its zero exactly right; no channel lies in it."""
    named = {c.effect for c in case.effects}
    known = {run.profile.kind for run in case.runs}
    kind = str(rng.choice([k for k in KINDS if k not in known]))
    long = max(SHARE * case.runs[0].profile.duration, SHORTEST)
    laid = profile(kind, case.scale.voltage, long, case.dt, rng, smooth=bool(named & NEEDS_SLEW))
    flow: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    if any(speed for run in case.runs for _, speed in run.flow):
        flow = flow_steps(rng, case.scale.flow, long, reversed_too=bool(named & NEEDS_REVERSED_FLOW))
    run = Run(laid, flow, 0.0, 0.0, int(rng.integers(2**62)))
    told = replace(case, runs=(run,), fault=None)
    (found,) = rows(told)
    cell = next(c for c in found.columns if c.quantity == "thrust")
    kept = slice(None, None, max(round(case.rate / RATE), 1))
    drive = replace(found, columns=tuple(c for c in found.columns if c.quantity != "thrust"))
    true = thrust_of(told, run, history(told, run))
    return Another(drive, cell.time[kept], true[kept], cell.value[kept])
