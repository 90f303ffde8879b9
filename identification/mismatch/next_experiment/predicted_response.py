"""A sweep that was not run yet, as a history: what would be measured in which interval, and by how much rivals differ.

The measured values themselves are not needed: what is compared are predictions, whitened with the noise as it was
found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from identification.mismatch.diagnosis import PlanStep
from identification.mismatch.estimate.estimate import Estimate, forces
from identification.mismatch.estimate.fitting import Fit, bounds_of, columns_of, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.parameters import Layout, Theta
from identification.mismatch.model.predictor import Predictor
from identification.mismatch.model.whitening import weights
from identification.recording import Floats
from identification.run_history.filters import lowpass
from identification.run_history.history import History

AFTER_STEP = 0.003
"""s after a step in which samples are not used, as in preparing."""
FINEST, COARSEST, GROWTH = 0.004, 0.5, 0.15
"""s, s, and length of an interval per time since the step: coarser than in preparing, for speed."""
RAMP = 0.05
"""s of an interval on a ramp between levels."""
SLOW = (20.0, 100.0)
"""s: memories of the power with which a channel that a term reads is foreseen."""
TARE = 0.1
"""Share of the largest thrust: how far a tare may lie off, one standard deviation."""


@dataclass(frozen=True, eq=False)
class PredictedResponse:
    """What one model says of a sweep, whitened, and what the data in hand leave open."""

    value: Floats
    """(n,) the prediction."""
    slopes: Floats
    """(n, q) over its parameters."""
    cov: Floats
    """(q, q) of the parameters of `slopes`; 0 where they are known or not free."""
    layout: Layout | None = None
    """Of these; None where there are no zeros to be shared."""

    @cached_property
    def root(self) -> Floats:
        """(q, q) R with R R' = cov."""
        size = np.sqrt(np.maximum(np.diag(self.cov), 1e-300))
        value, vector = np.linalg.eigh(self.cov / np.outer(size, size))
        out: Floats = size[:, None] * vector * np.sqrt(np.maximum(value, 0.0))
        return out


@dataclass(frozen=True, eq=False)
class Bench:
    """How the recordings were made: what a new one will look like."""

    estimate: Estimate
    data: Data
    slew: float
    """Units of the driver per s; inf: at once."""

    @cached_property
    def sampling(self) -> float:
        """Thrust samples per s."""
        return _per_second([h.count for h in self.data.histories], self._seconds)

    @cached_property
    def rate_sampling(self) -> float:
        return _per_second([h.rate_count for h in self.data.histories if h.rate_count is not None], self._seconds)

    @property
    def _seconds(self) -> float:
        return float(sum(h.edges[-1] - h.edges[0] for h in self.data.histories))

    @cached_property
    def laws(self) -> dict[str, Floats]:
        """Quantity -> coefficients of `_drive`: channels that terms read, as they followed the driver."""
        histories = self.data.histories
        known = set.intersection(*(set(h.others) for h in histories)) - {"flow_speed"}
        design = np.concatenate([_drive(h.driver, h.dt, self.data.scale.driver) for h in histories])
        found = {}
        for quantity in known:
            value = np.concatenate([h.others[quantity] for h in histories])
            found[quantity] = np.linalg.lstsq(design, value, rcond=1e-8)[0]
        return found

    def rehearsed(self, runs: Sequence[Sequence[PlanStep]]) -> Data:
        """Sweeps as data without measurements; each run has one flow speed."""
        histories = tuple(self._history(run, k) for k, run in enumerate(runs))
        return replace(
            self.data, histories=histories, keep=None, prior_factor=None, twin_factor=None, predictor=Predictor()
        )

    def _history(self, steps: Sequence[PlanStep], number: int) -> History:
        dt, driver, blind = intervals(steps, self.slew)
        edges = np.concatenate([[0.0], np.cumsum(dt)])
        count = np.where(blind, 0, _counts(edges, self.sampling))
        others = {q: _drive(driver, dt, self.data.scale.driver) @ law for q, law in self.laws.items()}
        if any("flow_speed" in h.others for h in self.data.histories):
            others["flow_speed"] = np.full(driver.size, steps[0].flow_speed)
        first = self.data.histories[0]
        history = History(
            recording_id=f"next-{number}",
            driver_quantity=first.driver_quantity,
            edges=edges,
            driver=driver,
            thrust=np.where(count > 0, 0.0, np.nan),
            count=count,
            sampled=0.5 * (edges[1:] + edges[:-1]),
            within=np.zeros(driver.size),
            others=others,
            rate_per_driver=first.rate_per_driver,
            spacing=first.spacing,
            jitter=first.jitter,
            rate_spacing=first.rate_spacing,
            tick=first.tick,
        )
        if "rotation_rate" not in others:
            return history
        many = _counts(edges, self.rate_sampling)
        rate = np.where(many > 0, others["rotation_rate"], np.nan)
        return replace(history, rate=rate, rate_count=many, rate_sampled=history.sampled)

    def outlook(
        self, fits: Sequence[Fit], runs: Sequence[Sequence[PlanStep]]
    ) -> tuple[tuple[PredictedResponse, ...], Floats]:
        """What each model says of these runs, all whitened alike, with the noise of the present answer.

        And (n, 2) of each row: which run, and s since it began.
        """
        new = self.rehearsed(runs)
        now = _moved(self.estimate.fit, len(new.histories))
        size = forces(self.estimate.fit.model, now, new)
        w = weights(new, self.estimate.noise, size, self.estimate.rate_noise)
        out = []
        for fitted in fits:
            theta = _moved(fitted, len(new.histories))
            thrust, rate = raw(fitted.model, theta, new, with_rate=bool(w.rate))
            slopes = columns_of(fitted.model, theta, new, w, np.ones(theta.vector.size, dtype=bool))
            cov = open_ends(fitted, theta, self.data)
            out.append(PredictedResponse(w.whiten(thrust, rate), slopes, cov, fitted.model.layout(theta)))
        where = [np.column_stack([np.full(h.rows.size, k), h.middle[h.rows]]) for k, h in enumerate(new.histories)]
        if w.rate:
            rated = [(k, h.middle[h.rate_rows]) for k, h in enumerate(new.histories)]
            where += [np.column_stack([np.full(middle.size, k), middle]) for k, middle in rated]
        return tuple(out), np.concatenate(where)


