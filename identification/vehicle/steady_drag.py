"""Step one of the vehicle's identification (section 4.2): drag, efficiency, current and buoyancy from steady runs.

At constant velocity k xi + k2 |xi| xi = tau: what was measured is the velocity, what is asked for makes the force.
The runs are therefore fitted in velocity, where their errors are, by maximum likelihood. The thruster coefficients
are parameters too, known beforehand with the covariance of their calibration: an error in one of them is the same
error in every run, and comes out as part of the covariance of drag and efficiency.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq, nnls

from identification.estimation.maximum_likelihood import NOTHING, Gaussian, Maximum, independent, maximise
from identification.estimation.verdicts import Underfit, significance, underfit
from identification.recording import Floats, Recording
from identification.thruster.thrust_data import Unusable
from identification.vehicle.efficiency import Installation, efficiency_sentence
from identification.vehicle.entangled import entanglement
from identification.vehicle.simulation import column, current_along
from identification.vehicle.trials import SteadyRun, ballast_of, steady_runs

CURRENT_STD = 1.0
"""m/s: known of any current before it is measured. It settles the direction that no run was driven along."""
CURRENT = ("current_north", "current_east")
UNITS = {
    "m": ("kg", "kg.m^2"),
    "k": ("N/(m/s)", "N.m/(rad/s)"),
    "k2": ("N/(m/s)^2", "N.m/(rad/s)^2"),
    "current_north": ("m/s", "m/s"),
    "current_east": ("m/s", "m/s"),
}
"""Of a translation and of yaw."""


def unit_of(name: str, axis: str) -> str:
    """Unit of a vehicle parameter.

    >>> unit_of("k", "yaw"), unit_of("eta_hull", "surge"), unit_of("buoyancy[light]", "heave")
    ('N.m/(rad/s)', '1', 'N')
    """
    if name in UNITS:
        return UNITS[name][axis == "yaw"]
    if name.startswith("C"):
        return "N/V^2"
    return "N" if name.startswith(("buoyancy", "thrust")) else "1"


@dataclass(frozen=True, eq=False)
class DragFit:
    """Drag and what was found with it on one axis."""

    axis: str
    estimate: Gaussian
    """k, k2, efficiencies, current, buoyancies and thruster coefficients, with their joint covariance."""
    etas: tuple[str, ...]
    runs: tuple[SteadyRun, ...]
    predicted: Floats
    """Velocity of each run by the fit, m/s or rad/s."""
    underfit: Underfit
    excess_std: float
    """m/s or rad/s added to each velocity's standard error so that the runs scatter as they say; 0 when they did."""
    maximum: Maximum = field(repr=False)
    buoyancy: Mapping[str, str]
    """recording id -> parameter, heave only."""

    @property
    def statements(self) -> tuple[str, ...]:
        """Parameters, then verdicts, a sentence each."""
        return (*_parameters(self), *self.verdicts)

    @property
    def verdicts(self) -> tuple[str, ...]:
        return _verdicts(self)


def steady_velocity(push: Floats, k: Floats, k2: Floats) -> Floats:
    """The root xi of k xi + k2 |xi| xi = push that has the sign of push; also where k2 or k is 0.

    >>> steady_velocity(np.array([6.0, -6.0, 4.0]), np.array([1.0, 1.0, 2.0]), np.array([1.0, 1.0, 0.0])).tolist()
    [2.0, -2.0, 2.0]
    """
    inside = np.maximum(k**2 + 4 * k2 * np.abs(push), 0.0)
    out: Floats = 2 * push / np.maximum(k + np.sqrt(inside), 1e-12)
    return out


