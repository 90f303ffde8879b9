"""The sweep that tells a line of a fixed frequency from one that goes with the rotor: two levels of one direction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.estimation.tails import normal_sf
from identification.mismatch import policy
from identification.mismatch.diagnosis import NextExperiment, PlanStep
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.model.data import Data
from identification.mismatch.next_experiment.proposal import largest_level
from identification.mismatch.next_experiment.sweeps import REST, Limits
from identification.mismatch.periodic.periodic_disturbances import Line

SECOND_LEVEL = 0.7
"""Of the highest: a line that goes with the rotor is plainly elsewhere there."""
LONGEST, SHORTEST = 120.0, 10.0
"""s of one level of the sweep that tells a fixed line from one that goes with the rotor."""


def two_levels(line: Line, estimate: Estimate, data: Data, limits: Limits) -> NextExperiment:
    """Two levels of one direction: a line of a fixed frequency stays, one that goes with the rotor moves.

    At the second level only the true kind gains, in proportion to the time; chi-square apart is normal, its standard
    deviation twice the root of its mean.
    """
    volts = data.scale.driver_unit == "V"
    limits = limits if volts else replace(limits, max_voltage=None)  # of a bench, in V
    top = largest_level(data, estimate, limits)
    gain = line.gain / sum(float(h.edges[-1] - h.edges[0]) for h in data.histories)
    longest = max(0.5 * (limits.budget - 2 * REST), SHORTEST)
    seconds = float(
        np.clip(np.ceil(policy.next_experiment.LEVELS_APART_CHI2 / max(gain, 1e-9)), SHORTEST, min(LONGEST, longest))
    )
    apart = gain * seconds
    power = float(normal_sf((policy.select.RIVALS_EQUAL_BIC - apart) / (2 * np.sqrt(apart)))) if apart > 0 else 0.5
    steps = ((0.0, REST), (float(f"{top:.6g}"), seconds), (float(f"{SECOND_LEVEL * top:.3g}"), seconds), (0.0, REST))
    why = f"separates a line at {line.frequency:.4g} Hz from one that goes with the rotor: two levels of one direction"
    held = "command_voltage" if volts else "rotation_rate"
    return NextExperiment(why, tuple(PlanStep(level, s) for level, s in steps), power, held)
