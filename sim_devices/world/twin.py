"""The world of a twin: `twin = "T1.twin.json"` in a world file. The file is read as data, its terms become effects.

A twin speaks of x, the rotor's rate in volts of the steady state; the world of n = k x in rev/s. So the world has one
thruster, at once at n = k V (a lag is an effect of its own), and what a term says per volt is divided by k.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from math import sqrt
from pathlib import Path
from typing import Any

from sim_devices.tables import WorldError
from sim_devices.world.settings import Thruster

FORMAT = "thruster-rig-twin"
VERSIONS = (1, 2)
WHOLE = 0.02
"""Of a turn: how far from a whole number the periods per turn of a blade pass may be."""
Values = Mapping[str, float]
Table = dict[str, Any]


def with_twin(tables: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The tables of a world file with its twin's thruster and effects in them; unchanged where it names no twin.

    Raises WorldError naming file, term, what was expected and what came.
    """
    rest = {key: value for key, value in tables.items() if key != "twin"}
    if "twin" not in tables:
        return rest
    if not isinstance(tables["twin"], str):
        raise WorldError(f"twin: expected the path of a twin file, got {tables['twin']!r}")
    path = folder / tables["twin"]
    content = _read(path)
    for key in ("thrusters", "mounted"):
        if key in rest:
            raise WorldError(f"{key}: the thruster is the twin's ({path.name}); leave out [{key}], or twin")
    try:
        thruster, effects = world_of(content)
    except WorldError as error:
        raise WorldError(f"{path}: {error}") from None
    except (KeyError, TypeError, ValueError, ZeroDivisionError) as error:
        raise WorldError(f"{path}: not as --save-twin writes it: {type(error).__name__} {error}") from error
    doubled = sorted(set(effects) & set(rest.get("effects", {})))
    if doubled:
        raise WorldError(f"effects: {', '.join(doubled)} stand in the twin {path.name} already; leave them out here")
    named = str(content["thruster"]) or "T1"
    return {**rest, "thrusters": {named: thruster}, "mounted": named, "effects": {**rest.get("effects", {}), **effects}}


