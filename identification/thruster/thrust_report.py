"""A thrust fit in words: the sentence, the table and the verdicts, as plain text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from identification.thruster.thrust import Parameter, ThrustFit

BOTH_MATTER = 0.01
"""A significant difference of C+ and C- below this share of C is called small: the symmetric model stays useful."""
MISFIT_P = 1e-3
"""Probability, under a model that fits, of points so far from it, from which C is not told without a warning."""


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table."""

    name: str
    value: float
    std: float
    low: float
    high: float
    unit: str
    percent: float
    """Relative error of eq. 4.11, corrected for correlated samples."""
    verdict: str
    percent_uncorrected: float = float("nan")
    """The same as if samples were independent."""


def digits(value: float, std: float) -> str:
    """A value with the digits its standard deviation supports (two of it).

    >>> digits(0.40123456, 0.00121), digits(12.3, float("nan")), digits(5.0, 0.0)
    ('0.4012', '12.3', '5')
    """
    if not np.isfinite(value):
        return "not determined"
    if not np.isfinite(std) or std <= 0:
        return f"{value:.6g}"
    places = max(0, 1 - int(np.floor(np.log10(std))))
    return f"{value:.{min(places, 12)}f}"


def parameter_text(p: Parameter) -> str:
    """`0.4012 ± 0.0012 N/V^2 (95 %: 0.3988 to 0.4036)`."""
    if not np.isfinite(p.std):
        return f"{digits(p.value, p.std)} {p.unit} (standard error unknown)"
    low, high = digits(p.low, p.std), digits(p.high, p.std)
    return f"{digits(p.value, p.std)} ± {digits(p.std, p.std)} {p.unit} (95 %: {low} to {high})"


def _percent(std: float, value: float) -> float:
    return 100 * std / abs(value) if value else float("inf")


def table(fit: ThrustFit) -> tuple[Row, ...]:
    """Coefficients, then one tare per recording."""
    rows = []
    for name, p in fit.parameters.items():
        verdict = fit.significance[name]
        word = "significant" if verdict.significant else "not significant"
        plain = _percent(p.std_uncorrected, p.value)
        rows.append(Row(name, p.value, p.std, p.low, p.high, p.unit, verdict.percent, word, plain))
    for k, p in enumerate(fit.tare.values()):
        name = "tare" if len(fit.tare) == 1 else f"tare {k + 1}"
        percent, plain = _percent(p.std, p.value), _percent(p.std_uncorrected, p.value)
        rows.append(Row(name, p.value, p.std, p.low, p.high, p.unit, percent, "", plain))
    return tuple(rows)


def sentence(fit: ThrustFit) -> str:
    """What was found, in one sentence."""
    found = ", ".join(f"{name} = {parameter_text(p)}" for name, p in fit.parameters.items())
    count, plural = len(fit.recordings), "s" if len(fit.recordings) > 1 else ""
    n = fit.estimate.rows.y.size
    rmse = f"RMSE {fit.rmse:.3g} N over {n} {fit.rmse_of} of {count} recording{plural}"
    return f"{fit.thruster or 'thruster'}: thrust = {fit.model} with {found}; {rmse}."


def _difference(fit: ThrustFit) -> str:
    found = fit.difference
    one = fit.model.partition("+")[0]
    both = f"{one}+ and {one}-"
    if found is None:
        return f"{both}: cannot be compared, only one direction was driven far enough"
    plus, minus, *_ = (p.value for p in fit.parameters.values())
    share = abs(plus - minus) / max(abs(plus + minus) / 2, 1e-300)
    rarity = "p < 1e-12" if found.p_value < 1e-12 else f"p = {found.p_value:.2g}"
    if not found.significant:
        return f"{both} differ by {100 * share:.2g} %, which is not significant ({rarity}): one {one} is enough"
    if share < BOTH_MATTER:
        return f"{both} differ significantly ({rarity}) but by {100 * share:.2g} % only"
    return f"{both} differ by {100 * share:.3g} % ({rarity}): the directions are not alike, use --model C+/C-"


def misfit(fit: ThrustFit) -> str:
    """Why the constant is none of the thruster's, in a sentence without an end; empty where the model fits its points.

    At 0.1 %: a table of numbers is read before its verdicts are.
    """
    judged = fit.estimate.underfit
    if judged is None or judged.dof <= 0 or judged.p_value >= MISFIT_P:
        return ""
    rarity = "p < 1e-12" if judged.p_value < 1e-12 else f"p = {judged.p_value:.2g}"
    return (
        f"{fit.model} does NOT fit its points (chi2/dof {judged.per_dof:.3g}, {rarity}): C holds for these levels only"
    )


def verdicts(fit: ThrustFit, alternatives: Sequence[ThrustFit] = ()) -> Iterator[str]:
    """One sentence for each thing to know before the numbers are used."""
    if any(run.unsigned for run in fit.runs):
        yield (
            "this fit means nothing: the rotation rate never changes sign while the thrust does (a tachometer that "
            "does not tell the direction); give the rate its sign when importing, and fit again"
        )
    judged = fit.estimate.underfit
    if judged is None:
        how = (
            f"correlation of neighbouring {fit.rmse_of} allowed for" if fit.estimate.noise else "taken as uncorrelated"
        )
        yield f"fit not judged: noise was estimated from the residual itself (Indiveri 1998, eq. 4.12; {how})"
    else:
        yield judged.statement
        if fit.estimate.excess_std:
            birge, extra = fit.estimate.birge_ratio or 1.0, fit.estimate.excess_std
            yield (
                f"points scatter {birge:.3g} times their standard errors (Birge ratio): {extra:.3g} N "
                "of lack of fit or repeatability was added to each"
            )
    for split in (fit, *alternatives):
        if split.form.split and not split.form.with_flow:
            yield _difference(split)
            break
    if fit.whiteness is not None:
        yield fit.whiteness.statement
    condition = fit.estimate.fit.condition
    if condition > 100:
        yield f"poorly excited: condition number {condition:.3g}; drive more levels, both directions and rest"
    lost = fit.estimate.fit.deficiency
    if lost is not None:
        yield lost.statement
    yield from _remarks(fit)


def _remarks(fit: ThrustFit) -> Iterator[str]:
    if fit.unsteady:
        total = fit.estimate.rows.y.size
        why = "still settling, or drifting by more than 0.5 % of full thrust"
        yield f"{fit.unsteady} of {total} holds were not steady ({why})"
    if fit.skipped:
        yield f"{fit.skipped} thrust samples were left out: not a number, or at no known voltage"
    if fit.voltage_quantity == "rotation_rate":
        yield "explained by rotation_rate (n in rev/s): no voltage was recorded, or it was asked for"
    elif fit.voltage_quantity != "command_voltage":
        yield f"explained by {fit.voltage_quantity}, not by the command"
    if not any(run.gain_std for run in fit.runs):
        yield "calibration uncertainty of the load cell is not stated (gain_std): std is statistical only"
    if len({run.gain_std for run in fit.runs}) > 1:
        yield "recordings state different calibration uncertainties; the largest was used for C"
