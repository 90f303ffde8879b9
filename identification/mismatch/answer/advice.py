"""What a person at the bench does next about something that has a place and no name."""

from __future__ import annotations

from collections.abc import Mapping

STEPS = "in fine steps, both directions, and record rate, current and the voltage at the motor"
ADVICE: Mapping[str, str] = {
    "command_voltage": f"go through this range {STEPS}",
    "motor_voltage": f"go through this range {STEPS}",
    "rotation_rate": f"go through this range {STEPS}",
    "current": f"go through this range {STEPS}",
    "direction": "run the same levels in both directions, then hang dead weights on the cell both ways",
    "time": "repeat the run with a rest and a tare at its beginning, middle and end, and log supply and temperatures",
    "time_since_step": (
        "have the recording say what the cell's amplifier smooths (low_pass, window); "
        "make large and small steps, sampled ten times as fast, and tap the stand at rest"
    ),
    "previous_voltage": "reach one level from above, from below and from rest, each held until it is steady",
    "direction_of_change": "run the same levels going up and going down, each held until it is steady",
    "load_history": "hold a long load, then rest as long, and log motor temperature and supply",
    "bus_voltage": "run the same levels at two supply voltages",
    "motor_temperature": "run the same levels with a cold motor and with a warm one",
    "water_temperature": "run the same levels in colder and in warmer water",
    "flow_speed": "run the same levels in still water and at two speeds of the flow",
    "neighbour_thrust": "run the same levels with the neighbour at rest and at two of its levels",
    "torque": "hang dead weights on the cell both ways, and load it with a torque alone",
}
"""Quantity over which it is left -> what shows its cause."""


def what_to_do(quantity: str) -> str:
    """A sentence; empty where nothing is known to help.

    >>> what_to_do("bus_voltage")
    'Next: run the same levels at two supply voltages.'
    """
    return f"Next: {ADVICE[quantity]}." if quantity in ADVICE else ""
