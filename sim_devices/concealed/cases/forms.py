"""Textbook forms of the effects that have several: what is concealed at random, what only by name, what never."""

from __future__ import annotations

FORMS: dict[str, tuple[str, ...]] = {
    "dead_band": ("shrink", "jump"),
    "motor_lag": ("first_order", "quadratic"),
    "exponent": ("below", "above"),
    "asymmetry": ("weak_reverse", "strong_reverse"),
    "heating": ("winding", "magnet"),
    "recirculation": ("rate", "thrust"),
    "load_cell_creep": ("one_constant", "two_constants"),
    "load_cell_nonlinearity": ("quadratic", "cubic"),
    "cavitation": ("linear", "square"),
    "zero_drift": ("rate", "exponential"),
    "torque_crosstalk": ("even",),
    "periodic_disturbance": ("frequency", "blades"),
    "supply_sag": ("resistance", "discharge"),
}


NEIGHBOURS: dict[str, tuple[str, ...]] = {
    "command_saturation": ("knee",),
    "load_cell_saturation": ("knee",),
    "recirculation": ("circuit",),
}
"""Forms that are never concealed, but what is concealed may be mistaken for them: tried as rivals beside FORMS."""


VARIANTS: dict[str, tuple[str, ...]] = {
    "dead_band": ("smooth",),
    "command_saturation": ("soft",),
    "winding_resistance": ("linearised",),
    "motor_lag": ("two_lags",),
    "exponent": ("drive",),
    "inflow_dynamics": ("water_column",),
    "periodic_disturbance": ("blades_resonant",),
    "heating": ("both",),
    "cavitation": ("exponential",),
    "recirculation": ("late",),
    "zero_drift": ("root",),
    "load_cell_saturation": ("soft", "before_noise"),
}
"""Further textbook forms, there when asked for by name only: the same physics in other words."""