def _read(path: Path) -> Mapping[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise WorldError(f"twin: {path} cannot be read ({error.strerror})") from error
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise WorldError(f"twin: {path} is not JSON: {error}") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT or content.get("version") not in VERSIONS:
        raise WorldError(f"twin: {path} is not a {FORMAT} of version {' or '.join(map(str, VERSIONS))}")
    return content


def world_of(content: Mapping[str, Any]) -> tuple[Table, dict[str, Table]]:
    """`[thrusters.<name>]` and `[effects.*]` of the twin in a file's JSON. Raises WorldError."""
    if content["driver"] == "rotation_rate":
        raise WorldError("the twin is driven by rotation_rate, the bench is commanded in volts; fit it to the command")
    k = float(content["rate_per_driver"] or 1.0)
    thruster: Table = {"C": float(content["C"]), "rate_per_volt": abs(k), "rotor": "instant"}
    effects: dict[str, Table] = {}
    for term in content["terms"]:
        name = str(term["effect"])
        if name in effects:
            raise WorldError(f"the term {name} is there twice; the world has each effect once")
        if name not in TERMS:
            raise WorldError(f"the world cannot act the term {name!r}; it knows {', '.join(sorted(TERMS))}")
        values = {key: float(entry["value"]) for key, entry in term["parameters"].items()}
        effects[name] = TERMS[name](values, str(term["form"]), abs(k), float(term["scale"]["driver"]))
        if name == "heating":
            thruster["heating_time"] = values["time_constant"]
    lines = content.get("lines", [])
    if len(lines) > 1:
        raise WorldError(f"the twin has {len(lines)} periodic disturbances; the world has one at a time")
    if lines:
        effects["periodic_disturbance"] = _line(lines[0], abs(k))
    return thruster, effects


def _line(line: Mapping[str, Any], k: float) -> Table:
    """A phase that is not known is 0: the table of the effect has it so."""
    table: Table = {"amplitude": float(line["amplitude"]["value"])}
    if line["phase"] is not None:
        table["phase"] = float(line["phase"]["value"])
    if line["kind"] == "fixed":
        return {**table, "frequency": float(line["frequency"]["value"])}
    per_turn = float(line["ratio"]["value"]) / (1.0 if line["turns"] == "rev" else k)
    if round(per_turn) < 1 or abs(per_turn - round(per_turn)) > WHOLE:
        raise WorldError(
            f"the twin has a periodic disturbance of {per_turn:.4g} periods per turn; the world has whole numbers only"
        )
    return {**table, "blades": round(per_turn)}


_PLAIN = Thruster(C=1.0)
COLD_SHARE = 0.25
"""Drop in the cold winding over back-EMF at the largest voltage: a fifth of the whole. A twin says what warmth costs
there, not what the winding takes."""


def _same(values: Values, _form: str, _k: float, _driver: float) -> Table:
    return dict(values)


def _with_form(values: Values, form: str, _k: float, _driver: float) -> Table:
    return {**values, "form": form}


def _limit(values: Values, form: str, _k: float, _driver: float) -> Table:
    return {**values, "form": form or "hard"}


def _winding(values: Values, _form: str, k: float, _driver: float) -> Table:
    return {"resistance": values["loss"] * _ohm(k)}


def _ohm(k: float) -> float:
    """Of a winding whose voltage is V = e + e^2 times 1/V."""
    return _PLAIN.torque_acceleration / (_PLAIN.drag * k**2)


def _lag(values: Values, form: str, _k: float, driver: float) -> Table:
    return {**values, "form": form, "reference_voltage": driver}


def _exponent(values: Values, _form: str, _k: float, driver: float) -> Table:
    return {**values, "reference_voltage": driver}


def _cavitation(values: Values, form: str, k: float, _driver: float) -> Table:
    return {"onset": k * values["onset"], "slope": values["slope"] / k, "form": form}


def _heating(values: Values, form: str, k: float, driver: float) -> Table:
    if form.startswith("measured_"):
        raise WorldError("the twin's heating follows a recorded motor temperature, which the bench cannot foresee")
    rise = _PLAIN.heating * (_PLAIN.drag * (k * driver) ** 2 / _PLAIN.torque_acceleration) ** 2
    left = sqrt(1.0 - values["loss"])  # of the rate
    if form == "winding":
        # hot: left + share warmer left^2 = 1 + share, with the driver's largest voltage as 1
        warmer = (1.0 - left + COLD_SHARE) / (COLD_SHARE * left**2)
        return {"resistance": COLD_SHARE * _ohm(k) / driver, "copper": (warmer - 1.0) / rise, "form": form}
    if left <= 1.0:
        raise WorldError("the twin's motor slows down as its magnets warm; in the world it turns faster")
    return {"magnet": (1.0 - 1.0 / left) / rise, "form": form, "time_constant": values["magnet_time_constant"]}


def _reversal(values: Values, form: str, _k: float, _driver: float) -> Table:
    if form != "wake":
        raise WorldError(f"the world has reversal_loss in the form 'wake' only, got {form!r}")
    return dict(values)


def _inflow(values: Values, form: str, _k: float, _driver: float) -> Table:
    if form:
        raise WorldError(f"the world has inflow_dynamics of first order only, got the form {form!r}")
    return dict(values)


def _linear(values: Values, _form: str, _k: float, _driver: float) -> Table:
    return {"coefficient": values["slope"]}


def _per_rate(values: Values, _form: str, k: float, _driver: float) -> Table:
    return {"coefficient": values["coefficient"] / k}


def _recirculation(values: Values, form: str, k: float, _driver: float) -> Table:
    return {**values, "coefficient": values["coefficient"] / k**2, "form": form}


def _crosstalk(values: Values, form: str, k: float, _driver: float) -> Table:
    if form == "measured":
        raise WorldError("the twin's torque_crosstalk follows a recorded torque, which the bench cannot foresee")
    return {"coefficient": values["coefficient"] / k**2}


def _resonance(values: Values, _form: str, _k: float, _driver: float) -> Table:
    if abs(values["compliance"] - 1.0) > 1e-6:
        raise WorldError(f"the world's stand resonates with compliance 1 only, got {values['compliance']:g}")
    return {"frequency": values["frequency"], "damping": values["damping"]}


def _hysteresis(values: Values, _form: str, _k: float, _driver: float) -> Table:
    return {"width": values["half_width"]}


def _cell(values: Values, form: str, _k: float, _driver: float) -> Table:
    return {form: values["coefficient"]}


def _offset(values: Values, _form: str, _k: float, _driver: float) -> Table:
    return {"offset": values["offset"], "start": max(values["at"], 0.0)}


TERMS: Mapping[str, Callable[[Values, str, float, float], Table]] = {
    "command_saturation": _limit,
    "dead_band": _with_form,
    "winding_resistance": _winding,
    "motor_lag": _lag,
    "exponent": _exponent,
    "asymmetry": _same,
    "inflow_dynamics": _inflow,
    "cavitation": _cavitation,
    "heating": _heating,
    "reversal_loss": _reversal,
    "linear_term": _linear,
    "speed_of_advance": _per_rate,
    "recirculation": _recirculation,
    "strut_drag": _same,
    "torque_crosstalk": _crosstalk,
    "stand_resonance": _resonance,
    "hysteresis": _hysteresis,
    "time_skew": _same,
    "load_cell_creep": _same,
    "load_cell_nonlinearity": _cell,
    "load_cell_even_bend": _same,
    "zero_drift": _same,
    "zero_offset": _offset,
    "load_cell_saturation": _limit,
}
"""Effect id -> (values, form, k, the driver that the form refers to) -> `[effects.<id>]`. The rest (supply_sag,
rotation_coupling, thruster_interaction) follow a channel that the world makes itself."""
