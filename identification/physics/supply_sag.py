"""The command is a fraction of a supply that moves: V_eff = V (V_bus / V_ref)^k, V_ref the highest of all runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.equation import follows
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Proxy, Traits
from identification.recording import Floats
from identification.run_history.filters import lowpass

UNKNOWN = "no bus voltage was recorded"
OTHER_SUPPLY = (("", "another supply voltage at the same levels"),)


def _reference(now: TermContext) -> float:
    """V, one for all runs that are fitted and all that these numbers are for: supplies differ between runs, too."""
    return now.scale.bus or float(np.nanmax(now.history.others["bus_voltage"]))


def _loss(drop: float, driver: float) -> float:
    """Where e + a V^2 e^2 = V: a, if e = (1 - drop) V at the largest driver."""
    return drop / ((1 - drop) ** 2 * driver**3)


def _reference_told(scale: Scale) -> str:
    return f"{scale.bus:.6g}" if scale.bus else "max(bus_voltage)"


def _highest(scale: Scale) -> str:
    return f"{scale.bus:.3g} V" if scale.bus > 0 else "its highest"


@dataclass(frozen=True, slots=True)
class SupplySag:
    """The command is a fraction of a supply that moves: V_eff = V (V_bus / V_ref)^k, V_ref the highest of all runs."""

    id: ClassVar[str] = "supply_sag"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "the command is a fraction of a supply voltage that moves"
    needs: ClassVar[tuple[str, ...]] = ("bus_voltage",)
    covariates: ClassVar[tuple[str, ...]] = ("bus_voltage",)
    traits: ClassVar[Traits] = Traits(
        refers=True,
        seen_by="bus_voltage",
        shown_over="bus_voltage",
        shown_as="gain",
        told_by=OTHER_SUPPLY,
        revealed_by="the same level at another supply voltage",
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("exponent", "1", 0.0, 3.0, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.1,), (1.0,))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        bus = now.history.others["bus_voltage"]
        ratio = np.maximum(bus / _reference(now), 1e-3)
        out: Floats = value * ratio ** theta[0]
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        V = model.symbol
        return (f"{V} = {V} * (bus_voltage / {_reference_told(model.scale)}) ** {theta[0]:.6g}",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Supply sag: the thruster sees the command times (bus voltage / {_highest(scale)})^{theta[0]:.2f}; "
            "keep the supply up, or correct by the recorded bus voltage."
        )


@dataclass(frozen=True, slots=True)
class Buffered:
    """The supply as the thruster feels it: an output capacitor follows the load a little later than a meter shows."""

    id: ClassVar[str] = "supply_sag"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "the command is a fraction of a buffered supply voltage that moves"
    needs: ClassVar[tuple[str, ...]] = ("bus_voltage",)
    covariates: ClassVar[tuple[str, ...]] = ("bus_voltage",)
    traits: ClassVar[Traits] = Traits(
        refers=True,
        seen_by="bus_voltage",
        shown_over="bus_voltage",
        shown_as="gain",
        told_by=OTHER_SUPPLY,
        revealed_by="the same level at another supply voltage",
    )
    form: ClassVar[str] = "buffered"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("exponent", "1", 0.0, 3.0, 0.0), Parameter("time_constant", "s", 0.001, 0.3))

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((1.0, 0.02), (1.0, 0.08))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        bus = now.history.others["bus_voltage"]
        felt = lowpass(bus, now.history.dt, theta[1], float(bus[0]))[1]
        out: Floats = value * np.maximum(felt / _reference(now), 1e-3) ** theta[0]
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        V = model.symbol
        return (
            follows("supply", "bus_voltage", theta[1], "bus_voltage(0)"),
            f"{V} = {V} * (supply / {_reference_told(model.scale)}) ** {theta[0]:.6g}",
        )

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Supply sag: the thruster sees the command times (bus voltage / {_highest(scale)})^{theta[0]:.2f}, "
            f"{1000 * theta[1]:.3g} ms later than the load draws on it; keep the supply up."
        )


@dataclass(frozen=True, slots=True)
class Discharge:
    """The proxy where no bus voltage was recorded, or in steps that hide how it falls: V_eff = V / (1 + d Q), Q the
    integral of |V|^3 over time.

    The drive switches, so it draws V_eff^3 / V_b of current: with r = V_b / V_0 = V_eff / V that is |V|^3 r^2 / V_0. A
    supply that falls by what was drawn has dr/dt = -d |V|^3 r^2, of which 1 / r = 1 + d Q is the solution.
    """

    id: ClassVar[str] = "supply_sag"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "the supply falls as it is drawn on"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    traits: ClassVar[Traits] = Traits(
        moving=True,
        refers=True,
        seen_by="bus_voltage",
        proxy=Proxy("bus_voltage", UNKNOWN, "the energy drawn so far, |V|^3 over time,"),
        shown_over="bus_voltage",
        shown_as="gain",
        told_by=OTHER_SUPPLY,
        revealed_by="the same level at another supply voltage",
    )
    form: ClassVar[str] = "discharge"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("drop", "1", 0.0, 2.0, 0.0, told="drop of the supply"),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.05,),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        drawn = np.abs(now.history.driver / now.scale.driver) ** 3 * now.history.dt / now.scale.duration
        out: Floats = value / (1 + theta[0] * (np.cumsum(drawn) - 0.5 * drawn))
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        V, scale = model.symbol, model.scale
        power = f"abs({model.driver} / {scale.driver:.6g}) ** 3"
        return (
            f"d(drawn)/dt = {power} / {scale.duration:.6g}, drawn(0) = 0",
            f"{V} = {V} / (1 + {theta[0]:.6g} * drawn)",
        )

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Supply sag: the voltage falls as the supply is drawn on, by {100 * theta[0] / (1 + theta[0]):.2g} % for "
            f"{scale.duration:.3g} s at full power; energy drawn stands for the bus voltage: record it in fine steps."
        )


@dataclass(frozen=True, slots=True)
class Loaded:
    """The proxy for a source that gives way at once behind a switching drive: V_eff = V - (V/V_b)^2 R_s i.

    The drive draws D i of the source, D = V/V_b its duty, and gives D of what is left; i goes as V_eff^2. A share of
    V^3 is lost; behind a linear amplifier it would be R_s i, a share of V as in the winding. `drop`: the share lost at
    the largest V.
    """

    id: ClassVar[str] = "supply_sag"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "the supply gives way to the load"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    traits: ClassVar[Traits] = Traits(
        moving=True,
        refers=True,
        seen_by="bus_voltage",
        proxy=Proxy("bus_voltage", UNKNOWN, "the power drawn, |V|^3,"),
        shown_over="bus_voltage",
        shown_as="gain",
        told_by=(("bus_voltage", "the bus voltage"),),
        revealed_by="levels at 0.3, 0.6 and 1.0 of the highest, the bus voltage recorded",
    )
    form: ClassVar[str] = "loaded"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("drop", "1", 0.0, 0.5, 0.0, told="drop of the supply"),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.03,),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        a = _loss(theta[0], now.scale.driver)
        out: Floats = 2 * value / (1 + np.sqrt(1 + 4 * a * np.abs(value) ** 3))
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        V, a = model.symbol, _loss(theta[0], model.scale.driver)
        return (f"{V} = 2 * {V} / (1 + sqrt(1 + 4 * {a:.6g} * abs({V}) ** 3))",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Supply sag: at {scale.driver:.3g} {scale.driver_unit} the supply gives way by {100 * theta[0]:.2g} %; "
            "power drawn stands for the bus voltage: record it in fine steps."
        )


FORMS = (SupplySag(), Buffered(), Discharge(), Loaded())
