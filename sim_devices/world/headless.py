"""A run in virtual time: a command profile in, the sensors' samples and the truth behind them out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from heapq import heapify, heapreplace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_devices.world.settings import WorldSettings
from sim_devices.world.world import World

FINE_STEP = 0.001
"""s while anything moves."""
COARSE_STEP = 0.01
"""s once the rotor has settled: a tenth of its fastest time constant, and its rest point is exact at any step."""
SETTLED = 1e-9
"""rev/s of change in one fine step."""
ALWAYS_FINE = {"supply_sag", "stand_resonance", "time_skew", "periodic_disturbance", "inflow_dynamics", "reversal_loss"}
"""Effects whose own dynamics need the fine step."""


class Trace(NamedTuple):
    """One sensor's run. All (n,), float64, SI."""

    time: NDArray[np.float64]
    """s since the start of the run."""
    value: NDArray[np.float64]
    """As measured: noise, clipping and faults in it; NaN where the sensor gave nothing."""
    exact: NDArray[np.float64]
    """The same sensor without noise, clipping and faults."""


def run(
    settings: WorldSettings,
    time: Sequence[float],
    volts: Sequence[float],
    duration: float,
    *,
    rates: Mapping[str, float],
    rng: np.random.Generator,
    flow: Sequence[tuple[float, float]] = (),
) -> dict[str, Trace]:
    """Run the world for `duration` s.

    `time` (s, ascending), `volts`: the command as rows of changes, each holding until the next; 0 V before the first.
    `rates`: channel of noise.CHANNELS -> samples/s. `flow`: (s, m/s) changes of the tunnel flow.
    Raises ValueError when the profile is not ascending or a rate is not positive.
    """
    if len(time) != len(volts) or any(b < a for a, b in pairwise(time)):
        raise ValueError("run: time and volts must have the same length, and time must ascend")
    if any(not rate > 0 for rate in rates.values()):
        raise ValueError(f"run: every rate must be above zero, got {dict(rates)}")
    world = World(settings, rng)
    walk = _Walk(world, coarse=not ALWAYS_FINE & set(settings.effects))
    logs: dict[str, list[tuple[float, float, float]]] = {channel: [] for channel in rates}
    changes = sorted([(t, 0, v) for t, v in zip(time, volts, strict=True)] + [(t, 1, u) for t, u in flow])
    due = [(0.0, 0, channel) for channel in rates]
    heapify(due)
    at = 0
    while due and due[0][0] <= duration:
        t, count, channel = due[0]
        while at < len(changes) and changes[at][0] <= t:
            walk.change(*changes[at])
            at += 1
        walk.to(t)
        logs[channel].append((t, world.sample(channel), world.exact(channel)))
        heapreplace(due, ((count + 1) / rates[channel], count + 1, channel))
    return {channel: Trace(*np.array(rows, dtype=np.float64).reshape(-1, 3).T) for channel, rows in logs.items()}


class _Walk:
    """A world moved forward with the step that its motion needs."""

    def __init__(self, world: World, *, coarse: bool) -> None:
        self._world, self._coarse = world, coarse
        self._volts = 0.0
        self._step = FINE_STEP

    def change(self, t: float, what: int, value: float) -> None:
        """At t: 0 the command becomes `value` (V), 1 the flow (m/s)."""
        self.to(t)
        if what:
            self._world.state.flow = value
        else:
            self._volts = value
        self._step = FINE_STEP

    def to(self, t: float) -> None:
        """Advance to t (s)."""
        world, s, volts = self._world, self._world.state, self._volts
        while (left := t - s.t) > 1e-9:  # s: rounding of sample times
            before = s.n
            world.step(min(self._step, left), volts)
            settled = self._coarse and abs(s.n - before) < SETTLED and left >= self._step
            self._step = COARSE_STEP if settled or self._step == COARSE_STEP else FINE_STEP
