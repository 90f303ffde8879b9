"""A run in virtual time: a command profile in, the sensors' samples and the truth behind them out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from itertools import pairwise
from math import exp, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_devices.world.noise import Noise
from sim_devices.world.settings import WorldSettings
from sim_devices.world.state import State
from sim_devices.world.world import World

FINE_STEP = 0.001
"""s while anything moves."""
COARSE_STEP = 0.01
"""s once the rotor has settled: a tenth of its fastest time constant, and its rest point is exact at any step."""
SETTLED = 1e-6
"""rev/s of change in one fine step: what is left of the motion is below 3e-4 rev/s and goes on shrinking."""
ALWAYS_FINE = {"supply_sag", "stand_resonance", "time_skew", "periodic_disturbance", "inflow_dynamics", "reversal_loss"}
"""Effects whose own dynamics need the fine step."""
SAME_TIME = 1e-9
"""s: rounding of sample times."""

Floats = NDArray[np.float64]


class Trace(NamedTuple):
    """One sensor's run. All (n,), float64, SI."""

    time: Floats
    """s since the start of the run."""
    value: Floats
    """As measured: noise, clipping and faults in it; NaN where the sensor gave nothing."""
    exact: Floats
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
    changes = sorted([(t, 0, v) for t, v in zip(time, volts, strict=True)] + [(t, 1, u) for t, u in flow])
    times = {channel: np.arange(int(duration * rate + SAME_TIME) + 1) / rate for channel, rate in rates.items()}
    exact = _exact(world, changes, times, coarse=not ALWAYS_FINE & set(settings.effects))
    traces = {}
    for channel, values in exact.items():
        noisy = values + noise_series(settings.noise.get(channel, Noise()), values, rates[channel], rng)
        traces[channel] = Trace(times[channel], _measured(world, channel, times[channel], noisy), values)
    return traces


def noise_series(noise: Noise, values: Floats, rate: float, rng: np.random.Generator) -> Floats:
    """Noise of one channel sampled at `rate` (1/s), in the channel's unit; same law as noise.NoiseSource."""
    n = len(values)
    total = (noise.white + noise.proportional * np.abs(values)) * rng.standard_normal(n)
    if noise.slow:
        from scipy.signal import lfilter  # only here: the live bench imports this module and must start quickly

        keep = exp(-1.0 / (rate * noise.slow_time))
        pushes = noise.slow * sqrt(1.0 - keep * keep) * rng.standard_normal(n)
        pushes[:1] = noise.slow * rng.standard_normal(1)
        total += lfilter([1.0], [1.0, -keep], pushes)
    return np.asarray(total, dtype=np.float64)


def _exact(
    world: World, changes: list[tuple[float, int, float]], times: Mapping[str, Floats], *, coarse: bool
) -> dict[str, Floats]:
    """Walk the world past every change and every sample time."""
    walk = _Walk(world, coarse=coarse)
    channels = list(times)
    stamps = np.concatenate([*times.values(), np.empty(0)])
    owners = np.concatenate([*(np.full(len(t), i) for i, t in enumerate(times.values())), np.empty(0)])
    order = np.argsort(stamps, kind="stable")
    logs: list[list[float]] = [[] for _ in channels]
    state, at = world.state, 0
    for t, owner in zip(stamps[order].tolist(), owners[order].astype(int).tolist(), strict=True):
        while at < len(changes) and changes[at][0] <= t:
            walk.change(*changes[at])
            at += 1
        if t - state.t > SAME_TIME:
            walk.to(t)
        logs[owner].append(world.exact(channels[owner]))
    return {channel: np.array(log, dtype=np.float64) for channel, log in zip(channels, logs, strict=True)}


def _measured(world: World, channel: str, time: Floats, noisy: Floats) -> Floats:
    """Clipping and faults of the channel, sample by sample where there are any."""
    effects = world.output_effects(channel)
    if not effects:
        return noisy
    state, out = State(), []
    for state.t, value in zip(time.tolist(), noisy.tolist(), strict=True):
        out.append(reduce(lambda v, effect: effect.apply(v, state, 0.0), effects, value))
    return np.array(out, dtype=np.float64)


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
        while (left := t - s.t) > SAME_TIME:
            before = s.n
            world.step(min(self._step, left), volts)
            if self._coarse and self._step == FINE_STEP and left >= FINE_STEP and abs(s.n - before) < SETTLED:
                self._step = COARSE_STEP
