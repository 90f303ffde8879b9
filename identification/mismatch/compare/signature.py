"""Signatures: what a model leaves out, as measured and as the found physics has it, over the physics' own covariate.

Everything is binned from the curves of a diagnosis. Where the recordings are at hand too, each effect is seen by itself
(the residual of the model without it) and over what else was recorded; otherwise all effects are seen together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.compare.reported_runs import Run
from identification.mismatch.diagnosis import Finding
from identification.physics.catalogue import traits_of
from identification.physics.traits import SignatureKind
from identification.recording import Floats

Kind = SignatureKind
SPREAD_OUT = frozenset({"time_since_step", "time_since_reversal"})
"""Coordinates with a logarithmic scale."""
SHAPES: Mapping[str, Kind] = {"driver": "force", "time_since_step": "step", "direction": "force", "thrust": "force"}
"""What is averaged over a covariate where no effect says it; a share of the thrust when it is not here."""
LEVELS = 24
"""So many values of a covariate, at most, are levels with a bin each."""
BINS = {"time": 24, "time_since_step": 12, "time_since_reversal": 12}
"""Bins of the covariates in time: as many as a picture shows."""
MOST = 20
"""Bins of any other covariate."""
CORRELATED = 0.9
"""Largest correlation of neighbouring rows that error bars are made for."""


@dataclass(frozen=True, eq=False)
class Signature:
    """Of one effect, bin by bin (k,)."""

    quantity: str
    """The covariate: a name of `Run.covariates`."""
    kind: Kind
    at: Floats
    measured: Floats
    """N, or a share (1) for the kinds gain and step."""
    std: Floats
    modelled: Floats
    alone: bool
    """This effect by itself; otherwise everything that was found together."""


@dataclass(frozen=True, eq=False)
class Profile:
    """RMS of the residual in N over a covariate, bin by bin (k,)."""

    quantity: str
    at: Floats
    before: Floats
    after: Floats


def signature(runs: Sequence[Run], finding: Finding) -> Signature | None:
    """Of one finding; None where its covariate does not move enough to be seen, or none shows it (a line, a fault)."""
    traits = traits_of(finding.effect, finding.form)
    if traits is None:
        return None
    quantity, kind = traits.shown_over, traits.shown_as
    if not all(quantity in run.covariates for run in runs):
        quantity = "time" if kind == "gain" else "driver"
    key = finding.effect, finding.form
    if runs and all(key in run.effects for run in runs):
        return _binned(runs, quantity, kind, [run.effects[key] for run in runs], alone=True)
    return shape(runs, quantity, kind)


def shape(runs: Sequence[Run], quantity: str, kind: Kind | None = None) -> Signature | None:
    """What the baseline lacks over any covariate, and what the whole model adds to it there; None as above."""
    if not runs or any(quantity not in run.covariates for run in runs):
        return None
    chosen = kind or SHAPES.get(quantity, "gain")
    return _binned(runs, quantity, chosen, [run.before - run.left for run in runs], alone=False)


def _binned(
    runs: Sequence[Run], quantity: str, kind: Kind, modelled: Sequence[Floats], *, alone: bool
) -> Signature | None:
    over = [run.covariates[quantity] for run in runs]
    weight = [_weight(run, kind) for run in runs]
    rows = []
    for low, high in pairwise(_edges(np.concatenate(over), quantity)):
        inside = [(x >= low) & (x < high) & (u != 0) for x, u in zip(over, weight, strict=True)]
        if any(mask.any() for mask in inside):
            rows.append(_bin(runs, over, weight, modelled, inside))
    if len(rows) < 2:
        return None
    at, measured, std, model = np.array(rows).T
    return Signature(quantity, kind, at, measured, std, model, alone)


def _weight(run: Run, kind: Kind) -> Floats:
    """What the residual is a multiple of, (n,); 0 for a row that is left out."""
    match kind:
        case "force":
            return np.ones(run.time.size)
        case "turn":
            return run.covariates["direction_of_change"]
        case _:
            size = run.force if kind == "gain" else run.step
            out: Floats = np.where(
                np.abs(size) > policy.compare.SIGNATURE_THRUST * float(np.max(np.abs(run.force), initial=0.0)),
                size,
                0.0,
            )
            return out


def _bin(
    runs: Sequence[Run],
    over: Sequence[Floats],
    weight: Sequence[Floats],
    modelled: Sequence[Floats],
    inside: Sequence[NDArray[np.bool_]],
) -> tuple[float, float, float, float]:
    """Middle, measured, its standard error, modelled: slopes of the residual over the weight."""
    at = np.concatenate([x[m] for x, m in zip(over, inside, strict=True)])
    u = np.concatenate([w[m] for w, m in zip(weight, inside, strict=True)])
    change = np.concatenate([c[m] for c, m in zip(modelled, inside, strict=True)])
    left = np.concatenate([run.left[m] for run, m in zip(runs, inside, strict=True)])
    power = float(u @ u)
    noise = float(u @ left) / power
    model = float(u @ change) / power
    visit = np.concatenate([_visits(m) + 1_000_000 * i for i, m in enumerate(inside)])
    return float(at.mean()), model + noise, _std(u, left, noise, visit, runs), model


def _visits(inside: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Number of the stretch of neighbouring rows, for the rows inside."""
    starts = np.diff(inside.astype(np.int8), prepend=0) == 1
    out: NDArray[np.int64] = np.cumsum(starts)[inside]
    return out


