"""All terms that may be added to `tau = C V|V|`, form by form."""

from __future__ import annotations

from itertools import chain

from identification.physics import (
    asymmetry,
    cavitation,
    command_saturation,
    dead_band,
    exponent,
    heating,
    hysteresis,
    inflow_dynamics,
    linear_term,
    load_cell_creep,
    load_cell_even_bend,
    load_cell_nonlinearity,
    load_cell_saturation,
    motor_lag,
    recirculation,
    reversal_loss,
    rotation_coupling,
    speed_of_advance,
    stand_resonance,
    strut_drag,
    supply_sag,
    thruster_interaction,
    time_skew,
    torque_crosstalk,
    winding_resistance,
    zero_drift,
    zero_offset,
)
from identification.physics.term import Term
from identification.physics.traits import Traits

CATALOGUE: tuple[Term, ...] = tuple(
    chain(
        command_saturation.FORMS,
        supply_sag.FORMS,
        dead_band.FORMS,
        winding_resistance.FORMS,
        heating.FORMS,
        motor_lag.FORMS,
        rotation_coupling.FORMS,
        exponent.FORMS,
        asymmetry.FORMS,
        inflow_dynamics.FORMS,
        cavitation.FORMS,
        reversal_loss.FORMS,
        linear_term.FORMS,
        speed_of_advance.FORMS,
        recirculation.FORMS,
        thruster_interaction.FORMS,
        strut_drag.FORMS,
        torque_crosstalk.FORMS,
        stand_resonance.FORMS,
        hysteresis.FORMS,
        time_skew.FORMS,
        load_cell_creep.FORMS,
        load_cell_nonlinearity.FORMS,
        load_cell_even_bend.FORMS,
        zero_drift.FORMS,
        zero_offset.FORMS,
        load_cell_saturation.FORMS,
    )
)
"""In the order in which they act within their stage."""


def traits_of(effect: str, form: str = "") -> Traits | None:
    """Of an effect by its id, in one of its forms, or the first; None of what has no term: a line, a fault."""
    forms = [term for term in CATALOGUE if term.id == effect]
    return next((term.traits for term in (*(t for t in forms if t.form == form), *forms)), None)
