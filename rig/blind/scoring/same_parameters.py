"""Parameters that mean the same in the world and in the catalogue: for the coverage of the intervals. Pure.

The world speaks of rev/s and amperes, the catalogue of volts: n = k V, k = rate / voltage of the scale. What the two
put differently (what warm magnets give, lags referred to different voltages, two-constant creep) is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import copysign, sqrt
from typing import Any, Final, NamedTuple

from rig.blind.scoring.hot_copper import COPPER, loss_at_full, loss_per_kelvin

Table = Mapping[str, Any]


class Told(NamedTuple):
    """What a finding says before its numbers are compared."""

    form: str
    k: float
    """(rev/s)/V."""
    truth: Table
    chosen: Mapping[str, float]
    """Values of all its parameters, those that it chose itself among them."""


Same = Callable[[Table, Told], Table]


def true_values(effect: str, form: str, truth: Table, chosen: Mapping[str, float] | None = None) -> dict[str, float]:
    """Catalogue parameter -> true value, for a finding of `effect` in the catalogue's `form` with values `chosen`.

    >>> told = {"effect": "dead_band", "parameters": {"form": "jump", "half_width": 0.5}}
    >>> sealed = {"effects": [told], "scale": {"rate": 20.0, "voltage": 10.0}}
    >>> true_values("dead_band", "jump", sealed), true_values("dead_band", "shrink", sealed)
    ({'half_width': 0.5}, {})
    """
    world = _of(effect, truth)
    if not world or effect not in SAME:
        return {}
    k = truth["scale"]["rate"] / truth["scale"]["voltage"]
    same = SAME[effect](world, Told(form, k, truth, chosen or {}))
    return {name: float(value) for name, value in same.items()}


def _of(effect: str, truth: Table) -> dict[str, Any]:
    """The world's parameters of an effect, empty where it is not there."""
    return next((dict(e["parameters"]) for e in truth["effects"] if e["effect"] == effect), {})


def _direct(**names: str) -> Same:
    """Catalogue name = the world's name, same number."""
    return lambda p, _told: {name: p[world] for name, world in names.items()}


def _in_form(**names: str) -> Same:
    """The same where both are of one form."""
    return lambda p, told: {name: p[w] for name, w in names.items()} if p.get("form") == told.form else {}


def _limit(p: Table, told: Told) -> Table:
    """Of a limit that is met at once, wherever the noise comes in; a soft one has no such value."""
    return {"limit": p["limit"]} if "form" not in p and told.form != "knee" else {}


def _winding(p: Table, told: Told) -> Table:
    """|V| = e + loss e^2 with loss = R alpha k^2 / b (the world's WindingResistance)."""
    return {} if p.get("form") == "linearised" else {"loss": _per_volt(p["resistance"], told.truth)}


def _per_volt(resistance: float, truth: Table) -> float:
    """1/V of a winding: R alpha k^2 / b, alpha n^2 / b the current."""
    s = truth["scale"]
    return float(resistance * s["current"] / s["voltage"] ** 2)


def _inflow(p: Table, told: Told) -> Table:
    """Momentum: of the world at its reference voltage, of the catalogue at the largest one."""
    if p.get("form", "first_order") == (told.form or "first_order"):
        at_full = p["reference_voltage"] / told.truth["scale"]["voltage"] if told.form else 1.0
        return {"share": p["share"], "time_constant": p["time_constant"] * at_full}
    return {}


def _interaction(p: Table, told: Told) -> Table:
    """The world's at equal thrusts, the catalogue's with both at full: as the root of the neighbour's full thrust."""
    share = sqrt(abs(p["neighbour_thrust"]) / told.truth["scale"]["thrust"])
    return {"loss": copysign(p["loss"] * share, p["neighbour_thrust"])}


def _cavitation(p: Table, told: Told) -> Table:
    return {"slope": p["slope"] * told.k, "onset": p["onset"] / told.k} if p.get("form") == told.form else {}


def _recirculation(p: Table, told: Told) -> Table:
    same = {"coefficient": p["coefficient"] * told.k**2, "time_constant": p["time_constant"]}
    return same if p.get("form") == told.form else {}


def _bend(p: Table, told: Told) -> Table:
    return {"coefficient": p[told.form]} if p.get(told.form) else {}


def _drift(p: Table, told: Told) -> Table:
    if "rate" in p:
        return {"rate": p["rate"]} if told.form == "linear" else {}
    both = told.form == "exponential" and "amplitude" in p
    return {n: p[n] for n in ("amplitude", "time_constant")} if both else {}


