"""The regression of a thrust model: rows of all recordings of one thruster, their errors and their order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Literal

import numpy as np

from identification.estimation.least_squares import Rows
from identification.recording import Floats
from identification.steady_state.pooling import moderate
from identification.thruster.thrust_data import Run
from identification.thruster.thrust_forms import Form, columns


def _flow(runs: Sequence[Run], of_points: bool) -> Floats | None:
    found = [run.flow.points if of_points else run.flow.samples for run in runs if run.flow is not None]
    known = [flow for flow in found if flow is not None]
    return np.concatenate(known) if len(known) == len(runs) else None


def _level_doubt(runs: Sequence[Run], tares: Floats, thrust: Floats) -> Floats | None:
    """N (n,): what the standard error of a measured voltage or rate makes of the thrust, 2 C |V| std(V)."""
    stds = [run.level_std for run in runs if run.level_std is not None]
    if len(stds) < len(runs):
        return None
    level = np.concatenate([run.points.voltage for run in runs if run.points is not None])
    square = level * np.abs(level)
    first, *_ = np.linalg.lstsq(np.column_stack([square, tares]), thrust, rcond=None)
    out: Floats = 2 * abs(float(first[0])) * np.abs(level) * np.concatenate(stds)
    return out


def rows_of(runs: Sequence[Run], form: Form) -> tuple[Rows, Literal["points", "samples"]]:
    """Stack the runs: signals of the form, one column of ones per recording; points if every run has holds."""
    points = [run.points for run in runs if run.points is not None]
    of_points = len(points) == len(runs)
    V = [p.voltage for p in points] if of_points else [run.voltage for run in runs]
    y = [p.thrust for p in points] if of_points else [run.thrust for run in runs]
    ends = np.cumsum([0, *[v.size for v in V]])
    blocks = tuple(slice(int(a), int(b)) for a, b in pairwise(ends))
    signals = columns(form, np.concatenate(V), _flow(runs, of_points))
    tares = np.zeros((signals[0].size, len(runs)))
    for k, block in enumerate(blocks):
        tares[block, k] = 1.0
    names = (*form.coefficients, *(f"tare[{run.recording_id}]" for run in runs))
    H, thrust = np.column_stack([*signals, tares]), np.concatenate(y)
    if not of_points:
        return Rows(H, thrust, names, blocks, even=True), "samples"
    error = np.concatenate([p.std_error for p in points])
    if not np.all(np.isfinite(error) & (error > 0)):
        return Rows(H, thrust, names, blocks, even=True), "points"
    dof = np.concatenate([p.dof for p in points])
    shared = moderate(error, dof, np.abs(thrust))
    doubt = _level_doubt(runs, tares, thrust)
    if doubt is not None:
        shared = replace(shared, std_error=np.hypot(shared.std_error, doubt))
    return Rows(H, thrust, names, blocks, shared.std_error, shared.dof, float(dof.max())), "points"
