"""Runs in one of which something is wired otherwise: what was said of it beside what is true, and the goals. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from rig.blind.scoring.rates import Goal, of_rate, rate

if TYPE_CHECKING:
    from rig.blind.scoring.score import Score

EFFECT: Final = "channel_fault"
FORMS: Final[Mapping[str, str]] = {
    "current_for_command": "swapped",
    "bus_for_command": "swapped",
    "current_rescaled": "rescaled",
    "thrust_unit": "rescaled",
    "thrust_reversed": "reversed",
    "rate_unit": "rescaled",
    "driver_changed": "driver",
    "thrust_strange": "strange",
}
"""What is wired otherwise -> the form of its finding."""
TOLD_BY_FIGURES: Final = ("current_rescaled", "driver_changed")
"""Of two runs nobody can say in which of them it is."""


@dataclass(frozen=True, slots=True)
class Wired:
    """What was said of the wiring in one case."""

    said: tuple[str, ...]
    """`form channel` or `form channel/channel` of each finding."""
    right: bool
    """Exactly the fault that is there, form and channels; or none where there is none."""
    thrust_blamed: bool
    """The thrust is said to have changed, and it has not."""
    run: bool | None = None
    """Whether the right run was named; None where none was, or it cannot be known."""


def wired(found: Mapping[str, Any], truth: Mapping[str, Any]) -> Wired | None:
    """Of a diagnosis; None where the case is not about several runs' wiring.

    >>> told = {"effect": "channel_fault", "form": "driver", "channels": ["command_voltage"], "recording": "b"}
    >>> fault = {"kind": "driver_changed", "channel": "command_voltage", "run": 1}
    >>> seal = {"asked": {"wiring": "driver_changed"}, "fault": fault, "recordings": ["a", "b", "c"]}
    >>> wired({"findings": [told]}, seal)
    Wired(said=('driver command_voltage',), right=True, thrust_blamed=False, run=True)
    """
    if "wiring" not in truth.get("asked", {}):
        return None
    findings, fault = found["findings"], truth["fault"]
    told = [f for f in findings if f["effect"] == EFFECT]
    said = tuple(f"{f['form']} {'/'.join(f['channels'])}" for f in told)
    changed = any(f["effect"] == "thrust_constant" for f in findings)
    lying = set() if fault is None else {fault["channel"], fault.get("other", fault["channel"])}
    blamed = "thrust" not in lying and (changed or any("thrust" in f["channels"] for f in told))
    if fault is None:
        return Wired(said, not told, blamed)
    right = len(told) == 1 and told[0]["form"] == FORMS[fault["kind"]] and set(told[0]["channels"]) == lying
    known = right and (len(truth["recordings"]) > 2 or fault["kind"] not in TOLD_BY_FIGURES)
    run = told[0]["recording"] == truth["recordings"][fault["run"]] if known else None
    return Wired(said, right, blamed, run)


def wired_goals(scores: Sequence[Score]) -> list[Goal]:
    """Of the cell `wiring`."""
    faulty = [s for s in scores if EFFECT in s.truth]
    sound = [s for s in scores if EFFECT not in s.truth]
    return [
        of_rate("wiring between runs: the fault, by kind and channel", rate(s.right for s in faulty), least=0.95),
        of_rate(
            "wiring between runs: thrust blamed wrongly",
            rate(s.wired is not None and s.wired.thrust_blamed for s in scores),
            most=0.01,
        ),
        of_rate("wiring between runs, nothing changed: false alarms", rate(not s.right for s in sound), most=0.02),
    ]


def wired_besides(scores: Iterable[Score]) -> list[Goal]:
    """Where it can be known, whether the right run was named."""
    known = [s.wired.run for s in scores if s.wired is not None and s.wired.run is not None]
    return [of_rate("wiring between runs: the run, where it can be known", rate(known))]
