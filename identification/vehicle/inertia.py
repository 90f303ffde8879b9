"""Step two of the vehicle's identification (section 4.2): inertia from sine-force trials, with step one carried in.

`output_error` is the best estimate: the simulated vehicle is fitted to the position itself; drag, efficiencies,
current and thruster coefficients are parameters too, known beforehand as step one left them. `by_derivative` is the
thesis's way: Savitzky and Golay's derivatives and a straight line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.fft import dct, idct

from identification.estimation.even_noise import fit_noise
from identification.estimation.maximum_likelihood import NOTHING, Gaussian, Maximum, maximise
from identification.estimation.verdicts import Whiteness, significance, whiteness
from identification.recording import Floats
from identification.thruster.thrust_data import Unusable
from identification.vehicle.entangled import entanglement
from identification.vehicle.inertia_by_derivative import LEAST, SMOOTHING, inverse_inertia, sensor_noise, smoothed
from identification.vehicle.replay import Validation, validate
from identification.vehicle.simulation import simulate_all
from identification.vehicle.steady_drag import unit_of
from identification.vehicle.trials import Trial
from identification.velocity.velocity import derivative

ROUNDS = 3
"""Most times the noise is found anew from the residual of the fit it weighs."""
SETTLING = 0.1
"""Share of a trial, see `start_inertia`."""
SAME_NOISE = 0.03
"""Relative change of the noise below which it is not worth another round."""


@dataclass(frozen=True, eq=False)
class InertiaFit:
    """Inertia of one axis, by any method."""

    axis: str
    method: str
    estimate: Gaussian
    """m and everything that was known or fitted with it, jointly. Starts of trials are left out."""
    noise_std: tuple[float, ...]
    """Of one measurement of each trial."""
    validation: tuple[Validation, ...]
    """Of the trials it was fitted to."""
    whiteness: tuple[Whiteness | None, ...] = ()
    maximum: Maximum | None = field(default=None, repr=False)

    @property
    def statements(self) -> tuple[str, ...]:
        out = []
        for name in self.estimate.names:
            if name.startswith(("C[", "C+", "C-", "thrust[", "current")) or (name != "m" and not self._fitted(name)):
                continue
            value, std = self.estimate[name], self.estimate.std_of(name)
            unit = unit_of(name, self.axis)
            known = significance(value, std).significant
            text = f"{value:.4g} ± {std:.2g} {unit}" if np.isfinite(std) else "not determined"
            weak = "" if known or not np.isfinite(std) else ", not significant (Indiveri 1998, eq. 4.11)"
            out.append(f"{self.axis}: {name} = {text}{weak} ({self.method})")
        out.extend(f"{self.axis}: {v.statement}" for v in self.validation)
        return (*out, *self.verdicts)

    @property
    def verdicts(self) -> tuple[str, ...]:
        """What to know before the numbers are used."""
        out: list[str] = []
        out.extend(
            f"{self.axis}: {name} is negative, which no body has: the model lacks something, or the data do not show it"
            for name in ("m", "k", "k2")
            if name in self.estimate.names and self.estimate[name] < 0
        )
        if self.maximum is not None:
            physical = [n for n in self.estimate.names if n in ("m", "k", "k2") or n.startswith("eta")]
            out.extend(entanglement(self.axis, self.maximum, physical))
        coloured = [w for w in self.whiteness if w is not None and not w.white]
        if coloured:
            worst = min(coloured, key=lambda w: w.p_value)
            out.append(f"{self.axis}: in {len(coloured)} of {len(self.whiteness)} trials {worst.statement}")
        return tuple(out)

    def _fitted(self, name: str) -> bool:
        return self.maximum is not None and name in self.maximum.estimate.names


def starts_of(trials: Sequence[Trial]) -> dict[str, float]:
    """First position and velocity of each trial, by a polynomial through its first samples: `x0[0]`, `v0[0]` ..."""
    out = {}
    for i, one in enumerate(trials):
        if one.quantity == "speed":
            out[f"v0[{i}]"] = float(one.response[: SMOOTHING.n_r].mean())
            continue
        found = derivative(one.time, one.response, SMOOTHING, 2)
        out[f"x0[{i}]"], out[f"v0[{i}]"] = float(found.position[0]), float(found.velocity[0])
    return out


def responses(
    trials: Sequence[Trial], names: Sequence[str], theta: Floats, buoyancy: Mapping[str, str]
) -> list[Floats]:
    """Simulated measurement (k, n_i) of each trial."""
    floats = [buoyancy.get(one.recording_id, "") for one in trials]
    states = [(f"x0[{i}]", f"v0[{i}]") for i in range(len(trials))]
    moved = simulate_all(trials, names, theta, floats, states)
    return [m.position if one.quantity == "position" else m.velocity for one, m in zip(trials, moved, strict=True)]


def output_error(
    trials: Sequence[Trial],
    known: Gaussian = NOTHING,
    free: Mapping[str, float] | None = None,
    buoyancy: Mapping[str, str] | None = None,
    *,
    correlated: bool = False,
) -> InertiaFit | Unusable:
    """Fit the simulated vehicle to trials of one axis.

    `known`: parameters with their covariance from step one or from elsewhere (a weighed mass). `free`: further
    parameters and where to start; default: m alone, started by `start_inertia`. Noise may be autocorrelated: the
    covariance allows for it. `correlated` weighs by the spectrum of the residual as well, which is the most likely
    fit under slow sensor noise (and also forgives slowly what the model lacks: on real vehicles look at both).
    """
    if not trials:
        return Unusable("no trial was given; expected at least one with a measured motion")
    axis, floats = trials[0].axis, dict(buoyancy or {})
    chosen = dict(free) if free is not None else {"m": start_inertia(trials, known, floats)}
    names, start = _begun(trials, known, chosen)
    scale = _scales(names, start, known)
    measured = [one.response for one in trials]
    roots = [np.full(one.time.size, sensor_noise(one)) for one in trials]
    for _ in range(ROUNDS):

        def misfit(theta: Floats, roots: Sequence[Floats] = tuple(roots)) -> Floats:
            found = responses(trials, names, theta, floats)
            return np.hstack([_cosines(y - f) / s for y, f, s in zip(measured, found, roots, strict=True)])

        best = maximise(names, start, scale, misfit, known)
        start, used = best.estimate.mean, roots
        left = _residuals(best, used)
        spectra = [_spectrum(r) for r in left]
        roots = spectra if correlated else [_level(r, len(names) / len(trials)) for r in left]
        if max(float(np.abs(np.log(new / old)).mean()) for new, old in zip(roots, used, strict=True)) < SAME_NOISE:
            break
    estimate = _without_starts(trials, best, np.hstack([s / root for s, root in zip(spectra, used, strict=True)]))
    sigma = tuple(float(np.sqrt(np.mean(root**2))) for root in roots)
    white = tuple(whiteness(r) for r in left)
    return InertiaFit(axis, "output error", estimate, sigma, _validation(trials, left), white, best)


def _begun(trials: Sequence[Trial], known: Gaussian, chosen: Mapping[str, float]) -> tuple[tuple[str, ...], Floats]:
    """Every parameter by name and where its fit begins (p,): those chosen, what else is known, the trials' starts."""
    begin = {**chosen, **{n: known[n] for n in known.names if n not in chosen}, **starts_of(trials)}
    return tuple(begin), np.array([*begin.values()])


