"""What a vehicle's trials cannot tell apart, by name: drag and efficiency of runs that all use the same thrusters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.estimation.maximum_likelihood import Maximum
from identification.recording import Floats

ENTANGLED = 0.98
"""Correlation above which two parameters are called hardly told apart."""


def entanglement(axis: str, found: Maximum, physical: Sequence[str]) -> tuple[str, ...]:
    """What cannot be told apart, by name: combinations never seen with the ratios that are, then close correlations."""
    lost = found.deficiency
    out = []
    if lost is not None:
        out.append(f"{axis}: {lost.statement}")
        etas = [name for name in lost.names if name.startswith("eta")]
        drags = [name for name in ("m", "k", "k2") if name in lost.names]
        for eta in etas if drags else []:
            shares = [_ratio(found, drag, eta) for drag in drags]
            told = ", ".join(text for text in shares if text)
            if told:
                out.append(f"{axis}: drag and {eta} only scale together; determined are {told}")
        if etas and drags:
            names = ", ".join(etas)
            out.append(f"{axis}: add runs whose thrusters are free of {names}, or state one of them")
    out.extend(f"{axis}: {text}" for text in _correlations(found, physical))
    return tuple(out)


def _correlations(found: Maximum, physical: Sequence[str]) -> list[str]:
    """Pairs that these measurements hardly tell apart, and parameters whose errors only go together.

    All forces are as wrong as the calibration is: drag and inertia then move together, which is no fault of the runs.
    """
    names = found.estimate.names
    own = found.gain[:, : found.misfit.size]
    parts = (own @ own.T, found.estimate.cov)
    out, together = [], []
    for i, a in enumerate(names):
        for j, b in enumerate(names[:i]):
            if a in physical and b in physical:
                told, all_told = (_correlation(cov, i, j) for cov in parts)
                if abs(told) > ENTANGLED and abs(all_told) > ENTANGLED:
                    out.append(f"{b} and {a} are hardly told apart (correlation {told:.3f})")
                elif abs(all_told) > ENTANGLED:
                    together += [b, a]
    if together:
        shared = ", ".join(dict.fromkeys(together))
        out.append(f"{shared} share the error of what was known beforehand (thrusters): their ratios are better known")
    return out


def _correlation(cov: Floats, i: int, j: int) -> float:
    """0 where one of them is not determined."""
    size = float(np.sqrt(cov[i, i] * cov[j, j]))
    return float(cov[i, j]) / size if np.isfinite(size) and size > 0 else 0.0


def _ratio(found: Maximum, over: str, under: str) -> str:
    """`k/eta = 120 ± 3`, or nothing when the unseen combination changes the ratio."""
    estimate, lost = found.estimate, found.deficiency
    a, b = estimate[over], estimate[under]
    if a == 0 or b == 0 or lost is None:
        return ""
    moves = [dict(c).get(over, 0.0) / a - dict(c).get(under, 0.0) / b for c in lost.combinations]
    size = max(abs(dict(c).get(under, 0.0) / b) for c in lost.combinations)
    if size == 0 or max(abs(move) for move in moves) > 0.02 * size:
        return ""
    gradient = np.zeros(len(estimate.names))
    gradient[estimate.names.index(over)], gradient[estimate.names.index(under)] = 1 / b, -a / b**2
    return f"{over}/{under} = {a / b:.4g} ± {found.spread(gradient):.2g}"
