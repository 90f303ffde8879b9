"""Steps of a plan in the order they are run: where each stands, and that none may do harm."""

from __future__ import annotations

from rig.campaign.plan import TARE_AGAIN, Step
from rig.campaign.shapes import require

__all__ = ["TARE_AGAIN", "Step", "places", "require_steps"]


def places(steps: tuple[Step, ...]) -> tuple[int, ...]:
    """Where in its plan each step stands; a tare that is none of its steps stands where the one after it does.

    >>> places((Step(TARE_AGAIN, "tare", 0.0, 1.0, 1.0), Step(7, "hold", 4.0, 1.0, 1.0)))
    (7, 7)
    """
    return tuple(next((s.index for s in steps[k:] if s.index >= 0), 0) for k in range(len(steps)))


def require_steps(steps: tuple[Step, ...], max_voltage: float) -> None:
    """Raise PlanError for no steps at all and for a command beyond `max_voltage` V."""
    require(len(steps) > 0, "the plan has no steps: nothing would be measured")
    for step in steps:
        sentence = f"step {step.number} commands {step.peak:g} V, but at most {max_voltage:g} V are allowed"
        require(step.peak <= max_voltage, sentence)
