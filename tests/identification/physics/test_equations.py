"""What each term says of itself as lines to be typed in is what it does, line by line evaluated by another program."""

import re

import numpy as np
import pytest

from identification.flexible_terms.flexible import MULTIPLIERS, Flexible, turned
from identification.flexible_terms.formula import Formula, Monomial
from identification.physics.catalogue import CATALOGUE
from identification.physics.term import EquationContext, TermContext
from identification.run_history.remembered import RememberedRun
from identification.run_history.splines import spline
from tests.identification.physics.every_channel import DT, OTHERS, RATE, RUN, SCALE, UNREFERRED, C, T, V, with_only
from tests.identification.physics.typed_in import Typed, code_of

TARE = 1.5
WIDEST = 98
"""Columns that a line may take, without its comment: the text of a diagnosis indents it by two."""
PLAIN = {
    ("command_saturation", "hard"): (8.3,),
    ("command_saturation", "knee"): (0.21, 6.1),
    ("supply_sag", ""): (0.93,),
    ("supply_sag", "buffered"): (1.1, 0.04),
    ("supply_sag", "discharge"): (0.31,),
    ("supply_sag", "loaded"): (0.12,),
    ("dead_band", "shrink"): (1.31,),
    ("dead_band", "jump"): (2.63,),
    ("winding_resistance", ""): (0.031,),
    ("heating", "winding"): (0.13, 9.0),
    ("heating", "magnet"): (0.041, 9.0, 7.0),
    ("heating", "winding_and_magnet"): (0.13, 9.0, 0.041, 7.0),
    ("heating", "own_winding"): (0.13, 9.0, 0.23),
    ("heating", "measured_winding"): (0.0123,),
    ("heating", "measured_magnet"): (0.0021, 7.0),
    ("heating", "measured_winding_and_magnet"): (0.0123, 0.0021, 7.0),
    ("heating", "measured_own_winding"): (0.0123, 0.23),
    ("motor_lag", "first_order"): (0.12,),
    ("motor_lag", "quadratic"): (0.12,),
    ("motor_lag", "mixed"): (0.12, 0.37),
    ("motor_lag", "coasting"): (0.12, 0.37, 0.71),
    ("rotation_coupling", ""): (0.83,),
    ("exponent", ""): (1.83,),
    ("asymmetry", ""): (0.81,),
    ("inflow_dynamics", ""): (0.33, 0.21),
    ("inflow_dynamics", "momentum"): (0.33, 0.21),
    ("cavitation", "linear"): (0.051, 7.3),
    ("cavitation", "square"): (0.091, 7.3),
    ("reversal_loss", "wake"): (0.37, 0.9),
    ("reversal_loss", "step"): (0.37, 0.9),
    ("linear_term", ""): (-0.37,),
    ("speed_of_advance", ""): (0.91,),
    ("recirculation", "rate"): (0.083, 4.1),
    ("recirculation", "thrust"): (0.083, 4.1),
    ("recirculation", "circuit"): (0.083, 4.1),
    ("thruster_interaction", ""): (0.21,),
    ("strut_drag", ""): (-3.7,),
    ("torque_crosstalk", ""): (-0.021,),
    ("torque_crosstalk", "measured"): (1.7,),
    ("stand_resonance", ""): (0.87, 3.1, 0.07),
    ("hysteresis", ""): (1.3,),
    ("time_skew", ""): (0.0473,),
    ("load_cell_creep", "one_constant"): (-0.043, 6.1),
    ("load_cell_creep", "two_constants"): (0.043, 3.1, 0.021, 17.0),
    ("load_cell_nonlinearity", "quadratic"): (-0.0011,),
    ("load_cell_nonlinearity", "cubic"): (0.000013,),
    ("load_cell_even_bend", ""): (0.00043,),
    ("zero_drift", "linear"): (-0.13,),
    ("zero_drift", "exponential"): (2.1, 6.3),
    ("zero_offset", ""): (-2.3, 7.77),
    ("load_cell_saturation", "hard"): (51.3,),
    ("load_cell_saturation", "before_noise"): (51.3,),
    ("load_cell_saturation", "averaged"): (51.3, 2.3),
    ("load_cell_saturation", "knee"): (0.031, 33.1),
    ("load_cell_saturation", "off_centre"): (51.3, -2.7),
    ("load_cell_saturation", "off_centre_before_noise"): (51.3, 2.7),
}
"""Values that are plain to see."""
DIGITS = 22 / 21
"""Times them: numbers that six digits do not hold."""
PRINTED = 5e-6
"""Of full thrust or full drive: six digits, and 1e-6 of the limit by which the engine rounds an edge."""
INTEGRATED = 2e-5
"""The same where a state is integrated (one that follows another takes its means over 5 ms for what it is), or a step
comes late: by the last digit of the delay."""
SMOOTHED = 5e-4
"""The same where the engine takes the noise out of a measured rate."""
DYNAMIC = ("d(", "delayed(")
SMOOTHING = {"rotation_coupling"}
"""It follows the measured rate without its noise, which no line can say."""


