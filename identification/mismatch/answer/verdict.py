"""The verdict: decided here and nowhere else, once all findings are there."""

from __future__ import annotations

from collections.abc import Sequence

from identification.mismatch import policy
from identification.mismatch.diagnosis import (
    Adequate,
    Ambiguous,
    Explained,
    Finding,
    HeldOutRmse,
    Mismatch,
    NextExperiment,
    Unexplained,
    Verdict,
)
from identification.mismatch.faults.channel_faults import EFFECT as FAULT
from identification.mismatch.periodic.periodic_disturbances import EFFECT as LINE
from identification.mismatch.unexplained import Remainder
from identification.mismatch.value import Where

NOT_OF_THE_MODEL = frozenset({FAULT, LINE})
"""Findings that are put right, or taken out, before anything is predicted."""
NOWHERE = Where("time", float("nan"), float("nan"), "s")


def decided(
    findings: tuple[Finding, ...],
    remainder: Remainder | None,
    experiment: NextExperiment | None,
    held: HeldOutRmse,
    mismatch: Sequence[Mismatch] = (),
    unit: str = "N",
) -> Verdict:
    """Unexplained where something is left, or where what was found predicts unfitted data worse than the baseline or
    far from as well as noise allows; ambiguous where a finding has a rival that does as well; else explained.

    `mismatch`: where the baseline fails, the clearest place first; `unit`: of the errors.
    """
    if remainder is not None:
        return Unexplained(findings, remainder, experiment)
    wrong = refuted(findings, held)
    if wrong:
        known = tuple(f for f in findings if f not in wrong)
        return Unexplained(known, unpredictive(wrong, held, mismatch, unit), experiment)
    if not findings:
        return Adequate()
    if held.beyond_noise and _of_the_model(findings):
        return Unexplained(findings, beyond_noise(held, mismatch, unit), experiment)
    if any(rival.bic_loss < policy.select.RIVALS_EQUAL_BIC for finding in findings for rival in finding.rivals):
        return Ambiguous(findings, experiment)
    return Explained(findings)


def refuted(findings: tuple[Finding, ...], held: HeldOutRmse) -> tuple[Finding, ...]:
    """Findings of the model, where it predicts unfitted data worse than the baseline does."""
    return _of_the_model(findings) if held.grown else ()


def _of_the_model(findings: tuple[Finding, ...]) -> tuple[Finding, ...]:
    return tuple(f for f in findings if f.effect not in NOT_OF_THE_MODEL)


def beyond_noise(held: HeldOutRmse, mismatch: Sequence[Mismatch], unit: str = "N") -> Remainder:
    """What the baseline lacks, of which what was found makes too little."""
    place = mismatch[0] if mismatch else Mismatch("thrust", NOWHERE, 1.0, 1.0, "")
    says = (
        f"Something is left that shows on data that were not fitted: {held.after:.3g} {unit} there, "
        f"{held.after / held.noise:.2g} times the {held.noise:.3g} {unit} of noise alone."
    )
    return Remainder(place.where, place.share, place.p_value, (), says, (), unpredictive=True)


def unpredictive(
    wrong: Sequence[Finding], held: HeldOutRmse, mismatch: Sequence[Mismatch], unit: str = "N"
) -> Remainder:
    """What the baseline lacks, and a model of it that describes the runs fitted and predicts no others."""
    place = mismatch[0] if mismatch else Mismatch("thrust", NOWHERE, 1.0, 1.0, "")
    names = " and ".join(dict.fromkeys(f.effect for f in wrong))
    says = (
        f"What was found describes the data that were fitted and predicts no others: with {names} the error on data "
        f"that were not fitted grows from {held.before:.4g} to {held.after:.4g} {unit}."
    )
    resembles = tuple(f"{f.effect}: the error on data that were not fitted grows with it" for f in wrong)
    return Remainder(place.where, place.share, place.p_value, (), says, resembles, unpredictive=True)
