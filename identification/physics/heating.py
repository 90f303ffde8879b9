"""Winding and magnet warm up: T (1 - h Theta), Theta' = (power - Theta)/tau, power as V^4; magnets follow later."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.filters import lowpass
from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class Heating:
    """Winding and magnet warm up: T (1 - h Theta), Theta' = (power - Theta)/tau, power as V^4; magnets follow later."""

    id: ClassVar[str] = "heating"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "winding and magnets warm up under load"
    needs: ClassVar[tuple[str, ...]] = ()
    coordinates: ClassVar[tuple[str, ...]] = ("time",)
    form: Literal["winding", "magnet"] = "winding"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        slowest = max(60.0, 0.7 * scale.duration)  # slower ones are a trend that any cause may have
        known = (Parameter("loss", "1", 0.0, 0.95, 0.0), Parameter("time_constant", "s", 5.0, slowest))
        return known if self.form == "winding" else (*known, Parameter("magnet_time_constant", "s", 5.0, slowest))

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.form == "winding":
            return tuple((0.05, tau) for tau in (15.0, 40.0, 100.0, 300.0) if tau < 0.7 * scale.duration)
        return tuple((0.05, tau, later) for tau, later in ((30.0, 30.0), (120.0, 60.0)) if tau < 0.7 * scale.duration)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        history = now.history
        current = history.others.get("current")
        load = (now.x / now.scale.driver) ** 4 if current is None else (current / np.nanmax(np.abs(current))) ** 2
        warm = lowpass(load, history.dt, theta[1])[1]
        if self.form == "magnet":
            warm = lowpass(warm, history.dt, theta[2])[1]
        out: Floats = value * np.maximum(1 - theta[0] * warm, 0.0)
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Heating: at full load for long thrust falls by {100 * theta[0]:.2g} %, with a time "
            f"constant of {theta[1]:.3g} s; rest between loads, or record the motor temperature."
        )


FORMS = (Heating("winding"), Heating("magnet"))
