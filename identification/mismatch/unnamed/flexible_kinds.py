"""What a flexible term over a covariate may multiply."""

from __future__ import annotations

from identification.flexible_terms.flexible import Flexible, Multiplier
from identification.mismatch.model.data import Data
from identification.mismatch.select.covariates import FOLLOWED, LOADS

UNITS = {**dict(FOLLOWED), "torque": "N.m"}
"""Of the recorded quantities."""


def shapes_over(quantity: str, data: Data) -> list[Flexible]:
    """What a flexible term over this covariate may multiply; knots to be chosen."""
    driver = data.histories[0].driver_quantity
    units = {"time": "s", "time_since_step": "s", "previous_voltage": data.scale.driver_unit, **UNITS}

    def over(*times: tuple[Multiplier, ...], unit: str = "1", memory: float = 0.0) -> list[Flexible]:
        unit = units.get(quantity, unit)
        return [Flexible(quantity, unit, (0.0,), (), each, memory=memory) for each in times]

    match quantity:
        case _ if quantity == driver:
            return over(("force",), ("gain",), unit=data.scale.driver_unit)
        case "direction":
            return over(("gain",), ("force",))
        case "time":
            return over(("gain",), ("force",), ("gain", "force"))
        case "time_since_step":
            return over(("step",), ("gain",), ("reversed",), ("step", "gain"))
        case "previous_voltage":
            return over(("gain",), ("even",), ("force",), ("gain", "even"))
        case "direction_of_change":
            return over(("gain",), ("even",), ("force",), ("rate",), ("gain", "even"))
        case "load_history":
            memories = [tau for tau in LOADS if tau < 0.5 * data.scale.duration]
            return [each for tau in memories for each in over(("gain",), ("force",), ("late",), memory=tau)]
        case "rotation_rate":
            return over(("drive",), unit=data.scale.driver_unit)
        case _ if quantity in UNITS:
            return over(("gain",), ("force",), ("rate",), ("gain", "even"), ("gain", "force"))
        case _:
            return []