def _std(u: Floats, left: Floats, slope: float, visit: NDArray[np.int64], runs: Sequence[Run]) -> float:
    """Of the slope: the larger of what neighbouring rows and what visits to the bin say of the scatter."""
    every = np.concatenate([run.left for run in runs])
    every = every - every.mean()
    size = float(np.sqrt(every @ every / max(every.size - 1, 1)))
    rho = float(np.clip(every[1:] @ every[:-1] / max(float(every @ every), 1e-300), 0.0, CORRELATED))
    power = float(u @ u)
    moved = u * (left - slope * u)
    rows = float(moved @ moved) / max(1 - 1 / u.size, 0.5) if u.size > 3 else size**2 * power
    _, index = np.unique(visit, return_inverse=True)
    groups = np.bincount(index, weights=moved)
    between = float(groups @ groups) * groups.size / (groups.size - 1) if groups.size > 3 else 0.0
    return float(np.sqrt(max(rows * (1 + rho) / (1 - rho), between))) / power


def _edges(values: Floats, quantity: str) -> Floats:
    """Of the bins: one for each level where there are few, otherwise of equal width on the covariate's scale.

    A driver's bins are even in the square root of its size: what small levels do is as wide as what large ones do.
    """
    found = values[np.isfinite(values)]
    if found.size == 0:
        return np.empty(0)
    if quantity in SPREAD_OUT:
        found = found[found > 0]
        low, high = float(np.quantile(found, 0.002)), float(found.max())
        return np.geomspace(low * 0.999, max(high, low * 1.01) * 1.001, BINS[quantity] + 1)
    size = float(np.max(np.abs(found))) or 1.0
    levels, count = np.unique(np.round(found / size, 3), return_counts=True)
    common = levels[count >= max(1, 0.004 * found.size)] * size
    if (
        quantity != "time"
        and 2 <= common.size <= LEVELS
        and count[count >= max(1, 0.004 * found.size)].sum() > 0.8 * found.size
    ):
        middle = 0.5 * (common[1:] + common[:-1])
        first, last = common[0] - 0.01 * size, common[-1] + 0.01 * size
        return np.concatenate([[first], middle, [last]])
    if quantity == "driver":
        even = np.linspace(-1.0, 1.0, MOST + 2)
        fine = size * even * np.abs(even) * 1.001
        used: Floats = fine[(np.r_[fine[1:], np.inf] > found.min()) & (np.r_[-np.inf, fine[:-1]] < found.max())]
        return used
    slack = 1e-9 * max(float(np.ptp(found)), 1e-9 * size)
    return np.linspace(float(found.min()) - slack, float(found.max()) + slack, BINS.get(quantity, MOST) + 1)


def profile(runs: Sequence[Run], quantity: str) -> Profile | None:
    """RMS before and after over a covariate of the runs; None where they do not have it, or it does not move."""
    if not runs or any(quantity not in run.covariates for run in runs):
        return None
    over = np.concatenate([run.covariates[quantity] for run in runs])
    before, left = (np.concatenate([getattr(run, name) for run in runs]) for name in ("before", "left"))
    rows = []
    for low, high in pairwise(_edges(over, quantity)):
        m = (over >= low) & (over < high)
        if m.any():
            rows.append((over[m].mean(), np.sqrt(np.mean(before[m] ** 2)), np.sqrt(np.mean(left[m] ** 2))))
    if len(rows) < 2:
        return None
    at, old, new = np.array(rows).T
    return Profile(quantity, at, old, new)
