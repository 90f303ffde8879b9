"""Jobs carried out: on each lane a process of the world and one of the diagnosis, which share files and nothing else.

A diagnosis that takes longer than its limit is killed and its answer is `timeout`; of one that dies it is `died`. Both
are failures of the diagnosis. A world that fails ends the proof. What is broken off, by us or by Ctrl+C, is no answer.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from rig.blind.design import Job, Kinds, Order
from rig.blind.store import TIMEOUT, ProofError, Store
from rig.workers.child import STOPPING, BrokenOff, Child, Ended, Overdue
from rig.workers.lanes import drive

__all__ = ["STOPPING", "BrokenOff", "Child", "Ended", "Lane", "Overdue", "carry_out", "concealable"]

WORLD_LIMIT = 900.0
"""s for one case: thirty draws at 500 samples/s."""


def concealable() -> Kinds:
    """What the world can conceal. Raises ProofError."""
    told = subprocess.run([sys.executable, "-m", "sim_devices", "concealable"], capture_output=True, check=False)
    if told.returncode:
        raise ProofError(f"the simulated world does not answer: {told.stderr.decode(errors='replace').strip()}")
    found = json.loads(told.stdout)
    forms, variants = ({e: tuple(names) for e, names in found[part].items()} for part in ("forms", "variants"))
    return Kinds(
        tuple(found["effects"]),
        forms,
        variants,
        tuple(found["lies"]),
        tuple(found["noise"]),
        found["version"],
        tuple(found["benches"]),
        tuple(found["recorded_effects"]),
        found["recorded_version"],
        tuple(found["wide_noise"]),
        tuple(found["field"]),
        tuple(found["added"]),
        tuple(found["wiring"]),
    )


@dataclass
class Lane:
    """One job at a time."""

    store: Store
    name: str
    limit: float
    """s for each answer."""
    code: str
    """Version of the diagnosis, written into each answer."""
    keep: bool = False
    """Recordings stay after they were answered."""
    world: Child = field(init=False)
    diagnosis: Child = field(init=False)

    def __post_init__(self) -> None:
        root = self.store.root
        self.store.opened.mkdir(parents=True, exist_ok=True)
        self.store.answers.mkdir(parents=True, exist_ok=True)
        python = [sys.executable, "-m"]
        self.world = Child([*python, "sim_devices", "conceal", "-", str(root)], root / f"world-{self.name}.log")
        places = [str(self.store.opened), str(self.store.answers)]
        self.diagnosis = Child([*python, "rig.blind.answering", *places], root / f"answering-{self.name}.log")

    def carry_out(self, job: Job, renew: bool = False) -> None:
        """Make the case if need be, answer what is pending.

        Raises ProofError when the world fails, BrokenOff when the lane was closed.
        """
        if not self.store.has_recordings(job):
            try:
                self.world.ask(job.asked(), WORLD_LIMIT)
            except Overdue:
                raise ProofError(f"{job.id}: the world took more than {WORLD_LIMIT:g} s") from None
            except Ended as end:
                raise ProofError(f"{job.id}: the world ended ({end})") from end
            self.store.recordings_are_whole(job)
        for order in self.store.pending(job, self.code if renew else "", self.limit):
            self._answer(job, order)
        if not self.keep:
            self.store.drop_recordings(job)

    def _answer(self, job: Job, order: Order) -> None:
        line = {"token": job.token, "tag": order.tag, "without": order.without, "code": self.code}
        try:
            self.diagnosis.ask(line, self.limit)
        except Overdue:
            late = {"seconds": self.limit, "error": TIMEOUT, "limit": self.limit, "code": self.code}
            self.store.put(job, order, late)
        except Ended as end:
            self.store.put(job, order, {"seconds": 0.0, "error": f"died: {end}", "code": self.code})

    def close(self, patience: float = STOPPING) -> None:
        """For good."""
        self.world.dismiss(patience)
        self.diagnosis.dismiss(patience)


def carry_out(jobs: Sequence[Job], lanes: Sequence[Lane], renew: bool, told: Callable[[Job], None]) -> None:
    """All jobs, in order, on all lanes; `told` after each, in this thread. Raises ProofError; Ctrl+C ends it."""

    def work(lane: Lane, job: Job) -> Job:
        lane.carry_out(job, renew)
        return job

    def close(patience: float) -> None:
        for lane in lanes:
            lane.close(patience)

    drive(jobs, [partial(work, lane) for lane in lanes], close, told)
