"""What is told of a run that is wired otherwise: which file, which channel, what to check."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import log, pi

from identification.mismatch import policy
from identification.mismatch.faults.between_runs import Differs
from identification.mismatch.faults.comparison_of_runs import Changed
from identification.recording import Recording

UNITS: Mapping[str, Mapping[str, float]] = {
    "thrust": {"lbf": 1 / 4.4482216152605, "kgf": 1 / 9.80665, "gf": 1000 / 9.80665, "mN": 1000.0, "kN": 0.001},
    "rotation_rate": {"rpm": 60.0, "rad/s": 2 * pi, "deg/s": 360.0},
    "current": {"mA": 1000.0},
    "motor_voltage": {"mV": 1000.0},
    "torque": {"N.mm": 1000.0, "N.cm": 100.0, "kgf.cm": 10.1971621, "lbf.in": 8.85074579, "lbf.ft": 0.737562149},
}
"""Quantity -> unit that it is recorded in by mistake -> its figure for one of the SI unit."""
SI = {"thrust": "N", "rotation_rate": "rev/s", "current": "A", "motor_voltage": "V", "torque": "N.m"}
CHECK: Mapping[str, str] = {
    "swapped": "check which wire, column or name is which in {run}",
    "reversed": "check the polarity of that channel, or its sign in the import, of {run}",
    "rescaled": "check range, gain, shunt and calibration of that channel in {run}",
    "driver": "check the settings of the motor controller, its scale of command and its supply in {run}",
    "strange": "check connector, name and clock of that channel in {run}",
}
SAME_FACTOR = 9
"""Decimals of a logarithm to which two factors are one."""


@dataclass(frozen=True, slots=True)
class Unit:
    """That explains a factor."""

    name: str
    factor: float
    """Exactly."""
    inverse: bool
    """Whether the figures were converted once more than needed, or those of the run beside it once less."""


def name_of(recording: Recording) -> str:
    """The file that a run came from, or its id where it came from none."""
    return recording.source or recording.recording_id


def unit_of(one: Changed) -> Unit | None:
    """The unit of a channel that is rescaled; None where there is none.

    Of two that fit, as a kN that was left alone and a mN that was converted twice, the one that was left alone.
    """
    if one.kind != "rescaled":
        return None
    near = [
        (abs(log(one.factor) - sign * log(size)), Unit(name, size**sign, sign < 0))
        for name, size in UNITS.get(one.channel, {}).items()
        for sign in (1, -1)
    ]
    off, unit = min(near, key=lambda n: (round(n[0], SAME_FACTOR), n[1].inverse), default=(1.0, None))
    return unit if off < policy.faults.UNIT_BETWEEN_RUNS else None


def said(one: Differs) -> str:
    """One or two sentences: what is found, by what, and what to check where."""
    change, run = one.changed, name_of(one.recording)
    found = f"{run}: {_found(one)}"
    check = CHECK[change.kind].format(run=run)
    if change.kind == "rescaled" and unit_of(change) is not None:
        check = f"check the unit of that column in {run}"
    if one.beside is None or one.known:
        return f"{found}; {check}."
    other = name_of(one.beside)
    return f"{found}; {check}, or in {other}: of two runs nobody knows which is the right one."


def _found(one: Differs) -> str:
    change = one.changed
    with_ = ", ".join(change.by)
    lone = len(change.by) == 1
    there = "the other runs" if one.runs > 2 else name_of(one.beside) if one.beside is not None else ""
    match change.kind:
        case "swapped":
            off = 100 * abs(log(change.factor)) if change.factor > 0 else 0.0
            agree = f" (to {max(off, 0.1):.2g} %)" if there else ""
            also = f" with {with_}" if with_ else ""
            return (
                f"{change.channel} and {change.other} are exchanged: put back, they go together{also} as "
                f"{'in ' + there if there else 'they should'}{agree}"
            )
        case "reversed":
            return f"{change.channel} has the other sign than in {there}, against {with_}: it is reversed"
        case "strange":
            if not change.sure:
                return (
                    f"{change.channel} and {with_} do not go together as in {there}; no third channel tells which lies"
                )
            which = "which goes with the others" if lone else "which go together"
            also = f", {which}" + (f" as in {there}" if there else "")
            return f"{change.channel} follows nothing that was recorded beside it ({with_}{also})"
        case "driver":
            return (
                f"the same command_voltage gives what {1 / change.factor:.3g} times it gives in {there}: "
                f"{with_} all say so and agree with one another: the motor controller or what the command means to it "
                "changed"
            )
        case _:
            return _rescaled(change, with_, there)


def _rescaled(change: Changed, with_: str, there: str) -> str:
    unit = unit_of(change)
    size = f"{change.channel} is {change.factor:.3g} times what {with_} let expect after {there}"
    if not change.sure:
        size += f" (no third channel tells whether it is {change.channel} or {with_} that changed)"
    if unit is None:
        return f"{size}, and no unit explains it"
    si = SI[change.channel]
    if unit.inverse:
        return f"{size}: converted from {unit.name} to {si} once more than needed"
    return f"{size}: it is in {unit.name}, told as {si}"
