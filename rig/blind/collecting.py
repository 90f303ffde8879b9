"""The third step: truths and answers of a store joined into scores."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from rig.blind.design import LADDER, Job
from rig.blind.scoring.score import Score, scored
from rig.blind.store import Store


@dataclass(frozen=True, slots=True)
class Known:
    """A score with what it is a score of."""

    score: Score
    version: str
    """Of the diagnosis that answered."""
    asked: str
    """Job.digest: what the world was asked for."""


@dataclass(frozen=True, slots=True)
class Collected:
    """`missing`: orders not answered yet; `undrawn`: cases that the world could not make."""

    known: tuple[Known, ...]
    missing: int
    undrawn: tuple[str, ...]

    @property
    def scores(self) -> tuple[Score, ...]:
        return tuple(each.score for each in self.known)

    @property
    def versions(self) -> tuple[str, ...]:
        """Of the diagnosis, the most frequent first."""
        return tuple(version for version, _ in Counter(each.version for each in self.known).most_common())


def not_good(found: Collected, jobs: Sequence[Job]) -> list[Job]:
    """The jobs with their orders that did not come out as they should, those below faint left aside."""
    bad = {s.order.id for s in found.scores if not s.good and s.order.cell not in LADDER}
    kept = (replace(job, orders=tuple(o for o in job.orders if o.id in bad)) for job in jobs)
    return [job for job in kept if job.orders]


def collected(
    store: Store, jobs: Sequence[Job], elsewhere: Mapping[str, Known] | None = None, version: str = ""
) -> Collected:
    """All that is answered: in the store, or among the scores from `elsewhere`, by the ids of their orders.

    Where both have one, that of the store counts, unless only the other is by `version` of the diagnosis.
    """
    found, missing, undrawn = [], 0, []
    elsewhere = elsewhere or {}
    for job in jobs:
        truth = store.truth(job)
        if truth is not None and truth["error"]:
            undrawn.append(f"{job.id}: {truth['error']}")
            continue
        for order in job.orders:
            answer, other = store.answer(job, order), elsewhere.get(order.id)
            newer = other is not None and answer is not None and other.version == version != answer["code"]
            if truth is not None and answer is not None and not newer:
                score = scored(order, truth, answer, store.thrust(job), store.predictions(job, order))
                found.append(Known(score, str(answer["code"]), job.digest))
            elif other is not None:
                found.append(other)
            else:
                missing += 1
    return Collected(tuple(found), missing, tuple(undrawn))
