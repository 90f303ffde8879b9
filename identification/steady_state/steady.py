"""Mean, its honest standard error and the drift of one window, after the fact or while the rig dwells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.even_noise import MIN_SAMPLES, NoiseModel, fit_noise, leverage
from identification.estimation.tails import student_quantile
from identification.recording import Floats
from identification.steady_state.asymptote import Asymptote, asymptote
from identification.steady_state.settling import settle
from identification.steady_state.shared_noise import fit_noise_jointly

MOST_SAMPLES = 512
"""The monitor averages neighbours above this: a tick stays cheap, the mean and slow noise stay as they are."""
DRIFT_ALPHA = 0.01
"""Chance of calling a drift-free window drifting."""
LEAST_SETTLING = 8
"""Fewer samples cannot tell an approach from its end."""
STILL_MISSING = 2.0
"""A hold has settled when it is within this many standard errors of where it is going."""


@dataclass(frozen=True, slots=True)
class MeanEstimate:
    """Mean of a window. NaN where samples are too few: under 5 there is no standard error, under 8 no drift."""

    mean: float
    std_error: float
    """Same unit as the values; 95 % half width = t quantile(dof) x std_error."""
    dof: float
    n: int
    n_effective: float
    """Independent samples that would give the same standard error."""
    drift: float
    """Unit per second, least squares."""
    drift_std: float
    drift_dof: float
    t_start: float
    t_end: float
    settled: bool = True

    @property
    def drifting(self) -> bool:
        """The slope is significant at 1 %."""
        if not np.isfinite(self.drift_std):
            return False
        return bool(abs(self.drift) > student_quantile(1 - DRIFT_ALPHA / 2, self.drift_dof) * self.drift_std)


def mean_estimate(
    time: Floats, value: Floats, noise_std: float | None = None, model: NoiseModel | None = None
) -> MeanEstimate:
    """Estimate from NaN-free, nearly even samples (n,) of one window, all of them used.

    `noise_std` (known sensor noise) stands in for the standard error when there are too few samples to find it.
    `model` is the noise of these samples when it was found together with that of other windows.

    >>> t = np.arange(400) / 100
    >>> e = mean_estimate(t, 5 + np.random.default_rng(1).normal(0, 1, 400))
    >>> (abs(e.mean - 5) < 0.15, 0.04 < e.std_error < 0.06, e.drifting)
    (True, True, False)
    """
    n = value.size
    if n == 0:
        nan = float("nan")
        return MeanEstimate(nan, nan, 0.0, 0, 0.0, nan, nan, 0.0, nan, nan, False)
    mean, start, end = float(value.mean()), float(time[0]), float(time[-1])
    if n < MIN_SAMPLES:
        known = noise_std is not None and noise_std > 0
        std = noise_std / float(np.sqrt(n)) if noise_std is not None and known else float("nan")
        dof = float("inf") if known else 0.0
        return MeanEstimate(mean, std, dof, n, float(n), float("nan"), float("nan"), 0.0, start, end)
    model = model or fit_noise(value)
    std, dof = model.mean_std()
    effective = float(np.clip((model.std / std) ** 2, 1.0, n)) if std > 0 else float(n)
    return MeanEstimate(mean, std, dof, n, effective, *_slope(time, value), start, end)


def _slope(time: Floats, value: Floats) -> tuple[float, float, float]:
    """Least-squares slope, its standard deviation under the correlated noise found beside it, its dof."""
    centred = time - time.mean()
    power = float(centred @ centred)
    if value.size < 8 or power == 0:
        return float("nan"), float("nan"), 0.0
    weights = centred / power
    slope = float(weights @ value)
    lost = leverage(centred[:, None] / np.sqrt(power))
    std, dof = fit_noise(value - slope * centred, lost).combination_std(weights)
    return slope, std, dof


@dataclass(frozen=True, eq=False)
class _Kept:
    """What remains of a window: its samples, and the approach to its end value where there is one."""

    time: Floats
    value: Floats
    settled: bool
    approach: Asymptote | None

    @property
    def residual(self) -> Floats:
        return self.value if self.approach is None else self.value - self.approach.approach

    @property
    def lost(self) -> Floats | None:
        return None if self.approach is None else leverage(self.approach.basis)


def _kept(time: Floats, value: Floats) -> _Kept:
    found = settle(value)
    late = value[found.cut :]
    if found.settled or late.size < LEAST_SETTLING:
        return _Kept(time[found.cut :], late, found.settled, None)
    return _Kept(time[found.cut :], late, False, asymptote(late))


def _settling_estimate(kept: _Kept, model: NoiseModel) -> MeanEstimate:
    """The value the window is going to; settled when what is missing of it at the window's end is within its error."""
    assert kept.approach is not None
    noise, dof = model.combination_std(kept.approach.weights)
    std = float(np.hypot(noise, kept.approach.spread))
    missing = abs(float(kept.approach.approach[-1]))
    effective = float(np.clip((model.std / std) ** 2, 1.0, kept.value.size)) if std > 0 else float(kept.value.size)
    return MeanEstimate(
        kept.approach.value,
        std,
        dof,
        kept.value.size,
        effective,
        *_slope(kept.time, kept.value),
        float(kept.time[0]),
        float(kept.time[-1]),
        missing <= STILL_MISSING * std,
    )


