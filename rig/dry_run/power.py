"""Electrical energy that a run is expected to take, from the power that was measured at each level before. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from identification.recording import Channel, Floats, Recording
from rig.campaign.plan import Step
from rig.dry_run.command import corners

SETTLED: Final = 0.5
"""Share of a hold, at its end, whose mean power is taken: the motor's current has settled by then."""
LEAST_ROWS: Final = 2
"""Of current and of voltage in that time: a VESC sends its input current five times a second."""
FINEST: Final = 0.05
"""s between two looks at the power in a ramp."""
MOST_LOOKS: Final = 200
"""At one straight piece of the command."""
ROUNDING: Final = 1e-3
"""Relative; a level this much beyond the last measured one is that level."""


@dataclass(frozen=True)
class PowerCurve:
    """Electrical power that a thruster took from its supply at the levels of an earlier run, at rest (0 V) too."""

    volts: tuple[float, ...]
    """Command in V, rising."""
    watts: tuple[float, ...]
    source: str
    """Recording that it was measured in."""

    @property
    def reach(self) -> tuple[float, float]:
        """V, lowest and highest that was measured."""
        return self.volts[0], self.volts[-1]

    def at(self, volts: Floats) -> Floats:
        """W at commands in V, (n,); NaN beyond the levels that were measured.

        Between two levels power goes in proportion to V^3, as a propeller's does (thrust as V^2, its speed as V).
        """
        low, high = self.reach
        slack = ROUNDING * max(abs(low), abs(high))
        known = (volts >= low - slack) & (volts <= high + slack)
        found: Floats = np.interp(volts**3, np.array(self.volts) ** 3, self.watts)
        return np.where(known, found, np.nan)


@dataclass(frozen=True, slots=True)
class Energy:
    """Of one run by plan. Raising the propeller's speed and the watchdog's proof are not in it."""

    joules: float
    mean_watts: float
    peak_watts: float
    source: str


def energy(steps: Iterable[Step], curve: PowerCurve) -> Energy | str:
    """What the steps take by a curve, or a sentence that says why that is not known."""
    time, volts = corners(steps)
    low, high = curve.reach
    if np.isnan(curve.at(volts)).any():
        return (
            f"not known: the plan goes from {volts.min():g} to {volts.max():g} V, and {curve.source} has the power "
            f"from {low:g} to {high:g} V only"
        )
    joules = peak = 0.0
    for k in range(len(time) - 1):
        seconds = float(time[k + 1] - time[k])
        looks = 2 if volts[k] == volts[k + 1] else int(np.clip(seconds / FINEST, 2, MOST_LOOKS))
        watts = curve.at(np.linspace(volts[k], volts[k + 1], looks))
        joules += float(np.mean((watts[1:] + watts[:-1]) / 2)) * seconds
        peak = max(peak, float(watts.max()))
    total = float(time[-1])
    return Energy(joules, joules / total if total else 0.0, peak, curve.source)


def measured_power(recording: Recording) -> PowerCurve | str:
    """Power from the supply at the holds of a recording, or a sentence that says what it lacks.

    Power is `bus_voltage` times `input_current`, which is the supply's. A channel of the quantity `current` may be the
    motor's, whose voltage is another, and is not taken.
    """
    voltage = recording.first_of("bus_voltage")
    current = next((c for c in recording.channels if c.name == "input_current" and c.unit == "A"), None)
    missing = [name for name, found in (("bus_voltage", voltage), ("input_current", current)) if found is None]
    if voltage is None or current is None:
        return f"{recording.source} has no {' and no '.join(missing)}"
    found: dict[float, list[float]] = {}
    for step in recording.steps:
        if step.phase in ("hold", "tare"):
            watts = _mean(voltage, step.t_start, step.t_end) * _mean(current, step.t_start, step.t_end)
            if np.isfinite(watts):
                found.setdefault(step.command_voltage, []).append(watts)
    if len(found) < 2 or 0.0 not in found:
        return f"{recording.source} has no power measured at rest and at one level or more"
    volts = tuple(sorted(found))
    return PowerCurve(volts, tuple(float(np.mean(found[v])) for v in volts), recording.source)


def _mean(channel: Channel, start: float, end: float) -> float:
    _, values = channel.window(end - SETTLED * (end - start), end)
    values = values[np.isfinite(values)]
    return float(values.mean()) if values.size >= LEAST_ROWS else float("nan")
