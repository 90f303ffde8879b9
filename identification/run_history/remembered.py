"""A run with what was worked out of it lately: a fit asks for the same again and again.

Each value depends on the run and on what is asked for, never on what was asked before, so that predictions do not
depend on the order in which they are made. None of it is a part of the history, which stages hand on.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import cached_property
from math import exp, log
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from identification.run_history.converter import Places
from identification.run_history.filters import Delay, delay_of
from identification.run_history.held import Held, held_of
from identification.run_history.history import History, Samples
from identification.run_history.least_recently_used import LeastRecentlyUsed
from identification.run_history.rate_gap import RateGap, asked_rows, rate_gap
from identification.run_history.rotor_lag import Rotor, lag_ends, lag_means
from identification.run_history.ticks.step_response_rows import TickRows, tick_rows

Channel = Literal["thrust", "rate"]
MOST_PREDICTIONS = 400
"""Values behind the first terms of models: a fit moves one parameter at a time."""
MOST_LEADS = 160
"""What dynamics make of the ticks: those of all trials of a screening, twice."""
MOST_LATELY = 24
"""What the rates of the last few models make at the samples: most terms change none."""
MOST_GAINS = 24
"""How much of a small change the last few models pass on, term by term."""
MOST_KNOTS = 4
"""Ticks with where a rotor passes through rest: many stands are tried on one rotor."""
MOST_FOLLOWERS = 48
"""What follows the rates of the last few models late: most parameters change neither the rates nor its time."""
MOST_REFERENCES = 64
"""Rotors from whose rates those of similar ones are sought."""
MOST_DELAYS = 8
"""Delays of which is known what each interval looks at: that of a fit, and of its slope."""
MOST_BEHIND = 4
"""Of the same run behind a dead band: that of a fit, and of its slope."""
REFERENCES = 8.0
"""Of them to a factor e in each coefficient."""


class RememberedRun:
    """One run, read-only."""

    def __init__(self, history: History) -> None:
        self.history = history
        self.predictions = LeastRecentlyUsed[Floats](MOST_PREDICTIONS)
        self.leads = LeastRecentlyUsed[Floats](MOST_LEADS)
        self.lately = LeastRecentlyUsed[Floats](MOST_LATELY)
        self.gains = LeastRecentlyUsed[Any](MOST_GAINS)
        self.knots = LeastRecentlyUsed[tuple[Floats, Floats]](MOST_KNOTS)
        self._followers = LeastRecentlyUsed[Floats](MOST_FOLLOWERS)
        self._references = LeastRecentlyUsed[Floats](MOST_REFERENCES)
        self._delays = LeastRecentlyUsed[Delay](MOST_DELAYS)
        self._behind = LeastRecentlyUsed[RememberedRun](MOST_BEHIND)

    @cached_property
    def step_responses(self) -> TickRows | None:
        """What the ticks of the command tell within the intervals; None where they tell nothing, or no sample is of
        an instant."""
        return tick_rows(self.history) if self.history.converter.instant else None

    @cached_property
    def rate_asked(self) -> NDArray[np.bool_]:
        """(m,) rows of the rate on which its gap is found."""
        return asked_rows(self.history)

    @cached_property
    def rate_gap(self) -> RateGap | None:
        """What takes the noise out of how far the measured rate is from a model."""
        return rate_gap(self.history)

    @cached_property
    def _held(self) -> Held | None:
        return held_of(self.history.driver, self.history.dt)

    def behind(self, what: Hashable, history: Callable[[], History]) -> RememberedRun:
        """The run with another driver, which ticks when its own does."""
        return self._behind(what, lambda: RememberedRun(history()))

    def followed(self, value: Floats, rotor: Rotor) -> Floats:
        """(M,) means of the rate of a rotor that follows `value` (rotor_lag.lag_means)."""
        h = self.history
        near = self._reference("intervals", h.driver, h.dt, rotor)
        return lag_means(value, h.dt, rotor, float(value[0]), near, self._held)

    def driven(self, rotor: Rotor | None) -> Floats:
        """(M,) the same of the driver itself, worked out once: a delay behind it moves and the rotor does not."""
        driver = self.history.driver
        return driver if rotor is None else self._followers(("driver", rotor), lambda: self.followed(driver, rotor))

    def follower(self, value: Floats, rotor: Rotor) -> Floats:
        """(M,) means of what follows a `value` (M,) as `rotor_lag.lag` says, from rest; worked out once of the same."""

        def made() -> Floats:
            h = self.history
            near = self._reference("from rest", h.driver, h.dt, rotor, from_rest=True)
            return lag_means(value, h.dt, rotor, 0.0, near, self._held)

        return self._followers(rotor, made, value)

    def rates_at_ticks(self, rotor: Rotor | None) -> Floats:
        """(T,) rate of the rotor at each tick of the command; it was settled before the first."""
        assert self.history.ticks is not None
        when, value = self.history.ticks
        if rotor is None:
            return value
        held, dt = value[:-1], np.diff(when)
        end = lag_ends(held, dt, rotor, float(value[0]), self._reference("ticks", held, dt, rotor))
        return np.concatenate([value[:1], end])

    def _reference(self, of: str, value: Floats, dt: Floats, rotor: Rotor, *, from_rest: bool = False) -> Floats | None:
        """Ends of a similar rotor, from which those of `rotor` are a few steps; None where it is linear."""
        if rotor.quadratic == 0 or not value.size:
            return None
        near = Rotor(*(exp(round(REFERENCES * log(c)) / REFERENCES) if c > 0 else 0.0 for c in rotor))
        begin = 0.0 if from_rest else float(value[0])
        return self._references((of, near), lambda: lag_ends(value, dt, near, begin))

    def delayed(self, value: Floats, delay: float) -> Floats:
        """(M,) means over each interval of `value` (M,) `delay` s before."""
        edges = self.history.edges
        return self._delays(delay, lambda: delay_of(edges, delay)).of(value)

    def converted(self, value: Floats) -> Floats:
        """(M,) what the converter makes of `value` (M,) at the samples of each interval."""
        return self.history.converter.shown(value, self.history.dt, self._sampled_places)

    def converted_amid(self, value: Floats) -> Floats:
        """(M,) the same in the middle of each interval."""
        return self.history.converter.shown(value, self.history.dt, self._middle_places)

    @cached_property
    def _sampled_places(self) -> tuple[Places, ...]:
        return self.history.converter.places(self.history.edges, self.history.sampled)

    @cached_property
    def _middle_places(self) -> tuple[Places, ...]:
        return self.history.converter.places(self.history.edges, self.history.middle)

    def samples(self, channel: Channel) -> Samples:
        """Every sample of a channel that is in an interval."""
        return self.history.thrust_samples if channel == "thrust" else self.history.rate_samples

    def after_ticks(self, channel: Channel, delay: float) -> tuple[NDArray[np.intp], Floats]:
        """(N,) of each sample the last tick that is `delay` s ago or longer, else the first, and s since then."""
        assert self.history.ticks is not None
        return self.samples(channel).after(self.history.ticks[0], delay)
