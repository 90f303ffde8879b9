"""A formula of recorded quantities as a term: products and powers, added or times the thrust. No physics is claimed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.equation import signed
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.filters import lowpass
from identification.run_history.history import History

Times = Literal["1", "F", "|F|"]
CHANNELS: Mapping[str, tuple[str, str]] = {
    "n": ("rotation_rate", "rev/s"),
    "U": ("flow_speed", "m/s"),
    "T_w": ("water_temperature", "degC"),
    "T_m": ("motor_temperature", "degC"),
    "V_b": ("bus_voltage", "V"),
    "F_j": ("neighbour_thrust", "N"),
}
"""Symbol -> recorded quantity and its unit."""
MEMORIES = (5.0, 20.0, 60.0)
"""s, of the low-passes."""
MOST = 1e6
"""Bound of a coefficient in full thrusts: none, but the fit wants one."""


@dataclass(frozen=True, slots=True, order=True)
class Monomial:
    """A product of powers of quantities, each in units of its size, times 1, the thrust or its size."""

    powers: tuple[tuple[str, int], ...]
    """(symbol, power)"""
    times: Times

    @property
    def degree(self) -> int:
        return sum(p for _, p in self.powers)


@dataclass(frozen=True, slots=True)
class Formula:
    """A sum of monomials."""

    id: ClassVar[str] = "formula"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "a formula; no physics is claimed for it"
    traits: ClassVar[Traits] = Traits()
    needs: ClassVar[tuple[str, ...]] = ()
    monomials: tuple[Monomial, ...]
    sizes: tuple[tuple[str, float], ...]
    """(symbol, size)"""
    middles: tuple[float, ...] = ()
    """Of each product of powers in the data; empty: 0. A gain is counted from there, so that C stays what the thruster
    does and not what it would do at 0 degC: the response to a tick of the command is told from C."""

    @property
    def form(self) -> str:
        return " + ".join(_told(m) for m in self.monomials)

    @property
    def covariates(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(covariate_of(q) for m in self.monomials for q, _ in m.powers))

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        size = max(scale.thrust, scale.reading)
        return tuple(
            Parameter(f"c{i}", "N" if m.times == "1" else "1", -MOST * size, MOST * size, 0.0)
            for i, m in enumerate(self.monomials)
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        sizes, out = dict(self.sizes), value
        middles = self.middles or (0.0,) * len(self.monomials)
        for c, m, middle in zip(theta, self.monomials, middles, strict=True):
            product = product_of(m, {q: quantity(q, now.history) / sizes[q] for q, _ in m.powers})
            out = out + c * times(m.times, value) * (product - middle if m.times == "F" else product)
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        sizes, middles = dict(self.sizes), self.middles or (0.0,) * len(self.monomials)
        line = "F = F"
        for c, m, middle in zip(theta, self.monomials, middles, strict=True):
            product = " * ".join(f"({_typed(q, model)} / {sizes[q]:.6g}) ** {p}" for q, p in m.powers)
            if m.times == "F":
                product = f"({product} {signed(-middle)})"
            line += f" {signed(c)} * {product}" + {"1": "", "F": " * F", "|F|": " * abs(F)"}[m.times]
        return (line,)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return f"A formula, {self.form}; no physics is claimed for it."


def product_of(m: Monomial, unit: Mapping[str, Floats]) -> Floats:
    """(M,) of the powers; `unit`: symbol -> (M,) in units of its size."""
    return np.asarray(np.prod([unit[q] ** p for q, p in m.powers], axis=0))


def _told(m: Monomial) -> str:
    powers = " ".join(q if p == 1 else f"{q}^{p}" for q, p in m.powers)
    return powers if m.times == "1" else f"{powers} {m.times}"


def _typed(symbol: str, model: EquationContext) -> str:
    """A symbol by the name that its quantity has in a recording."""
    if symbol.startswith("lp"):
        memory, of = symbol[2:-1].split("(")
        load = f"{model.driver} * abs({model.driver})" if is_square(of) else f"abs({model.driver})"
        return f"lowpass({load}, {memory})"
    if symbol == model.symbol:
        return model.driver
    return CHANNELS[symbol][0] if symbol in CHANNELS else symbol


def times(kind: Times, force: Floats) -> Floats:
    """What a monomial is multiplied by."""
    return {"1": np.ones_like(force), "F": force, "|F|": np.abs(force)}[kind]


def quantity(symbol: str, history: History) -> Floats:
    """(M,) of a symbol of the grammar; NaN where it was not recorded."""
    driver = history.driver
    if symbol == driver_symbol(history):
        return driver
    if symbol == "t":
        return history.middle
    if symbol.startswith("lp"):
        memory, of = float(symbol[2 : symbol.index("(")]), symbol[symbol.index("(") + 1 : -1]
        return lowpass(driver * np.abs(driver) if is_square(of) else np.abs(driver), history.dt, memory)[1]
    out: Floats = history.others.get(CHANNELS[symbol][0], np.full(driver.size, np.nan))
    return out


def is_square(of: str) -> bool:
    """Whether what a low-pass is of goes as the square of the driver.

    >>> is_square("V|V|"), is_square("|V|")
    (True, False)
    """
    return not of.startswith("|")


def driver_symbol(history: History) -> str:
    """The letter for what drives a run in a formula: n for a rotation rate, else V."""
    return "n" if history.driver_quantity == "rotation_rate" else "V"


def covariate_of(symbol: str) -> str:
    """The covariate over which what a symbol leaves would be seen."""
    if symbol in CHANNELS:
        return CHANNELS[symbol][0]
    return {"t": "time", "V": "command_voltage"}.get(symbol, "load_history")