def predicted_velocities(
    runs: Sequence[SteadyRun], names: Sequence[str], theta: Floats, buoyancy: Mapping[str, str]
) -> Floats:
    """Velocity over ground (k, r) of r runs for k parameter sets."""
    k, k2 = column(names, theta, "k", 0.0), column(names, theta, "k2", 0.0)
    out = np.empty((theta.shape[0], len(runs)))
    for j, run in enumerate(runs):
        push = (run.force.weights(names, theta) @ run.force.signal)[:, 0]
        push = push + column(names, theta, buoyancy.get(run.recording_id, ""), 0.0)
        out[:, j] = steady_velocity(push, k, k2) + current_along(names, theta, run.axis, run.heading)
    return out


def identify_drag(
    recordings: Sequence[Recording],
    installation: Installation,
    axis: str,
    known: Gaussian = NOTHING,
    *,
    current: bool = True,
    experiments: Mapping[str, str] | None = None,
) -> DragFit | Unusable:
    """Step one on one axis from recordings of constant-velocity runs.

    `known`: what another axis already said of efficiencies and thruster coefficients, jointly (`passed_on`); without
    it the covariance of the calibration counts. `current`: allow for a uniform current (surge and sway).
    `experiments`: recording id -> ballast, for heave; each recording is its own ballast unless told.
    """
    return fit_runs(steady_runs(recordings, installation, axis), installation, axis, known, current, experiments or {})


def fit_runs(
    runs: Sequence[SteadyRun],
    installation: Installation,
    axis: str,
    known: Gaussian = NOTHING,
    current: bool = True,
    experiments: Mapping[str, str] | None = None,
) -> DragFit | Unusable:
    """`identify_drag` of runs made ready."""
    driven = sum(bool(np.any(run.force.nominal() != 0)) for run in runs)
    if driven < 2:
        return Unusable(
            f"{axis}: {driven} constant-velocity run(s) with a force on that axis; at least two of different force are "
            "needed for k and k2"
        )
    ids = tuple(dict.fromkeys(run.recording_id for run in runs))
    buoyancy = ballast_of(ids, experiments or {}) if axis == "heave" else {}
    in_force = tuple(dict.fromkeys(name for run in runs for name in run.force.parameters))
    etas = tuple(name for name in in_force if name in installation.etas)
    prior = _prior(in_force, installation, axis, known, current)
    names = tuple(dict.fromkeys(["k", "k2", *etas, *dict.fromkeys(buoyancy.values()), *prior.names]))
    found, extra = _fit(runs, names, prior, buoyancy)
    judged = underfit(found[0].chi2, found[0].dof)
    if judged.underfitted:
        found, extra = _with_excess(runs, names, prior, buoyancy)
    best, predicted = found
    return DragFit(axis, best.estimate, etas, tuple(runs), predicted, judged, extra, best, buoyancy)


def _prior(in_force: Sequence[str], installation: Installation, axis: str, known: Gaussian, current: bool) -> Gaussian:
    """Earlier knowledge of drag, of what enters the force on this axis, and of the current."""
    relevant = ("k", "k2", *in_force)
    flowing = current and axis in ("surge", "sway")
    told = known.select([n for n in known.names if n in relevant or (flowing and n in CURRENT)])
    rest = installation.known(name for name in in_force if name not in told.names)
    return independent(told, rest, current_prior(told) if flowing else NOTHING)


def current_prior(told: Gaussian) -> Gaussian:
    """What is known of a current that nothing told yet speaks of."""
    names = tuple(name for name in CURRENT if name not in told.names)
    return Gaussian(names, np.zeros(len(names)), CURRENT_STD**2 * np.eye(len(names)))


def _start(runs: Sequence[SteadyRun], names: tuple[str, ...], prior: Gaussian) -> tuple[Floats, Floats]:
    """Start and scale of each parameter: drag by non-negative least squares on the nominal forces."""
    v = np.array([run.velocity for run in runs])
    push = np.array([run.force.nominal()[0] for run in runs])
    (k, k2), _ = nnls(np.column_stack([np.abs(v), v**2]), np.abs(push))
    fastest, strongest = max(float(np.abs(v).max()), 1e-9), max(float(np.abs(push).max()), 1e-9)
    starts = {"k": max(k, 0.05 * strongest / fastest), "k2": max(k2, 0.05 * strongest / fastest**2)}
    scales = {"k": strongest / fastest, "k2": strongest / fastest**2}
    start, scale = [], []
    for name in names:
        if name in prior.names:
            start.append(prior[name])
            scale.append(max(prior.std_of(name), 1e-3 * abs(prior[name])))
        elif name.startswith("buoyancy"):
            start.append(0.0)
            scale.append(strongest)
        else:
            start.append(starts.get(name, 0.9))
            scale.append(scales.get(name, 1.0))
    return np.array(start), np.array(scale)


