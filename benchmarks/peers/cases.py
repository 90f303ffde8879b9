"""Recordings in which one effect is concealed, or none: one to fit, one of another plan to predict, and the truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.physics.catalogue import CATALOGUE
from identification.recording import Channel, Recording, Step
from sim_devices import concealed
from sim_devices.concealed.cases.definition import Case, Run, history, thrust_of
from sim_devices.concealed.cases.needs import NEEDS_SLEW
from sim_devices.concealed.cases.plans import profile

EFFECTS = tuple(sorted({t.id for t in CATALOGUE if "rotation_rate" not in t.needs} & set(concealed.SHAPES)))
"""Those that have columns (see columns.py); a periodic disturbance has none, ours looks for it in the spectrum."""
STRENGTHS = {"clean": 0.0, "clear": 15.0, "plain": 40.0}
"""Sigma at which an oracle sees the effect that knows it."""


@dataclass(frozen=True, slots=True)
class Truth:
    """What the methods are not told."""

    effect: str
    """Empty where nothing is concealed."""
    noise: float
    """N rms of the noise of the unseen recording: nobody can predict that."""
    noise_kind: str


@dataclass(frozen=True, eq=False, slots=True)
class Puzzle:
    fitted: Recording
    unseen: Recording
    """The same thruster, effect and noise under another plan of the same kind, with another tare."""


def made(kind: str, effect: str, seed: int) -> tuple[Puzzle, Truth]:
    """Thruster, scales, rate, plan, noise and channels drawn; the same arguments give the same recordings."""
    rng = np.random.default_rng([seed, 11])
    case = concealed.case(rng, [effect] if effect else [], STRENGTHS[kind] or 40.0)
    run = case.runs[0]
    plan = profile(
        run.profile.kind, case.scale.voltage, run.profile.duration, case.dt, rng, smooth=effect in NEEDS_SLEW
    )
    tare = case.scale.thrust * float(rng.uniform(-0.02, 0.02))
    other = replace(case, runs=(replace(run, profile=plan, tare=tare, seed=int(rng.integers(2**62))),))
    unseen = _recording(other)
    thrust = unseen.first_of("thrust")
    assert thrust is not None
    off = thrust.value - _exact(other, other.runs[0])
    noise = float(np.sqrt(np.mean(off**2)))
    return Puzzle(_recording(case), unseen), Truth(effect, noise, case.noise_kind)


def _exact(case: Case, run: Run) -> np.ndarray:
    return thrust_of(case, run, history(case, run))


def _recording(case: Case) -> Recording:
    (rows,) = concealed.rows(case)
    steps = tuple(Step(i, s.phase, s.volts, s.start, s.end) for i, s in enumerate(rows.steps))
    channels = tuple(
        Channel(c.name, c.stream, c.quantity, c.unit, c.time, c.value, thruster=c.thruster or None)
        for c in rows.columns
    )
    return Recording(rows.recording_id, rows.thruster, channels, steps, outcome="completed", source="simulated")
