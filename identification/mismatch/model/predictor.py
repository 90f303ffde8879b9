"""What a model says of a run; the only thing in a diagnosis that remembers what was worked out."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Any

import numpy as np

from identification.mismatch.model.behind_drive import behind_drive
from identification.mismatch.model.model import Acting, Model, acting
from identification.mismatch.model.parameters import Theta
from identification.mismatch.noise.covariance import Shapes
from identification.physics.term import STAGES, Scale, Term, TermContext
from identification.recording import Floats
from identification.run_history.history import History
from identification.run_history.least_recently_used import LeastRecentlyUsed
from identification.run_history.remembered import RememberedRun

HYDRO = STAGES.index("hydro")
CELL = STAGES.index("cell")
MOST_RUNS = 64
"""Histories of which something is remembered: a diagnosis has some tens at most, with their parts."""
MOST_LATELY = 16
"""Whole predictions: a fit asks for the residual and then for the slopes at the same values, and a term is put in the
place of another from several starts."""
MOST_COLUMNS = 64
"""Slopes over one parameter: those at one set of values are asked for with the noise before and after, and singly."""
MOST_ANSWERS = 64
"""Fits without a term, and what else is asked for more than once of the very same estimate."""


class Predictor:
    """Predictions of runs, by the history itself: one that is replaced has nothing from the one before it.

    What it returns depends on model, values and run alone, whatever was asked before.
    """

    def __init__(self) -> None:
        self._runs = LeastRecentlyUsed[RememberedRun](MOST_RUNS)
        self._answers = LeastRecentlyUsed[Any](MOST_ANSWERS)
        self._columns = LeastRecentlyUsed[Any](MOST_COLUMNS)
        self._lately = LeastRecentlyUsed[Any](MOST_LATELY)
        self.shapes = Shapes()

    def run(self, history: History) -> RememberedRun:
        return self._runs("run", lambda: RememberedRun(history), history)

    def once(self, key: Hashable, make: Callable[[], Any], *of: object) -> Any:
        """What `make` makes of the objects `of`, made once."""
        return self._answers(key, make, *of)

    def lately(self, key: Hashable, make: Callable[[], Any], *of: object) -> Any:
        """The same of what is asked for again at once or never."""
        return self._lately(key, make, *of)

    def column(self, key: Hashable, make: Callable[[], Any], *of: object) -> Any:
        """The same of slopes over one parameter, which many models do not ask for."""
        return self._columns(key, make, *of)


def predict(model: Model, theta: Theta, run: RememberedRun, scale: Scale, tare: float = 0.0) -> tuple[Floats, Floats]:
    """(F without tare, x) on the intervals of one run, each (M,).

    x is what the model itself says of the rate: a term that reads the measured rate does not count there.
    """
    behind, by_tick = behind_drive(model, theta, run, scale)
    value = behind.history.driver
    modelled = None
    x = value
    stage = 0
    terms = acting(model, theta, scale)
    key: object = (scale, tuple(each[:2] for each in terms[: len(by_tick)]))
    winding = winding_of(terms)
    for term, values, sizes in terms[len(by_tick) :]:
        at = STAGES.index(term.stage)
        if stage < HYDRO <= at:
            x = value
            value = theta.C * x * np.abs(x)
            key = (key, theta.C)
        if stage < CELL <= at:
            key = (key, tare)
        stage = at
        if "rotation_rate" in term.needs and modelled is None:
            modelled = value
        key = (key, term, values)
        now = TermContext(run, sizes, theta.C, tare, x if stage >= HYDRO else value, winding)
        value = run.predictions(key, _applied(term, value, now, values))
    if stage < HYDRO:
        x = value
        value = theta.C * x * np.abs(x)
    return value, x if modelled is None else modelled


def winding_of(terms: Sequence[Acting]) -> float | None:
    """The voltage that the model loses in the winding, 1/(unit of the driver); None where no term says so."""
    for term, values, sizes in terms:
        if term.traits.winding:
            return dict(zip((p.name for p in term.parameters(sizes)), values, strict=True))[term.traits.winding]
    return None


def _applied(term: Term, value: Floats, now: TermContext, values: tuple[float, ...]) -> Callable[[], Floats]:
    return lambda: term.apply(value, now, values)
