"""The rotor model in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identification.thruster.dynamics import DynamicsFit
from identification.thruster.thrust_report import digits

MATERIAL = 0.005
"""An offset of the steady rate below this share of the fastest rate is called small."""


def sentence(fit: DynamicsFit) -> str:
    """What was found, in one sentence."""
    slow = [level.time_constant for level in fit.levels]
    span = f"; time constant {min(slow):.3g} to {max(slow):.3g} s" if slow else ""
    return f"rotor: {fit.model}{span}; RMSE {fit.rmse:.3g} rev/s over {fit.residual.size} samples."


def levels_table(fit: DynamicsFit) -> list[tuple[str, str, str, str]]:
    """Voltage, rate measured, rate by the model, time constant: as text, header first."""
    rows = [("V", "n settled", "k V", "time constant / s")]
    for level in fit.levels:
        rate = f"{level.rate:.3f}" if np.isfinite(level.rate) else "-"
        constant = f"{digits(level.time_constant, level.std)} ± {digits(level.std, level.std)}"
        rows.append((f"{level.voltage:g}", rate, f"{level.model_rate:.3f}", constant))
    return rows


def verdicts(fit: DynamicsFit) -> Iterator[str]:
    """What to know before the numbers are used."""
    if fit.with_gamma:
        g = fit.significance["gamma"]
        yield (
            f"gamma is significant (relative error {g.percent:.2g} %, Indiveri 1998, eq. 4.11): without it the RMSE is "
            f"{fit.rmse_without_gamma:.3g} rev/s instead of {fit.rmse:.3g}; the motor itself pulls the rotor to k V"
        )
    else:
        yield "gamma (k V - n) was tried and dropped as not significant (Indiveri 1998, eq. 4.11)"
    late = fit.significance["delay"]
    word = "significant" if late.significant else "not significant"
    yield f"delay from command to motor {1000 * late.value:.2g} ± {1000 * late.std:.2g} ms: {word}"
    if fit.whiteness is not None:
        yield f"rate {fit.whiteness.statement}; standard errors allow for it"
    yield _steady(fit)


def _steady(fit: DynamicsFit) -> str:
    if fit.offset is None:
        return "whether the settled rate is proportional to the voltage cannot be told: too few settled holds"
    c, rates = fit.offset, [abs(level.rate) for level in fit.levels if np.isfinite(level.rate)]
    found = f"offset {c.value:.2g} ± {c.std:.2g} rev/s, p = {c.p_value:.2g}"
    if not c.significant:
        return f"settled rates are proportional to the voltage, n = k V ({found}): C = C_t k^2 holds"
    if abs(c.value) < MATERIAL * max(rates):
        return f"settled rates are proportional to the voltage but for a small offset ({found})"
    return f"settled rates are not proportional to the voltage ({found}): dead band or static load; C = C_t k^2 fails"
