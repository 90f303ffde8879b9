"""Jobs carried out: on each lane a process of the world and one of the diagnosis, which share files and nothing else.

A diagnosis that takes longer than its limit is killed and its answer is `timeout`; of one that dies it is `died`. Both
are failures of the diagnosis. A world that fails ends the proof. What is broken off, by us or by Ctrl+C, is no answer.
"""

from __future__ import annotations

import json
import os
import queue
import select
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event, Lock, Thread
from time import monotonic
from typing import Any

from rig.blind.design import Job, Kinds, Order
from rig.blind.store import TIMEOUT, ProofError, Store

WORLD_LIMIT = 900.0
"""s for one case: thirty draws at 500 samples/s."""
STOPPING = 5.0
"""s that a process is given to end by itself."""
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


class Overdue(Exception):
    """No line came within the limit; the process was killed."""


class Ended(Exception):
    """The process ended instead of answering."""


class BrokenOff(Exception):
    """The proof ends: nothing is asked any more, and what was asked has no answer."""


@dataclass
class Child:
    """A process that answers each line with a line. It is started when first asked, and again after it was killed."""

    command: Sequence[str]
    log: Path
    """Its standard error is added here."""
    process: subprocess.Popen[bytes] | None = None
    dismissed: bool = False
    """It is not asked any more."""
    starting: Lock = field(default_factory=Lock, repr=False)
    """So that none is started while it is dismissed: nobody would end it."""

    def ask(self, line: Mapping[str, Any], limit: float) -> None:
        """Raises Overdue after `limit` s without an answer, Ended when there will be none, BrokenOff when dismissed."""
        try:
            self._ask(line, limit)
        except (Overdue, Ended, OSError, ValueError) as end:  # its pipe may be closed under us
            if self.dismissed:
                raise BrokenOff from end
            raise

    def dismiss(self, patience: float = STOPPING) -> None:
        """End it for good, from any thread."""
        with self.starting:
            self.dismissed = True
        self.close(patience)

    def _ask(self, line: Mapping[str, Any], limit: float) -> None:
        process = self._running()
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(line).encode() + b"\n")
            process.stdin.flush()
        except OSError as error:
            raise Ended(self._end()) from error
        end, said = monotonic() + limit, b""
        while not said.endswith(b"\n"):
            ready, _, _ = select.select([process.stdout], [], [], max(end - monotonic(), 0.0))
            if not ready:
                self.close(0.0)
                raise Overdue
            piece = os.read(process.stdout.fileno(), 4096)
            if not piece:
                raise Ended(self._end())
            said += piece

    def close(self, patience: float = STOPPING) -> None:
        """End it; it is killed when that takes more than `patience` s."""
        process, self.process = self.process, None
        if process is None:
            return
        with suppress(OSError):
            if process.stdin is not None:
                process.stdin.close()
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if process.stdout is not None:
            process.stdout.close()

    def _running(self) -> subprocess.Popen[bytes]:
        with self.starting:
            if self.dismissed:
                raise BrokenOff
            if self.process is None:
                self.process = self._started()
            return self.process

    def _started(self) -> subprocess.Popen[bytes]:
        with self.log.open("ab") as log:
            return subprocess.Popen(
                self.command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env={**os.environ, **ONE_THREAD},
                bufsize=0,
                start_new_session=True,  # Ctrl+C in the terminal is for us: its death would be an answer
            )

    def _end(self) -> str:
        process = self.process
        self.close()
        return f"exit status {process.returncode if process else '?'}, see {self.log}"


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
    waiting: queue.SimpleQueue[Job] = queue.SimpleQueue()
    done: queue.SimpleQueue[Job | BaseException] = queue.SimpleQueue()
    stop, patience = Event(), 0.0
    for job in jobs:
        waiting.put(job)
    threads = [Thread(target=_drive, args=(lane, waiting, done, stop, renew), daemon=True) for lane in lanes]
    try:
        for thread in threads:
            thread.start()
        for _ in jobs:
            found = done.get()
            if isinstance(found, BaseException):
                raise found
            told(found)
        patience = STOPPING
    finally:
        stop.set()
        for lane in lanes:
            lane.close(patience)
        for thread in threads:
            if thread.is_alive():
                thread.join(STOPPING)


def _drive(
    lane: Lane,
    waiting: queue.SimpleQueue[Job],
    done: queue.SimpleQueue[Job | BaseException],
    stop: Event,
    renew: bool,
) -> None:
    while not stop.is_set():
        try:
            job = waiting.get_nowait()
        except queue.Empty:
            return
        try:
            lane.carry_out(job, renew)
            done.put(job)
        except BrokenOff:
            return
        except BaseException as error:  # noqa: BLE001  # raised again where the results are read
            done.put(error)
            return