def _without_starts(trials: Sequence[Trial], best: Maximum, louder: Floats) -> Gaussian:
    """What was asked, with the covariance of noise that is `louder` (n,) times as strong at each frequency."""
    names, starts = best.estimate.names, starts_of(trials)
    whole = Gaussian(names, best.estimate.mean, best.with_noise(np.diag(louder**2)))
    return whole.select([name for name in names if name not in starts])


def _scales(names: Sequence[str], start: Floats, known: Gaussian) -> Floats:
    known_std = dict(zip(known.names, np.sqrt(np.diag(known.cov)), strict=True))
    sizes = [max(float(known_std.get(n, 0.0)), 1e-3 * abs(v)) for n, v in zip(names, start, strict=True)]
    floor = [0.1 if n.startswith(("x0", "v0")) else 1.0 for n in names]
    return np.array(
        [max(abs(v), f) if n not in known_std else s for n, v, s, f in zip(names, start, sizes, floor, strict=True)]
    )


def _cosines(y: Floats) -> Floats:
    """Cosine coefficients of the last axis: white noise stays white, other noise becomes nearly independent."""
    out: Floats = dct(y, axis=-1, norm="ortho")
    return out


def _residuals(best: Maximum, roots: Sequence[Floats]) -> list[Floats]:
    """Of each trial, in the unit of the measurement."""
    parts = np.split(best.misfit, np.cumsum([root.size for root in roots])[:-1])
    return [idct(part * root, norm="ortho") for part, root in zip(parts, roots, strict=True)]


