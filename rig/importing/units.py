"""Units by the names that instruments and spreadsheets print, and what they are in the recording format's units."""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import pi
from typing import Final

from identification.recording import QUANTITY_UNITS, Floats
from rig.errors import ConfigError

LBF: Final = 4.4482216152605
"""N, exact: 0.45359237 kg (international pound, 1959) times 9.80665 m/s^2."""
KGF: Final = 9.80665
"""N, exact: standard gravity (3rd CGPM, 1901)."""
OZF: Final = LBF / 16
INCH: Final = 0.0254
FOOT: Final = 0.3048
KNOT: Final = 1852 / 3600
FROM_HEADER: Final = "header"
"""As a unit in a map: the one in brackets at the end of the column's name."""

LINEAR: Final[Mapping[str, Mapping[str, float]]] = {
    "s": {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "V": {"V": 1.0, "volt": 1.0, "volts": 1.0, "mV": 1e-3, "uV": 1e-6, "kV": 1e3},
    "A": {"A": 1.0, "amp": 1.0, "amps": 1.0, "mA": 1e-3, "uA": 1e-6},
    "rev/s": {
        **{"rev/s": 1.0, "rps": 1.0, "r/s": 1.0, "Hz": 1.0, "rpm": 1 / 60, "r/min": 1 / 60, "rev/min": 1 / 60},
        **{"1/min": 1 / 60, "krpm": 1000 / 60, "rad/s": 0.5 / pi, "deg/s": 1 / 360},
    },
    "N": {
        **{"N": 1.0, "newton": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": LBF, "lb": LBF, "lbs": LBF, "ozf": OZF, "oz": OZF},
        **{"kgf": KGF, "kp": KGF, "kg": KGF, "gf": KGF / 1000, "g": KGF / 1000},
    },
    "N.m": {
        **{"N.m": 1.0, "Nm": 1.0, "mN.m": 1e-3, "mNm": 1e-3, "kN.m": 1e3, "kNm": 1e3, "N.cm": 0.01, "Ncm": 0.01},
        **{"N.mm": 1e-3, "Nmm": 1e-3, "kgf.m": KGF, "kg.m": KGF, "kgf.cm": KGF / 100, "kg.cm": KGF / 100},
        **{"gf.cm": KGF / 1e5, "g.cm": KGF / 1e5, "lbf.ft": LBF * FOOT, "ft.lbf": LBF * FOOT, "lb.ft": LBF * FOOT},
        **{"ft.lb": LBF * FOOT, "lbf.in": LBF * INCH, "in.lbf": LBF * INCH, "lb.in": LBF * INCH, "in.lb": LBF * INCH},
        **{"ozf.in": OZF * INCH, "in.ozf": OZF * INCH, "oz.in": OZF * INCH, "in.oz": OZF * INCH},
    },
    "m/s": {
        **{"m/s": 1.0, "cm/s": 0.01, "mm/s": 1e-3, "km/h": 1 / 3.6, "kn": KNOT, "kt": KNOT, "kts": KNOT, "knots": KNOT},
        **{"ft/s": FOOT, "fps": FOOT, "mph": 1609.344 / 3600},
    },
    "m": {"m": 1.0, "cm": 0.01, "mm": 1e-3, "km": 1e3, "ft": FOOT, "in": INCH, "inch": INCH},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": pi / 180, "degrees": pi / 180, "rev": 2 * pi, "turns": 2 * pi},
    "rad/s": {"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": pi / 180, "rpm": 2 * pi / 60, "rev/s": 2 * pi},
    "m/s^2": {"m/s^2": 1.0, "cm/s^2": 0.01, "mm/s^2": 1e-3, "g": KGF, "mg": KGF / 1000, "ft/s^2": FOOT},
    "degC": {"degC": 1.0, "C": 1.0, "celsius": 1.0},
    "1": {"1": 1.0, "": 1.0, "%": 0.01, "bool": 1.0},
}
"""Unit of the format: names that come to it by a factor. `g` and `kg` of a force are what the cell weighs."""
TEMPERATURE: Final = {"K": (1.0, -273.15), "kelvin": (1.0, -273.15), "degF": (5 / 9, -160 / 9), "F": (5 / 9, -160 / 9)}
"""Factor and offset to degC."""


@dataclass(frozen=True)
class Conversion:
    """`apply` takes values in a unit and the map's parameters to `si`, a unit of the format."""

    name: str
    si: str
    apply: Callable[[Floats, Mapping[str, float]], Floats]
    needs: tuple[str, ...] = ()
    """Parameters that the conversion cannot do without."""
    said: str = ""
    """The arithmetic, for the reader."""


def _pulse(microseconds: float) -> Callable[[Floats, Mapping[str, float]], Floats]:
    return lambda x, p: (x * microseconds - p["pulse_stop"]) / p["pulse_span"] * p["nominal_voltage"]


def _effort(share: float) -> Callable[[Floats, Mapping[str, float]], Floats]:
    return lambda x, p: x * share * p["nominal_voltage"]


PULSE_NEEDS: Final = ("pulse_stop", "pulse_span", "nominal_voltage")
PULSE: Final = "(pulse - pulse_stop) / pulse_span * nominal_voltage"
DRIVES: Final[Mapping[str, Conversion]] = {
    "us": Conversion("us", "V", _pulse(1.0), PULSE_NEEDS, PULSE),
    "ms": Conversion("ms", "V", _pulse(1000.0), PULSE_NEEDS, PULSE),
    "%": Conversion("%", "V", _effort(0.01), ("nominal_voltage",), "% of nominal_voltage"),
    "%duty": Conversion("%duty", "V", _effort(0.01), ("nominal_voltage",), "% of nominal_voltage"),
    "duty": Conversion("duty", "V", _effort(1.0), ("nominal_voltage",), "share of nominal_voltage"),
    "1": Conversion("1", "V", _effort(1.0), ("nominal_voltage",), "share of nominal_voltage"),
}
"""Units in which a command is given that are no volts: they need to know what full command is."""
ELECTRICAL: Final = Conversion(
    "erpm", "rev/s", lambda x, p: x / p["pole_pairs"] / 60, ("pole_pairs",), "electrical rpm / pole_pairs / 60"
)
KNOWN_PARAMETERS: Final = (*PULSE_NEEDS, "pole_pairs")
"""Parameters that conversions ask for; `--set` may give them though the map does not have them."""


def spelled(name: str) -> str:
    """A unit's name without what differs from program to program.

    >>> [spelled(text) for text in ("µs", "N·m", "lb-ft", "m/s²", "° C", "% duty", "min⁻¹", "kgf cm", "(gf)")]
    ['us', 'N.m', 'lb.ft', 'm/s^2', 'degC', '%duty', '1/min', 'kgf.cm', 'gf']
    """
    text = re.sub(r"(?<=s)²", "^2", name.strip().strip("()[]")).replace("⁻¹", "^-1")
    text = unicodedata.normalize("NFKC", text).replace("μ", "u").replace("°", "deg").replace("deg ", "deg")
    text = {"min^-1": "1/min", "s^-1": "Hz", "m/s2": "m/s^2"}.get(text, text)
    text = re.sub(r"^% +", "%", text)
    return re.sub(r"\s*[·⋅*\-]\s*|(?<=\w)\s+(?=\w)", ".", text).replace(" ", "")


def unit_in(column: str) -> str:
    """The unit in brackets at the end of a column's name; empty where there is none.

    >>> unit_in("Thrust (lbf)"), unit_in("vbat[V]"), unit_in("speed")
    ('lbf', 'V', '')
    """
    found = re.search(r"[(\[]([^()\[\]]*)[)\]]\s*$", column)
    return found.group(1).strip() if found else ""


def _named(name: str, table: Mapping[str, object]) -> str | None:
    """The name in `table`: as it is, else the only one that is the same without regard to capitals."""
    wanted = spelled(name)
    if wanted in table:
        return wanted
    alike = [known for known in table if known.lower() == wanted.lower()]
    return alike[0] if len(alike) == 1 else None


def conversion(quantity: str, unit: str) -> Conversion:
    """From `unit` to the unit that the format has for `quantity`. Raises ConfigError that lists what is known."""
    if quantity == "command_voltage" and (driven := _named(unit, DRIVES)) is not None:
        return DRIVES[driven]
    if quantity == "rotation_rate" and spelled(unit).lower() == "erpm":
        return ELECTRICAL
    for si in QUANTITY_UNITS[quantity]:
        if (name := _named(unit, LINEAR[si])) is not None and unit:
            return _linear(name, si, LINEAR[si][name], 0.0)
    if "degC" in QUANTITY_UNITS[quantity] and (name := _named(unit, TEMPERATURE)) is not None:
        return _linear(name, "degC", *TEMPERATURE[name])
    known = known_units(quantity)
    near = difflib.get_close_matches(spelled(unit), known, 1)
    hint = f"did you mean {near[0]}?" if near else "or convert it with factor or value"
    raise ConfigError(f"{quantity} in {unit!r}: not a unit that is known for it; known are {', '.join(known)}; {hint}")


def _linear(name: str, si: str, factor: float, offset: float) -> Conversion:
    shift = f" {'+' if offset > 0 else '-'} {abs(offset):.6g}" if offset else ""
    said = "" if factor == 1 and not offset else f"x {factor:.6g}{shift}"
    return Conversion(name, si, lambda x, _: x * factor + offset, said=said)


def known_units(quantity: str) -> list[str]:
    """Names of units that a channel of this quantity may be given in, for a reader."""
    found = [name for si in QUANTITY_UNITS[quantity] for name in LINEAR[si] if name]
    if "degC" in QUANTITY_UNITS[quantity]:
        found += TEMPERATURE
    if quantity == "command_voltage":
        found += DRIVES
    return [*found, "erpm"] if quantity == "rotation_rate" else list(dict.fromkeys(found))


def seconds(unit: str) -> float:
    """Seconds in a unit of time. Raises ConfigError.

    >>> seconds("ms"), seconds("min")
    (0.001, 60.0)
    """
    name = _named(unit, LINEAR["s"])
    if name is None:
        raise ConfigError(f"time in {unit!r}: not a unit that is known; known are {', '.join(LINEAR['s'])}")
    return LINEAR["s"][name]


def factor_to_si(unit: str) -> float:
    """Of a unit that is only a factor, as in `any_of = [["Thrust (gf)", "gf"]]`. Raises ConfigError."""
    for table in LINEAR.values():
        if (name := _named(unit, table)) is not None and unit:
            return table[name]
    known = ", ".join(dict.fromkeys(name for table in LINEAR.values() for name in table if name))
    raise ConfigError(f"{unit!r} is not a unit that is known; known are {known}; or give a number")