def stretches(steps: Sequence[PlanStep]) -> list[list[PlanStep]]:
    """One run for each stretch of one flow speed: the rig does not set the flow, so it makes a recording of each."""
    return [list(part) for _, part in groupby(steps, key=lambda step: step.flow_speed)]


def _per_second(counts: Sequence[NDArray[np.int64]], seconds: float) -> float:
    return float(sum(int(c.sum()) for c in counts)) / seconds


def _counts(edges: Floats, rate: float) -> NDArray[np.int64]:
    """Samples at an even rate in each interval."""
    out: NDArray[np.int64] = np.diff(np.floor(edges * rate + 0.5)).astype(np.int64)
    return out


def _drive(driver: Floats, dt: Floats, largest: float) -> Floats:
    """(M, k) functions of the driver, now and with memory, that a channel may follow."""
    v = driver / largest
    slow = [lowpass(v**2, dt, tau)[1] for tau in SLOW]
    return np.column_stack([np.ones_like(v), v, np.abs(v), v * np.abs(v), v**2, v**2 * np.abs(v), *slow])


def intervals(steps: Sequence[PlanStep], slew: float) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """(dt, driver, without samples) of holds reached at `slew` from 0; ramps are made of RAMP s."""
    dt: list[Floats] = []
    driver: list[Floats] = []
    at = 0.0
    for step in steps:
        ramp = abs(step.command_voltage - at) / slew
        many = int(np.ceil(ramp / RAMP)) if ramp > AFTER_STEP else 0
        if many:
            dt.append(np.full(many, ramp / many))
            driver.append(at + (step.command_voltage - at) * (np.arange(many) + 0.5) / many)
        widths = _widths(step.duration)
        dt.append(widths)
        driver.append(np.full(widths.size, step.command_voltage))
        at = step.command_voltage
    every, value = np.concatenate(dt), np.concatenate(driver)
    return every, value, every <= AFTER_STEP * (1 + 1e-9)


def ending(steps: Sequence[PlanStep], slew: float) -> Floats:
    """(n,) s at which each step ends, the ways between the levels included."""
    volts = np.array([step.command_voltage for step in steps])
    ways = np.abs(np.diff(volts, prepend=0.0)) / slew
    out: Floats = np.cumsum(ways * (ways > AFTER_STEP) + np.array([step.duration for step in steps]))
    return out


def one_zero(view: PredictedResponse) -> PredictedResponse:
    """The same with one zero for all runs: blocks of one sweep share it."""
    at = view.layout
    assert at is not None
    zero = view.slopes[:, at.tares].sum(axis=1, keepdims=True)
    slopes = np.column_stack([view.slopes[:, : at.tare(0)], zero, view.slopes[:, at.shift :]])
    keep = np.delete(np.arange(at.size), np.arange(at.tare(1), at.shift))
    return PredictedResponse(view.value, slopes, view.cov[np.ix_(keep, keep)], replace(at, runs=1))


def _widths(seconds: float) -> Floats:
    """Of the intervals of a hold."""
    edges = [0.0, AFTER_STEP]
    while edges[-1] < seconds:
        edges.append(edges[-1] + min(max(FINEST, GROWTH * edges[-1]), COARSEST))
    edges[-1] = seconds
    out: Floats = np.diff(np.array(edges))
    return out


def _moved(fitted: Fit, runs: int) -> Theta:
    """The fitted values for other runs; their tares stand at 0."""
    return replace(fitted.theta, tares=(0.0,) * runs)


def open_ends(fitted: Fit, theta: Theta, data: Data) -> Floats:
    """(q, q) covariance, in the lay-out of `theta`, of what the data in hand leave open. Tares of new runs are open.

    A parameter that the data hardly fix is known from its bounds all the same: a quarter of their span.
    """
    here, there = fitted.layout, fitted.model.layout(theta)
    low, high, _ = bounds_of(fitted.model, data, fitted.theta)
    known = known_from_bounds(low, high)
    old = np.zeros((here.size, here.size))
    old[np.ix_(fitted.free, fitted.free)] = inverse_information(fitted.jacobian, known[fitted.free])
    out = np.diag(np.full(there.size, (TARE * data.scale.thrust) ** 2))
    shared, keep = (np.delete(np.arange(at.size), at.tares) for at in (here, there))
    out[np.ix_(keep, keep)] = old[np.ix_(shared, shared)]
    return out


def known_from_bounds(low: Floats, high: Floats) -> Floats:
    """(q,) 1/standard deviation of parameters that the data hardly fix: a quarter of the span of their bounds."""
    return np.where(np.isfinite(high - low) & (high > low), 4.0 / np.maximum(high - low, 1e-300), 0.0)


def inverse_information(columns: Floats, known: Floats) -> Floats:
    """Inverse of columns' columns + diag(known^2), each parameter scaled to its own size."""
    both = np.concatenate([columns, np.diag(known)])
    size = np.linalg.norm(both, axis=0)
    size = np.where(size > 0, size, 1.0)
    out: Floats = np.linalg.pinv((both / size).T @ (both / size), hermitian=True, rcond=1e-12) / np.outer(size, size)
    return out
