"""The run as it is behind a drive's limit and dead band, where these come first: ticks pass them one by one, or not.

A slope says what a small change of a tick becomes, and nothing of a tick that begins to act, or that a drive clips.
What follows the command behind them, within an interval too, follows the ticks that left them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.mismatch.model.model import Acting, Model, acting
from identification.mismatch.model.parameters import Theta
from identification.physics.term import Scale, Term, TermContext
from identification.recording import Floats
from identification.run_history.command_means import command_means
from identification.run_history.history import TURNING, History
from identification.run_history.remembered import RememberedRun
from identification.run_history.ticks.sub_interval_leads import with_leads


def behind_drive(
    model: Model, theta: Theta, run: RememberedRun, scale: Scale
) -> tuple[RememberedRun, tuple[Term, ...]]:
    """That run, and the terms that it is behind: the last that ticks pass one by one, and all before it. The run itself
    and none where there is no such term, or nothing is known of ticks."""
    if run.history.ticks is None:
        return run, ()
    every = acting(model, theta, scale)
    last = max((i for i, each in enumerate(every) if _lets_ticks_pass(each)), default=-1)
    if last < 0:
        return run, ()
    first = tuple(every[: last + 1])
    return run.behind(first, lambda: _behind(first, run)), tuple(term for term, _, _ in first)


def _lets_ticks_pass(each: Acting) -> bool:
    term, values, sizes = each
    return term.traits.tick_by_tick and values[0] != term.parameters(sizes)[0].neutral


def _behind(first: Sequence[Acting], run: RememberedRun) -> History:
    """Its driver, ticks and leads are those that leave the terms that come first."""
    history = run.history
    assert history.ticks is not None
    (when, command), driver = history.ticks, history.driver
    if not all(term.traits.tick_by_tick for term, _, _ in first):
        when, command = _at_edges_too(when, command, history.edges)
    instant = RememberedRun(history.with_driver(excess=np.zeros(1)))
    for term, values, sizes in first:
        if term.traits.tick_by_tick:
            command = term.apply(command, TermContext(instant, sizes, 1.0, 0.0, command), values)
            driver = command_means(history.with_driver(ticks=(when, command)), lambda each: each)
        else:
            before, driver = driver, term.apply(driver, TermContext(run, sizes, 1.0, 0.0, driver), values)
            command = command * _share(driver, before, history, when)
    behind = history.with_driver(driver=driver, ticks=(when, command))
    excess = command_means(behind, lambda each: each * np.abs(each)) - driver * np.abs(driver)
    return with_leads(behind.with_driver(excess=excess))


def _at_edges_too(when: Floats, command: Floats, edges: Floats) -> tuple[Floats, Floats]:
    """The same ticks, told again where intervals begin: what a term leaves of a command moves while that is held."""
    knots = np.union1d(when, edges[edges > when[0]])
    return knots, command[np.searchsorted(when, knots, side="right") - 1]


def _share(after: Floats, before: Floats, history: History, when: Floats) -> Floats:
    """(T,) of what drives, that a term leaves which says it of means over intervals, at the ticks: that of the interval
    which follows, or where none drives what lies between."""
    drives = np.abs(before) > TURNING * history.size
    if not drives.any():
        return np.ones(when.size)
    share = np.interp(history.middle, history.middle[drives], after[drives] / before[drives])
    return np.asarray(share[np.clip(np.searchsorted(history.edges, when, side="right") - 1, 0, share.size - 1)])
