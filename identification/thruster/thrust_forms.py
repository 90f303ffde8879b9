"""The thruster models: which coefficients, in which unit, multiply which signals of voltage V or rotation rate n.

Steady thrust is linear in its coefficients (section 4.2.2): tau = C V|V| (eq. 4.14), one C for each direction,
tau = C_t n|n|, and tau = C_t n|n| - C_s |n| U with the velocity of advance U (Fossen's bilinear model).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from identification.recording import Floats

Model = Literal["C V|V|", "C+/C-", "C V|V| - C_s|V|U", "C+/C- - C_s|V|U"]
"""One coefficient, or one for each direction; without or with the flow term. V stands for n where n explains."""
MODELS: tuple[Model, ...] = ("C V|V|", "C+/C-", "C V|V| - C_s|V|U", "C+/C- - C_s|V|U")
HARDLY_DRIVEN = 0.05
"""Share of the other direction's largest voltage or rate up to which a direction counts as not driven."""


@dataclass(frozen=True, slots=True)
class Form:
    """How a model is called, its coefficients and their units."""

    name: str
    coefficients: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def split(self) -> bool:
        """One coefficient for each direction: the first two."""
        return len(self.coefficients) > 1 and self.coefficients[1].endswith("_minus")

    @property
    def with_flow(self) -> bool:
        return self.coefficients[-1] == "C_s"


_V, _N = "N/V^2", "N.s^2/rev^2"
_VU, _NU = "N.s/(V.m)", "N.s^2/(rev.m)"
FORMS: dict[tuple[Model, bool], Form] = {
    ("C V|V|", False): Form("C V|V|", ("C",), (_V,)),
    ("C+/C-", False): Form("C+/C-", ("C_plus", "C_minus"), (_V, _V)),
    ("C V|V| - C_s|V|U", False): Form("C V|V| - C_s|V|U", ("C", "C_s"), (_V, _VU)),
    ("C+/C- - C_s|V|U", False): Form("C+/C- - C_s|V|U", ("C_plus", "C_minus", "C_s"), (_V, _V, _VU)),
    ("C V|V|", True): Form("C_t n|n|", ("C_t",), (_N,)),
    ("C+/C-", True): Form("C_t+/C_t-", ("C_t_plus", "C_t_minus"), (_N, _N)),
    ("C V|V| - C_s|V|U", True): Form("C_t n|n| - C_s|n|U", ("C_t", "C_s"), (_N, _NU)),
    ("C+/C- - C_s|V|U", True): Form("C_t+/C_t- - C_s|n|U", ("C_t_plus", "C_t_minus", "C_s"), (_N, _N, _NU)),
}
"""By model and whether it is explained by rotation rate n in rev/s."""


def directions(square: Floats) -> list[Floats]:
    """V|V| of each direction; one that was hardly driven (noise about rest, an overshoot) tells nothing: zeros.

    >>> [side.tolist() for side in directions(np.array([4.0, -1.0]))]
    [[4.0, 0.0], [0.0, -1.0]]
    """
    sides = [np.maximum(square, 0.0), np.minimum(square, 0.0)]
    most = max(float(np.abs(side).max()) for side in sides)
    return [side if np.abs(side).max() > HARDLY_DRIVEN**2 * most else np.zeros_like(side) for side in sides]


def columns(form: Form, level: Floats, flow: Floats | None) -> list[Floats]:
    """Signal (n,) of each coefficient at levels (n,) V or rev/s and flow (n,) m/s. ValueError without a flow it needs.

    >>> form = FORMS["C V|V| - C_s|V|U", True]
    >>> [c.tolist() for c in columns(form, np.array([2.0, -3.0]), np.array([0.5, 0.5]))]
    [[4.0, -9.0], [-1.0, -1.5]]
    """
    square = level * np.abs(level)
    found = directions(square) if form.split else [square]
    if form.with_flow:
        if flow is None:
            raise ValueError(f"columns: {form.name} needs the flow")
        found.append(-np.abs(level) * flow)
    return found


def model_of(form: Form) -> Model:
    """The model a form belongs to."""
    return next(model for (model, _), other in FORMS.items() if other == form)
