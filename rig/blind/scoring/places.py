"""Where an effect shows: a diagnosis that cannot name it is right about the place when it points to one of these.

The physics decides, not the catalogue: a gain that steps is a matter of time; a loss that depends on the temperature of
water that warms steadily is a matter of that temperature, and of time just as well. Quantities are those of `where` in
the answer (docs/howto/diagnosis-json.md).
"""

from __future__ import annotations

from typing import Final

LEVEL: Final = frozenset({"command_voltage", "motor_voltage", "current"})
"""The static curve; the current follows the level."""
SIDE: Final = LEVEL | {"direction"}
COURSE: Final = frozenset({"time"})
LOAD: Final = frozenset({"load_history", "motor_temperature", "time"})
STEP: Final = frozenset({"time_since_step", "previous_voltage", "direction_of_change"})
FLOW: Final = frozenset({"flow_speed"})
SLIP: Final = frozenset({"rotation_rate"})
"""Where the rotor leaves the command, a measured rate shows it."""
UPSTREAM: Final = frozenset(
    {"dead_band", "winding_resistance", "command_saturation", "supply_sag", "motor_lag", "heating"}
)
"""Act before the rotor: with the rate recorded, "thrust follows the rate" (rotation_coupling) is as true of them."""

PLACES: Final = {
    "dead_band": LEVEL | SLIP,
    "exponent": LEVEL,
    "linear_term": LEVEL,
    "winding_resistance": LEVEL | SLIP,
    "command_saturation": LEVEL | SLIP,
    "load_cell_saturation": SIDE,
    "load_cell_nonlinearity": LEVEL,
    "load_cell_even_bend": SIDE,
    "cavitation": LEVEL,
    "asymmetry": SIDE,
    "torque_crosstalk": SIDE,
    "supply_sag": LEVEL | LOAD | SLIP | {"bus_voltage"},
    "heating": LOAD | LEVEL | SLIP,
    "motor_lag": STEP | SLIP,
    "time_skew": STEP,
    "stand_resonance": STEP | {"frequency"},
    "inflow_dynamics": STEP,
    "reversal_loss": STEP,
    "hysteresis": STEP,
    "speed_of_advance": FLOW,
    "strut_drag": FLOW,
    "recirculation": STEP | {"load_history"},
    "load_cell_creep": STEP | {"load_history"},
    "thruster_interaction": COURSE | {"neighbour_thrust"},
    "rotation_coupling": COURSE | SLIP | {"current"},
    "zero_drift": COURSE,
    "zero_offset": COURSE,
    "periodic_disturbance": COURSE | {"frequency"},
    "gain_step": COURSE,
    "gain_wave": COURSE,
    "fouling": COURSE,
    "aeration_pulses": COURSE,
    "reversed_flow_loss": FLOW,
    "crossed_flow_loss": FLOW,
    "temperature_squared": COURSE | {"water_temperature"},
    "level_bump": LEVEL,
    "wall_effect": SIDE,
    "upsweep_loss": STEP,
    "thermal_derating": LOAD,
}
