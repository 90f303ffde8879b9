"""The folder of a proof: recordings (open), truth (sealed), answers. What is there need not be done again."""

from __future__ import annotations

import json
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np

import identification
from identification.recording import Floats
from rig.blind.design import Job, Order
from rig.errors import RigError


class ProofError(RigError):
    """The proof itself cannot go on; the sentence says why."""


@dataclass(frozen=True, slots=True)
class Store:
    root: Path

    @property
    def opened(self) -> Path:
        return self.root / "open"

    @property
    def answers(self) -> Path:
        return self.root / "answers"

    def truth(self, job: Job) -> dict[str, Any] | None:
        """What was concealed; None before the world has made the case. Raises ProofError for another design."""
        found = _read(self.root / "sealed" / f"{job.token}.json")
        if found is not None and found["asked"] != job.asked():
            raise ProofError(
                f"{self.root} holds {job.id} of another design or world; give another --store, or remove it"
            )
        return found

    def thrust(self, job: Job) -> tuple[Floats, Floats] | None:
        """True and measured thrust of the other run, (n,) N each."""
        found = _arrays(self.root / "sealed" / f"{job.token}.npz")
        return None if found is None else (found["thrust"], found["measured"])

    def answer(self, job: Job, order: Order) -> dict[str, Any] | None:
        return _read(self.answers / job.token / f"{order.tag}.json")

    def predictions(self, job: Job, order: Order) -> dict[str, Floats] | None:
        """`model` and `baseline` of the other run, (n,) N each."""
        return _arrays(self.answers / job.token / f"{order.tag}.npz")

    def put(self, job: Job, order: Order, answer: dict[str, Any]) -> None:
        """An answer that the diagnosing process did not live to give."""
        folder = self.answers / job.token
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{order.tag}.npz").unlink(missing_ok=True)
        (folder / f"{order.tag}.json").write_text(json.dumps(answer, indent=1) + "\n", encoding="utf-8")

    def pending(self, job: Job, code: str = "") -> tuple[Order, ...]:
        """Orders not answered yet; with `code` also those that another version of the diagnosis answered."""
        truth = self.truth(job)
        if truth is not None and truth["error"]:
            return ()
        answers = {order: self.answer(job, order) for order in job.orders}
        return tuple(o for o, found in answers.items() if found is None or (code and found.get("code") != code))

    def has_recordings(self, job: Job) -> bool:
        return self.truth(job) is not None and (self.opened / job.token / "0.npz").exists()

    def drop_recordings(self, job: Job) -> None:
        """They can be made again from their seed; all of them are some 30 GB."""
        rmtree(self.opened / job.token, ignore_errors=True)


def version_of_diagnosis() -> str:
    """Changes with every change of the sources of identification."""
    folder = Path(identification.__file__).parent
    found = sha256()
    for path in sorted(folder.rglob("*.py")):
        found.update(path.relative_to(folder).as_posix().encode())
        found.update(path.read_bytes())
    return found.hexdigest()[:12]


def _read(path: Path) -> dict[str, Any] | None:
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    return found


def _arrays(path: Path) -> dict[str, Floats] | None:
    if not path.exists():
        return None
    with np.load(path) as found:
        return {name: found[name].astype(np.float64) for name in found.files}
