"""A vehicle's diagnosis put together: places, findings, what is left, numbers with units, what is tied by scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.answer.report_assembly import values_told
from identification.mismatch.diagnosis import Curves, Mismatch
from identification.mismatch.noise.whiteness import whiteness
from identification.mismatch.unexplained import Remainder
from identification.mismatch.value import Value, Where
from identification.mismatch.vehicle.fitting import Fit
from identification.mismatch.vehicle.free_force import BACK, Left, Structure, place_of
from identification.mismatch.vehicle.naming import Named
from identification.mismatch.vehicle.runs import Prepared
from identification.mismatch.vehicle.search import State
from identification.mismatch.verdict_clauses import refused


def baseline_words(data: Prepared) -> str:
    """The baseline as a formula."""
    inertia = "v'" if data.scale.per_kg else "m v'"
    return f"{inertia} = -k2 |v| v + thrusters"


def values_of(fitted: Fit, data: Prepared) -> dict[str, Value]:
    """Every parameter but the starts of the runs; thrusters' constants in their own unit."""
    std = fitted.std
    out = {}
    for i, p in enumerate(fitted.layout.base):
        factor, unit = _of_thruster(p.name, data) if p.name.startswith("C[") else (1.0, p.unit)
        out[p.name] = Value(float(fitted.theta[i]) * factor, float(std[i]) * abs(factor), unit)
    for term, values in fitted.values.items():
        told = values_told(term, values, std[fitted.layout.of(term)].tolist(), data.scale)
        out |= {f"{term.id}.{name}": value for name, value in told.items()}
    return out


def _of_thruster(name: str, data: Prepared) -> tuple[float, str]:
    thruster = next(t for t in data.installation.thrusters if f"C[{t.name}]" == name)
    if thruster.levels is None and thruster.coefficients.size == 1:
        return float(thruster.coefficients[0]), "N/V^2" + (" per kg" if data.scale.per_kg else "")
    return 1.0, "1"


def where_of(structure: Structure) -> Where:
    """The stretch of the covariate in which a free force is largest against its error."""
    place = place_of(structure)
    return Where(structure.covariate.quantity, place.low, place.high, structure.covariate.unit)


def _place(where: Where, data: Prepared) -> str:
    if where.quantity == "run":
        return f"run {where.low:.0f} ({data.runs[round(where.low) - 1].recording_id})"
    unit = "" if where.unit == "1" else f" {where.unit}"
    return f"{where.quantity} {where.low:.3g} to {where.high:.3g}{unit}"


def places_of(left: Left, data: Prepared, channel: str) -> tuple[Mismatch, ...]:
    """Where the baseline fails, the clearest covariates first."""
    if left.p_value >= policy.locate.RESIDUAL_FALSE_ALARM:
        return ()
    out = []
    clear = [s for i, s in enumerate(left.structures) if i == 0 or s.p_value <= policy.locate.PLACE_P]
    for structure in clear[: policy.locate.PLACES_TOLD]:
        where = where_of(structure)
        says = (
            f"{structure.covariate.what} explains {100 * structure.share:.0f} % of what is left, in units of its "
            f"noise, most at {_place(where, data)}."
        )
        out.append(Mismatch(channel, where, structure.share, structure.p_value, says[0].upper() + says[1:]))
    return tuple(out)


def place_of_findings(left: Left, before: State, after: State, data: Prepared, channel: str) -> tuple[Mismatch, ...]:
    """Where no free force shows through slow noise, but named terms do: over the covariate that the first shows in."""
    own = after.terms[0].covariates
    structure = next((s for s in left.structures if s.covariate.quantity in own), None)
    structure = structure or next(iter(left.structures), None)
    if structure is None:
        return ()
    gain = before.fit.chi2 - after.fit.chi2
    count = sum(map(len, after.fit.values.values()))
    p = max(float(chi2_sf(gain, count)), BACK)
    where, share = where_of(structure), gain / before.fit.chi2
    says = (
        f"What was found together explains {100 * share:.2g} % of what the baseline leaves, in units of its noise; of "
        f"a free force over {structure.covariate.quantity} most would act at {_place(where, data)}."
    )
    return (Mismatch(channel, where, share, p, says),)


