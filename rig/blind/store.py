"""The folder of a proof: recordings (open), truth (sealed), answers. What is there need not be done again."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shutil import rmtree
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np

import identification
from identification.recording import Floats
from rig.blind.design import Job, Order
from rig.errors import RigError
from rig.workers.locking import folder_locked
from rig.workers.version import version_of

TIMEOUT: Final = "timeout"
"""The error of an answer that took longer than its `limit`."""
WHOLE: Final = "whole"
"""File beside the recordings of a case, when all of them are there."""


class ProofError(RigError):
    """The proof itself cannot go on; the sentence says why."""


@dataclass(frozen=True, slots=True)
class Store:
    """The folder of one proof: recordings in the open, truths sealed, and the answers given."""

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
        part = folder / f"{order.tag}.json.part"
        part.write_text(json.dumps(answer, indent=1) + "\n", encoding="utf-8")
        part.replace(folder / f"{order.tag}.json")

    def forget(self, job: Job) -> None:
        """Truth and answers; they are made anew, by the world and the diagnosis of today."""
        (self.root / "sealed" / f"{job.token}.json").unlink(missing_ok=True)
        for order in job.orders:
            (self.answers / job.token / f"{order.tag}.json").unlink(missing_ok=True)

    def pending(self, job: Job, code: str = "", limit: float = 0.0) -> tuple[Order, ...]:
        """Orders not answered yet, or given up after less than `limit` s.

        With `code` also those that another version of the diagnosis answered.
        """
        truth = self.truth(job)
        if truth is not None and truth["error"]:
            return ()
        answers = {order: self.answer(job, order) for order in job.orders}
        return tuple(o for o, found in answers.items() if found is None or _again(found, code, limit))

    def recordings_are_whole(self, job: Job) -> None:
        """The world has made all of them; where no such case could be drawn there are none."""
        folder = self.opened / job.token
        if folder.is_dir():
            (folder / WHOLE).touch()

    def has_recordings(self, job: Job) -> bool:
        return self.truth(job) is not None and (self.opened / job.token / WHOLE).exists()

    def drop_recordings(self, job: Job) -> None:
        """They can be made again from their seed; all of them are some 30 GB."""
        folder = self.opened / job.token
        (folder / WHOLE).unlink(missing_ok=True)
        rmtree(folder, ignore_errors=True)

    @contextmanager
    def locked(self) -> Iterator[None]:
        """While a proof works here. Raises ProofError when another one does."""
        busy = ProofError(f"another proof works in {self.root}; wait for it, or give another --store")
        with folder_locked(self.root, busy):
            yield


def version_of_diagnosis() -> str:
    """Changes with every change of the sources of identification."""
    return version_of(identification)


def _again(answer: dict[str, Any], code: str, limit: float) -> bool:
    given_up = answer.get("error") == TIMEOUT and float(answer.get("limit", limit)) < limit
    return given_up or bool(code and answer.get("code") != code)


def _read(path: Path) -> dict[str, Any] | None:
    """None where there is no such file. Raises ProofError for what is no JSON."""
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except ValueError as error:
        raise ProofError(f"{path} is broken ({error}); remove it, and it is made again") from error
    return found


def _arrays(path: Path) -> dict[str, Floats] | None:
    """None where there is no such file. Raises ProofError for what holds no arrays."""
    if not path.exists():
        return None
    try:
        with np.load(path) as found:
            return {name: found[name].astype(np.float64) for name in found.files}
    except (BadZipFile, EOFError, ValueError) as error:
        raise ProofError(f"{path} is broken ({error}); remove it and its JSON, and they are made again") from error