def _fit(
    runs: Sequence[SteadyRun], names: tuple[str, ...], prior: Gaussian, buoyancy: Mapping[str, str], extra: float = 0.0
) -> tuple[tuple[Maximum, Floats], float]:
    v = np.array([run.velocity for run in runs])
    std = np.hypot(np.array([run.std for run in runs]), extra)

    def misfit(theta: Floats) -> Floats:
        out: Floats = (v - predicted_velocities(runs, names, theta, buoyancy)) / std
        return out

    best = maximise(names, *_start(runs, names, prior), misfit, prior)
    return (best, predicted_velocities(runs, names, best.estimate.mean[None], buoyancy)[0]), extra


def _with_excess(
    runs: Sequence[SteadyRun], names: tuple[str, ...], prior: Gaussian, buoyancy: Mapping[str, str]
) -> tuple[tuple[Maximum, Floats], float]:
    """Extra scatter of the velocities (repeatability, cable) that brings chi-square to its degrees of freedom."""

    def surplus(log_extra: float) -> float:
        (found, _), _ = _fit(runs, names, prior, buoyancy, float(np.exp(log_extra)))
        return found.chi2 - found.dof

    low = float(np.log(min(run.std for run in runs) * 1e-2))
    high = float(np.log(max(abs(run.velocity) for run in runs) + max(run.std for run in runs)))
    if surplus(low) <= 0 or surplus(high) >= 0:
        return _fit(runs, names, prior, buoyancy)
    return _fit(runs, names, prior, buoyancy, float(np.exp(brentq(surplus, low, high, xtol=0.01))))


def passed_on(fit: DragFit) -> Gaussian:
    """What a fit of one axis tells the next: efficiencies, current and thruster coefficients, jointly."""
    seen = fit.estimate.determined()
    keep = [name for name in seen.names if not (name in ("k", "k2") or name.startswith("buoyancy"))]
    return seen.select(keep)


def _parameters(fit: DragFit) -> tuple[str, ...]:
    out = []
    for name in fit.estimate.names:
        value, std = fit.estimate[name], fit.estimate.std_of(name)
        if name in fit.etas:
            out.append(f"{fit.axis}: {efficiency_sentence(name, value, std)}")
        elif not name.startswith(("C[", "C+", "C-", "thrust[")):
            unit = unit_of(name, fit.axis)
            if not np.isfinite(std):
                out.append(f"{fit.axis}: {name} is not determined")
                continue
            word = "" if significance(value, std).significant else ", not significant (Indiveri 1998, eq. 4.11)"
            out.append(f"{fit.axis}: {name} = {value:.4g} ± {std:.2g} {unit}{word}")
    return tuple(out)


def _verdicts(fit: DragFit) -> tuple[str, ...]:
    out = [f"{fit.axis}: {len(fit.runs)} runs, {fit.underfit.statement}"]
    if fit.excess_std:
        unit = "rad/s" if fit.axis == "yaw" else "m/s"
        out.append(f"{fit.axis}: {fit.excess_std:.2g} {unit} of scatter between runs was added to each velocity")
    bent = sum(not run.straight for run in fit.runs)
    if bent:
        out.append(f"{fit.axis}: {bent} of {len(fit.runs)} runs had not reached a constant velocity")
    out.extend(entanglement(fit.axis, fit.maximum, ("k", "k2", *fit.etas)))
    return tuple(out)
