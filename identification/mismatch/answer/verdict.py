"""The verdict: decided here and nowhere else, once all findings are there."""

from __future__ import annotations

from identification.mismatch import policy
from identification.mismatch.diagnosis import (
    Adequate,
    Ambiguous,
    Explained,
    Finding,
    NextExperiment,
    Remainder,
    Unexplained,
    Verdict,
)


def decided(findings: tuple[Finding, ...], remainder: Remainder | None, experiment: NextExperiment | None) -> Verdict:
    """Unexplained where something is left; ambiguous where a finding has a rival that does as well; else explained."""
    if remainder is not None:
        return Unexplained(findings, remainder, experiment)
    if not findings:
        return Adequate()
    if any(rival.bic_loss < policy.select.RIVALS_EQUAL_BIC for finding in findings for rival in finding.rivals):
        return Ambiguous(findings, experiment)
    return Explained(findings)
