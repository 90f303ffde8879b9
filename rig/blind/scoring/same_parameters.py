"""Parameters that mean the same in the world and in the catalogue: for the coverage of the intervals. Pure.

The world speaks of rev/s and amperes, the catalogue of volts: n = k V, k = rate / voltage of the scale. What the two
put differently (what warmth costs, lags referred to different voltages, two-constant creep) is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

Table = Mapping[str, Any]


def true_values(effect: str, form: str, truth: Table) -> dict[str, float]:
    """Catalogue parameter -> true value, for a finding of `effect` in the catalogue's `form`.

    >>> told = {"effect": "dead_band", "parameters": {"form": "jump", "half_width": 0.5}}
    >>> sealed = {"effects": [told], "scale": {"rate": 20.0, "voltage": 10.0}}
    >>> true_values("dead_band", "jump", sealed), true_values("dead_band", "shrink", sealed)
    ({'half_width': 0.5}, {})
    """
    told: dict[str, Any] = next((dict(e["parameters"]) for e in truth["effects"] if e["effect"] == effect), {})
    if not told or effect not in SAME:
        return {}
    k = truth["scale"]["rate"] / truth["scale"]["voltage"]
    return {name: float(value) for name, value in SAME[effect](told, form, k, truth).items()}


def _direct(**names: str) -> Callable[[Table, str, float, Table], Table]:
    """Catalogue name = the world's name, same number."""
    return lambda p, _form, _k, _truth: {name: p[world] for name, world in names.items()}


def _in_form(**names: str) -> Callable[[Table, str, float, Table], Table]:
    """The same where both are of one form."""
    return lambda p, form, _k, _truth: {name: p[w] for name, w in names.items()} if p.get("form") == form else {}


def _winding(p: Table, _form: str, _k: float, truth: Table) -> Table:
    """|V| = e + loss e^2 with loss = R alpha k^2 / b (the world's WindingResistance)."""
    s = truth["scale"]
    return {"loss": p["resistance"] * s["current"] / s["voltage"] ** 2}


def _cavitation(p: Table, form: str, k: float, _truth: Table) -> Table:
    return {"slope": p["slope"] * k, "onset": p["onset"] / k} if p.get("form") == form else {}


def _recirculation(p: Table, form: str, k: float, _truth: Table) -> Table:
    same = {"coefficient": p["coefficient"] * k**2, "time_constant": p["time_constant"]}
    return same if p.get("form") == form else {}


def _bend(p: Table, form: str, _k: float, _truth: Table) -> Table:
    return {"coefficient": p[form]} if p.get(form) else {}


def _drift(p: Table, form: str, _k: float, _truth: Table) -> Table:
    if "rate" in p:
        return {"rate": p["rate"]} if form == "linear" else {}
    return {n: p[n] for n in ("amplitude", "time_constant")} if form == "exponential" and "amplitude" in p else {}


def _line(p: Table, _form: str, k: float, _truth: Table) -> Table:
    known = {"amplitude": p["amplitude"]}
    if p.get("frequency"):
        return known | {"frequency": p["frequency"]}
    return known | {"periods_per_turn": p["blades"], "periods_per_volt_second": p["blades"] * k}


def _heating(p: Table, form: str, _k: float, truth: Table) -> Table:
    """What warmth costs goes with the level: no one number of the world's is the catalogue's loss."""
    world = p.get("form")
    if form == f"measured_{world}":
        return {"magnet_time_constant": p["time_constant"]} if world == "magnet" else {}
    return {"time_constant": truth["thruster"]["heating_time"]} if form == world == "winding" else {}


SAME: Final[Mapping[str, Callable[[Table, str, float, Table], Table]]] = {
    "dead_band": _in_form(half_width="half_width"),
    "asymmetry": _direct(ratio="ratio"),
    "exponent": _direct(exponent="exponent"),
    "linear_term": _direct(slope="coefficient"),
    "winding_resistance": _winding,
    "command_saturation": _direct(limit="limit"),
    "supply_sag": lambda _p, form, _k, _truth: {} if form else {"exponent": 1.0},
    "motor_lag": lambda p, form, _k, _truth: (
        {"time_constant": p["time_constant"]} if form == p.get("form") == "first_order" else {}
    ),
    "inflow_dynamics": lambda p, form, _k, _truth: (
        {} if form or p.get("form") else {name: p[name] for name in ("share", "time_constant")}
    ),
    "cavitation": _cavitation,
    "heating": _heating,
    "reversal_loss": lambda p, form, _k, _truth: (
        {name: p[name] for name in ("loss", "time_constant")} if form == "wake" else {}
    ),
    "speed_of_advance": lambda p, _form, k, _truth: {"coefficient": p["coefficient"] * k},
    "recirculation": _recirculation,
    "thruster_interaction": _direct(loss="loss"),
    "rotation_coupling": lambda _p, _form, _k, _truth: {"share": 1.0},
    "strut_drag": _direct(coefficient="coefficient"),
    "torque_crosstalk": lambda p, _form, k, _truth: {"coefficient": p["coefficient"] * k**2},
    "stand_resonance": _direct(frequency="frequency", damping="damping"),
    "hysteresis": _direct(half_width="width"),
    "time_skew": _direct(delay="delay"),
    "load_cell_creep": lambda p, form, _k, _truth: (
        {name: p[name] for name in ("share", "time_constant")} if form == "one_constant" and "share_2" not in p else {}
    ),
    "load_cell_nonlinearity": _bend,
    "load_cell_even_bend": _direct(coefficient="coefficient"),
    "zero_drift": _drift,
    "zero_offset": _direct(offset="offset", at="start"),
    "load_cell_saturation": _direct(limit="limit"),
    "periodic_disturbance": _line,
}
