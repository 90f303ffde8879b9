"""Which terms are worth a fit: what a small amount of each changes, against what the residual asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2 as chi2_law

from identification.estimation.singular_values import thin_svd
from identification.mismatch import policy
from identification.mismatch.model.whitening import Weights
from identification.mismatch.vehicle.fitting import Fit
from identification.mismatch.vehicle.model import predict, with_term
from identification.mismatch.vehicle.runs import Prepared
from identification.physics.vehicle.catalogue import CATALOGUE
from identification.physics.vehicle.installation_efficiency import InstallationEfficiency
from identification.physics.vehicle.term import VehicleTerm
from identification.recording import Floats

SURROGATES = 300
"""Draws of the null distribution; beyond them a Bonferroni bound holds."""
BLOCKS = 40
"""Of one run: the residual's sign is flipped block by block."""
SEEN = 1e-9
"""Share of a column that must be its own, beside the model's, to be seen at all."""


def applicable(data: Prepared, without: Sequence[str] = ()) -> tuple[tuple[VehicleTerm, ...], tuple[str, ...]]:
    """Terms of the catalogue that these recordings may show, and sentences about efficiencies that they cannot."""
    out: list[VehicleTerm] = []
    notes = []
    for term in (*(t for t in CATALOGUE if t.id != "installation_efficiency"), *_efficiencies(data)):
        why = term.needs(data.scale)
        if term.id in without:
            continue
        if not why:
            out.append(term)
        elif term.id == "installation_efficiency":
            notes.append(why)
    return tuple(out), tuple(notes)


def _efficiencies(data: Prepared) -> tuple[InstallationEfficiency, ...]:
    """Those of the lay-out; without any, one common to all thrusters."""
    found = []
    thrusters = {t.name for t in data.installation.thrusters}
    for name in data.installation.etas:
        parts = [i for i in data.installation.interactions if i.name == name]
        covered = {t for i in parts if i.direction == 0 and not i.partner for t in i.thrusters}
        if covered >= thrusters:
            found.append(InstallationEfficiency("overall", name))
        elif any(i.partner for i in parts):
            found.append(InstallationEfficiency("propeller_propeller", name))
        else:
            found.append(InstallationEfficiency("propeller_hull", name))
    if not any(one.form == "overall" for one in found):
        found.append(InstallationEfficiency("overall", "eta"))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Trial:
    """One term at one amount: what it changes of the prediction, unit amount of each parameter apart."""

    term: VehicleTerm
    values: tuple[float, ...]
    columns: tuple[Floats, ...]
    """(n, k) per run."""


def trials(fitted: Fit, data: Prepared, terms: Sequence[VehicleTerm], most: int = 99) -> list[Trial]:
    """Every term at every amount that it asks for (at most so many), beside the terms that the model has."""
    out = []
    for term in terms:
        parameters = term.parameters(data.scale)
        for values in term.trials(data.scale)[:most]:
            columns: list[list[Floats]] = [[] for _ in data.runs]
            for i, p in enumerate(parameters):
                single = [q.neutral or 0.0 for q in parameters]
                single[i] = values[i]
                layout, theta = with_term(fitted.layout, data, fitted.theta, term, single)
                for j in range(len(data.runs)):
                    moved = predict(layout, theta, data, j, fitted.motions[j], slopes=False).response
                    columns[j].append((moved - fitted.predicted[j]) / (values[i] - (p.neutral or 0.0)))
            out.append(Trial(term, values, tuple(np.nan_to_num(np.column_stack(c)) for c in columns)))
    return out


@dataclass(frozen=True, eq=False)
class Screened:
    """A trial against the residual."""

    trial: Trial
    gain: float
    """Chi-square that it would explain, to first order."""
    p_value: float