def name(term):
    return f"{term.id}-{term.form}" if term.form else term.id


def context(scale, winding=None, quantities=OTHERS):
    return EquationContext(scale, C, "command_voltage", winding, RATE, frozenset(quantities))


def done(term, theta, scale, winding=None, run=RUN):
    """What the engine makes of the value of its stage."""
    term = term.sharp() if term.traits.spread else term
    value = V if term.stage in ("command", "rotor") else C * V * np.abs(V)
    return term.apply(value, TermContext(RememberedRun(run), scale, C, TARE, V, winding), theta)


def typed(lines, **more):
    known = {"V": V, "x": V, "F": C * V * np.abs(V), "tare": TARE, "command_voltage": V, **OTHERS, **more}
    return Typed(DT, **known).run(lines)


def variable(term):
    return {"command": "V", "rotor": "x"}.get(term.stage, "F")


def close(term, lines, expected, mask=slice(None)):
    got = typed(lines)[variable(term)]
    full = SCALE.driver if term.stage in ("command", "rotor") else SCALE.thrust
    tolerance = INTEGRATED if any(word in line for line in lines for word in DYNAMIC) else PRINTED
    tolerance = SMOOTHED if term.id in SMOOTHING else tolerance
    assert np.max(np.abs(got - expected)[mask]) < tolerance * full, lines


def settled(term, theta):
    """(M,) where a jump that the engine spreads over 1/500 of the run is over."""
    if not term.traits.instant:
        return np.ones(T.size, dtype=bool)
    at = theta[[p.name for p in term.parameters(SCALE)].index(term.traits.instant)]
    return np.abs(T - at) > 2e-3 * SCALE.duration


def test_every_term_is_asked():
    assert set(PLAIN) == {(term.id, term.form) for term in CATALOGUE}


@pytest.mark.parametrize("term", CATALOGUE, ids=name)
def test_its_lines_do_what_it_does(term):
    """With all channels and with those that it needs, beside a winding that is known and one that is not, with sizes
    that are known and those of each run: where that is another equation."""
    theta = tuple(DIGITS * value for value in PLAIN[term.id, term.form])
    asked = {}
    for scale in (SCALE, UNREFERRED):
        for winding in (None, 0.021):
            for quantities in (frozenset(OTHERS), frozenset(term.needs)):
                lines = term.equation(theta, context(scale, winding, quantities))
                asked.setdefault(tuple(map(code_of, lines)), (scale, winding, quantities))
    assert np.max(np.abs(done(term, theta, SCALE) - (V if variable(term) != "F" else C * V * np.abs(V)))) > 1e-3
    for lines, (scale, winding, quantities) in asked.items():
        expected = done(term, theta, scale, winding, with_only(quantities))
        close(term, lines, expected, settled(term, theta))


