"""Several effects at once, as much of each as the field has; and the same thruster again, with one effect more, with
another amount of one, or as it was.

Amounts are drawn here, and the strength at which an oracle sees each effect beside the others follows from them: the
other way round than in `draw.case`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from sim_devices.concealed.cases.bystanders import with_bystanders
from sim_devices.concealed.cases.definition import Case, Concealed
from sim_devices.concealed.cases.field_size import FIELD, of_field_size
from sim_devices.concealed.cases.needs import NEEDS_DRIFT, NEEDS_FLOW, NEEDS_ROTATION
from sim_devices.concealed.cases.plans import KINDS
from sim_devices.concealed.cases.shapes import SHAPES, shape
from sim_devices.concealed.draw import TRIES, Rng, bare, one_run
from sim_devices.concealed.visibility.amounts import changed_at
from sim_devices.concealed.visibility.oracle import OutOfReach, added_at, measured

ADDED: Final = tuple(e for e in SHAPES if e not in NEEDS_FLOW | NEEDS_DRIFT | NEEDS_ROTATION | {"thruster_interaction"})
"""What may come on top in the second run: it needs no channel that the first run may lack."""


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

    What is not given is drawn as by `draw.case`. Raises ValueError for an effect that is not in FIELD.
    """
    if unknown := set(effects) - set(FIELD):
        raise ValueError(f"field: expected some of {', '.join(FIELD)}, got {', '.join(sorted(unknown))}")
    drawn = bare(rng, (), plan, noise, 0.0, 0.0, sampling, duration, None, 1, "")
    drawn = with_bystanders(drawn, rng.spawn(1)[0], frozenset(effects))
    return measured(replace(drawn, effects=of_field_size(effects, drawn, rng)))


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
    changed: str = "",
) -> Difference:
    """A composite of `effects`, and the thruster again with `more` beside them at `strength` sigma; "" is nothing.

    `changed`: one of `effects` instead, of which the second run has less or more, as is seen at `strength`. The plan of
    the second run is drawn. Raises OutOfReach when no pair of TRIES shows it so, ValueError for a name that is not
    known.
    """
    if more and (more not in ADDED or more in effects):
        raise ValueError(f"more: expected one of {', '.join(e for e in ADDED if e not in effects)}, got {more!r}")
    if changed and (more or changed not in effects):
        raise ValueError(f"changed: expected one of {', '.join(effects)} and nothing more, got {changed!r}, {more!r}")
    for _ in range(TRIES):
        first = composite(rng, effects, plan=plan, noise=noise, sampling=sampling, duration=duration)
        try:
            return Difference(first, _again(first, rng, more, strength, changed))
        except OutOfReach:
            continue
    raise OutOfReach(f"no pair of {TRIES} shows {more or changed} at {strength} sigma; expected a lower strength")


def _again(first: Case, rng: Rng, more: str, strength: float, changed: str) -> Case:
    """Another run on another day, of another plan and with another zero. Raises OutOfReach."""
    flows = any(speed for run in first.runs for _, speed in run.flow)
    long = first.runs[0].profile.duration
    kind = str(rng.choice(KINDS))
    run = one_run(rng, first.scale, kind, 0.0, long, frozenset({more}), with_flow=flows)
    second = replace(first, runs=(run,))
    if more:
        added = Concealed(shape(more, first.scale, rng), 0.0)
        second = added_at(replace(second, effects=(*second.effects, added)), more, strength)
    return changed_at(measured(second), changed, strength, rng) if changed else measured(second)
