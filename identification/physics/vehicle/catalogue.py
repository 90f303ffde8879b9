"""All terms that may be added to m xi' = -k2 |xi| xi + sum of the thrusters, form by form."""

from __future__ import annotations

from itertools import chain

from identification.physics.vehicle import (
    added_mass,
    buoyancy_offset,
    current,
    dead_band,
    installation_efficiency,
    linear_drag,
    motor_lag,
    quadratic_drag,
    tether_drag,
)
from identification.physics.vehicle.term import VehicleTerm

CATALOGUE: tuple[VehicleTerm, ...] = tuple(
    chain(
        dead_band.FORMS,
        motor_lag.FORMS,
        installation_efficiency.FORMS,
        added_mass.FORMS,
        linear_drag.FORMS,
        quadratic_drag.FORMS,
        current.FORMS,
        buoyancy_offset.FORMS,
        tether_drag.FORMS,
    )
)
"""In the order in which they act within their stage."""