def screen(
    fitted: Fit, white: Weights, found: Sequence[Trial], rng: np.random.Generator
) -> tuple[list[Screened], float]:
    """Best trial of each term, best first; and the p-value that the best must pass (SCREENING_FALSE_ALARM)."""
    base, _ = np.linalg.qr(_scaled(fitted.jacobian))
    residual = fitted.residual
    bases = [_own(white, trial, base, residual.size) for trial in found]
    every = np.hstack([base, *bases])
    U, s, _ = thin_svd(every)
    span = U[:, s > np.sqrt(SEEN) * s[0]]
    quiet = residual - span @ (span.T @ residual)
    flipped = surrogates(_of_unit_size(quiet), [w.rows.time.size for w in white.thrust], rng)
    flipped = flipped - base @ (base.T @ flipped)
    least = np.ones(flipped.shape[1])
    best: dict[tuple[str, str, str], Screened] = {}
    for trial, Q in zip(found, bases, strict=True):
        if not Q.shape[1]:
            continue
        gain = float(np.sum((Q.T @ residual) ** 2))
        p = float(chi2_law.sf(gain, Q.shape[1]))
        least = np.minimum(least, chi2_law.sf(np.sum((Q.T @ flipped) ** 2, axis=0), Q.shape[1]))
        key = (trial.term.id, trial.term.form, getattr(trial.term, "name", ""))
        if key not in best or gain > best[key].gain:
            best[key] = Screened(trial, gain, p)
    families = max(len({id(s.trial.term) for s in best.values()}), 1)
    needed = min(
        float(np.quantile(least, policy.select.SCREENING_FALSE_ALARM)), policy.select.SCREENING_FALSE_ALARM / families
    )
    return sorted(best.values(), key=lambda s: (s.p_value, -s.gain)), needed


def _of_unit_size(quiet: Floats) -> Floats:
    """What the catalogue does not reach, robustly no larger than the noise model says: its correlation counts here."""
    size = max(float(np.median(np.abs(quiet)) / 0.6745), 1e-12)
    return np.clip(quiet / max(size, 1.0), -policy.vehicle.VEHICLE_OUTLIER_SIGMA, policy.vehicle.VEHICLE_OUTLIER_SIGMA)


def _scaled(H: Floats) -> Floats:
    size = np.sqrt(np.sum(H**2, axis=0))
    out: Floats = H[:, size > 0] / size[size > 0]
    return out


def _own(white: Weights, trial: Trial, base: Floats, rows: int) -> Floats:
    """Orthonormal basis (N + q, k) of what the trial changes and the model's parameters do not."""
    return beyond(base, whitened(white, trial.columns, rows))


def whitened(white: Weights, columns: Sequence[Floats], rows: int) -> Floats:
    """(N + q, k) whitened columns of all runs; what was known beforehand does not move."""
    known = rows - sum(c.shape[0] for c in columns)
    return white.whiten(columns, [], [np.zeros((known, columns[0].shape[1]))])


def beyond(base: Floats, columns: Floats) -> Floats:
    """Orthonormal basis of columns with `base` projected out; what is not their own to SEEN is left out."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    scaled = columns[:, size > 0] / size[size > 0]
    left = scaled - base @ (base.T @ scaled)
    left = np.asarray(left - base @ (base.T @ left))
    if not left.shape[1]:
        return left
    U, s, _ = thin_svd(left)
    return np.asarray(U[:, s > np.sqrt(SEEN)])


def surrogates(residual: Floats, sizes: Sequence[int], rng: np.random.Generator) -> Floats:
    """(N + q, SURROGATES): the whitened residual with the sign of whole blocks flipped at random."""
    out = np.tile(residual[:, None], (1, SURROGATES))
    at = 0
    for n in sizes:
        block = max(n // BLOCKS, 1)
        index = np.arange(n) // block
        signs = rng.choice([-1.0, 1.0], size=(int(index[-1]) + 1, SURROGATES))
        out[at : at + n] *= signs[index]
        at += n
    if at < residual.size:
        out[at:] *= rng.choice([-1.0, 1.0], size=(residual.size - at, SURROGATES))
    return out
