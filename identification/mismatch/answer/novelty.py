"""Findings beside a twin, as new or not: what its own recordings have too is none, what they could not show is said."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from identification.mismatch.compare.earlier_recordings import Novelty
from identification.mismatch.diagnosis import Finding
from identification.physics.term import Term
from identification.twin import Twin

SAYS = {
    "changed": "That is new: the recordings behind {} speak against it.",
    "not shown before": "Whether that is new cannot be told: the recordings behind {} could not have shown it.",
}
NOT_NEW = "Not new, for it suits the recordings behind {} as well (chi-square of both {:+.3g} if it was there then): {}"


@dataclass(frozen=True, eq=False, slots=True)
class ToldNew:
    """What is told of the findings."""

    findings: tuple[Finding, ...]
    """Without those that are not new."""
    not_new: tuple[str, ...]
    """The statements of those."""
    notes: tuple[str, ...]


def told_new(findings: Mapping[Term, Finding], novelties: Mapping[Term, Novelty], twin: Twin | None) -> ToldNew:
    """Each with whether it is new, where that was asked."""
    new, not_new, notes = [], [], []
    origin = "the twin" if twin is None else twin.origin
    for term, finding in findings.items():
        novelty = novelties.get(term)
        if novelty is None:
            new.append(finding)
        elif novelty.since == "there before":
            not_new.append(finding.statement)
            notes.append(NOT_NEW.format(origin, novelty.loss, finding.statement))
        else:
            statement = f"{finding.statement} {SAYS[novelty.since].format(origin)}"
            new.append(replace(finding, statement=statement, since=novelty.since))
    return ToldNew(tuple(new), tuple(not_new), tuple(notes))
