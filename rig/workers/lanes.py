"""Jobs carried out in order on several lanes, each a thread that asks processes of its own."""

from __future__ import annotations

import queue
from collections.abc import Callable, Sequence
from threading import Event, Thread
from typing import TypeVar

from rig.workers.child import STOPPING, BrokenOff

J = TypeVar("J")
R = TypeVar("R")


def drive(
    jobs: Sequence[J],
    works: Sequence[Callable[[J], R]],
    close: Callable[[float], None],
    told: Callable[[R], None],
) -> None:
    """All jobs, each by one of `works`, which run side by side; `told` after each, in this thread.

    `close` ends the processes of all lanes, given so many s; it is called however this is left. Raises what a work
    raises, but for BrokenOff, which only `close` brings about.
    """
    waiting: queue.SimpleQueue[J] = queue.SimpleQueue()
    done: queue.SimpleQueue[tuple[R] | BaseException] = queue.SimpleQueue()
    stop, patience = Event(), 0.0
    for job in jobs:
        waiting.put(job)
    threads = [Thread(target=_drive, args=(work, waiting, done, stop), daemon=True) for work in works]
    try:
        for thread in threads:
            thread.start()
        for _ in jobs:
            found = done.get()
            if isinstance(found, BaseException):
                raise found
            told(*found)
        patience = STOPPING
    finally:
        stop.set()
        close(patience)
        for thread in threads:
            if thread.is_alive():
                thread.join(STOPPING)


def _drive(
    work: Callable[[J], R],
    waiting: queue.SimpleQueue[J],
    done: queue.SimpleQueue[tuple[R] | BaseException],
    stop: Event,
) -> None:
    while not stop.is_set():
        try:
            job = waiting.get_nowait()
        except queue.Empty:
            return
        try:
            done.put((work(job),))
        except BrokenOff:
            return
        except BaseException as error:  # noqa: BLE001  # raised again where the results are read
            done.put(error)
            return
