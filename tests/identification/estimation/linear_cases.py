"""Monte Carlo cases of the linear estimators (4.1), the thruster models (4.2.2) and the velocity (4.2.3)."""

from functools import lru_cache

import numpy as np

from identification.estimation.least_squares import Rows, estimate
from identification.estimation.maximum_likelihood import maximise
from identification.estimation.regression import least_squares
from identification.estimation.streaming import stream_least_squares
from identification.thruster.thrust import fit_thrust
from identification.velocity.linear_drag import THESIS_EXAMPLE, linear_drag_response
from identification.velocity.velocity import Window, derivative
from tests.identification.estimation.monte_carlo import (
    NOISES,
    Case,
    Draw,
    covariance,
    drawn,
    efficient,
    efficient_blockwise,
)
from tests.identification.thrust_runs import sine, staircase

NAMES = ("C", "tare")
THETA = np.array([0.4, 1.5])
SIGMA = 0.3
LINEAR_ROWS = 120


@lru_cache
def regressor(n):
    V = 18 * np.sin(2 * np.pi * np.arange(n) / (n / 3))
    return np.column_stack([V * np.abs(V), np.ones(n)])


@lru_cache
def uneven(n):
    """Standard deviations that grow threefold along the rows."""
    return SIGMA * np.linspace(0.5, 1.5, n)


@lru_cache(maxsize=32)
def best(noise, n, weights=False):
    s = uneven(n) if weights else np.full(n, SIGMA)
    return efficient(regressor(n), covariance(noise, n) * np.outer(s, s))


def linear(name, noise, solve, n=LINEAR_ROWS, weights=False, cheap=10, remark=""):
    """`solve`(H, y) -> theta, std, dof."""
    H, ideal = regressor(n), best(noise, n, weights)
    s = uneven(n) if weights else SIGMA

    def draw(rng):
        e = s * drawn(noise, rng, n)
        theta, std, dof = solve(H, H @ THETA + e)
        return Draw(theta - THETA, std, np.broadcast_to(dof, 2) * 1.0, ideal.gain @ e, ideal.std)

    return Case(name, noise, NAMES, draw, cheap, remark)


def _ls(H, y):
    fit = least_squares(H, y, NAMES)
    return fit.theta, fit.std, fit.dof


def _wls(sigma):
    def solve(H, y):
        fit = least_squares(H, y, NAMES, sigma)
        return fit.theta, fit.std, np.inf

    return solve


def _ml(Sigma):
    root = np.linalg.inv(np.linalg.cholesky(Sigma))

    def solve(H, y):
        A, b = root @ H, root @ y
        found = maximise(NAMES, np.array([0.1, 0.0]), np.ones(2), lambda theta: b - theta @ A.T)
        return found.estimate.mean, np.sqrt(np.diag(found.estimate.cov)), np.inf

    return solve


def _rows(H, y, method="wls"):
    """Even samples of unknown noise, as `rig fit` treats a sine or a ramp."""
    found = estimate(Rows(H, y, NAMES, (slice(0, y.size),), even=True), method)
    spread = [found.spread(c) for c in np.eye(2)]
    return found.fit.theta, np.array([s.std for s in spread]), np.array([s.dof for s in spread])


def _stream(H, y):
    blocks = ((H[i : i + 400], y[i : i + 400]) for i in range(0, len(y), 400))
    fit = stream_least_squares(blocks, NAMES).fit
    return fit.theta, fit.std, fit.dof


def linear_cases():
    n = LINEAR_ROWS
    yield linear("LS", "white", _ls)
    for noise in ("AR(1) 0.5", "AR(1) 0.9"):
        yield linear("LS", noise, _ls, remark="eq. 4.6 as printed: not corrected for correlation")
    yield linear("WLS diagonal", "white", _wls(uneven(n)), weights=True)
    for noise in NOISES:
        S = covariance(noise, n)
        yield linear("WLS full Sigma (BLUE)", noise, _wls(S * np.outer(uneven(n), uneven(n))), weights=True, cheap=5)
        yield linear("Gaussian ML", noise, _ml(S * SIGMA**2), cheap=1)
    yield linear("streaming LS", "white", _stream, n=2000, cheap=2)
    for noise in NOISES:
        yield linear("samples, noise unknown, 120", noise, _rows, cheap=2)
        yield linear("samples, spectrum weighed, 120", noise, lambda H, y: _rows(H, y, "gls"), cheap=2)
        yield linear("samples, noise unknown, 1600", noise, _rows, n=1600)