def settled_estimate(time: Floats, value: Floats, noise_std: float | None = None) -> MeanEstimate:
    """`mean_estimate` of what remains after the start of a hold is left out (identification.steady_state.settling)."""
    return settled_estimates([(time, value)], noise_std)[0]


def settled_estimates(
    windows: Sequence[tuple[Floats, Floats]], noise_std: float | None = None
) -> tuple[MeanEstimate, ...]:
    """Estimate of each (time, value) without its settling, their noise found together (shared_noise.py).

    A window that settles over more than half of its length gives the value it is going to (asymptote.py).
    """
    kept = [_kept(time, value) for time, value in windows]
    enough = [k for k in kept if k.value.size >= MIN_SAMPLES]
    models = iter(fit_noise_jointly([k.residual for k in enough], [k.lost for k in enough]))
    out = []
    for k in kept:
        model = next(models) if k.value.size >= MIN_SAMPLES else None
        if k.approach is not None and model is not None:
            out.append(_settling_estimate(k, model))
        else:
            out.append(replace(mean_estimate(k.time, k.value, noise_std, model), settled=k.settled))
    return tuple(out)


class SteadyMonitor:
    """Collects the samples of one hold as they arrive and says how well the mean is known so far.

    `mean`, `std_error`, `drift` and `drift_std` are those of `estimate`, worked out when first asked for after `add`.

    NaN samples are counted and left out. `estimate` costs about a millisecond whatever the length of the hold.

    >>> monitor = SteadyMonitor()
    >>> rng = np.random.default_rng(0)
    >>> for k in range(100):
    ...     monitor.add(np.array([k / 50, k / 50 + 0.01]), 3 + rng.normal(0, 0.1, 2))
    >>> e = monitor.estimate()
    >>> (abs(e.mean - 3) < 0.03, e.std_error < 0.02, e.settled)
    (True, True, True)
    """

    def __init__(self) -> None:
        self._time = np.empty(256)
        self._value = np.empty(256)
        self._count = 0
        self.skipped = 0
        self._latest: MeanEstimate | None = None

    def add(self, time: Floats | float, value: Floats | float) -> None:
        """One sample or one block: times (k,) s and values (k,), in order."""
        time, value = np.atleast_1d(time), np.atleast_1d(value)
        good = np.isfinite(value)
        self._latest = None
        self.skipped += int(good.size - good.sum())
        time, value = time[good], value[good]
        end = self._count + value.size
        if end > self._time.size:
            room = max(end, 2 * self._time.size)
            self._time = np.concatenate([self._time[: self._count], np.empty(room - self._count)])
            self._value = np.concatenate([self._value[: self._count], np.empty(room - self._count)])
        self._time[self._count : end] = time
        self._value[self._count : end] = value
        self._count = end

    def estimate(self) -> MeanEstimate:
        """Of all samples so far, their settling left out; `n` counts averages of neighbours above 512 samples."""
        if self._latest is not None:
            return self._latest
        step = -(-self._count // MOST_SAMPLES) if self._count else 1
        used = self._count // step * step
        late = slice(self._count - used, self._count)
        time = self._time[late].reshape(-1, step).mean(axis=1)
        value = self._value[late].reshape(-1, step).mean(axis=1)
        self._latest = settled_estimate(time, value)
        return self._latest

    @property
    def mean(self) -> float:
        return self.estimate().mean

    @property
    def std_error(self) -> float:
        return self.estimate().std_error

    @property
    def dof(self) -> float:
        return self.estimate().dof

    @property
    def drift(self) -> float:
        return self.estimate().drift

    @property
    def drift_std(self) -> float:
        return self.estimate().drift_std
