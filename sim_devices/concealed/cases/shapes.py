"""How each effect is drawn: everything of it but how much there is, to suit the thruster."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sim_devices.concealed.cases.forms import FORMS, NEIGHBOURS, VARIANTS
from sim_devices.concealed.cases.knob import LEAST, Scale, Shape
from sim_devices.world.effects.motor import NEODYMIUM

Rng = np.random.Generator


FERRITE = 0.002
"""1/K: of all magnets in motors these lose their remanence fastest."""


def shape(effect: str, scale: Scale, rng: Rng, form: str = "") -> Shape:
    """Draw the shape of `effect` at this scale; `form` picks one of several textbook forms where there are several.

    Raises ValueError for an effect or a form that is not known.
    """
    if effect not in SHAPES:
        raise ValueError(f"effect must be one of {', '.join(SHAPES)}, got {effect!r}")
    forms = FORMS.get(effect, ("",))
    known = (*forms, *NEIGHBOURS.get(effect, ()), *VARIANTS.get(effect, ()))
    if form and form not in known:
        raise ValueError(f"form of {effect} must be one of {', '.join(known)}, got {form!r}")
    return SHAPES[effect](scale, rng, form or str(rng.choice(forms)))


def _log(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _uniform(rng: Rng, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _sign(rng: Rng) -> float:
    return float(rng.choice((-1.0, 1.0)))


def _exponent(s: Scale, rng: Rng, form: str) -> Shape:
    """Above 2 by 0.8 at most; below down to the 2/3 of a drive that holds its power."""
    fixed: dict[str, Any] = {"reference_voltage": s.voltage * _uniform(rng, 0.4, 1.0)}
    if form == "above":
        return Shape("exponent", "exponent", 0.8, base=2.0, fixed=fixed)
    fixed |= {"form": form} if form == "drive" else {}
    return Shape("exponent", "exponent", 4.0 / 3.0, -1.0, base=2.0, fixed=fixed, lowest=LEAST * 0.8, start=0.05 * 0.8)


def _creep(_s: Scale, rng: Rng, form: str) -> Shape:
    fixed, second = {"time_constant": _log(rng, 8.0, 60.0)}, {}
    if form == "two_constants":
        fixed["time_constant_2"] = fixed["time_constant"] * _uniform(rng, 4.0, 10.0)
        second = {"share_2": _uniform(rng, 0.5, 1.5)}
    return Shape("load_cell_creep", "share", 0.3, _sign(rng), fixed=fixed, with_knob=second)


def _cell_curve(s: Scale, rng: Rng, form: str) -> Shape:
    power = 1 if form == "quadratic" else 2
    return Shape("load_cell_nonlinearity", form, 0.3, _sign(rng) / s.thrust**power)


def _cavitation(s: Scale, rng: Rng, form: str) -> Shape:
    onset = s.rate * _uniform(rng, 0.55, 0.85)
    return Shape("cavitation", "slope", 0.5, 1.0 / (s.rate - onset), fixed={"onset": onset, "form": form})


def _drift(s: Scale, rng: Rng, form: str) -> Shape:
    if form == "root":
        return Shape("zero_drift", "root", 0.5, _sign(rng) * s.thrust / s.duration**0.5)
    if form == "rate":
        return Shape("zero_drift", "rate", 0.5, _sign(rng) * s.thrust / s.duration)
    fixed = {"time_constant": s.duration * _uniform(rng, 0.15, 0.6)}
    return Shape("zero_drift", "amplitude", 0.5, _sign(rng) * s.thrust, fixed=fixed)


def _line(s: Scale, rng: Rng, form: str) -> Shape:
    fixed: dict[str, float | int] = {"phase": _uniform(rng, 0.0, 6.28)}
    if form in ("blades", "blades_resonant"):
        fixed["blades"] = int(rng.integers(2, 6))
        fixed["reference_voltage"] = s.voltage
    else:
        fixed["frequency"] = s.sampling * _uniform(rng, 0.05, 0.45)
    if form == "blades_resonant":
        fixed["resonance"] = fixed["blades"] * s.rate * _uniform(rng, 0.3, 0.9)  # within the rates of the run
        fixed["damping"] = _log(rng, 0.02, 0.1)
    return Shape("periodic_disturbance", "amplitude", 0.2, s.thrust, fixed=fixed)


def _sag(s: Scale, _rng: Rng, form: str) -> Shape:
    drawn = s.current * s.voltage / s.bus  # A from the supply at the largest command
    if form == "resistance":
        return Shape("supply_sag", "source_resistance", 0.3, s.bus / drawn)
    return Shape("supply_sag", "discharge", 0.5, s.bus / (drawn * s.duration))


def _lag(s: Scale, rng: Rng, form: str) -> Shape:
    fixed = {"form": form, "reference_voltage": s.voltage * _uniform(rng, 0.4, 0.8)}
    return Shape("motor_lag", "time_constant", 1.5, fixed=fixed, lowest=s.grid)


def _winding(s: Scale, _rng: Rng, form: str) -> Shape:
    """Amount: the share of the largest command that is lost in the winding, to first order."""
    if form:
        return Shape("winding_resistance", "resistance", 0.4, s.voltage / s.current, fixed={"form": form})
    return Shape("winding_resistance", "resistance", 1.0, s.voltage / s.current)


def _heating(s: Scale, rng: Rng, form: str) -> Shape:
    """Amount: the drop in the cold winding at the largest command, of that command; of magnets what they lose per K.

    Both: magnets of NdFeB (0.11 % per K) where a fifth of the command is lost, weaker with it.
    """
    fixed = {"form": form, "time_constant": _log(rng, 30.0, 120.0)}
    if form == "magnet":
        return Shape("heating", "magnet", FERRITE, fixed=fixed)
    beside = {"magnet": NEODYMIUM / 0.2 * s.current / s.voltage} if form == "both" else {}
    return Shape("heating", "resistance", 0.5, s.voltage / s.current, fixed=fixed, with_knob=beside)


def _clipped(effect: str, highest: float, limit: float, rng: Rng, form: str) -> Shape:
    """A soft limit also bends what lies far below it: it may lie above the largest value."""
    if form == "before_noise":
        return Shape(effect, "limit", highest, -limit, base=limit, fixed={"place": "cell"})
    if form == "knee":
        fixed = {"onset": limit * _uniform(rng, 0.3, 0.9), "form": form}
        return Shape(effect, "bend", 2.0, 1.0 / limit, fixed=fixed)
    if form:
        return Shape(effect, "limit", highest + 0.3, -limit, base=1.3 * limit, fixed={"form": form})
    return Shape(effect, "limit", highest, -limit, base=limit)


def _inflow(s: Scale, rng: Rng, form: str) -> Shape:
    """Of the jet that forms in a tank 0.2 to 1.5 s; of the water column in the disc alone, L g / (4 u), 8 to 17 ms with
    76 mm and 40 to 80 ms with 300 mm of diameter at full drive, longer at less.
    """
    if form == "water_column":
        fixed: dict[str, Any] = {"time_constant": _log(rng, 0.008, 0.08), "form": "momentum"}
        return Shape("inflow_dynamics", "share", 1.0, fixed=fixed | {"reference_voltage": s.voltage})
    return Shape("inflow_dynamics", "share", 1.0, fixed={"time_constant": _log(rng, 0.2, 1.5)})


def _recirculation(s: Scale, rng: Rng, form: str) -> Shape:
    fixed: dict[str, Any] = {"time_constant": _log(rng, 10.0, 50.0), "form": form}
    if form == "late":
        fixed["delay"] = _uniform(rng, 0.1, 0.4) * fixed["time_constant"]
    return Shape("recirculation", "coefficient", 0.4, s.thrust / s.rate**2, fixed=fixed)


def _neighbour(s: Scale, rng: Rng, _form: str) -> Shape:
    period = s.duration / _uniform(rng, 4.0, 9.0)
    fixed = {"neighbour_thrust": s.thrust, "period": period, "on_time": 0.5 * period}
    return Shape("thruster_interaction", "loss", 0.65, fixed=fixed)


SHAPES: dict[str, Callable[[Scale, Rng, str], Shape]] = {
    "command_saturation": lambda s, r, f: _clipped("command_saturation", 0.6, s.voltage, r, f),
    "supply_sag": _sag,
    "dead_band": lambda s, _r, f: Shape("dead_band", "half_width", 0.4, s.voltage, fixed={"form": f}),
    "winding_resistance": _winding,
    "motor_lag": _lag,
    "rotation_coupling": lambda _s, r, _f: Shape(
        "rotation_coupling", "amplitude", 0.3, fixed={"period": _log(r, 8.0, 60.0), "phase": _uniform(r, 0.0, 6.28)}
    ),
    "exponent": _exponent,
    "asymmetry": lambda _s, _r, f: Shape("asymmetry", "ratio", 0.6, -1.0 if f == "weak_reverse" else 1.0, base=1.0),
    "inflow_dynamics": _inflow,
    "cavitation": _cavitation,
    "heating": _heating,
    "reversal_loss": lambda _s, r, _f: Shape("reversal_loss", "loss", 0.8, fixed={"time_constant": _log(r, 0.5, 4.0)}),
    "linear_term": lambda s, r, _f: Shape("linear_term", "coefficient", 0.4, _sign(r) * s.thrust / s.voltage),
    "speed_of_advance": lambda s, _r, _f: Shape("speed_of_advance", "coefficient", 0.5, s.thrust / (s.rate * s.flow)),
    "recirculation": _recirculation,
    "thruster_interaction": _neighbour,
    "strut_drag": lambda s, _r, _f: Shape("strut_drag", "coefficient", 0.4, -s.thrust / s.flow**2),
    "torque_crosstalk": lambda s, r, f: Shape(
        "torque_crosstalk", "coefficient", 0.4, _sign(r) * s.thrust / s.rate**2, fixed={"form": f}
    ),
    "stand_resonance": lambda s, r, _f: Shape(
        "stand_resonance",
        "frequency",
        2.0,
        inverse=True,
        fixed={"damping": _log(r, 0.02, 0.3)},
        lowest=1.0 / (0.45 * s.sampling),  # below half the sampling rate, or it rings between the samples
    ),
    "hysteresis": lambda s, _r, _f: Shape("hysteresis", "width", 0.2, s.thrust),
    "time_skew": lambda s, _r, _f: Shape("time_skew", "delay", 1.0, lowest=s.grid, quantum=s.grid),
    "load_cell_creep": _creep,
    "load_cell_nonlinearity": _cell_curve,
    "load_cell_even_bend": lambda s, r, _f: Shape("load_cell_even_bend", "coefficient", 0.04, _sign(r) / s.thrust),
    "periodic_disturbance": _line,
    "zero_drift": _drift,
    "zero_offset": lambda s, r, _f: Shape(
        "zero_offset", "offset", 0.5, _sign(r) * s.thrust, fixed={"start": s.duration * _uniform(r, 0.25, 0.75)}
    ),
    "load_cell_saturation": lambda s, r, f: _clipped("load_cell_saturation", 0.7, s.thrust, r, f),
    "gain_step": lambda s, r, _f: Shape(
        "gain_step", "amount", 0.5, _sign(r), fixed={"start": s.duration * _uniform(r, 0.3, 0.7)}
    ),
    "reversed_flow_loss": lambda _s, _r, _f: Shape("reversed_flow_loss", "amount", 0.8),
    "crossed_flow_loss": lambda _s, _r, _f: Shape("crossed_flow_loss", "amount", 0.8),
    "temperature_squared": lambda _s, _r, _f: Shape(
        "temperature_squared", "amount", 0.8, fixed={"reference": 18.0, "span": 5.0}
    ),
    "gain_wave": lambda s, r, _f: Shape(
        "gain_wave",
        "amount",
        0.5,
        fixed={"period": s.duration / _uniform(r, 2.0, 6.0), "phase": _uniform(r, 0.0, 6.28)},
    ),
    "level_bump": lambda s, r, _f: Shape(
        "level_bump",
        "amount",
        0.9,
        fixed={"rate": s.rate * _uniform(r, 0.4, 0.8), "width": s.rate * _uniform(r, 0.08, 0.2)},
    ),
    "upsweep_loss": lambda _s, _r, _f: Shape("upsweep_loss", "amount", 0.6),
    "wall_effect": lambda s, r, _f: Shape(
        "wall_effect",
        "amount",
        0.8,
        fixed={"rate": s.rate * _uniform(r, 0.4, 0.7), "width": s.rate * _uniform(r, 0.02, 0.06)},
    ),
    "fouling": lambda s, r, _f: Shape(
        "fouling",
        "amount",
        0.8,
        fixed={"start": s.duration * _uniform(r, 0.3, 0.6), "time_constant": s.duration * _uniform(r, 0.05, 0.2)},
    ),
    "thermal_derating": lambda s, r, _f: Shape(
        "thermal_derating", "amount", 0.6, fixed={"limit": s.rise * _uniform(r, 0.15, 0.3)}
    ),
    "aeration_pulses": lambda _s, r, _f: Shape(
        "aeration_pulses", "amount", 0.9, fixed={"period": _uniform(r, 25.0, 60.0), "length": _uniform(r, 3.0, 8.0)}
    ),
}
"""Effect id -> how its shape is drawn. `channel_fault` is not here: a lie about a channel has no amount."""