def _level(residual: Floats, parameters: float) -> Floats:
    """Standard deviation (n,) of each cosine coefficient of white noise (eq. 4.12)."""
    dof = max(residual.size - parameters, 1.0)
    return np.full(residual.size, max(float(np.sqrt(residual @ residual / dof)), 1e-12))


def _spectrum(residual: Floats) -> Floats:
    """Standard deviation (n,) of each cosine coefficient of autocorrelated noise."""
    model, n = fit_noise(residual), residual.size
    power = np.concatenate([[n * model.mean_variance()], model.spectrum(np.arange(1, n) / (2 * n))])
    out: Floats = np.sqrt(np.maximum(power, 1e-24))
    return out


def _validation(trials: Sequence[Trial], left: Sequence[Floats]) -> tuple[Validation, ...]:
    out = []
    for one, r in zip(trials, left, strict=True):
        power = float(np.linalg.norm(one.response - one.response.mean()))
        fit = 100 * (1 - float(np.linalg.norm(r)) / power) if power > 0 else float("nan")
        out.append(Validation(one.recording_id, one.quantity, float(np.sqrt(np.mean(r**2))), fit))
    return tuple(out)


def start_inertia(trials: Sequence[Trial], known: Gaussian, buoyancy: Mapping[str, str]) -> float:
    """Inertia to start a search from: the thesis's way on the first trial where it gives a positive one.

    If it does on none: what would make the vehicle settle in a tenth of the trial.
    """
    settling = [1.0]
    k, k2 = (known[name] if name in known.names else 0.0 for name in ("k", "k2"))
    for one in trials:
        found = smoothed(one)
        if found is None:
            continue
        inverse, _ = inverse_inertia(found, known.names, known.mean, buoyancy)
        if np.isfinite(inverse) and inverse > 0:
            return 1 / inverse
        slope = abs(k) + 2 * abs(k2) * float(np.abs(found.velocity).max())
        settling.append(slope * SETTLING * float(np.ptp(one.time)))
    return max(settling)


def by_derivative(
    trials: Sequence[Trial], known: Gaussian, buoyancy: Mapping[str, str] | None = None
) -> InertiaFit | Unusable:
    """The thesis's way: derivatives by Savitzky and Golay, then least squares for 1/m; step one's errors carried in.

    Trials are averaged by their own variances; what is known beforehand moves all of them together.
    """
    floats = dict(buoyancy or {})
    ready = [found for one in trials if (found := smoothed(one)) is not None]
    if not trials or len(ready) < len(trials):
        return Unusable(f"by_derivative: each trial needs at least {LEAST} measurements, two windows of the filter")
    single = [inverse_inertia(one, known.names, known.mean, floats) for one in ready]
    if not all(q > 0 for q, _ in single):
        return Unusable("by_derivative: acceleration does not follow the force; signs or drag are not as stated")
    weight = np.array([1 / std**2 for _, std in single])
    weight = weight / weight.sum()

    def inertia(theta: Floats) -> float:
        return 1 / float(weight @ [inverse_inertia(one, known.names, theta, floats)[0] for one in ready])

    m = inertia(known.mean)
    own = m**2 * float(np.sqrt(np.sum((weight * [std for _, std in single]) ** 2)))
    step = 1e-2 * np.sqrt(np.diag(known.cov)) + 1e-9
    slope = np.array(
        [
            (inertia(known.mean + d) - inertia(known.mean - d)) / (2 * s)
            for d, s in zip(np.diag(step), step, strict=True)
        ]
    ).reshape(-1)
    cross = known.cov @ slope
    cov = np.block([[np.array([[own**2 + float(slope @ cross)]]), cross[None]], [cross[:, None], known.cov]])
    estimate = Gaussian(("m", *known.names), np.append(m, known.mean), cov)
    noise = tuple(sensor_noise(one) for one in trials)
    checked = validate(trials, estimate, floats)
    return InertiaFit(trials[0].axis, "Savitzky-Golay and least squares", estimate, noise, checked)
