"""The engine of many machines: a cluster of Dask workers, asked through its scheduler.

Each order is a task whose name is the table's and the key of its answer, so that a task that is there already is not
begun twice. By the first part workers keep what they know of a kind of task, and of ten thousand kinds too. A worker
that dies gives its tasks to the others; one that ends worker after worker is told by name.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import Any

from rig.errors import ConfigError, RigError
from rig.fleet.engine import Answered, Failed, Order
from rig.fleet.one import one
from rig.fleet.question import Question, Row
from rig.workers.called import called

PATIENCE = 20.0
"""s to reach a scheduler."""
AT_ONCE = 2_000
"""Orders that the scheduler is given ahead: each costs it memory."""


def require_distributed() -> None:
    """Raises ConfigError."""
    if find_spec("distributed") is None:
        raise ConfigError("--scheduler asks Dask, which is not installed: pip install 'thruster-rig[fleet]'")


def ask(url: str, question: Question) -> Row:
    """On a worker. Raises RigError where its program is another than the one that asks: its answers would be too."""
    ours = sources(question.place)
    if ours != question.version:
        raise RigError(
            f"a worker runs other sources of thruster-rig ({ours}) than the one that asks ({question.version}); "
            "install the same version there"
        )
    return one(url, question)


@cache
def sources(place: str) -> str:
    """The version of what answers, by the `version` beside it."""
    module, _, _ = place.partition(":")
    found: str = called(f"{module}:version")()
    return found


@dataclass(frozen=True)
class DaskCluster:
    """By the address of its scheduler: `tcp://host:8786`."""

    address: str

    def carry_out(self, question: Question, orders: Sequence[Order], told: Callable[[Answered | Failed], None]) -> None:
        """See Engine. Raises ConfigError where no scheduler answers."""
        from distributed import Client, as_completed

        try:
            client = Client(self.address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ConfigError(
                f"--scheduler {self.address}: no scheduler of Dask answers there ({error}); start one: dask scheduler"
            ) from None
        waiting, at = list(reversed(orders)), dict[str, Order]()

        def given() -> Any:
            order = waiting.pop()
            name = f"{question.table}-{order.key}"
            at[name] = order
            return client.submit(ask, order.url, question, key=name, pure=True, retries=1)

        with client:
            running = as_completed([given() for _ in range(min(AT_ONCE, len(waiting)))], loop=client.loop)
            for future in running:
                told(_answer(future, at.pop(future.key)))
                if waiting:
                    running.add(given())


def _answer(future: Any, order: Order) -> Answered | Failed:
    from distributed import KilledWorker

    try:
        return order, future.result()
    except KilledWorker:
        return Failed(order, f"{order.url}: the workers that were at it ended, one after the other")
    except Exception as error:  # noqa: BLE001  # whatever a worker raised says why this file has no answer
        return Failed(order, f"{order.url}: {error or type(error).__name__}")
