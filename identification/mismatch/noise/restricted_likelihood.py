"""Restricted likelihood of the variances of the noise, with its slope and average information.

All variances enter the covariance linearly. With columns fitted to the same data, P = K^-1 - K^-1 X (X' K^-1 X)^-1 X'
K^-1 and V_i = dK/dv_i the slope of half the restricted deviance is (tr P V_i - y' P V_i P y)/2 (Patterson and Thompson,
Biometrika 58, 545, 1971) and its average information y' P V_i P V_j P y/2 (Gilmour, Thompson and Cullis, Biometrics 51,
1440, 1995): the mean of observed and expected, without a trace.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from celerite2 import backprop, driver

from identification.mismatch.noise.covariance import Noise, Rows, Shape, Shapes
from identification.recording import Floats

LinAlgError = driver.LinAlgError
MOST_COLUMNS = 4
"""celerite2 0.3.3 gives wrong slopes for more of them (its tests stop there): then slopes are found by differences."""
STEP = 1e-5
"""Relative step of a difference."""


@dataclass(frozen=True, eq=False)
class Response:
    """What one run left: residual (n,), columns (n, p) of what was fitted to it and |F| (n,) at its rows."""

    rows: Rows
    residual: Floats
    columns: Floats
    size: Floats
    shapes: Shapes = field(default_factory=Shapes, repr=False)
    """What remembers the matrices of the noise on these rows."""


@dataclass(frozen=True, eq=False)
class Likelihood:
    """At some variances v, (k,) each."""

    value: float
    """Half the restricted deviance."""
    traces: Floats
    """tr P V_i / 2."""
    squares: Floats
    """y' P V_i P y / 2."""
    information: Floats
    """(k, k) average information."""
    quadratic: float
    """y' P y."""
    freedom: int
    """Rows less columns."""

    @property
    def slope(self) -> Floats:
        return self.traces - self.squares

    def scaled(self, s: float) -> Likelihood:
        """The same where all variances are s times as large."""
        value = self.value + 0.5 * self.freedom * float(np.log(s)) + 0.5 * self.quadratic * (1 / s - 1)
        squares, information = self.squares / s**2, self.information / s**3
        return Likelihood(value, self.traces / s, squares, information, self.quadratic / s, self.freedom)


@dataclass(frozen=True, eq=False)
class _Factored:
    """Of one run's covariance, with the residual and columns solved."""

    c: Floats
    a: Floats
    U: Floats
    V: Floats
    d: Floats
    W: Floats
    S: Floats
    Z: Floats
    """(n, p + 1) L^-1 of columns and residual."""
    F: Floats


def likelihood(noise: Noise, responses: Sequence[Response]) -> Likelihood:
    """At the variances of `noise`; raises `LinAlgError` where the covariance is not positive."""
    factored, value, turn = _reduced(noise, responses)
    p = turn.shape[0] - 1
    k = noise.variances.size
    slope, squares, inner, across = np.zeros(k), np.zeros(k), np.zeros((k, k)), np.zeros((p, k))
    backwards = factored[0].U.shape[1] <= MOST_COLUMNS
    quadratic = 0.0
    for response, f in zip(responses, factored, strict=True):
        Z = f.Z @ turn
        quadratic += float(np.sum(Z[:, p] ** 2 / f.d))
        if backwards:
            slope += _over_variances(noise, response, *_backwards(response.rows.time, f, Z, turn))
        moved, square = _moved(noise, response, _solved(response.rows.time, f, Z[:, p]))
        squares += square
        white = _whitened(response.rows.time, f, moved)
        weighted = white / f.d[:, None]
        inner += white.T @ weighted
        across += Z[:, :p].T @ weighted
    if not backwards:
        slope = _differences(noise, responses, value)
    information = 0.5 * (inner - across.T @ across)
    freedom = sum(r.residual.size for r in responses) - p
    return Likelihood(value, slope + squares, squares, information, quadratic, freedom)


def _reduced(noise: Noise, responses: Sequence[Response]) -> tuple[list[_Factored], float, Floats]:
    """Each run factored, half the restricted deviance, and what makes of (columns, residual) orthonormal columns and
    what they leave."""
    p = responses[0].columns.shape[1]
    gram, moment, square = np.zeros((p, p)), np.zeros(p), 0.0
    value = 0.0
    factored = []
    for response in responses:
        f = _factored(noise, response)
        weighted = f.Z[:, :p] / f.d[:, None]
        gram += f.Z[:, :p].T @ weighted
        moment += weighted.T @ f.Z[:, p]
        square += float(np.sum(f.Z[:, p] ** 2 / f.d))
        value += 0.5 * float(np.sum(np.log(f.d)))
        factored.append(f)
    lower = np.linalg.cholesky(gram + 1e-12 * np.diag(np.diag(gram) + 1e-300))
    over = np.linalg.inv(lower)
    turn = np.zeros((p + 1, p + 1))
    turn[:p, :p] = over.T
    turn[:p, p] = -over.T @ (over @ moment)
    turn[p, p] = 1.0
    value += float(np.sum(np.log(np.diag(lower)))) + 0.5 * (square - float(np.sum((over @ moment) ** 2)))
    return factored, value, turn


