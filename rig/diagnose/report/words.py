"""Words of a diagnosis as people write them: quantities, effects, numbers with their intervals."""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import isfinite

from identification.mismatch.compare.signature import Kind
from identification.mismatch.diagnosis import Diagnosis, Finding
from identification.mismatch.value import Value, Where
from identification.mismatch.verdict_clauses import degree, sureness
from identification.physics.catalogue import CATALOGUE
from identification.thruster.thrust_report import digits
from rig.diagnose.report.rivals import WITHOUT_TERM
from rig.report.style import prose, unit_text

UNITS: Mapping[str, str] = {
    "command_voltage": "V",
    "motor_voltage": "V",
    "rotation_rate": "rev/s",
    "time": "s",
    "time_since_step": "s",
    "time_since_reversal": "s",
    "previous_voltage": "V",
    "flow_speed": "m/s",
    "bus_voltage": "V",
    "current": "A",
    "torque": "N·m",
    "motor_temperature": "°C",
    "water_temperature": "°C",
    "neighbour_thrust": "N",
    "thrust": "N",
    "frequency": "Hz",
    "direction": "",
    "direction_of_change": "",
    "load_history": "",
}
KINDS: Mapping[Kind, tuple[str, float]] = {
    "force": ("left out / N", 1.0),
    "turn": ("left out, towards the last change / N", 1.0),
    "gain": ("left out / % of the thrust", 100.0),
    "step": ("left out / % of the step", 100.0),
}
"""Label of a signature's ordinate and its factor."""
EFFECTS = (*{term.id for term in CATALOGUE}, *WITHOUT_TERM)
_NAMES = re.compile(r"\b(" + "|".join(sorted((*UNITS, *EFFECTS), key=len, reverse=True)) + r")\b")


def words(text: str) -> str:
    """A sentence of the diagnosis without underscores in names that are ours.

    >>> words("within +-1 V at 20 degC")
    'within ±1 V at 20 °C'
    >>> words("70 % lies at command_voltage -1 to 1 V, C = 0.4 N/V^2; see my_file")
    '70 % lies at command voltage −1 to 1 V, C = 0.4 N/V²; see my_file'
    """
    told = _NAMES.sub(lambda name: name[0].replace("_", " "), prose(text))
    told = re.sub(r"\bdegC\b", "°C", told.replace("+-", "±"))
    return re.sub(r"(?<![\w.])-(?=\d)", "−", told)


def driver_quantity(d: Diagnosis) -> str:
    """What drove the thruster."""
    if d.twin is not None:
        return d.twin.driver_quantity
    return "rotation_rate" if "n|n|" in d.baseline_model else "command_voltage"


def axis(quantity: str, driver: str) -> str:
    """Label of an axis.

    >>> axis("driver", "command_voltage"), axis("direction", "command_voltage")
    ('command voltage / V', 'direction')
    """
    name = driver if quantity == "driver" else quantity
    unit = UNITS.get(name, "")
    if name == "previous_voltage":
        name, unit = "level before", UNITS[driver]
    return name.replace("_", " ") + (f" / {unit}" if unit else "")


def stretch(where: Where) -> str:
    """A located stretch.

    >>> stretch(Where("time_since_step", 0.01, 0.4, "s"))
    'time since step 0.01 to 0.4 s'
    """
    unit = f" {unit_text(where.unit)}" if unit_text(where.unit) else ""
    size = max(abs(where.low), abs(where.high))
    low, high = (0.0 if abs(x) < 1e-3 * size else x for x in (where.low, where.high))
    return words(f"{where.quantity} {low:.3g} to {high:.3g}{unit}")


def effect_name(effect: str, form: str = "") -> str:
    """An effect for a heading.

    >>> effect_name("motor_lag", "first_order")
    'motor lag (first order)'
    >>> effect_name("flexible:flow_speed")
    'free curve over flow speed'
    """
    if effect.startswith("flexible:"):
        return f"free curve over {effect.removeprefix('flexible:').replace('_', ' ')}"
    return effect.replace("_", " ") + (f" ({form.replace('_', ' ')})" if form else "")


def rarity(p: float) -> str:
    """A p value; below 1e-12 nobody believes the digits.

    >>> rarity(0.0312), rarity(3e-7), rarity(0.0)
    ('p = 0.031', 'p = 3·10⁻⁷', 'p < 10⁻¹²')
    """
    if p < 1e-12:
        return "p < 10⁻¹²"
    if p >= 1e-3:
        return f"p = {p:.2g}"
    mantissa, exponent = f"{p:.0e}".split("e")
    return f"p = {mantissa}·10{str(int(exponent)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def value_cells(value: Value) -> tuple[str, str, str]:
    """Value with its standard error, 95 % interval, unit; what is not known is a dash.

    >>> value_cells(Value(0.40123, 0.0012, "N/V^2")), value_cells(Value(3.0, float("nan"), "1"))
    (('0.4012 ± 0.0012', '0.3989 to 0.4036', 'N/V²'), ('3', '–', ''))
    >>> value_cells(Value(432.0, 376232.0, "s")), value_cells(Value(24.0, 5.8e9, "s", limits=(1.0, 400.0)))
    (('–', 'not determined', 's'), ('–', 'not determined (between 1 and 400)', 's'))
    """
    unit = unit_text(value.unit)
    if not isfinite(value.value):
        return "–", "–", unit
    if not (isfinite(value.std) and value.std > 0):
        return f"{value.value:.4g}".replace("-", "−"), "–", unit
    if not value.determined:
        low, high = (f"{x:.3g}".replace("-", "−") for x in value.interval)
        return "–", "not determined" + (f" (between {low} and {high})" if value.limits else ""), unit
    shown, error, low, high = (
        digits(x, value.std).replace("-", "−") for x in (value.value, value.std, *value.interval)
    )
    return f"{shown} ± {error}", f"{low} to {high}", unit


def not_drawn(rows: int) -> str:
    """A sentence on bins whose value the data do not determine; empty where there are none.

    >>> not_drawn(1)
    ' 1 place is not drawn: the data do not determine its value.'
    """
    if not rows:
        return ""
    return f" {rows} place{'s are' if rows > 1 else ' is'} not drawn: the data do not determine its value."


def evidence(finding: Finding) -> str:
    """How sure a finding is, and how much of what could be explained it is."""
    gain = f"{finding.bic_gain:.3g}" if abs(finding.bic_gain) < 100 else f"{finding.bic_gain:.0f}"
    near = "" if finding.rivals else "no rival comes near"
    told = (rarity(finding.p_value), sureness(finding), f"BIC better by {gain}", near)
    graded = "; ".join(part for part in (degree(finding), *finding.doubts) if part)
    return ", ".join(part for part in told if part) + (f". {graded[:1].upper()}{graded[1:]}" if graded else "")
