"""Velocity from sampled position (section 4.2.3): Savitzky and Golay's derivative, its noise and its bias.

Around each sample a polynomial is fitted to n_l samples on the left and n_r on the right; its slope at the sample is
the velocity. What that passes on of the noise of the position is known exactly (the norm of the weights). What the
polynomial is too stiff to follow is estimated from the next two terms, fitted in a window twice as wide: less noise in
the estimate, but it falls short (by a third for a sine of which that window holds a whole period).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from identification.velocity.local_polynomial import Windows, local_fits, significant_orders

Ends = Literal["shrink", "slide", "leave out"]
"""Near the ends of the record: `shrink` keeps of the window what there is; `slide` keeps its length and fits off centre
(what scipy calls `interp`); `leave out` gives NaN."""


@dataclass(frozen=True, slots=True)
class Window:
    """Savitzky and Golay's window. n_r = 0: causal, only samples up to now."""

    n_l: int
    n_r: int

    def __post_init__(self) -> None:
        if self.n_l < 0 or self.n_r < 0 or self.n_l + self.n_r < 1:
            raise ValueError(f"Window: n_l and n_r must be >= 0 and not both 0, got {self.n_l} and {self.n_r}")

    @property
    def size(self) -> int:
        return self.n_l + self.n_r + 1


@dataclass(frozen=True, slots=True)
class Adaptive:
    """The order of each window by an F test, in steps of two (Barak, Anal. Chem. 1995)."""

    lowest: int = 2
    highest: int = 6
    alpha: float = 0.05

    def __post_init__(self) -> None:
        if not (1 <= self.lowest <= self.highest and 0 < self.alpha < 1):
            raise ValueError(f"Adaptive: needs 1 <= lowest <= highest and 0 < alpha < 1, got {self}")


@dataclass(frozen=True, eq=False)
class Derivative:
    """All (n,), one entry a sample; NaN where a window has too few samples."""

    time: Floats
    """s"""
    position: Floats
    """Smoothed, in the unit of the position."""
    velocity: Floats
    """Unit of the position a second."""
    noise_gain: Floats
    """1/s: standard deviation of the velocity for white position noise of standard deviation 1 (order given)."""
    bias: Floats
    """Estimate of the systematic error of the velocity, from the next two terms of the polynomial."""
    bias_gain: Floats
    """1/s: standard deviation of that estimate for position noise of standard deviation 1."""
    moment: Floats
    """(n, 2): the bias is moment @ (d^(p+1)x/dt^(p+1) / (p+1)!, d^(p+2)x/dt^(p+2) / (p+2)!), p the order."""
    order: NDArray[np.intp]
    left: NDArray[np.intp]
    """Samples used before this one."""
    right: NDArray[np.intp]
    position_noise: float
    """Standard deviation of the position noise estimated from the residuals; NaN when nothing is left over."""
    whole: NDArray[np.bool_]
    """False near the ends, where the window is not the one asked for."""

    def std(self, sigma: float | None = None) -> Floats:
        """Standard deviation of the velocity, for position noise `sigma` or the one estimated from the residuals."""
        out: Floats = self.noise_gain * (self.position_noise if sigma is None else sigma)
        return out

    def rms_bias(self, sigma: float | None = None) -> float:
        """Root mean square of the bias over whole windows, less what noise alone would make its estimate."""
        noise = self.bias_gain * (self.position_noise if sigma is None else sigma)
        known = self.whole & np.isfinite(self.bias) & np.isfinite(noise)
        power = float(np.mean(self.bias[known] ** 2 - noise[known] ** 2)) if known.any() else float("nan")
        return float(np.sqrt(max(power, 0.0))) if np.isfinite(power) else power

    @property
    def statement(self) -> str:
        cut, none = int(np.sum(~self.whole)), int(np.sum(~np.isfinite(self.velocity)))
        return (
            f"velocity of {self.time.size} samples; {cut} near the ends rest on other windows than asked for, "
            f"{none} of all have none"
        )


