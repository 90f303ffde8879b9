"""Several effects at once, as much of each as the field has; and the same thruster again, with one effect more or none.

Amounts are drawn here, and the strength at which an oracle sees each effect beside the others follows from them: the
other way round than in `draw.case`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.optimize import brentq

from sim_devices.concealed.cases.bystanders import with_bystanders
from sim_devices.concealed.cases.definition import Case, Concealed, settings
from sim_devices.concealed.cases.knob import LEAST, Shape
from sim_devices.concealed.cases.needs import NEEDS_DRIFT, NEEDS_FLOW, NEEDS_ROTATION
from sim_devices.concealed.cases.plans import KINDS
from sim_devices.concealed.cases.shapes import SHAPES, shape
from sim_devices.concealed.draw import TRIES, Rng, bare, one_run
from sim_devices.concealed.visibility.oracle import OutOfReach, added_at, measured
from sim_devices.world.sweep import sweep

FIELD: Final[Mapping[str, tuple[float, float]]] = {
    "dead_band": (0.02, 0.10),
    "asymmetry": (0.05, 0.40),
    "winding_resistance": (0.05, 0.35),
    "motor_lag": (0.05, 0.30),
    "inflow_dynamics": (0.10, 0.50),
    "heating": (0.01, 0.08),
    "recirculation": (0.01, 0.08),
}
"""Least and most amount: share of the largest command, of the thrust in the other direction, of the largest command
lost; s; share of the step in thrust; change of the largest thrust once warm, and once the water goes round."""
ADDED: Final = tuple(e for e in SHAPES if e not in NEEDS_FLOW | NEEDS_DRIFT | NEEDS_ROTATION | {"thruster_interaction"})
"""What may come on top in the second run: it needs no channel that the first run may lack."""
LONG, POINTS = 20.0, 2000
"""Time constants, and points of the grid, after which a motor is as warm as it gets."""


@dataclass(frozen=True, eq=False, slots=True)
class Difference:
    """Two recordings of one thruster."""

    first: Case
    second: Case
    """With all that `first` conceals."""


def composite(
    rng: Rng,
    effects: Sequence[str],
    *,
    plan: str = "",
    noise: str = "",
    sampling: float = 0.0,
    duration: float = 0.0,
) -> Case:
    """A case with `effects` of FIELD, the amount of each drawn log-uniformly, its strength written beside.

    What is not given is drawn as by `draw.case`. Magnets warm alone in a motor whose winding takes no voltage: beside a
    winding loss it is the copper. Raises ValueError for an effect that is not in FIELD.
    """
    if unknown := set(effects) - set(FIELD):
        raise ValueError(f"field: expected some of {', '.join(FIELD)}, got {', '.join(sorted(unknown))}")
    drawn = bare(rng, (), plan, noise, 0.0, 0.0, sampling, duration, None, 1, "")
    drawn = with_bystanders(drawn, rng.spawn(1)[0], frozenset(effects))
    forms = {"heating": "winding"} if "winding_resistance" in effects else {}
    added = tuple(_of_field_size(effect, drawn, rng, forms.get(effect, "")) for effect in effects)
    return measured(replace(drawn, effects=added))


def difference(
    rng: Rng,
    effects: Sequence[str],
    more: str,
    strength: float = 15.0,
    *,
    plan: str = "",
    noise: str = "",
    sampling: float = 0.0,
    duration: float = 0.0,
) -> Difference:
    """A composite of `effects`, and the thruster again with `more` beside them at `strength` sigma; "" is nothing.

    The plan of the second run is drawn. Raises OutOfReach when no pair of TRIES shows it so, ValueError for a name that
    is not known.
    """
    if more and (more not in ADDED or more in effects):
        raise ValueError(f"more: expected one of {', '.join(e for e in ADDED if e not in effects)}, got {more!r}")
    for _ in range(TRIES):
        first = composite(rng, effects, plan=plan, noise=noise, sampling=sampling, duration=duration)
        try:
            return Difference(first, _again(first, rng, more, strength))
        except OutOfReach:
            continue
    raise OutOfReach(f"no pair of {TRIES} shows {more} at {strength} sigma; expected a lower strength")


def _again(first: Case, rng: Rng, more: str, strength: float) -> Case:
    """Another run on another day, of another plan and with another zero. Raises OutOfReach."""
    flows = any(speed for run in first.runs for _, speed in run.flow)
    long = first.runs[0].profile.duration
    kind = str(rng.choice(KINDS))
    run = one_run(rng, first.scale, kind, 0.0, long, frozenset({more}), with_flow=flows)
    second = replace(first, runs=(run,))
    if more:
        added = Concealed(shape(more, first.scale, rng), 0.0)
        second = added_at(replace(second, effects=(*second.effects, added)), more, strength)
    return measured(second)


def _of_field_size(effect: str, case: Case, rng: Rng, form: str) -> Concealed:
    low, high = FIELD[effect]
    drawn = shape(effect, case.scale, rng, form)
    if effect != "heating":
        return Concealed(drawn, _log(rng, low, high))
    share = _log(rng, low, min(high, warm_change(case, drawn, drawn.highest)))
    return Concealed(_per_change(case, drawn, share), share)


def _per_change(case: Case, heating: Shape, share: float) -> Shape:
    """The shape whose amount is the change of thrust, for this one amount of it."""
    least = LEAST * heating.highest
    own = brentq(lambda amount: warm_change(case, heating, amount) - share, least, heating.highest, xtol=1e-3 * least)
    return replace(heating, gain=heating.gain * own / share, highest=share)


def warm_change(case: Case, heating: Shape, amount: float) -> float:
    """Share of the thrust that heating alone adds or takes at the largest command, held until nothing warms more."""
    alone = replace(case, effects=(Concealed(heating, amount),), decoys={})
    slowest = max(case.thruster.heating_time, heating.fixed["time_constant"])
    still, command = np.zeros(POINTS), np.full(POINTS, case.scale.voltage)
    h = sweep(settings(alone), LONG * slowest / POINTS, command, still, still)
    return float(abs(h.thrust[-1] / case.scale.thrust - 1.0))


def _log(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