LEVELS = (0.0, 9.0, -9.0, 18.0, -18.0, 0.0, 13.0, -13.0, 0.0, 6.0, -6.0, 16.0, -16.0, 0.0)


def thruster(name, noise, model, make, H, lengths, where, parameters):
    """`lengths`: samples of each stretch whose noise has nothing to do with that of the others."""
    ideal = efficient_blockwise(H, noise, lengths, SIGMA)
    truth = np.array([0.4] * (H.shape[1] - 1) + [1.5])

    def draw(rng):
        run = make(rng, noise)
        e = run.channels[1].value - H @ truth
        fit = fit_thrust([run], model=model)
        found = [*fit.parameters.values(), *fit.tare.values()]
        value, std, dof = (np.array([getattr(p, f) for p in found]) for f in ("value", "std", "dof"))
        return Draw(value - truth, std, dof, ideal.gain @ e, ideal.std)

    return Case(f"{name}, {where}", noise, parameters, draw)


def _noise(name):
    return lambda rng, n, runs=1: drawn(name, rng, n)[None]


def _holds(samples):
    """Noise of a hold has nothing to do with that of the next: on the rig the thruster settles between them. Were it
    continuous, the best estimator would live on the last sample before a step and the first one after it."""

    def make(rng, noise):
        def apart(rng, n, runs=1):
            return np.concatenate([drawn(noise, rng, samples) for _ in LEVELS])[None]

        return staircase(noise=apart, levels=LEVELS, hold=samples / 50, rate=50.0, rng=rng, sigma=SIGMA)

    return make


def _sine(rng, noise):
    return sine(noise=_noise(noise), rng=rng, sigma=SIGMA)


def thruster_cases():
    for noise in NOISES:
        for samples in (60, 200):
            square = np.repeat([v * abs(v) for v in LEVELS], samples)
            one = np.column_stack([square, np.ones(square.size)])
            two = np.column_stack([np.maximum(square, 0), np.minimum(square, 0), np.ones(square.size)])
            where = f"holds of {samples}"
            yield thruster(
                "C V|V| + tare", noise, "C V|V|", _holds(samples), one, [samples] * len(LEVELS), where, ("C", "tare")
            )
            yield thruster(
                "C+/C- + tare",
                noise,
                "C+/C-",
                _holds(samples),
                two,
                [samples] * len(LEVELS),
                where,
                ("C+", "C-", "tare"),
            )
        V = _sine(np.random.default_rng(0), "white").channels[0].value
        H = np.column_stack([V * np.abs(V), np.ones(V.size)])
        yield thruster("C V|V| + tare", noise, "C V|V|", _sine, H, [V.size], "sine", ("C", "tare"))


POSITION_SIGMA = 0.07
"""m, section 4.2.3."""


def velocity_cases():
    """The worked example at t = 60 s. Efficient: least squares of order 4 in the same window, which the filter is."""
    t = np.arange(181.0 * 3) / 3
    x, v = linear_drag_response(t, THESIS_EXAMPLE)
    at, window = 180, Window(10, 10)
    clean = derivative(t, x, window)
    shift = clean.velocity[at] - v[at]
    for noise in NOISES:
        used = slice(at - 10, at + 11)
        u = t[used] - t[at]
        S = covariance(noise, 21) * POSITION_SIGMA**2
        ideal = efficient(np.vander(u, 5, increasing=True), S)

        def draw(rng, noise=noise, used=used, ideal=ideal):
            e = POSITION_SIGMA * drawn(noise, rng, t.size)
            found = derivative(t, x + e, window)
            error = np.array([found.velocity[at] - v[at] - shift])
            std, n = np.array([found.std()[at]]), t.size
            return Draw(error, std, np.array([n / 2.0]), (ideal.gain @ e[used])[1:2], ideal.std[1:2])

        remark = "bias of the clean trajectory taken off" if noise == "white" else "stated for white noise"
        yield Case("Savitzky-Golay velocity", noise, ("velocity",), draw, 1, remark)


def cases():
    yield from linear_cases()
    yield from thruster_cases()
    yield from velocity_cases()
