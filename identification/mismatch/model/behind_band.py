"""The run as it is behind a dead band, where that comes first: ticks pass it one by one or not at all.

A slope says what a small change of a tick becomes, and nothing of a tick that begins to act. What follows the command
behind the band, within an interval too, follows the ticks that left it.
"""

from __future__ import annotations

import numpy as np

from identification.mismatch.model.model import Acting, Model, acting
from identification.mismatch.model.parameters import Theta
from identification.physics.term import Scale, TermContext
from identification.run_history.command_means import command_means
from identification.run_history.history import History
from identification.run_history.remembered import RememberedRun
from identification.run_history.ticks.sub_interval_leads import with_leads


def behind_band(model: Model, theta: Theta, run: RememberedRun, scale: Scale) -> tuple[RememberedRun, Acting | None]:
    """That run and the band; the run itself and None where no such band comes first, or nothing is known of ticks."""
    first = next(iter(acting(model, theta, scale)), None) if run.history.ticks is not None else None
    if first is None or not _lets_ticks_pass(first):
        return run, None
    term, values, sizes = first
    return run.behind((term, values, sizes), lambda: _behind(first, run)), first


def _lets_ticks_pass(each: Acting) -> bool:
    term, values, _ = each
    return term.traits.tick_by_tick and values[0] > 0


def _behind(band: Acting, run: RememberedRun) -> History:
    """Its driver, ticks and leads are those that leave the band."""
    term, values, sizes = band
    history = run.history
    assert history.ticks is not None
    when, command = history.ticks
    instant = RememberedRun(history.with_driver(excess=np.zeros(1)))
    left = term.apply(command, TermContext(instant, sizes, 1.0, 0.0, command), values)
    driver = term.apply(history.driver, TermContext(run, sizes, 1.0, 0.0, history.driver), values)
    behind = history.with_driver(driver=driver, ticks=(when, left))
    excess = command_means(behind, lambda each: each * np.abs(each)) - driver * np.abs(driver)
    return with_leads(behind.with_driver(excess=excess))