def _differences(noise: Noise, responses: Sequence[Response], value: float) -> Floats:
    """Slope over each variance by small steps."""
    values = noise.variances
    slope = []
    for j, step in enumerate(STEP * np.maximum(values, 1e-9 * values.max())):
        moved = values.copy()
        moved[j] += step
        slope.append((_reduced(noise.with_variances(moved), responses)[1] - value) / step)
    return np.array(slope)


def _factored(noise: Noise, response: Response) -> _Factored:
    time = response.rows.time
    c, a, U, V = noise.correlated(response.rows, response.size, response.shapes(noise, response.rows))
    n, J = U.shape
    Y = np.ascontiguousarray(np.column_stack([response.columns, response.residual]))
    if J == 0:  # celerite2 wants a column at least
        return _Factored(c, a, U, V, a, V, np.empty((n, 0, 0)), Y, np.empty((n, 0, Y.shape[1])))
    d, W, S = backprop.factor_fwd(time, c, a, U, V, np.empty(n), np.empty((n, J)), np.empty((n, J, J)))
    Z, F = backprop.solve_lower_fwd(time, c, U, W, Y, np.empty_like(Y), np.empty((n, J, Y.shape[1])))
    return _Factored(c, a, U, V, d, W, S, Z, F)


def _backwards(time: Floats, f: _Factored, Z: Floats, turn: Floats) -> tuple[Floats, Floats]:
    """Slopes over a and U of half of log det K + sum of y' K^-1 y over the columns y that `turn` makes Z."""
    n, J = f.U.shape
    k = Z.shape[1]

    def none(*shape: int) -> Floats:
        return np.zeros(shape)  # celerite2 adds to what it is given

    bd = 0.5 / f.d - 0.5 * np.sum(Z**2, axis=1) / f.d**2
    if J == 0:
        return bd, none(n, J)
    bZ = np.ascontiguousarray(Z @ turn.T / f.d[:, None])
    solved = backprop.solve_lower_rev(
        time, f.c, f.U, f.W, f.Z, f.Z, f.F, bZ, none(n), none(J), none(n, J), none(n, J), none(n, k)
    )
    bW = np.ascontiguousarray(solved[3])
    factored = backprop.factor_rev(
        time, f.c, f.a, f.U, f.V, f.d, f.W, f.S, bd, bW, none(n), none(J), none(n), none(n, J), none(n, J)
    )
    return factored[2], solved[2] + factored[3]


def _over_variances(noise: Noise, response: Response, ba: Floats, bU: Floats) -> Floats:
    """Slope over each variance of the noise, from those over celerite's a and U."""
    rows, size = response.rows, response.size
    shape = response.shapes(noise, rows)
    per_count = rows.extra / rows.count
    moved = np.sum(bU * shape.U, axis=0)  # U is linear in the variances
    J = len(noise.slow)
    by_band = moved[J:].reshape(-1, 2).sum(axis=1)
    own = [float(ba @ per_count), float(ba @ (per_count * size**2))]
    return np.array([*own, *(ba @ shape.gain2 + np.concatenate([moved[:J], by_band]))])


def _whitened(time: Floats, f: _Factored, Y: Floats) -> Floats:
    """(n, k) L^-1 Y."""
    if f.U.shape[1] == 0:
        return Y
    out: Floats = driver.solve_lower(time, f.c, f.U, f.W, np.ascontiguousarray(Y), np.empty_like(Y))
    return out


def _solved(time: Floats, f: _Factored, z: Floats) -> Floats:
    """(n,) K^-1 of what L^-1 made z."""
    if f.U.shape[1] == 0:
        return z / f.d
    Y = np.ascontiguousarray((z / f.d)[:, None])
    out: Floats = driver.solve_upper(time, f.c, f.U, f.W, Y, np.empty_like(Y))[:, 0]
    return out


def _moved(noise: Noise, response: Response, s: Floats) -> tuple[Floats, Floats]:
    """(V_i s (n, k), s' V_i s / 2 (k,))."""
    rows, size = response.rows, response.size
    shape = response.shapes(noise, rows)
    own = s * rows.extra / rows.count
    columns = [own, own * size**2]
    J = len(noise.slow)
    groups = [slice(j, j + 1) for j in range(J)] + [slice(J + 2 * b, J + 2 * b + 2) for b in range(len(noise.band))]
    columns += [_times(rows.time, shape, j, group, s) for j, group in enumerate(groups)]
    moved = np.column_stack(columns)
    return moved, 0.5 * (s @ moved)


def _times(time: Floats, shape: Shape, component: int, group: slice, s: Floats) -> Floats:
    """Covariance of one component at unit variance, times s."""
    c = np.ascontiguousarray(shape.c[group])
    U, V = np.ascontiguousarray(shape.U[:, group]), np.ascontiguousarray(shape.V[:, group])
    Y = np.ascontiguousarray(s[:, None])
    out = Y * shape.gain2[:, component, None]
    driver.matmul_lower(time, c, U, V, Y, out)
    driver.matmul_upper(time, c, U, V, Y, out)
    return out[:, 0]
