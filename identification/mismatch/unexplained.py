"""What no name carries: where it is, its shape, and the flexible terms or the formula that model it. Data only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.mismatch.value import Value, Where, told_rows
from identification.recording import Floats


@dataclass(frozen=True, eq=False)
class Spline:
    """What a flexible term multiplies by, over its covariate."""

    times: str
    """`force` (1), `gain` (thrust), `even` (|thrust|), `step` (change of thrust), `rate` (|drive|) or `drive`."""
    what: str
    """The same as a clause."""
    unit: str
    at: Floats
    value: Floats
    std: Floats
    """The curve, (n,) each."""
    table: tuple[tuple[float, float, float, float], ...]
    """(covariate, value of the spline, value measured there, its standard error) bin by bin."""

    @property
    def told(self) -> NDArray[np.bool_]:
        """Which rows of the table the data determine."""
        _, _, measured, std = np.array(self.table).reshape(-1, 4).T
        return told_rows(measured, std)

    @property
    def drawn(self) -> NDArray[np.bool_]:
        """Which points of the curve they do."""
        return told_rows(self.value, self.std)


@dataclass(frozen=True, eq=False)
class FlexibleShape:
    """A flexible term of the final model: a spline over a covariate, no physics."""

    covariate: str
    unit: str
    knots: tuple[float, ...]
    degree: int
    memory: float
    """s, of load_history; otherwise 0."""
    period: float
    """s after which a spline over time begins anew; 0: never."""
    coefficients: Mapping[str, Value]
    splines: tuple[Spline, ...]
    statement: str


@dataclass(frozen=True, eq=False)
class FormulaFound:
    """A formula that agrees with held-out data and in both halves; a formula, not a physics."""

    text: str
    """`residual = ...`"""
    symbols: str
    """What its symbols stand for: `T_w: water_temperature`."""
    coefficients: Mapping[str, Value]
    bic_gain: float
    heldout_before: float
    heldout_after: float
    """RMSE per sample on what was not fitted, without and with the formula alone, N."""
    halves_p: float
    """p-value of the same coefficients in both halves."""
    equals: tuple[str, ...] = ()
    """Other formulas that do about as well."""


@dataclass(frozen=True, eq=False)
class Remainder:
    """Structure that no term of the catalogue carries."""

    where: Where
    share: float
    p_value: float
    shape: tuple[tuple[float, float, float], ...]
    """(covariate, mean residual in N, its standard error) bin by bin."""
    statement: str
    resembles: tuple[str, ...] = ()
    """Effects that fit but whose name was not earned, each with the reason."""
    flexible: tuple[FlexibleShape, ...] = ()
    """Of the final model, the clearest first; empty where none predicts better what was not fitted."""
    equals: tuple[str, ...] = ()
    """Coordinates over which the first flexible term would have done about as well."""
    replaces: tuple[str, ...] = ()
    """Effects whose name was not earned and whose place the flexible terms take."""
    heldout_without: float | None = None
    """RMSE per sample on what was not fitted, without the flexible terms, N."""
    formula: FormulaFound | None = None
    unpredictive: bool = False
    """Whether nothing is left in what was fitted, but the model of it predicts what was not fitted worse, or far from
    as well as noise allows."""

    @property
    def told(self) -> NDArray[np.bool_]:
        """Which rows of the shape the data determine; one that is 0 by choice has no error."""
        _, residual, std = np.array(self.shape).reshape(-1, 3).T
        return np.asarray(told_rows(residual, std) | ((residual == 0) & np.isinf(std)))