def unexplained_of(left: Left, named: Sequence[Named], data: Prepared) -> Remainder | None:
    """What remains; `named` are those whose name is not earned."""
    if not left.structures or (left.p_value >= policy.locate.RESIDUAL_FALSE_ALARM and not named):
        return None
    structure = left.structures[0]
    if left.p_value >= policy.locate.RESIDUAL_FALSE_ALARM:
        own = {c for n in named for c in n.term.covariates}
        structure = next((s for s in left.structures if s.covariate.quantity in own), structure)
    where = where_of(structure)
    says = (
        f"Something is left that no effect of the catalogue carries: {structure.covariate.what}, clearest at "
        f"{_place(where, data)}, {100 * structure.share:.2g} % of what is left, in units of its noise."
    )
    resembles = tuple(f"{n.term.id}: {'; '.join(n.failed_checks)}" for n in named)
    if named:
        says += f" {refused([(n.term.id, n.failed_checks[0]) for n in named])}"
    table = place_of(structure).table
    return Remainder(where, structure.share, left.p_value, table, says, resembles)


def state_whiteness(state: State) -> float:
    """p-value of `whiteness` of the whitened residual."""
    return whiteness(state.fit.residual, [w.rows.time.size for w in state.white.thrust])


def curves_of(before: Fit, after: Fit, data: Prepared) -> tuple[Curves, ...]:
    """What a report draws."""
    out = []
    for run, old, new in zip(data.runs, before.predicted, after.predicted, strict=True):
        command = np.mean(np.sign(run.arms)[:, None] * run.moment.volts.mean(axis=2), axis=0)
        at = np.clip(((run.time - run.start) / run.moment.step).astype(int), 0, run.steps - 1)
        out.append(Curves(run.recording_id, run.time, command[at], run.response, old, new))
    return tuple(out)


def ties(data: Prepared, fitted: Fit, unseen: Sequence[str]) -> tuple[str, ...]:
    """What goes together by scale: said, not hidden."""
    scale = data.scale
    out = []
    if scale.per_kg:
        out.append(
            "neither the mass nor the thrusters' models are known: forces are per kg of inertia, and what is "
            "determined are the ratios C/m and k2/m"
        )
    elif scale.mass is None:
        out.append(
            "no mass is stated: m and all drags are as right as the thrusters' models are, and an efficiency common to "
            "all thrusters would scale them; state the mass (--mass) to see it"
        )
    elif not scale.thrust_known:
        out.append("the thrusters' models are not known: C and all drags are as right as the stated mass is")
    else:
        out.append(
            "mass and thrust are taken as stated: an efficiency common to all thrusters and an added mass change the "
            "same ratio of force to inertia, and each is stated given the other"
        )
        out += _per_mass(data, fitted)
    out += unseen if scale.per_kg or scale.mass is None else ()
    return tuple(dict.fromkeys(out))


def _per_mass(data: Prepared, fitted: Fit) -> list[str]:
    """eta/m, which is what the motion shows, with its own error."""
    layout = fitted.layout
    names = [p.name for p in layout.base]
    out = []
    for term, part in layout.parts.items():
        if term.id != "installation_efficiency" or term.form != "overall" or data.mass is None:
            continue
        at = layout.of(term).start
        eta = float(fitted.theta[at])
        m = float(fitted.theta[names.index("m")]) if "m" in names else data.mass.value
        slope = np.zeros(layout.size)
        slope[at] = 1 / m
        if "m" in names:
            slope[names.index("m")] = -eta / m**2
        std = float(np.sqrt(slope @ np.nan_to_num(fitted.cov) @ slope))
        name = part[0].name
        out.append(f"what the motion shows is {name}/m = {eta / m:.4g} +- {std:.2g} 1/{data.scale.mass_unit}")
    return out
