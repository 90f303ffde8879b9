"""Laws of noise drawn wide: what a cell in water may do beside what the six plain kinds of `draw.noise_law` do.

A stand rings anywhere with 1 to 20 % of critical damping; the zero wanders with time constants from a fifth of a hold
to a third of the run; noise goes with the thrust, or with the thrust that has not yet settled after a step; a converter
rounds by half to ten times the noise, which may then be silent; and several of these at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sim_devices.concealed.cases.plans import Profile
from sim_devices.world.noise_law import NoiseLaw, Peak, Slow, Unrest, scaled

Rng = np.random.Generator


@dataclass(frozen=True, slots=True)
class Setting:
    """What a law is drawn to suit."""

    std: float
    """N, about: of what is there all the time."""
    rate: float
    """1/s, of samples."""
    hold: float
    """s."""
    run: float
    """s."""
    thrust: float
    """N, largest."""


def usual_hold(profile: Profile) -> float:
    """Median length (s) of the steps of a plan in which the command stands still."""
    return float(np.median([s.end - s.start for s in profile.steps if s.phase in ("hold", "rest", "tare")]))


def wide_noise(kind: str, s: Setting, rng: Rng) -> NoiseLaw:
    """A law of `kind`. Raises ValueError for an unknown kind."""
    if kind not in WIDE_NOISE_KINDS:
        raise ValueError(f"noise must be one of {', '.join(WIDE_NOISE_KINDS)}, got {kind!r}")
    return LAWS[kind](s, rng)


def _log(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _split(s: Setting, share: float) -> tuple[float, float]:
    """Standard deviations of a part that has `share` of the variance, and of the rest."""
    return s.std * float(np.sqrt(share)), s.std * float(np.sqrt(1.0 - share))


def _resonant(s: Setting, rng: Rng) -> NoiseLaw:
    """From one period in a hold up to nearly half the sampling rate; full width at half power 2 zeta f."""
    frequency = _log(rng, 1.0 / s.hold, 0.45 * s.rate)
    ringing, rest = _split(s, float(rng.uniform(0.3, 0.95)))
    return NoiseLaw(rest, peak=Peak(ringing, frequency, 2.0 * _log(rng, 0.01, 0.2) * frequency))


def _slow(s: Setting, rng: Rng) -> NoiseLaw:
    wandering, rest = _split(s, float(rng.uniform(0.1, 0.8)))
    return NoiseLaw(rest, slow=(Slow(wandering, _log(rng, 0.2 * s.hold, s.run / 3.0)),))


def _proportional(s: Setting, rng: Rng) -> NoiseLaw:
    """At the largest thrust one to five times what is there always."""
    return NoiseLaw(s.std, proportional=s.std * _log(rng, 1.0, 5.0) / s.thrust)


def _near_steps(s: Setting, rng: Rng) -> NoiseLaw:
    """After a step as large as the largest thrust two to twenty times what is there always, for up to half a hold."""
    decay = _log(rng, 0.1, 0.5 * s.hold)
    unrest = Unrest(s.std * _log(rng, 2.0, 20.0) / s.thrust, decay, _log(rng, 0.05, 1.0) * decay)
    return NoiseLaw(s.std, unrest=unrest)


def _quantised(s: Setting, rng: Rng) -> NoiseLaw:
    quanta = _log(rng, 0.5, 10.0)
    white = s.std / float(np.sqrt(1.0 + quanta**2 / 12.0))
    return NoiseLaw(white, quantum=quanta * white)


def _mixture(s: Setting, rng: Rng) -> NoiseLaw:
    """Two to four of the others, each with a share of the power; in a third of the cases with heavy tails."""
    kinds = [str(kind) for kind in rng.permutation(list(PARTS))[: int(rng.integers(2, 5))]]
    shares = np.sqrt(rng.dirichlet(np.ones(len(kinds))))
    parts = [scaled(PARTS[kind](s, rng), float(share)) for kind, share in zip(kinds, shares, strict=True)]
    law = NoiseLaw(float(np.sqrt(sum(part.white**2 for part in parts))))
    for part in parts:
        law = replace(
            law,
            proportional=law.proportional or part.proportional,
            slow=(*law.slow, *part.slow),
            peak=law.peak or part.peak,
            unrest=law.unrest or part.unrest,
            quantum=law.quantum or part.quantum,
        )
    return replace(law, tails=float(rng.uniform(3.0, 6.0))) if rng.random() < 1.0 / 3.0 else law


Law = Callable[[Setting, Rng], NoiseLaw]
PARTS: dict[str, Law] = {
    "wide_resonant": _resonant,
    "wide_slow": _slow,
    "wide_proportional": _proportional,
    "wide_near_steps": _near_steps,
    "wide_quantised": _quantised,
}
LAWS: dict[str, Law] = {**PARTS, "wide_mixture": _mixture}
WIDE_NOISE_KINDS = tuple(LAWS)
