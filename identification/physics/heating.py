"""A motor fed with a voltage that warms up: copper costs it rate, magnets that weaken give it some (hot_motor.py)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from identification.physics.equation import follows
from identification.physics.hot_motor import (
    TYPICAL_LOSS,
    cold_motor,
    copper_at_full,
    hot_equation,
    hot_rate,
    weaker_at_full,
)
from identification.physics.term import KELVIN, THERMOMETER, EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Proxy, Traits
from identification.recording import Floats
from identification.run_history.filters import lowpass

MOST_PER_KELVIN = 1.0
"""1/K. Copper has 0.004, of which thrust loses a fourth; a thermometer outside sees only a part of their rise."""
MOST_FLUX = 0.3
"""Magnets that have lost more do not come back (Pyrhonen et al. 2008: 0.001 to 0.0012 1/K of NdFeB)."""
MOST_FLUX_PER_KELVIN = 0.1
"""1/K, a hundred times that of the magnet itself: a thermometer outside sees only a part of its rise."""
SLOWER_THAN_SEEN = 8.0
"""Magnets that follow a thermometer may be so much slower than what only time itself tells: how it moved is known, and
what is slower still follows the sum of it, however slow."""


def _slowest(scale: Scale) -> float:
    """s; what is slower is a trend that any cause may have."""
    return max(60.0, 0.7 * scale.duration)


def _full_current(now: TermContext) -> float:
    """A, one for all runs."""
    return now.scale.current or float(np.nanmax(np.abs(now.history.others["current"])))


def _taken(model: EquationContext) -> str:
    """A comment on a winding of which nobody said how much it takes."""
    return f"  # the cold winding is taken to lose {100 * TYPICAL_LOSS:g} %" if model.winding is None else ""


COLD_LOSS = Parameter("cold_loss", "1", 0.02, 0.5, told="share of the voltage in the cold winding")
"""5 to 35 % at full load in the field; what lies at an end is not determined."""
COLD_LOSSES = (0.07, 0.28)
"""Tried: a half of the typical one, and twice that."""
POWER = Proxy(
    THERMOMETER,
    "no motor temperature was recorded",
    "the power drawn before, the fourth power of the rotor's rate as the model has it, low-passed",
    better=("current", "the power drawn before, the recorded current squared, low-passed"),
)
REVEALED = "minutes at full load, then high and low levels straight after and once more cold; the motor's temperature"

TRAITS = Traits(
    moving=True,
    refers=True,
    seen_by=THERMOMETER,
    shown_over="time",
    shown_as="gain",
    told_by=((THERMOMETER, "the motor temperature"),),
    revealed_by=REVEALED,
)
CLOSER = replace(TRAITS, closer=True, own_winding=True)
CLOSER_OF_POWER = replace(CLOSER, proxy=POWER)
OF_POWER = replace(TRAITS, proxy=POWER)


@dataclass(frozen=True, slots=True)
class Heating:
    """No thermometer: both follow the power, V^4 or I^2, with a time constant; magnets follow the copper later.

    `loss`: share of the thrust at the largest driver that hot copper costs, at full load for long. `flux_loss`: share
    of k_e that hot magnets lose there. form "own_winding": how the loss grows with the level tells `cold_loss`, the
    share of the largest driver that the cold winding takes, where no winding_resistance of the model does.
    """

    id: ClassVar[str] = "heating"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "winding and magnets warm up under load"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    form: Literal["winding", "magnet", "winding_and_magnet", "own_winding"] = "winding"

    @property
    def traits(self) -> Traits:
        return CLOSER_OF_POWER if self.form == "own_winding" else OF_POWER

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        tau = Parameter("time_constant", "s", 5.0, _slowest(scale))
        later = Parameter("magnet_time_constant", "s", 5.0, _slowest(scale), told="time constant of the magnets")
        loss = Parameter("loss", "1", 0.0, 0.95, 0.0)
        match self.form:
            case "winding":
                return loss, tau
            case "own_winding":
                return loss, tau, COLD_LOSS
            case "magnet":
                return Parameter("flux_loss", "1", 0.0, MOST_FLUX, 0.0), tau, later
            case _:
                return loss, tau, Parameter("flux_loss", "1", 0.0, MOST_FLUX, 0.0), later

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.form in ("winding", "own_winding"):
            loss = [(0.05, tau) for tau in (15.0, 40.0, 100.0, 300.0) if tau < 0.7 * scale.duration]
            shares = COLD_LOSSES if self.form == "own_winding" else ()
            return tuple((*each, share) for each in loss for share in shares) or tuple(loss)
        times = tuple(pair for pair in ((30.0, 30.0), (120.0, 60.0)) if pair[0] < 0.7 * scale.duration)
        if self.form == "magnet":
            return tuple((0.02, *pair) for pair in times)
        return tuple((0.05, tau, 0.02, later) for tau, later in times)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        history, current = now.history, now.history.others.get("current")
        winding, full = self._cold_motor(now.winding, now.scale, theta)
        load = (value / full) ** 4 if current is None else (current / _full_current(now)) ** 2
        copper, flux, later = self._amounts(theta)
        warm = lowpass(load, history.dt, theta[1])[1]
        magnets = lowpass(warm, history.dt, later)[1] if later is not None else warm
        return hot_rate(value, winding, copper_at_full(copper, winding, full) * warm, flux * magnets)

    def _cold_motor(self, known: float | None, scale: Scale, theta: tuple[float, ...]) -> tuple[float, float]:
        """A winding that takes voltage warms with the magnets: magnets alone are of a motor with next to none."""
        share = theta[2] if self.form == "own_winding" else TYPICAL_LOSS
        return cold_motor(known or 0.0 if self.form == "magnet" else known, scale.driver, share)

    def _amounts(self, theta: tuple[float, ...]) -> tuple[float, float, float | None]:
        """Loss by copper, loss of flux, time constant of the magnets behind the copper."""
        match self.form:
            case "winding" | "own_winding":
                return theta[0], 0.0, None
            case "magnet":
                return 0.0, theta[0], theta[2]
            case _:
                return theta[0], theta[2], theta[3]

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        winding, full = self._cold_motor(model.winding, model.scale, theta)
        load = f"({model.symbol} / {full:.6g}) ** 4"
        if "current" in model.recorded:
            most = model.scale.current
            load = f"(current / {f'{most:.6g}' if most else 'max(abs(current))'}) ** 2"
        copper, flux, later = self._amounts(theta)
        lines = [f"load = {load}", follows("warmth", "load", theta[1])]
        if later is not None:
            lines.append(follows("magnets", "warmth", later))
        more = f"{copper_at_full(copper, winding, full):.6g} * warmth" if copper else ""
        weaker = f"{flux:.6g} * magnets" if later is not None else ""
        return *lines, *hot_equation(model.symbol, winding, more, weaker, "" if "own" in self.form else _taken(model))

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        copper, flux, _ = self._amounts(theta)
        said = (
            [f"its copper costs {100 * copper:.2g} % of the thrust there, and less at lower levels"] if copper else []
        )
        said += [f"its magnets lose {100 * flux:.2g} % of their flux, so that it turns faster"] if flux else []
        return (
            f"Heating: at full load for long {' and '.join(said) or 'nothing changes'} (time constant "
            f"{theta[1]:.3g} s); rest between loads, or record the motor temperature."
        )


@dataclass(frozen=True, slots=True)
class MeasuredHeating:
    """By the recorded temperature, from the lowest that a run began with: `loss_per_kelvin` of the thrust at the
    largest driver by copper, `flux_loss_per_kelvin` of k_e by magnets, which follow the thermometer later."""

    id: ClassVar[str] = "heating"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "winding and magnets warm up under load"
    needs: ClassVar[tuple[str, ...]] = (THERMOMETER,)
    covariates: ClassVar[tuple[str, ...]] = (THERMOMETER, "time")
    form: Literal["measured_winding", "measured_magnet", "measured_winding_and_magnet", "measured_own_winding"] = (
        "measured_winding"
    )

    @property
    def traits(self) -> Traits:
        return CLOSER if self.form == "measured_own_winding" else TRAITS

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        loss = Parameter("loss_per_kelvin", "1/K", 0.0, MOST_PER_KELVIN, 0.0)
        slowest = SLOWER_THAN_SEEN * _slowest(scale)
        later = Parameter("magnet_time_constant", "s", 5.0, slowest, told="time constant of the magnets")
        match self.form:
            case "measured_winding":
                return (loss,)
            case "measured_own_winding":
                return loss, COLD_LOSS
            case "measured_magnet":
                return Parameter("flux_loss_per_kelvin", "1/K", 0.0, MOST_FLUX_PER_KELVIN, 0.0), later
            case _:
                return loss, Parameter("flux_loss_per_kelvin", "1/K", 0.0, MOST_FLUX_PER_KELVIN, 0.0), later

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.form == "measured_winding":
            return ((0.001,),)
        if self.form == "measured_own_winding":
            return tuple((0.001, share) for share in COLD_LOSSES)
        amounts = (0.001,) if self.form == "measured_magnet" else (0.001, 0.001)
        return tuple((*amounts, tau) for tau in (15.0, 60.0, 200.0) if tau < 0.7 * scale.duration)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        copper, flux, later = self._amounts(theta)
        measured = now.history.others[THERMOMETER]
        rise = measured + KELVIN - now.scale.cold if now.scale.cold > 0 else measured - measured[0]
        magnets = lowpass(rise, now.history.dt, later, float(rise[0]))[1] if later is not None else rise
        winding, full = self._cold_motor(now.winding, now.scale, theta)
        weaker = np.minimum(flux * magnets, MOST_FLUX)
        return hot_rate(value, winding, copper * weaker_at_full(winding, full) * rise, weaker)

    def _cold_motor(self, known: float | None, scale: Scale, theta: tuple[float, ...]) -> tuple[float, float]:
        """As of Heating."""
        share = theta[1] if self.form == "measured_own_winding" else TYPICAL_LOSS
        return cold_motor(known or 0.0 if self.form == "measured_magnet" else known, scale.driver, share)

    def _amounts(self, theta: tuple[float, ...]) -> tuple[float, float, float | None]:
        """Loss by copper and of flux per kelvin, time constant of the magnets behind the thermometer."""
        match self.form:
            case "measured_winding" | "measured_own_winding":
                return theta[0], 0.0, None
            case "measured_magnet":
                return 0.0, theta[0], theta[1]
            case _:
                return theta[0], theta[1], theta[2]

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        scale = model.scale
        copper, flux, later = self._amounts(theta)
        winding, full = self._cold_motor(model.winding, scale, theta)
        cold = f"{scale.cold - KELVIN:.6g}" if scale.cold > 0 else "motor_temperature(0)"
        lines = [f"rise = motor_temperature - {cold}"]
        if later is not None:
            lines.append(follows("magnets", "rise", later, "rise(0)"))
        more = f"{copper * weaker_at_full(winding, full):.6g} * rise" if copper else ""
        weaker = f"minimum({flux:.6g} * magnets, {MOST_FLUX:g})" if later is not None else ""
        return *lines, *hot_equation(model.symbol, winding, more, weaker, "" if "own" in self.form else _taken(model))

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        copper, flux, later = self._amounts(theta)
        full = f"{scale.driver:.3g} {scale.driver_unit}"
        said = [f"the copper costs {100 * copper:.2g} % of the thrust at {full}, less below"] if copper else []
        said += [f"the magnets lose {100 * flux:.2g} % of their flux and the motor turns faster"] if flux else []
        late = "" if later is None else f", the magnets {later:.3g} s late"
        return f"Heating: per kelvin of the motor temperature {' and '.join(said) or 'nothing changes'}{late}."


FORMS = (
    Heating("winding"),
    Heating("magnet"),
    Heating("winding_and_magnet"),
    Heating("own_winding"),
    MeasuredHeating("measured_winding"),
    MeasuredHeating("measured_magnet"),
    MeasuredHeating("measured_winding_and_magnet"),
    MeasuredHeating("measured_own_winding"),
)
