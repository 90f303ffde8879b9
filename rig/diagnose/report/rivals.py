"""What tells one effect from another that explains a recording as well: the table of docs/physics in short."""

from __future__ import annotations

from collections.abc import Mapping

REVEALED_BY: Mapping[str, str] = {
    "dead_band": "fine levels close to zero, of both signs",
    "asymmetry": "the same levels of both signs, with rests between",
    "exponent": "levels over the whole range, evenly in thrust",
    "linear_term": "small and medium levels of both signs",
    "winding_resistance": "the measured rotation rate or current at high levels",
    "supply_sag": "the same level at another supply voltage",
    "heating": "a long load, a rest of minutes, the same load again; the motor's temperature",
    "motor_lag": "small and large steps, sampled fast; the measured rotation rate",
    "inflow_dynamics": "steps of several sizes: overshoot that scales with the flow, not with the rotor",
    "speed_of_advance": "flow with the propeller turning and at rest",
    "recirculation": "long levels in alternating directions, with rests for the water to calm",
    "zero_offset": "rests before and after",
    "zero_drift": "rests again and again: a zero that moves shows there, a gain does not",
    "load_cell_creep": "a rest after a long load: creep goes on there",
    "load_cell_nonlinearity": "dead weights on the load cell",
    "load_cell_saturation": "current or rotation rate at the highest levels: they go on rising",
    "command_saturation": "current or rotation rate at the highest levels: they stop rising too",
    "hysteresis": "slow triangles, up and down through the same levels",
    "stand_resonance": "a spectrum of the ringing after a step, at two levels",
    "time_skew": "small and large steps, sampled fast: a delay keeps the shape of the step",
    "cavitation": "high levels at another depth; the measured rotation rate",
    "reversal_loss": "the same step with and without a change of sign before it",
    "strut_drag": "flow with the propeller at rest",
    "torque_crosstalk": "dead weights on the load cell, or a torque channel",
    "periodic_disturbance": "two levels, and rest with the power on; the same level at two sampling rates",
    "rotation_coupling": "the same command at another load or supply, the rotation rate measured",
    "thruster_interaction": "the neighbour switched on and off at one level",
    "channel_fault": "one channel at a time against a known load or speed",
}


RECORDED: Mapping[tuple[str, str], str] = {
    ("torque_crosstalk", "measured"): "dead weights on the load cell, with and without a moment",
}
"""The same of forms that read a channel: what it takes beside that."""


def told_apart(effect: str, rival: str, form: str = "", rival_form: str = "") -> str:
    """What would decide between two effects, as a clause.

    >>> told_apart("zero_drift", "unheard_of")
    'rests again and again: a zero that moves shows there, a gain does not (zero drift)'
    """
    forms = dict.fromkeys(((effect, form), (rival, rival_form)))
    told = (
        f"{RECORDED.get((name, of), REVEALED_BY[name])} ({name.replace('_', ' ')})"
        for name, of in forms
        if name in REVEALED_BY
    )
    return "; ".join(dict.fromkeys(told))
