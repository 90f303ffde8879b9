"""Noise of a response: white, proportional to the force, slow on many time scales, and in bands; and its whitening.

The covariance of rows at uneven times is K = diag((white^2 + (proportional |F|)^2)/count) + sum_j v_j exp(-|dt|/T_j)
+ sum_b v_b cos-like kernels of damped oscillators: a celerite matrix (Foreman-Mackey, Agol, Ambikasaran and Angus,
AJ 154, 220, 2017), which is factored in time proportional to the number of rows. Exponentials on time scales a factor 8
apart make any noise between white and 1/f^2. All variances enter linearly; `noise_likelihood` finds them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from celerite2 import driver
from numpy.typing import NDArray

from identification.recording import Floats

MOST_REMEMBERED = 8
"""Sets of scales and bands whose matrices are kept with the rows."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Where one run's response was measured."""

    time: Floats
    """(n,) s, ascending."""
    count: Floats
    """(n,) samples in each row."""
    extra: Floats
    """(n,) variance factor of the white part, above 1 for rows that are trusted less."""
    width: Floats
    """(n,) s over which the samples of a row are spread."""
    memo: dict[object, Shape] = field(default_factory=dict, init=False, repr=False)
    """(scales, bands) -> the matrices of the noise on these rows at unit variances."""


@dataclass(frozen=True, eq=False, slots=True)
class Shape:
    """What the covariance on some rows has of the scales and bands alone: all variances are factors of it."""

    c: Floats
    """(J,) 1/s, celerite's decay of each column."""
    gain2: Floats
    """(n, components) variance that the mean over a row leaves of each."""
    U: Floats
    """(n, J) at unit variances."""
    V: Floats
    """(n, J)."""


@dataclass(frozen=True)
class Noise:
    """Variances in the square of the response's unit, times in s."""

    white: float
    """Of one sample."""
    proportional: float
    """Of one sample, relative to |F| squared."""
    scales: tuple[float, ...] = ()
    slow: tuple[float, ...] = ()
    bands: tuple[tuple[float, float], ...] = ()
    """(frequency in Hz, quality) of each damped oscillator."""
    band: tuple[float, ...] = ()

    @property
    def variances(self) -> Floats:
        return np.array([self.white, self.proportional, *self.slow, *self.band])

    def with_variances(self, values: Floats) -> Noise:
        J = len(self.scales)
        return replace(
            self,
            white=float(values[0]),
            proportional=float(values[1]),
            slow=tuple(map(float, values[2 : 2 + J])),
            band=tuple(map(float, values[2 + J :])),
        )

    def correlated(self, rows: Rows, size: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """c, a, U, V of celerite's matrices for rows at which the force is `size` (n,)."""
        diag = (self.white + self.proportional * size**2) * rows.extra / rows.count
        shape = self.shape(rows)
        spread = np.array([*self.slow, *self.band])
        a = diag + shape.gain2 @ spread if spread.size else diag
        columns = np.repeat(spread, [1] * len(self.slow) + [2] * len(self.band))
        return shape.c, a, shape.U * columns, shape.V

    def shape(self, rows: Rows) -> Shape:
        """As a search for variances asks for it again and again."""
        key = (self.scales, self.bands)
        known = rows.memo.get(key)
        if known is None:
            if len(rows.memo) >= MOST_REMEMBERED:
                rows.memo.clear()
            known = rows.memo[key] = self._shape(rows)
        return known

    def _shape(self, rows: Rows) -> Shape:
        unit = replace(self, slow=(1.0,) * len(self.scales), band=(1.0,) * len(self.bands))
        ac, bc, cc, dc = unit._oscillators()
        ar, cr = np.array(unit.slow), 1 / np.array(self.scales) if self.scales else np.empty(0)
        n, J = rows.time.size, ar.size + 2 * ac.size
        _, U, V = driver.get_celerite_matrices(
            ar, ac, bc, dc, rows.time, np.zeros(n), np.empty(n), np.empty((n, J)), np.empty((n, J))
        )
        gain = self.gains(rows)
        wide = np.repeat(gain, [1] * ar.size + [2] * ac.size, axis=1)
        c = np.concatenate([cr, np.repeat(cc, 2)])
        return Shape(c, gain**2, np.ascontiguousarray(U * wide), np.ascontiguousarray(V * wide))

    def gains(self, rows: Rows) -> Floats:
        """(n, components): what the mean of a row's samples leaves of each, as a factor of its standard deviation."""
        spacing = rows.width / rows.count
        rates = [-1 / T + 0j for T in self.scales]
        rates += [complex(-np.pi * f / Q, 2 * np.pi * f) for f, Q in self.bands]
        return (
            np.column_stack([_mean_gain(np.exp(r * spacing), rows.count) for r in rates])
            if rates
            else np.empty((rows.time.size, 0))
        )

    def _oscillators(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Underdamped harmonic oscillators with unit-height kernels times their variance."""
        f = np.array([b[0] for b in self.bands])
        Q = np.array([b[1] for b in self.bands])
        a = np.array(self.band)
        w = 2 * np.pi * f
        root = np.sqrt(np.maximum(4 * Q**2 - 1, 1e-9))
        return a, a / root, 0.5 * w / Q if Q.size else Q, 0.5 * w * root / Q if Q.size else Q


def _mean_gain(rho: NDArray[np.complex128], m: Floats) -> Floats:
    """Standard deviation of the mean of m even samples whose correlation over k samples is Re rho^k."""
    far = 1 - rho
    variance = np.real((1 + rho) / far - 2 * rho * (1 - rho**m) / (m * far**2)) / m
    out: Floats = np.sqrt(np.clip(np.where(m > 1.5, variance, 1.0), 1e-6, 1.0))
    return out


class Whitener:
    """The factored covariance of one run's rows."""

    def __init__(self, noise: Noise, rows: Rows, size: Floats) -> None:
        self.noise, self.rows = noise, rows
        self._c, a, self._U, V = noise.correlated(rows, size)
        n, J = self._U.shape
        if J == 0:
            self._d, self._W = a, V
        else:
            self._d, self._W = driver.factor(rows.time, self._c, a, self._U, V, np.empty(n), np.empty((n, J)))
        self._root = np.sqrt(self._d)

    @property
    def log_det(self) -> float:
        return float(np.sum(np.log(self._d)))

    def whiten(self, columns: Floats) -> Floats:
        """L^-1 columns for K = L L'; (n,) or (n, p)."""
        flat = columns.ndim == 1
        Y = np.ascontiguousarray(columns[:, None] if flat else columns)
        if self._U.shape[1]:
            Y = driver.solve_lower(self.rows.time, self._c, self._U, self._W, Y, np.empty_like(Y))
            Y /= self._root[:, None]
        else:
            Y = Y / self._root[:, None]
        return Y[:, 0] if flat else Y

    def weighed(self, white: Floats) -> Floats:
        """(n,) L'^-1 white, for products of any number of columns: `whiten(column) @ white` is `column @` this."""
        scaled = np.ascontiguousarray((white / self._root)[:, None])
        if self._U.shape[1]:
            scaled = driver.solve_upper(self.rows.time, self._c, self._U, self._W, scaled, np.empty_like(scaled))
        out: Floats = scaled[:, 0]
        return out
