"""The world of a twin: `twin = "T1.twin.json"` in a world file. The file is read as data, its terms become effects.

A twin speaks of x, the rotor's rate in volts of the steady state; the world of n = k x in rev/s. So the world has one
thruster, at once at n = k V (a lag is an effect of its own), and what a term says per volt is divided by k.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from sim_devices.tables import WorldError
from sim_devices.world.settings import Thruster
from sim_devices.world.twin_heat import heat_of

FORMAT = "thruster-rig-twin"
VERSIONS = (1, 2)
WHOLE = 0.02
"""Of a turn: how far from a whole number the periods per turn of a blade pass may be."""
FORCE = 2
"""Power of the rate with which a force of the rotor grows."""
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
    winding = next((_values(t)["loss"] for t in content["terms"] if t["effect"] == "winding_resistance"), None)
    for term in content["terms"]:
        name, form, driver = str(term["effect"]), str(term["form"]), float(term["scale"]["driver"])
        if name in effects:
            raise WorldError(f"the term {name} is there twice; the world has each effect once")
        if name not in ACTED:
            raise WorldError(f"the world cannot act the term {name!r}; it knows {', '.join(ACTED)}")
        values = _values(term)
        if name == "heating":
            effects[name] = heat_of(values, form, abs(k), driver, winding)
            thruster["heating_time"] = values["time_constant"]
        else:
            effects[name] = TERMS[name](values, form, abs(k), driver)
    lines = content.get("lines", [])
    if len(lines) > 1:
        raise WorldError(f"the twin has {len(lines)} periodic disturbances; the world has one at a time")
    if lines:
        effects["periodic_disturbance"] = _line(lines[0], abs(k))
    return thruster, effects


def _values(term: Mapping[str, Any]) -> Values:
    return {key: float(entry["value"]) for key, entry in term["parameters"].items()}


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
    growth = float(line.get("growth", 0.0))
    if growth != FORCE:
        raise WorldError(
            f"the twin has a periodic disturbance of the rotor that grows with the power {growth:g} of its rate; those "
            f"of the world grow with its square ({FORCE})"
        )
    at = float(line["at_speed"]) / (k if line["turns"] == "rev" else 1.0)
    return {**table, "blades": round(per_turn), "reference_voltage": at}


_PLAIN = Thruster(C=1.0)


def _same(values: Values, _form: str, _k: float, _driver: float) -> Table:
    return dict(values)


def _with_form(values: Values, form: str, _k: float, _driver: float) -> Table:
    return {**values, "form": form}


def _limit(values: Values, form: str, _k: float, _driver: float) -> Table:
    return {**values, "form": form or "hard"}


def _cell_limit(values: Values, form: str, _k: float, _driver: float) -> Table:
    if form == "averaged":
        raise WorldError(
            "load_cell_saturation of the form 'averaged' is a device's: give it `average`, and its limit here"
        )
    if form.endswith("before_noise"):
        return {**values, "place": "cell"}
    return {**values, "form": "knee" if form == "knee" else "hard"}


def _winding(values: Values, _form: str, k: float, _driver: float) -> Table:
    """V = e + loss e^2."""
    return {"resistance": values["loss"] * _PLAIN.torque_acceleration / (_PLAIN.drag * k**2)}


def _lag(values: Values, form: str, _k: float, driver: float) -> Table:
    return {**values, "form": form, "reference_voltage": driver}


def _exponent(values: Values, _form: str, _k: float, driver: float) -> Table:
    return {**values, "reference_voltage": driver}


def _cavitation(values: Values, form: str, k: float, _driver: float) -> Table:
    return {"onset": k * values["onset"], "slope": values["slope"] / k, "form": form}


def _reversal(values: Values, form: str, _k: float, _driver: float) -> Table:
    if form != "wake":
        raise WorldError(f"the world has reversal_loss in the form 'wake' only, got {form!r}")
    return dict(values)


def _inflow(values: Values, form: str, _k: float, driver: float) -> Table:
    return {**values, "form": "momentum", "reference_voltage": driver} if form else dict(values)


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
    "load_cell_saturation": _cell_limit,
}
"""Effect id -> (values, form, k, the driver that the form refers to) -> `[effects.<id>]`; heating is of twin_heat. The
rest (supply_sag, rotation_coupling, thruster_interaction) follow a channel that the world makes itself."""
ACTED = tuple(sorted((*TERMS, "heating")))
