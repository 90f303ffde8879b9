"""The third step: truths and answers of a store joined into scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rig.blind.design import LADDER, Job
from rig.blind.scoring import Score, scored
from rig.blind.store import Store


@dataclass(frozen=True, slots=True)
class Collected:
    """`missing`: orders not answered yet; `undrawn`: cases that the world could not make."""

    scores: tuple[Score, ...]
    missing: int
    undrawn: tuple[str, ...]
    versions: tuple[str, ...]
    """Of the diagnosis, the most frequent first."""


def not_good(found: Collected, jobs: Sequence[Job]) -> list[Job]:
    """The jobs with their orders that did not come out as they should, those below faint left aside."""
    bad = {s.order.id for s in found.scores if not s.good and s.order.cell not in LADDER}
    kept = (replace(job, orders=tuple(o for o in job.orders if o.id in bad)) for job in jobs)
    return [job for job in kept if job.orders]


def collected(store: Store, jobs: Sequence[Job]) -> Collected:
    """All that is answered."""
    found, missing, undrawn, versions = [], 0, [], []
    for job in jobs:
        truth = store.truth(job)
        if truth is not None and truth["error"]:
            undrawn.append(f"{job.id}: {truth['error']}")
            continue
        for order in job.orders:
            answer = store.answer(job, order)
            if truth is None or answer is None:
                missing += 1
                continue
            found.append(scored(order, truth, answer, store.thrust(job), store.predictions(job, order)))
            versions.append(str(answer["code"]))
    ranked = sorted(set(versions), key=lambda v: -versions.count(v))
    return Collected(tuple(found), missing, tuple(undrawn), tuple(ranked))