def _line(p: Table, told: Told) -> Table:
    """Of a force of the rotor the size at the speed that the finding refers to; not where a stand answers it."""
    if p.get("frequency"):
        same = {"amplitude": p["amplitude"], "frequency": p["frequency"]}
        return same if told.form == "fixed" else {}
    if told.form != "rotation":
        return {}
    orders = {"periods_per_turn": p["blades"], "periods_per_volt_second": p["blades"] * told.k}
    rings = "resonance" in p or _of("stand_resonance", told.truth)
    if told.chosen.get("growth") != 2.0 or rings:
        return orders
    at = told.chosen["at_speed"] / (told.k if "periods_per_turn" in told.chosen else 1.0)  # V
    return orders | {"amplitude": p["amplitude"] * (at / p["reference_voltage"]) ** 2}


def _heating(p: Table, told: Told) -> Table:
    """Two low-passes one behind the other commute: of magnets alone nobody can say which of the times is whose.

    What warm magnets give, without a thermometer, is left out: the world's draw more as they weaken, and lose more.
    What copper costs is the catalogue's at the largest current where a current was recorded, which noise makes larger.
    """
    measured, form = told.form.startswith("measured_"), told.form.removeprefix("measured_")
    own = form == "own_winding"
    form = "winding" if own else form
    if form != {"both": "winding_and_magnet"}.get(p["form"], p["form"]):
        return {}
    late, truth = {"magnet_time_constant": p["time_constant"]}, told.truth
    if form == "winding":
        drop = _per_volt(p["resistance"], truth) * truth["scale"]["voltage"]
        return {**_copper(p, truth, measured=measured), **({"cold_loss": drop / (1.0 + drop)} if own else {})}
    if form == "magnet":
        apart = not _of("winding_resistance", truth)
        return (late | ({"flux_loss_per_kelvin": p["magnet"]} if apart else {})) if measured else {}
    return late if measured else late | {"time_constant": truth["thruster"]["heating_time"]}


def _copper(p: Table, truth: Table, *, measured: bool) -> Table:
    s, winding = truth["scale"], _of("winding_resistance", truth)
    upstream = _per_volt(winding["resistance"], truth) if winding else 0.0
    cold = 2.0 * s["voltage"] / (1.0 + sqrt(1.0 + 4.0 * upstream * s["voltage"]))
    w, copper, series = _per_volt(p["resistance"], truth), p.get("copper", COPPER), upstream or None
    if measured:
        return {"loss_per_kelvin": loss_per_kelvin(w, cold, copper, series)}
    time = {"time_constant": truth["thruster"]["heating_time"]}
    if "current" in truth["channels"]:
        return time
    rise = truth["thruster"]["heating"] * (s["current"] * (cold / s["voltage"]) ** 2) ** 2
    return time | {"loss": loss_at_full(w, cold, rise, copper, series)}


SAME: Final[Mapping[str, Same]] = {
    "dead_band": _in_form(half_width="half_width"),
    "asymmetry": _direct(ratio="ratio"),
    "exponent": _direct(exponent="exponent"),
    "linear_term": _direct(slope="coefficient"),
    "winding_resistance": _winding,
    "command_saturation": _limit,
    "supply_sag": lambda _p, told: {} if told.form else {"exponent": 1.0},
    "motor_lag": lambda p, told: (
        {"time_constant": p["time_constant"]} if told.form == p.get("form") == "first_order" else {}
    ),
    "inflow_dynamics": _inflow,
    "cavitation": _cavitation,
    "heating": _heating,
    "reversal_loss": lambda p, told: (
        {name: p[name] for name in ("loss", "time_constant")} if told.form == "wake" else {}
    ),
    "speed_of_advance": lambda p, told: {"coefficient": p["coefficient"] * told.k},
    "recirculation": _recirculation,
    "thruster_interaction": _interaction,
    "rotation_coupling": lambda _p, _told: {"share": 1.0},
    "strut_drag": _direct(coefficient="coefficient"),
    "torque_crosstalk": lambda p, told: {"coefficient": p["coefficient"] * told.k**2},
    "stand_resonance": _direct(frequency="frequency", damping="damping"),
    "hysteresis": _direct(half_width="width"),
    "time_skew": _direct(delay="delay"),
    "load_cell_creep": lambda p, told: (
        {n: p[n] for n in ("share", "time_constant")} if told.form == "one_constant" and "share_2" not in p else {}
    ),
    "load_cell_nonlinearity": _bend,
    "load_cell_even_bend": _direct(coefficient="coefficient"),
    "zero_drift": _drift,
    "zero_offset": _direct(offset="offset", at="start"),
    "load_cell_saturation": _limit,
    "periodic_disturbance": _line,
}
