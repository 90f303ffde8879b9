"""A campaign before it is run, in numbers and in words: the same in `rig check` and in the editor. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rig.campaign.plan import Duration, Step
from rig.dry_run.command import Level, levels
from rig.dry_run.power import Energy, PowerCurve, energy


@dataclass(frozen=True)
class Outlook:
    """What a campaign that may run will take. Durations in s."""

    steps: tuple[Step, ...]
    """Of one run."""
    run: Duration
    """The first thruster, its proofs of the watchdog included."""
    total: Duration
    """All thrusters."""
    peak_voltage: float
    """V"""
    peak_thrust: float | None
    """N; None: the campaign gives no expected_C."""
    energies: Mapping[str, Energy | str] = field(default_factory=dict)
    """Thruster -> what its run takes, or why that is not known."""
    told: Mapping[float, float] = field(default_factory=dict)
    """V held by the plan -> V that the motor controller can be told, where they differ."""

    def rows(self) -> tuple[tuple[str, str], ...]:
        """(what, in words), in the order of a report."""
        thrust = "not known and not checked: the campaign gives no expected_C"
        if self.peak_thrust is not None:
            thrust = f"{self.peak_thrust:.4g} N expected, from expected_C"
        return (
            ("one run", f"{clock(self.run.expected)} expected, {clock(self.run.worst)} at worst"),
            ("campaign", f"{clock(self.total.expected)} expected, {clock(self.total.worst)} at worst"),
            ("holds", "; ".join(told_levels(levels(self.steps))) or "none: the plan moves all the time"),
            *(("set-points", text) for text in told_set_points(self.told)),
            ("peak voltage", f"{self.peak_voltage:g} V"),
            ("peak thrust", thrust),
            *(("energy", text) for text in told_energies(self.energies)),
        )


@dataclass(frozen=True)
class Assessment:
    """What can be said of a text that shall be a campaign file, whether it may run or not."""

    steps: tuple[Step, ...] = ()
    """Of one run; empty where the text is no campaign."""
    rows: tuple[tuple[str, str], ...] = ()
    """As `Outlook.rows`; empty where it may not run."""
    problem: str = ""
    """Why it may not run, a sentence; empty when it may."""
    notes: tuple[str, ...] = ()
    """What an operator must know beside it."""


def energies_of(steps: tuple[Step, ...], powers: Mapping[str, PowerCurve | str]) -> dict[str, Energy | str]:
    """Of the same steps by each thruster's curve; what is not known of a thruster stays a sentence."""
    return {name: curve if isinstance(curve, str) else energy(steps, curve) for name, curve in powers.items()}


def told_levels(found: Iterable[Level]) -> list[str]:
    """Levels that are held as often and as long as each other, together.

    >>> told_levels([Level(-4.0, 2, 6.0), Level(4.0, 2, 6.0), Level(8.0, 1, 3.0)])
    ['4 at -4, 4 V, 6 s at each', '1 at 8 V, 3 s']
    """
    groups: dict[tuple[int, float], list[float]] = {}
    for level in found:
        groups.setdefault((level.holds, round(level.seconds, 6)), []).append(level.voltage)
    return [
        f"{holds * len(volts)} at {', '.join(f'{v:.4g}' for v in volts)} V, {seconds:g} s"
        + (" at each" if len(volts) > 1 else "")
        for (holds, seconds), volts in groups.items()
    ]


def told_set_points(told: Mapping[float, float]) -> list[str]:
    """Levels that the motor controller can't be told exactly, the two ways of one level together.

    >>> told_set_points({5.0: 4.992, -5.0: -4.992})
    ['5 V is 4.992 V: the nearest that the motor controller can be told; recordings and fits have it']
    """
    near = dict(sorted((abs(asked), abs(volts)) for asked, volts in told.items()))
    pairs = ", ".join(f"{asked:.5g} V is {volts:.5g} V" for asked, volts in near.items())
    return [f"{pairs}: the nearest that the motor controller can be told; recordings and fits have it"] if near else []


def told_energies(energies: Mapping[str, Energy | str]) -> list[str]:
    """A line for each thruster, and their sum where all are known."""
    lines = [f"{name}: {told_energy(found)}" for name, found in energies.items()]
    known = [found for found in energies.values() if isinstance(found, Energy)]
    if len(known) == len(energies) > 1:
        lines.append(f"all {len(known)}: {_joules(sum(found.joules for found in known))}")
    return lines


def told_energy(found: Energy | str) -> str:
    """One thruster's."""
    if isinstance(found, str):
        return found
    return (
        f"{_joules(found.joules)} expected of one run, mean {_watts(found.mean_watts)}, peak "
        f"{_watts(found.peak_watts)}; by the power in {found.source}"
    )


def _joules(joules: float) -> str:
    return f"{joules / 1000:.3g} kJ ({joules / 3600:.3g} Wh)"


def _watts(watts: float) -> str:
    return f"{watts / 1000:.3g} kW" if abs(watts) >= 1000 else f"{watts:.3g} W"


def clock(seconds: float) -> str:
    """For people.

    >>> clock(62), clock(3723.0)
    ('1:02', '1:02:03')
    """
    if not math.isfinite(seconds):
        return "for ever"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
