"""A twin's `heating` as the world's: what warmth costs or gives at full load for long comes out the same.

A twin says it of the power that the cold motor draws, the world's motor warms with the current that flows. So the two
agree cold, and settled at the twin's largest voltage; on the way and below it they differ by what warmth does to the
current.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Any

from sim_devices.tables import WorldError
from sim_devices.world.settings import Thruster

TYPICAL_SHARE = 0.15
"""Of the largest voltage in the cold winding, where the twin has no winding_resistance: a term of the catalogue assumes
so (docs/physics/heating.md)."""
NEAR = 1e-3
"""Relative step of a slope."""
_PLAIN = Thruster(C=1.0)


@dataclass(frozen=True, slots=True)
class HotMotor:
    """V = (1 - m) y + (w + copper) y^2 / (1 - m): y in V, `w` and `copper` in 1/V, `m` the share of flux lost."""

    cold: float
    """V: y of the cold motor at the largest voltage."""
    w: float
    copper: float
    m: float

    def rate(self, warm: float = 1.0) -> float:
        """V: y with `warm` of the warmth at the largest voltage."""
        left = 1.0 - warm * self.m
        terminals = self.cold + self.w * self.cold**2
        bend = (self.w + warm * self.copper) / left
        return 2.0 * terminals / (left + sqrt(left * left + 4.0 * bend * terminals))

    def current(self, warm: float = 1.0) -> float:
        """V^2, in proportion to it."""
        return self.rate(warm) ** 2 / (1.0 - warm * self.m)

    @property
    def feedback(self) -> float:
        """By how much more it warms, relatively, once it is a little warmer: from 1 on it has no end."""
        more, less = (self.current(1.0 + side * NEAR) ** 2 for side in (1.0, -1.0))
        return (more - less) / (2.0 * NEAR * self.current() ** 2)


def heat_of(values: Mapping[str, float], form: str, k: float, driver: float, winding: float | None) -> dict[str, Any]:
    """`[effects.heating]`; `winding` is the twin's winding loss in 1/V, None where it has none. Raises WorldError."""
    if form.startswith("measured_"):
        raise WorldError("the twin's heating follows a recorded motor temperature, which the bench cannot foresee")
    motor = _motor(values, form, driver, winding)
    if motor.copper > 0.0 and motor.w <= 0.0:
        raise WorldError("the twin's heating is of a winding whose resistance is 0 in its winding_resistance")
    if motor.feedback >= 1.0:
        raise WorldError(
            f"the twin's magnets lose {100.0 * motor.m:.3g} % of their flux at full load; the weaker they are the more "
            "current the world's motor draws, and it would warm without end"
        )
    rise = _PLAIN.heating * (_PLAIN.drag * k**2 * motor.current() / _PLAIN.torque_acceleration) ** 2
    ohm = _PLAIN.torque_acceleration / (_PLAIN.drag * k**2)
    copper = {"resistance": motor.w * ohm, "copper": motor.copper / motor.w / rise} if motor.w > 0.0 else {}
    if form in ("winding", "own_winding"):
        return {**copper, "form": "winding"}
    magnets = {"magnet": motor.m / rise, "time_constant": values["magnet_time_constant"]}
    return {**copper, **magnets, "form": "both" if copper else "magnet"}


def _motor(values: Mapping[str, float], form: str, driver: float, winding: float | None) -> HotMotor:
    """Magnets alone are of a motor whose winding takes next to nothing."""
    if winding is None:
        share = values.get("cold_loss", TYPICAL_SHARE)
        w = 0.0 if form == "magnet" else share / ((1.0 - share) * driver)
        cold = driver
    else:
        w, cold = winding, 2.0 * driver / (1.0 + sqrt(1.0 + 4.0 * winding * driver))
    hot = sqrt(1.0 - values.get("loss", 0.0)) * cold
    copper = (cold - hot + w * (cold**2 - hot**2)) / hot**2
    return HotMotor(cold, w, copper, values.get("flux_loss", 0.0))
