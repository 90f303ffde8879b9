"""A selected model, what it leaves, its names, and what they are worth where nothing was fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.locate import stage as locate
from identification.mismatch.locate.stage import Located
from identification.mismatch.name import stage as name
from identification.mismatch.name.naming import Named
from identification.mismatch.prepare.channel_availability import predictable
from identification.mismatch.select.forward_selection import Selected
from identification.mismatch.validate import stage as validate
from identification.mismatch.validate.stage import Validated
from identification.recording import Recording
from identification.run_history.history import History


@dataclass(frozen=True, eq=False, slots=True)
class HeldBack:
    """Runs that judge, as recorded and as read."""

    recordings: tuple[Recording, ...]
    histories: tuple[History, ...]

    def seen_by(self, estimate: Estimate) -> tuple[tuple[History, ...], tuple[str, ...]]:
        """Those that hold what the model looks at, and a note on each that does not."""
        return predictable(self.recordings, self.histories, estimate)


@dataclass(frozen=True, eq=False, slots=True)
class Judged:
    """What the stages from `locate` to `validate` make of a model."""

    selected: Selected
    located: Located
    named: tuple[Named, ...]
    validated: Validated
    unseen: tuple[History, ...]
    """Whole runs that can judge it; where there are none blocks of time do."""
    unpredicted: tuple[str, ...]
    """Of the runs held out that cannot, a note each."""

    @property
    def same_run(self) -> bool:
        """Whether the runs that were fitted judge, by blocks of time."""
        return not self.unseen


def judged(selected: Selected, held_back: HeldBack, rng: np.random.Generator) -> Judged:
    """The model located, named and validated."""
    located = locate.run(selected, rng)
    unseen, unpredicted = held_back.seen_by(located.estimate)
    named = name.run(selected, located)
    validated = validate.run(located.estimate, named, selected.data, unseen)
    return Judged(selected, located, named, validated, unseen, unpredicted)
