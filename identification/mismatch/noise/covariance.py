"""Noise of a response: white, proportional to the force, slow on many time scales, and in bands; and its whitening.

The covariance of rows at uneven times is K = diag((white^2 + (proportional |F|)^2)/count) + sum_j v_j exp(-|dt|/T_j)
+ sum_b v_b cos-like kernels of damped oscillators: a celerite matrix (Foreman-Mackey, Agol, Ambikasaran and Angus,
AJ 154, 220, 2017), which is factored in time proportional to the number of rows. Exponentials on time scales a factor 8
apart make any noise between white and 1/f^2. All variances enter linearly; `noise_likelihood` finds them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from celerite2 import driver
from numpy.typing import NDArray

from identification.recording import Floats
from identification.run_history.least_recently_used import LeastRecentlyUsed

MOST_GROWTH = 60.0
"""Exponent of what lies farther apart than any correlation reaches."""
WITHIN = 0.999
"""Of the room that rows take: what is nearer is no rounding."""
MOST_SHAPES = 64
"""Matrices that are remembered: of some sets of scales and bands on the rows of each run, whole and in parts."""


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
    unsettled: Floats | None = None
    """(n,) N, by how much the thrust differs from its mean of late: what noise after steps goes with."""


def rows_of(time: Floats, count: Floats, spacing: float) -> Rows:
    """Rows of samples (n,) that are mostly `spacing` s apart.

    Where a log wrote them in bursts they are closer: rows that lay over each other would have no covariance.
    """
    width, apart = spacing * count, np.diff(time)
    reach = np.where(count > 1, width, 0.0)
    pair = 0.5 * (reach[1:] + reach[:-1])
    tight = apart < WITHIN * pair
    share = np.ones(apart.size)
    share[tight] = apart[tight] / pair[tight]
    room = np.minimum(np.append(share, 1.0), np.append(1.0, share))[: time.size]
    return Rows(time, count, np.ones(time.size), room * width)


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
    after_steps: int = 0
    """So many of the last scales are of noise that goes with what has not settled: their `slow` are relative."""

    @property
    def variances(self) -> Floats:
        return np.array([self.white, self.proportional, *self.slow, *self.band])

    def everywhere(self, rows: Sequence[Rows]) -> Noise:
        """A law of one size throughout, with the mean power that noise after steps has on these rows."""
        if not self.after_steps:
            return self
        size = np.concatenate([r.unsettled for r in rows if r.unsettled is not None])
        always = len(self.slow) - self.after_steps
        late = tuple(v * float(np.mean(size**2)) for v in self.slow[always:])
        return replace(self, slow=(*self.slow[:always], *late), after_steps=0)

    def with_variances(self, values: Floats) -> Noise:
        J = len(self.scales)
        return replace(
            self,
            white=float(values[0]),
            proportional=float(values[1]),
            slow=tuple(map(float, values[2 : 2 + J])),
            band=tuple(map(float, values[2 + J :])),
        )

    def correlated(self, rows: Rows, size: Floats, shape: Shape) -> tuple[Floats, Floats, Floats, Floats]:
        """c, a, U, V of celerite's matrices for rows at which the force is `size` (n,); `shape`: of this on them."""
        diag = (self.white + self.proportional * size**2) * rows.extra / rows.count
        spread = np.array([*self.slow, *self.band])
        a = diag + shape.gain2 @ spread if spread.size else diag
        columns = np.repeat(spread, [1] * len(self.slow) + [2] * len(self.band))
        return shape.c, a, shape.U * columns, shape.V

    def shape(self, rows: Rows) -> Shape:
        """Exact for samples that lie evenly within each row.

        Where single samples have the covariance Re(A e^(p |dt|)), the mean of a row and that of a later one have
        Re(A f e^(p dt) f'), f the mean of e^(p t) about the row's own middle.
        """
        n, spacing = rows.time.size, rows.width / rows.count
        none = np.empty((n, 0))
        c: list[float] = []
        gain2, U, V = [none], [none], [none]
        for T, size in zip(self.scales, self._sizes(rows), strict=True):
            relaxed = (size * _mean_wave(-spacing / T + 0j, rows.count).real)[:, None]
            c.append(1 / T)
            gain2.append(size**2 * _mean_variance(np.exp(-spacing / T + 0j), rows.count, 1.0))
            U.append(relaxed)
            V.append(relaxed)
        for A, p in self._waves():
            f = _mean_wave(p * spacing, rows.count)
            later, earlier = A * f * np.exp(1j * p.imag * rows.time), f * np.exp(-1j * p.imag * rows.time)
            c += [-p.real, -p.real]
            gain2.append(_mean_variance(np.exp(p * spacing), rows.count, A))
            U.append(np.column_stack([later.real, later.imag]))
            V.append(np.column_stack([earlier.real, -earlier.imag]))
        left, right = np.column_stack(U), np.column_stack(V)
        return Shape(np.array(c), np.column_stack(gain2), np.ascontiguousarray(left), np.ascontiguousarray(right))

    def _sizes(self, rows: Rows) -> list[Floats | float]:
        """What each slow part is a multiple of: 1, or (n,) what has not settled."""
        if not self.after_steps:
            return [1.0] * len(self.scales)
        if rows.unsettled is None:
            raise ValueError("noise after steps needs rows that say how much the thrust has not settled")
        return [1.0] * (len(self.scales) - self.after_steps) + [rows.unsettled] * self.after_steps

    def _waves(self) -> list[tuple[complex, complex]]:
        """A and p of each band: a damped oscillator whose kernel Re(A e^(p |dt|)) is 1 at 0."""
        out = []
        for f, Q in self.bands:
            root = float(np.sqrt(max(4 * Q**2 - 1, 1e-9)))
            out.append((1 - 1j / root, np.pi * f / Q * complex(-1, root)))
        return out


