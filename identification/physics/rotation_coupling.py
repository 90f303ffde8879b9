"""Thrust follows the measured rate n, not the command: x moves from V to n / k."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.term import Parameter, Scale, Stage, TermContext
from identification.recording import Floats
from identification.run_history.filters import reconstructed
from identification.run_history.rate_gap import running, without_ticks
from identification.run_history.remembered import RememberedRun


def slip(run: RememberedRun, x: Floats, k: float) -> Floats:
    """(M,) measured rate / k minus x, without the noise of the rate."""
    history = run.history
    rows = history.rate_rows
    if history.rate is None or history.rate_sampled is None or rows.size < 2:
        return np.zeros_like(x)
    there = reconstructed(x, history.middle, history.rate_sampled)[rows]
    gap = without_ticks(history.rate[rows] / k - there, history)
    if run.rate_gap is not None:
        return run.rate_gap.calmed(gap, history)
    amount, share = running(gap, np.ones_like(gap)), running(gap, there)
    by_share = share.error < amount.error
    found = share if by_share else amount
    out: Floats = np.interp(history.middle, history.rate_sampled[rows], found.coefficient)
    return x * out if by_share else out


@dataclass(frozen=True, slots=True)
class RotationCoupling:
    """Thrust follows the measured rate n, not the command: x moves from V to n / k."""

    id: ClassVar[str] = "rotation_coupling"
    stage: ClassVar[Stage] = "rotor"
    physics: ClassVar[str] = "thrust follows the measured rotation rate, and the rate does not follow the command"
    needs: ClassVar[tuple[str, ...]] = ("rotation_rate",)
    covariates: ClassVar[tuple[str, ...]] = ("rotation_rate",)
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("share", "1", 0.0, 1.2, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.1,), (1.0,))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        out: Floats = value + theta[0] * slip(now.run, value, now.history.rate_per_driver)
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            "Rotation coupling: thrust follows the measured rotation rate (share "
            f"{theta[0]:.2f}), which the command alone does not give; model it in n."
        )


FORMS = (RotationCoupling(),)
