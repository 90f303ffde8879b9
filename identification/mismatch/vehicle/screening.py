"""Which terms are worth a fit: what a small amount of each changes, against what the residual asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.family_wise import beyond, family_threshold, orthogonal_basis
from identification.mismatch.vehicle.fitting import Fit
from identification.mismatch.vehicle.model import predict, with_term
from identification.mismatch.vehicle.runs import Prepared
from identification.physics.vehicle.catalogue import CATALOGUE
from identification.physics.vehicle.installation_efficiency import InstallationEfficiency
from identification.physics.vehicle.term import VehicleTerm
from identification.recording import Floats


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
    span: Floats
    """(N + q, k) orthonormal: what it changes that the model's own parameters cannot."""
    gain: float
    """Chi-square that it would explain, to first order."""
    p_value: float


def explained(fitted: Fit, white: Weights, found: Sequence[Trial]) -> list[Screened]:
    """What each trial would explain of the residual."""
    base, residual = orthogonal_basis(fitted.jacobian), fitted.residual
    out = []
    for trial in found:
        Q = beyond(whitened(white, trial.columns, residual.size), base)
        if Q.shape[1]:
            gain = float(np.sum((Q.T @ residual) ** 2))
            out.append(Screened(trial, Q, gain, float(chi2_sf(gain, Q.shape[1]))))
    return out


def needed(judged: Sequence[Screened], residual: Floats, rng: np.random.Generator) -> float:
    """The p-value that the best must pass (SCREENING_FALSE_ALARM)."""
    if not judged:
        return 0.0
    p_values, spans = [s.p_value for s in judged], [s.span for s in judged]
    return family_threshold(p_values, spans, residual, rng, policy.select.SCREENING_FALSE_ALARM)


def best_of_each(judged: Sequence[Screened]) -> list[Screened]:
    """Best trial of each term, best first."""
    best: dict[VehicleTerm, Screened] = {}
    for one in sorted(judged, key=lambda s: -s.gain):
        best.setdefault(one.trial.term, one)
    return sorted(best.values(), key=lambda s: (s.p_value, -s.gain))


def effect_of(term: VehicleTerm) -> str:
    """Of which all forms are one effect: its id, and an efficiency's own name."""
    return f"{term.id} {getattr(term, 'name', '')}"


def whitened(white: Weights, columns: Sequence[Floats], rows: int) -> Floats:
    """(N + q, k) whitened columns of all runs; what was known beforehand does not move."""
    known = rows - sum(c.shape[0] for c in columns)
    return white.whiten(columns, [], [np.zeros((known, columns[0].shape[1]))])