def _windows(n: int, window: Window, ends: Ends) -> tuple[Windows, NDArray[np.bool_]]:
    """Windows inside a record of n samples, and which of them are as asked for."""
    centre = np.arange(n)
    left, right = np.minimum(window.n_l, centre), np.minimum(window.n_r, n - 1 - centre)
    whole = (left == window.n_l) & (right == window.n_r)
    if ends == "slide":
        left, right = (
            np.minimum(window.n_l + window.n_r - right, centre),
            np.minimum(window.n_r + window.n_l - left, n - 1 - centre),
        )
    return Windows(centre, left, right), whole


def _checked(time: Floats, position: Floats, window: Window, order: int | Adaptive, ends: Ends) -> None:
    if time.ndim != 1 or time.shape != position.shape:
        raise ValueError(f"derivative: time {time.shape} and position {position.shape} must be two (n,) arrays")
    if not (np.all(np.isfinite(time)) and np.all(np.isfinite(position))):
        raise ValueError("derivative: leave out missing samples first; the times need not be even")
    if np.any(np.diff(time) < 0):
        raise ValueError("derivative: time must not run backwards")
    if ends == "slide" and window.n_r == 0:
        raise ValueError("derivative: a causal window (n_r = 0) cannot slide: it would look ahead; use 'shrink'")
    lowest, highest = (order.lowest, order.highest) if isinstance(order, Adaptive) else (order, order)
    if lowest < 1 or highest >= window.size:
        raise ValueError(f"derivative: order must be from 1 to {window.size - 1}, window size less one, got {order}")


def derivative(
    time: Floats, position: Floats, window: Window, order: int | Adaptive = 4, ends: Ends = "shrink"
) -> Derivative:
    """Velocity at each sample of position (n,) taken at time (n,) s, even or not, never backwards.

    The noise quoted is that of white position noise and of the order used; where the order was chosen from the same
    samples (`Adaptive`) the choice itself adds a little. Raises ValueError for arrays or orders that do not fit.

    >>> t = np.array([0.0, 1.0, 2.5, 3.0, 4.0, 5.5])
    >>> derivative(t, t**2, Window(2, 2), order=2).velocity[2:4].round(9).tolist()
    [5.0, 6.0]
    """
    _checked(time, position, window, order, ends)
    n = time.size
    windows, whole = _windows(n, window, ends)
    wide, _ = _windows(n, Window(2 * window.n_l, 2 * window.n_r), ends)
    orders = np.full(n, order) if isinstance(order, int) else _choose(time, position, windows, order)
    smooth, velocity, gain, bias, bias_gain, leverage = np.full((6, n), np.nan)
    moment = np.full((n, 2), np.nan)
    for p in np.unique(orders):
        mine = orders == p
        fits = local_fits(time, position, windows.subset(mine), int(p), (0, 1))
        smooth[mine], velocity[mine] = fits.value.T
        gain[mine] = np.sqrt(fits.cov[:, 1, 1])
        moment[mine], leverage[mine] = fits.moment, fits.leverage
        more = local_fits(time, position, wide.subset(mine), int(p) + 2, (int(p) + 1, int(p) + 2))
        bias[mine] = np.sum(fits.moment * more.value, axis=1)
        bias_gain[mine] = np.sqrt(np.einsum("ki,kij,kj->k", fits.moment, more.cov, fits.moment))
    if ends == "leave out":
        for array in (smooth, velocity, gain, bias, bias_gain, leverage, moment):
            array[~whole] = np.nan
    noise = _position_noise(position - smooth, leverage)
    parts = (smooth, velocity, gain, bias, bias_gain, moment, orders, windows.left, windows.right)
    return Derivative(time, *parts, position_noise=noise, whole=whole)


def _choose(time: Floats, position: Floats, windows: Windows, order: Adaptive) -> NDArray[np.intp]:
    return significant_orders(time, position, windows, order.lowest, order.highest, order.alpha)


def _position_noise(residual: Floats, leverage: Floats) -> float:
    """A residual of white noise has variance sigma^2 (1 - leverage)."""
    used = np.isfinite(residual) & (leverage < 1 - 1e-6)
    power = residual[used] ** 2 / (1 - leverage[used])
    return float(np.sqrt(power.mean())) if used.any() else float("nan")
