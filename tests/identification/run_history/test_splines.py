"""Own splines against scipy.interpolate, which the diagnosis does not load."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from identification.run_history.splines import spline


@pytest.mark.parametrize("knots", [2, 3, 4, 9])
@pytest.mark.parametrize("columns", [(), (3,)])
def test_a_cubic_is_scipys_natural_spline_and_constant_beyond(knots: int, columns: tuple[int, ...]) -> None:
    rng = np.random.default_rng(knots)
    at = np.cumsum(rng.uniform(0.2, 2.0, knots))
    heights = rng.standard_normal((knots, *columns))
    over = np.linspace(at[0] - 1, at[-1] + 1, 301)
    wanted = CubicSpline(at, heights, bc_type="natural")(np.clip(over, at[0], at[-1]))
    np.testing.assert_allclose(spline(over, at, heights, 3), wanted, atol=1e-12)


def test_straight_lines_are_those_of_interp() -> None:
    rng = np.random.default_rng(0)
    at, heights = np.cumsum(rng.uniform(0.2, 2.0, 6)), rng.standard_normal((6, 4))
    over = np.linspace(at[0] - 1, at[-1] + 1, 301)
    wanted = np.column_stack([np.interp(over, at, column) for column in heights.T])
    np.testing.assert_allclose(spline(over, at, heights, 1), wanted, atol=1e-12)
