"""How long a run still takes by its plan. Pure: time is given."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate

from rig.campaign.plan import Step
from rig.link.front_end_messages import State


class TimeLeft:
    """Of a run of `steps`, with `proof` s for each proof of the watchdog."""

    def __init__(self, steps: Sequence[Step], proof: float) -> None:
        self._steps, self._proof = steps, proof
        self._after = tuple(accumulate((s.expected for s in reversed(steps)), initial=0.0))[-2::-1]

    def of_step(self, position: int, state: State) -> float:
        """Seconds that what is under way takes in all."""
        return self._proof if state == "proving" else self._steps[position].expected

    def of_run(self, position: int, state: State, elapsed: float, proofs: int) -> float:
        """Seconds, where what is under way has taken `elapsed` s and `proofs` are still to be made."""
        after = self._after[position] + self._proof * proofs
        if state == "proving":
            after += self._steps[position].expected - self._proof
        return max(self.of_step(position, state) - elapsed, 0.0) + after
