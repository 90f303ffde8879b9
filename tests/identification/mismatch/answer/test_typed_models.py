"""A whole model as lines to be typed in is what the engine predicts, and what a diagnosis says."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.answer.equations import equations_of
from identification.mismatch.compare.saved_model_baseline import given
from identification.mismatch.compare.simulation import waves
from identification.mismatch.diagnosis import Equation
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import predict
from identification.run_history.remembered import RememberedRun
from identification.twin import TERMS, Source, Twin, TwinLine, TwinNoise, TwinTerm, names_of
from tests.identification.physics.every_channel import DT, OTHERS, RATE, RUN, SCALE, C, T, V
from tests.identification.physics.test_equations import PLAIN
from tests.identification.physics.typed_in import Typed

TARE = 0.37
CLOSE = 5e-6
"""Of full thrust: a dozen terms, each with six digits and states that are means over 5 ms."""


def twin(*effects, driver="command_voltage", lines=(), scale=SCALE):
    terms = []
    for effect, form in effects:
        term = TERMS[effect, form]
        values = dict(zip((p.name for p in term.parameters(scale)), PLAIN[effect, form], strict=True))
        terms.append(TwinTerm(effect, form, values, scale))
    names, rate = names_of(tuple(terms)), None if driver == "rotation_rate" else RATE
    none = tuple((0.0,) * len(names) for _ in names)
    noise, sources = TwinNoise(0.01, 0.0), (Source("made", tare=TARE),)
    return Twin("T", driver, C, tuple(terms), names, none, noise, sources, DT, 12.0, rate, lines=lines)


def predicted(model, run=RUN):
    F, x = predict(Model((), given(model)), Theta(C, (), (TARE,)), RememberedRun(run), SCALE, TARE)
    return F + TARE + waves(model, run, x, T)


def typed(model, **channels):
    equations = equations_of(model, {"made": TARE}, OTHERS)
    return Typed(DT, **{"command_voltage": V, **OTHERS, **channels}).run([e.line for e in equations])


FIXED = TwinLine(1.3, 0.01, 7.3, 0.001, phase=-0.4)
BLADES = TwinLine(2.1, 0.01, 30.0, 0.1, ratio=3.01, phase=0.7, growth=2.0, at_speed=24.0)
SHAFT = TwinLine(0.9, 0.01, 10.0, 0.1, ratio=0.5, turns="V s")
MODELS = {
    "a motor that warms up, on a stand that rings": twin(
        ("command_saturation", "knee"),
        ("dead_band", "shrink"),
        ("winding_resistance", ""),
        ("heating", "winding_and_magnet"),
        ("motor_lag", "mixed"),
        ("asymmetry", ""),
        ("inflow_dynamics", "momentum"),
        ("recirculation", "thrust"),
        ("stand_resonance", ""),
        ("hysteresis", ""),
        ("load_cell_creep", "two_constants"),
        ("zero_drift", "exponential"),
        ("load_cell_saturation", "knee"),
    ),
    "a supply and a flow": twin(
        ("supply_sag", "buffered"),
        ("dead_band", "jump"),
        ("motor_lag", "first_order"),
        ("exponent", ""),
        ("cavitation", "square"),
        ("reversal_loss", "step"),
        ("speed_of_advance", ""),
        ("strut_drag", ""),
        ("time_skew", ""),
        ("load_cell_nonlinearity", "cubic"),
        ("load_cell_saturation", "hard"),
    ),
    "two lags and a line": twin(("motor_lag", "first_order"), ("motor_lag", "quadratic"), lines=(FIXED, SHAFT)),
    "nothing": twin(),
}


@pytest.mark.parametrize("of", MODELS)
def test_a_whole_model_is_what_the_engine_predicts(of):
    model = MODELS[of]
    assert typed(model)["thrust"] == pytest.approx(predicted(model), abs=CLOSE * SCALE.thrust)


def test_a_model_that_a_rate_drives_with_a_line_that_turns_with_it():
    n, scale = OTHERS["rotation_rate"], replace(SCALE, driver=24.0, driver_unit="rev/s")
    model = twin(
        *(("asymmetry", ""), ("load_cell_creep", "one_constant")), driver="rotation_rate", lines=(BLADES,), scale=scale
    )
    run = replace(RUN, driver_quantity="rotation_rate", driver=n)
    assert typed(model)["thrust"] == pytest.approx(predicted(model, run), abs=CLOSE * SCALE.thrust)
    assert equations_of(model, {})[:2] == (
        Equation("n = rotation_rate  # rev/s, straight from row to row; recorded up to 12"),
        Equation("x = n"),
    )


def test_a_thrust_that_follows_the_measured_rate_of_a_rotor_that_lags():
    """The engine takes noise out of the rate: between two steps that is all that they differ by."""
    model = replace(twin(("motor_lag", "first_order"), ("rotation_coupling", "")), slip_rate_per_driver=RATE)
    lagging = typed(model)["V"]  # what the second term makes its rate of
    rate = RATE * lagging * (1 + 0.1 * np.sin(T))
    run = replace(RUN, rate=rate, others={**OTHERS, "rotation_rate": rate})
    off = np.abs(typed(model, rotation_rate=rate)["thrust"] - predicted(model, run))
    assert np.median(off) < CLOSE * SCALE.thrust
    assert np.max(off) < 5e-4 * SCALE.thrust


def test_each_line_says_whose_it_is_and_each_run_has_its_tare():
    model = twin(("dead_band", "shrink"), ("motor_lag", "first_order"), lines=(FIXED,))
    assert equations_of(model, {"a": 0.5, "b": -0.25}) == (
        Equation("V = command_voltage  # V, held until its next row; recorded up to 12"),
        Equation("V = sign(V) * maximum(abs(V) - 1.31, 0)", "dead_band"),
        Equation("d(x)/dt = (V - x) / 0.12, x(0) = V(0)", "motor_lag"),
        Equation("F = 0.5 * x * abs(x)  # N; x: the rotor's rate, as the V that would keep it"),
        Equation("tare = 0.5  # N, of run a; none of the thruster's"),
        Equation("tare = -0.25  # N, of run b; none of the thruster's"),
        Equation("F = F + 1.3 * sin(2 * pi * 7.3 * t - 0.4)", "periodic_disturbance"),
        Equation("thrust = F + tare"),
    )


def test_lines_see_what_the_winding_of_the_model_takes():
    """Another term says it: the cold winding is not taken to be a typical one."""
    known, taken = (
        [e.line for e in equations_of(twin(*effects, ("heating", "winding")), {}) if e.effect == "heating"]
        for effects in ([("winding_resistance", "")], [])
    )
    assert any("+ 0.031 *" in line for line in known)
    assert not any("taken to lose" in line for line in known)
    assert any("taken to lose 15 %" in line for line in taken)


def test_a_value_that_is_a_hundredth_off_is_seen():
    model = MODELS["a supply and a flow"]
    (first, *rest) = model.terms
    off = replace(model, terms=(replace(first, parameters={**first.parameters, "exponent": 1.111}), *rest))
    assert np.max(np.abs(typed(off)["thrust"] - predicted(model))) > 3 * CLOSE * SCALE.thrust