@pytest.mark.parametrize("term", CATALOGUE, ids=name)
def test_its_lines_have_room_and_no_number_of_more_digits(term):
    for line in term.equation(tuple(v / 3 for v in PLAIN[term.id, term.form]), context(SCALE)):
        assert len(code_of(line)) <= WIDEST
        for number in re.findall(r"\d[\d.]*", code_of(line)):
            assert len(number.replace(".", "").lstrip("0")) <= 6


@pytest.mark.parametrize("term", CATALOGUE, ids=name)
def test_a_rate_that_drives_is_called_n(term):
    model = EquationContext(SCALE, C, "rotation_rate")
    lines = [code_of(line) for line in term.equation(PLAIN[term.id, term.form], model)]
    assert not any(re.search(r"\bV\b|command_voltage", line) for line in lines)


def test_nothing_lags_a_rotor_that_follows_at_once():
    lag = next(t for t in CATALOGUE if t.id == "motor_lag")
    assert lag.equation((0.0,), context(SCALE)) == ("x = V",)


COVARIATES = {
    "time": (0.0, 8.0, 20.0),
    "command_voltage": (-12.0, 0.0, 12.0),
    "previous_voltage": (-12.0, 0.0, 12.0),
    "bus_voltage": (26.0, 28.0, 31.0),
    "load_history": (0.0, 0.3, 1.0),
}


@pytest.mark.parametrize("quantity", COVARIATES)
@pytest.mark.parametrize("times", [(m,) for m in MULTIPLIERS if m != "reversed"] + [("force", "gain")], ids="+".join)
def test_a_free_shape_acts_where_its_line_says(quantity, times):
    """The curve itself is a table: it is given here."""
    zero = (1,)
    term = Flexible(quantity, "1", COVARIATES[quantity], zero, times, memory=3.0)
    theta = tuple(0.1 * (i + 1) for i, _ in enumerate(term.parameters(SCALE)))
    _acts(term, theta, np.ones(T.size, dtype=bool))


def test_a_free_shape_of_what_turned_round_acts_where_its_line_says():
    term = Flexible("time_since_step", "s", (0.01, 0.5, 3.0), (2,), ("reversed",))
    _acts(term, (0.3, 0.1), turned(RUN, V, SCALE)[1])


def _acts(term, theta, mask):
    (line,) = term.equation(theta, context(SCALE))
    assert line.endswith("  # curve: the table of what is not explained")
    over, curves, at = term.over(RememberedRun(RUN), V, SCALE), {}, 0
    for m in term.times:
        free, heights = term.free(m), np.zeros(len(term.knots))
        heights[list(free)] = theta[at : at + len(free)]
        at += len(free)
        curves["curve" if len(term.times) == 1 else f"curve_{m}"] = _curve(term, heights)
    got = typed([line], **{"previous_voltage": RUN.previous, term.quantity: over, **curves})
    expected = done(term, theta, SCALE)
    assert got[variable(term)][mask] == pytest.approx(expected[mask], abs=INTEGRATED * SCALE.thrust)


def _curve(term, heights):
    return lambda over: spline(term.axis(over), term.axis(np.array(term.knots)), heights, term.degree)


def test_a_formula_is_what_its_line_says():
    monomials = (
        Monomial((("T_w", 2), ("V_b", 1)), "F"),
        Monomial((("V", 1), ("t", 1)), "1"),
        Monomial((("lp5(V|V|)", 1),), "|F|"),
        Monomial((("lp20(|V|)", 2),), "1"),
    )
    sizes = (("T_w", 16.0), ("V_b", 30.0), ("V", 12.0), ("t", 20.0), ("lp5(V|V|)", 144.0), ("lp20(|V|)", 12.0))
    term = Formula(monomials, sizes, (0.9, 0.0, 0.0, 0.0))
    theta = (0.3, -2.0, 0.1, 3.0)
    (line,) = term.equation(theta, context(SCALE))
    expected = done(term, theta, SCALE)
    assert typed([line])["F"] == pytest.approx(expected, abs=INTEGRATED * SCALE.thrust)
