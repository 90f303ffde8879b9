"""The engine of one machine: as many processes as wanted, each with its imports made once, each killed at no loss.

A process that dies or takes too long is known with the file that it was at. That file is asked once more, in a new
process, as is one that was not to be had or not read; fails that too, the file is told by name and the others go on.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rig.fleet.engine import Answered, Failed, Order
from rig.fleet.question import Question
from rig.workers.child import Child, Ended, Overdue
from rig.workers.lanes import drive

TRIES = 2


@dataclass(frozen=True)
class Local:
    """`jobs` processes; `limit` s for one file; what they say on standard error is added to files in `logs`."""

    jobs: int
    limit: float
    logs: Path

    def carry_out(self, question: Question, orders: Sequence[Order], told: Callable[[Answered | Failed], None]) -> None:
        """See Engine."""
        command = [sys.executable, "-m", "rig.fleet.answering", json.dumps(question.as_json())]
        count = min(self.jobs, len(orders))
        children = [Child(command, self.logs / f"worker-{i}.log") for i in range(count)]

        def close(patience: float) -> None:
            for child in children:
                child.dismiss(patience)

        drive(orders, [partial(self._ask, child) for child in children], close, told)

    def _ask(self, child: Child, order: Order) -> Answered | Failed:
        why = ""
        for _ in range(TRIES):
            try:
                found = json.loads(child.ask({"url": order.url}, self.limit))
            except Overdue:
                return Failed(order, f"{order.url}: took more than {self.limit:g} s (--limit) and was ended")
            except Ended as end:
                why = f"{order.url}: the process that was at it ended, twice ({end})"
                continue
            if "failed" not in found:
                return order, found
            why = found["failed"]
        return Failed(order, why)
