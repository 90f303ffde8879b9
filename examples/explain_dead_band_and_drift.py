"""One recording with two concealed effects, and what every stage of its diagnosis hands on: docs/method.md reads it.

    python examples/explain_dead_band_and_drift.py [SEED]

Five minutes of random levels of 3 s within +-12 V, at rest every third; thrust at 10 Hz. C is 0.4 N/V^2. Concealed: a
dead band of 0.6 V and a zero that drifts by 1.5 N, settling with 100 s. The noise is white (0.2 N), slow (0.15 N, 2 s)
and proportional to the thrust (0.5 %). Nothing of `sim_devices` is used.
"""

from __future__ import annotations

import sys

import numpy as np

from identification.mismatch.answer.explained.explain import explained
from identification.mismatch.answer.explained.trace import Trace
from identification.mismatch.pipeline import traced
from identification.recording import Channel, Recording
from rig.diagnose.explanation import explanation_text
from rig.diagnose.text import diagnosis_text

SECONDS, DWELL, RATE = 300.0, 3.0, 10.0
C, DEAD, DRIFT, SETTLING, TARE = 0.4, 0.6, 1.5, 100.0, -0.8
WHITE, SLOW, SLOW_TIME, PROPORTIONAL = 0.2, 0.15, 2.0, 0.005


def recording(seed: int = 1) -> Recording:
    """As any bench would have written it: a command and a thrust, each with its own times."""
    rng = np.random.default_rng(seed)
    start = np.arange(0.0, SECONDS, DWELL)
    level = np.round(rng.uniform(-12.0, 12.0, start.size), 1)
    level[::3] = 0.0
    time = np.arange(0.013, SECONDS, 1 / RATE)
    volts = level[np.searchsorted(start, time, side="right") - 1]
    acting = np.sign(volts) * np.maximum(np.abs(volts) - DEAD, 0.0)
    force = C * acting * np.abs(acting)
    zero = TARE + DRIFT * (1 - np.exp(-time / SETTLING))
    thrust = force + zero + noise(rng, force)
    channels = (
        Channel("command_voltage", "drive", "command_voltage", "V", start, level),
        Channel("thrust", "cell", "thrust", "N", time, thrust),
    )
    return Recording("explained", "T1", channels, source="explained.h5")


def noise(rng: np.random.Generator, force: np.ndarray) -> np.ndarray:
    """(n,) N: white and proportional from sample to sample, and slow: a first-order autoregression."""
    fresh = WHITE * rng.standard_normal(force.size) + PROPORTIONAL * np.abs(force) * rng.standard_normal(force.size)
    keep, slow = np.exp(-1 / (RATE * SLOW_TIME)), np.empty(force.size)
    at = SLOW * rng.standard_normal()
    for i, kick in enumerate(rng.standard_normal(force.size).tolist()):
        slow[i] = at
        at = keep * at + SLOW * np.sqrt(1 - keep**2) * kick
    out: np.ndarray = fresh + slow
    return out


def trace(seed: int = 1) -> Trace:
    found = traced([recording(seed)])
    assert isinstance(found, Trace)
    return found


def main() -> None:
    found = trace(int(sys.argv[1]) if len(sys.argv) > 1 else 1)
    print(diagnosis_text(found.diagnosis), end="\n\n")
    print(explanation_text(explained(found)))


if __name__ == "__main__":
    main()
