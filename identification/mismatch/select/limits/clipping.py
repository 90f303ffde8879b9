"""Where something clips, what else clips says which: a drive holds current and rate, a cell holds neither.

Beyond a limit of the drive the rotor gets no more: rate, motor voltage and current stay where they are. Beyond a limit
of the cell they go on as below it. Noise tells as well (flatness), where the cell clips all of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.predictor import predict
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.select.limits.flatness import noise_goes_on
from identification.physics.term import Term, TermContext
from identification.recording import Floats

POWERS = {"current": 2.0, "rotation_rate": 1.0, "motor_voltage": 1.0}
"""Quantities that tell, and how each goes with the rate; the voltage about so."""


@dataclass(frozen=True, slots=True)
class GoesOn:
    """Of one quantity: its rise from the last level below a limit to those beyond it, 1 where it rises as below."""

    quantity: str
    share: float
    std: float
    allowed: float
    """The share that it has if it clips with the term: up to the limit it rises still."""


def contradiction(fitted: Fit, term: Term, noise: Noise, data: Data) -> str:
    """Why a saturation of the model can't be where it is said to be; empty: nothing speaks against it."""
    if noise_goes_on(fitted, term, noise, data):
        return "the noise goes on where the readings should be flat"
    for told in beyond(fitted, term, data):
        middle, sure = 0.5 * (1 + told.allowed), policy.select.GOES_ON_SIGMA * told.std
        name = told.quantity.replace("_", " ")
        if term.traits.limits == "command" and told.share > middle + sure:
            return f"the {name} goes on rising where the drive should clip"
        if term.traits.limits == "reading" and told.share < middle - sure:
            return f"the {name} stops rising with the thrust: the drive clips, not the cell"
    return ""


def beyond(fitted: Fit, term: Term, data: Data) -> tuple[GoesOn, ...]:
    """What each recorded quantity does beyond the limit of `term`, over all runs."""
    if not term.traits.limits:
        return ()
    sides = [_sides(fitted, term, data, i) for i in range(len(data.runs))]
    out = []
    for quantity, power in POWERS.items():
        if data.histories[0].driver_quantity == quantity or any(quantity not in h.others for h in data.histories):
            continue
        parts = []
        for h, (rows, over, kept, rate) in zip(data.histories, sides, strict=True):
            of_kept = power if term.traits.limits == "command" else 0.5 * power  # force goes with the rate squared
            f, was = rate[rows] ** power, kept[rows] ** of_kept
            parts.append((f, np.abs(h.others[quantity][rows]), over[rows], was))
        step = max(h.quanta.get(quantity, 0.0) for h in data.histories)
        told = _goes_on(quantity, step, *(np.concatenate(column) for column in zip(*parts, strict=True)))
        out += [told] if told is not None else []
    return tuple(out)


def _sides(fitted: Fit, term: Term, data: Data, run: int) -> tuple[NDArray[np.intp], NDArray[np.bool_], Floats, Floats]:
    """Settled rows of a run; (M,) whether the limit is passed; (M,) what of it comes through, in its own unit; (M,) the
    size of the rate if nothing clipped, in units of the driver: with a loss in the winding, say, it bends by itself.

    The unit is that of the driver or of the reading.
    """
    h, values, tare = data.histories[run], fitted.values[term], fitted.theta.tares[run]
    free, rate = predict(*fitted.less(term), data.runs[run], data.scale, tare)
    if term.traits.limits == "command":
        whole = np.abs(h.driver)
        now = TermContext(data.runs[run], data.scale, fitted.theta.C, tare, h.driver)
        kept = np.abs(term.apply(h.driver, now, values))
    else:
        whole = np.abs(free + tare)
        kept = np.abs(predict(fitted.model, fitted.theta, data.runs[run], data.scale, tare)[0] + tare)
    rows = np.flatnonzero(h.since_step > policy.select.GOES_ON_SETTLED)
    return rows, kept < (1 - policy.select.GOES_ON_DEPTH) * whole, kept, np.abs(rate)


def _goes_on(
    quantity: str, step: float, f: Floats, value: Floats, over: NDArray[np.bool_], kept: Floats
) -> GoesOn | None:
    """By a straight line over f (n,), the rate to the quantity's power, through rows below the limit. Readings in steps
    of `step` stand off by a part of one for as long as a level lasts."""
    good = np.isfinite(value)
    f, value, over, kept = f[good], value[good], over[good], kept[good]
    least = policy.select.GOES_ON_ROWS
    if np.count_nonzero(over) < least:
        return None
    limit = float(np.min(f[over]))
    below = ~over & (f > policy.select.GOES_ON_BELOW * limit) & (f < limit)
    if np.count_nonzero(below) < least or float(np.ptp(f[below])) <= 0:
        return None
    X = np.column_stack([np.ones(f.size), f])
    line, *_ = np.linalg.lstsq(X[below], value[below], rcond=None)
    scatter = float(np.std(value[below] - X[below] @ line)) * np.sqrt(1 + 2 / np.count_nonzero(below))
    rounded = step / np.sqrt(12) if scatter < step else 0.0
    edge = float(np.max(f[below]))
    rise = float(line[1] * (np.mean(f[over]) - edge))
    if rise <= 0:
        return None
    share = float(np.mean(value[over]) - line[0] - line[1] * edge) / rise
    ahead = (np.mean(f[over]) - edge) / np.linalg.norm(f[below] - np.mean(f[below]))
    std = scatter * float(np.sqrt(1 / np.count_nonzero(over) + (share * ahead) ** 2 + 1 / below.sum()))
    through = float(np.mean(kept[over]) - np.max(kept[below]))
    asked = float(np.mean(f[over]) - edge) * float(np.max(kept[below])) / edge
    std = float(np.hypot(std, np.sqrt(2) * rounded))  # on either side of the limit
    return GoesOn(quantity, share, std / rise, float(np.clip(through / max(asked, 1e-300), 0.0, 1.0)))