def _mean_wave(turn: NDArray[np.complexfloating], m: Floats) -> NDArray[np.complex128]:
    """(n,) mean of e^(turn k) over m values of k, one apart and even about 0; smaller than that where it overflows."""
    much = 0.5 * np.where(turn.real < 0, -turn, turn)
    growth = (m - 1) * much
    growth = np.minimum(growth.real, MOST_GROWTH) + 1j * growth.imag
    mean = np.exp(growth) * np.expm1(-2 * m * much) / (m * np.expm1(-2 * much))
    out: NDArray[np.complex128] = np.where(m > 1.5, mean, 1.0)
    return out


def _mean_variance(rho: NDArray[np.complex128], m: Floats, height: complex) -> Floats:
    """(n,) variance of the mean of m even samples whose correlation over k samples is Re height rho^k, 1 at 0."""
    far = 1 - rho
    total = 2 * height * rho / far * (m - (1 - rho**m) / far)
    variance = (m + np.real(total)) / m**2
    out: Floats = np.clip(np.where(m > 1.5, variance, 1.0), 1e-12, 1.0)
    return out


class Shapes:
    """The matrices of noises on rows: a search for variances asks for the same again and again."""

    def __init__(self) -> None:
        self._known = LeastRecentlyUsed[Shape](MOST_SHAPES)

    def __call__(self, noise: Noise, rows: Rows) -> Shape:
        return self._known((noise.scales, noise.after_steps, noise.bands), lambda: noise.shape(rows), rows)


MOSTLY = 0.8
"""Share of columns that are not all zero, above which it does not pay to leave out those that are."""


class Whitener:
    """The factored covariance of one run's rows."""

    def __init__(self, noise: Noise, rows: Rows, size: Floats, shapes: Shapes | None = None) -> None:
        self.noise, self.rows = noise, rows
        shape = noise.shape(rows) if shapes is None else shapes(noise, rows)
        self._c, a, self._U, V = noise.correlated(rows, size, shape)
        n, J = self._U.shape
        if J == 0:
            self._d, self._W = a, V
        else:
            self._d, self._W = driver.factor(rows.time, self._c, a, self._U, V, np.empty(n), np.empty((n, J)))
        self._root = np.sqrt(self._d)

    @property
    def log_det(self) -> float:
        return float(np.sum(np.log(self._d)))

    @property
    def innovation(self) -> Floats:
        """(n,) variance of each row, given those before it."""
        return self._d

    def whiten(self, columns: Floats) -> Floats:
        """L^-1 columns for K = L L'; (n,) or (n, p)."""
        flat = columns.ndim == 1
        Y = np.ascontiguousarray(columns[:, None] if flat else columns)
        some = Y.any(axis=0)  # most terms do not move the rate at all
        if np.count_nonzero(some) < MOSTLY * some.size:
            out = np.zeros_like(Y)
            out[:, some] = self.whiten(Y[:, some])
            return out[:, 0] if flat else out
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
