"""What force and rotation did at the commanded voltage, against its sign. Pure: a recording in, sentences out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.recording import Channel, Floats, Recording

SETTLE = 0.7
"""s at a voltage before the propeller is taken to turn as it will."""
LEAST = 0.5
"""s of a hold that is judged."""
CORRELATED = 0.25
"""s for which water and stand remember: so many independent values has a mean."""
SIGMAS = 4.0
"""By how many standard errors a mean is another than 0: a wire is not swapped for noise."""


@dataclass(frozen=True, slots=True)
class Side:
    """A mean while the voltage was held, less that at rest; its standard error; in the channel's unit."""

    mean: float
    std_error: float

    @property
    def sign(self) -> int:
        """0: not told from rest."""
        return int(np.sign(self.mean)) if abs(self.mean) > SIGMAS * self.std_error else 0


@dataclass(frozen=True, slots=True)
class Direction:
    """Of a run at `volts`. None: no such channel on the bench, or no hold long enough."""

    volts: float
    held: float
    """s that the voltage was held, `SETTLE` left out."""
    thrust: Side | None
    rotation: Side | None


def direction_of(recording: Recording, volts: float) -> Direction:
    """From the holds on the side of `volts`, also those that were cut, and the tare before them.

    A jog has one voltage; what a motor controller of coarse set-points made of it stands in the steps.
    """
    held = [
        (step.t_start + SETTLE, step.t_end)
        for step in recording.steps
        if step.phase in ("hold", "free") and step.command_voltage * volts > 0.0 and step.t_end - step.t_start > SETTLE
    ]
    seconds = sum(end - start for start, end in held)
    rest = [(step.t_start, step.t_end) for step in recording.steps if step.phase == "tare"]
    if seconds < LEAST:
        return Direction(volts, seconds, None, None)
    thrust, rotation = recording.first_of("thrust"), recording.first_of("rotation_rate")
    return Direction(volts, seconds, _side(thrust, held, rest), _side(rotation, held, rest))


def _side(channel: Channel | None, held: list[tuple[float, float]], rest: list[tuple[float, float]]) -> Side | None:
    if channel is None:
        return None
    at, before = _within(channel, held), _within(channel, rest)
    if at.size < 2 or before.size < 2:
        return None
    error = np.hypot(_error(at, held), _error(before, rest))
    return Side(float(at.mean() - before.mean()), float(error))


def _within(channel: Channel, spans: list[tuple[float, float]]) -> Floats:
    inside = np.zeros(channel.time.size, dtype=bool)
    for start, end in spans:
        inside |= (channel.time >= start) & (channel.time <= end)
    values: Floats = channel.value[inside]
    return values[np.isfinite(values)]


def _error(values: Floats, spans: list[tuple[float, float]]) -> float:
    independent = max(1.0, min(sum(end - start for start, end in spans) / CORRELATED, values.size))
    return float(values.std(ddof=1) / np.sqrt(independent))


def sentences(found: Direction, force: str) -> list[str]:
    """`force`: the device of the bench file whose thrust it is."""
    asked = "positive" if found.volts > 0 else "negative"
    if found.held < LEAST:
        return [
            f"{found.volts:g} V was held for {found.held:.1f} s beyond the first {SETTLE:g} s: nothing can be said of"
            f" the direction; hold it for {SETTLE + LEAST:.1f} s at least"
        ]
    lines = [
        _told("thrust", "N", found.thrust, asked, found.volts),
        _told("rotation", "rev/s", found.rotation, asked, found.volts),
    ]
    return [*lines, _advice(found, asked, force)]


def _told(what: str, unit: str, side: Side | None, asked: str, volts: float) -> str:
    if side is None:
        return f"{what}: not measured on this bench"
    size = f"{side.mean:+.3g} ± {side.std_error:.2g} {unit}"
    if side.sign == 0:
        return f"{what} does not differ from rest ({size}) at {volts:+g} V"
    return f"{what} is {'positive' if side.sign > 0 else 'negative'} ({size}) for a {asked} command of {volts:+g} V"


def _advice(found: Direction, asked: str, force: str) -> str:
    way = 1 if found.volts > 0 else -1
    thrust = 0 if found.thrust is None else found.thrust.sign * way
    rotation = 0 if found.rotation is None else found.rotation.sign * way
    match thrust, rotation:
        case 1, 1:
            return f"as it should be: a {asked} command gives {asked} thrust and {asked} rotation"
        case 1, -1:
            return (
                "the force is right and the rotation is counted backwards: exchange the two channels of the encoder, or"
                " the sign of the sensor in the controller"
            )
        case 1, _:
            return f"the force is right: a {asked} command gives {asked} thrust"
        case -1, -1:
            return "both are reversed: swap two motor wires"
        case -1, 1:
            return (
                "the force is reversed and the rotation is not: look which way the water goes. Forward: set sign = -1"
                f" in [devices.{force}]. Backward: swap two motor wires, or the propeller is of the other hand (a"
                " controller without a sensor counts its own field, not the shaft)"
            )
        case -1, _:
            return f"the force is reversed: swap two motor wires or set sign = -1 in [devices.{force}]"
        case 0, 0:
            return "nothing moved that is measured: is the motor wired, the propeller in the water, the voltage enough?"
    return (
        f"the propeller turns and no force is seen: is the cell between thruster and stand, is {force} the right"
        " device, is the voltage enough?"
    )
