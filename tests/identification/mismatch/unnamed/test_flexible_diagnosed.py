"""Flexible terms end to end: they predict what was not fitted, a twin keeps them, a formula takes their place."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from identification.flexible_terms.formula import Monomial
from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.compare.simulation import Drive, Prediction, others_of, simulate
from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.model.data import Data
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.prepare.scales import scale_of
from identification.mismatch.unnamed.formula import term_of
from identification.physics.term import TermContext
from identification.recording import Channel
from identification.run_history.remembered import RememberedRun
from rig.diagnose.report.page import diagnosis_page
from rig.diagnose.text import diagnosis_text
from rig.errors import TwinError
from rig.twin.reading import read_twin
from rig.twin.writing import twin_json, write_twin
from tests.identification.diagnosed_runs import C, run

QUIET = 0.2
"""N: five samples a second at this tell as much as ten at the noise of other runs, in a third of the time."""


def diagnosed(*runs, **how):
    found = diagnose(runs, **how)
    assert isinstance(found, Diagnosis), found
    return found


@pytest.fixture(scope="module")
def wave():
    """A gain that comes and goes."""
    recording = run(lambda t, _V, F: F * (1 + 0.05 * np.sin(2 * np.pi * t / 80)), seconds=150.0, rate=5.0, noise=QUIET)
    return recording, diagnosed(recording)


def test_the_fit_improves_on_what_was_not_fitted(wave):
    _, found = wave
    left = found.unexplained
    assert found.verdict == "unexplained"
    assert found.model_terms == ("flexible:time",)
    assert found.heldout.after < min(1.15 * found.heldout.noise, 0.9 * left.heldout_without)
    (shape,) = left.flexible
    assert shape.covariate == "time"
    (curve,) = shape.splines
    truth = 0.05 * np.sin(2 * np.pi * curve.at / 80)
    assert curve.times == "gain"
    assert np.std(curve.value - truth) < 0.005
    assert np.mean(np.abs(curve.value - truth - np.mean(curve.value - truth)) < 3 * curve.std + 0.003) > 0.9
    assert left.formula is None, "a wave is none of the grammar"


def test_the_answer_says_so_in_json_text_and_page(wave):
    _, found = wave
    told = json.loads(json.dumps(diagnosis_json(found), allow_nan=False))
    free = told["unexplained"]["flexible"]
    assert {"covariate", "unit", "knots", "coefficients", "table"} <= set(free)
    assert told["model"]["terms"] == ["flexible:time"]
    assert all(f"flexible:time.{name}" in told["model"]["parameters"] for name in free["coefficients"])
    text = diagnosis_text(found)
    assert "A free curve over time" in text
    assert "flexible:time" in text
    page = diagnosis_page(found)
    assert any("Free curve over time" in getattr(part, "title", "") for s in page.sections for part in s.parts)


def test_a_twin_keeps_it_and_simulates_it(wave, tmp_path):
    recording, found = wave
    path = tmp_path / "T1.twin.json"
    write_twin(found.twin, path)
    twin = read_twin(path)
    assert replace(twin, origin=found.twin.origin) == found.twin
    command = recording.first_of("command_voltage")
    thrust = recording.first_of("thrust")
    made = simulate(twin, Drive(command.time, command.value, others=others_of(recording)), thrust.time)
    assert isinstance(made, Prediction)
    error = thrust.value - made.thrust - found.twin.sources[0].tare
    assert np.std(error) < 1.15 * QUIET
    again = diagnosed(recording, baseline=twin)
    assert again.verdict == "adequate"
    assert again.baseline["flexible:time." + twin.terms[0].term.parameters(twin.terms[0].scale)[0].name].std > 0


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("knots", [3.0, 1.0], "ascending"),
        ("zero", [99], "places in knots"),
        ("times", ["magic"], "force, gain"),
        ("degree", 2, "1 or 3"),
        ("quantity", "flow_speed", "as its shape is"),
    ],
)
def test_a_twin_whose_shape_is_wrong_is_refused(wave, tmp_path, key, value, says):
    content = twin_json(wave[1].twin)
    content["terms"][0]["flexible"] = {**content["terms"][0]["flexible"], key: value}
    path = tmp_path / "wrong.json"
    path.write_text(json.dumps(content))
    with pytest.raises(TwinError, match=says):
        read_twin(path)


def warming(seconds=150.0):
    """Water that warms and cools."""
    t = np.arange(0.0, seconds, 1.0)
    return Channel(
        "water_temperature", "thermometer", "water_temperature", "degC", t, 15 + 4 * np.sin(t / 9) + 0.01 * t
    )


def test_water_temperature_squared_is_a_formula():
    water = warming()

    def colder(t, _V, F):
        return F * (1 - 0.003 * (np.interp(t, water.time, water.value) - 13.0) ** 2)

    found = diagnosed(run(colder, extra=(water,), rate=10.0))
    left = found.unexplained
    assert found.findings == ()
    assert left.where.quantity == "water_temperature"
    formula = left.formula
    assert formula is not None
    assert formula.text.startswith("residual = ")
    assert "T_w" in formula.text
    assert "V|V|" in formula.text
    a, middle = formula.coefficients["a"], formula.coefficients["T_w_0"]
    assert abs(a.value + 0.003 * C) < 3 * a.std < 0.3 * C * 0.003
    assert abs(middle.value - 13.0) < 3 * middle.std < 1.0
    assert f"+- {middle.std:.2g}) degC)^2" in formula.text
    assert formula.heldout_after < formula.heldout_before
    told = diagnosis_json(found)["unexplained"]["formula"]
    assert told["text"] == formula.text
    assert "formula (not a physics)" in diagnosis_text(found)
    assert any("not a physics" in str(part) for s in diagnosis_page(found).sections for part in s.parts)


def test_a_formula_counts_its_gain_from_the_middle_of_the_data():
    """Counted from 0 degC it would make C another, and with it the response to a tick of the command."""
    history = history_of(run(lambda _t, _V, F: F, extra=(warming(),)))
    monomials = (Monomial((("T_w", 1),), "F"), Monomial((("T_w", 2),), "F"))
    data = Data((history,), scale_of((RememberedRun(history),), C))
    term = term_of(monomials, {"T_w": 20.0}, data)
    size = data.scale.driver
    now = TermContext(RememberedRun(history), data.scale, C, 0.0, np.full(history.driver.size, size))
    gain = term.apply(np.ones(history.driver.size), now, (3.0, -2.0))[data.rows[0]]
    assert abs(np.mean(gain) - 1) < 1e-9
    assert np.ptp(gain) > 0.1


def dented(seed):
    """20 % less at +8 V only."""
    return run(lambda _t, V, F: F * (1 - 0.2 * ((V > 7) & (V < 9))), seed=seed, seconds=80.0, rate=5.0, noise=QUIET)


def test_a_run_that_was_not_fitted_judges_the_flexible_term():
    found = diagnosed(dented(0), holdout=(dented(1),))
    left = found.unexplained
    assert left.flexible[0].covariate == "command_voltage"
    assert found.heldout.after < 0.5 * left.heldout_without
    assert "whole runs" in found.heldout.what


@pytest.mark.parametrize("step", [0.93, 1.07])
def test_a_step_in_gain_is_no_formula(step):
    """A supply that falls as it is drawn on does most of a gain that falls, and nothing of one that rises."""
    found = diagnosed(run(lambda t, _V, F: F * np.where(t < 70, 1.0, step), rate=20.0))
    left = found.unexplained
    assert found.verdict == "unexplained"
    assert {f.effect for f in found.findings} <= ({"supply_sag"} if step < 1 else set())
    assert all(f.grade == "mostly" and "time" in " ".join(f.doubts) for f in found.findings)
    assert left.where.quantity == "time"
    assert left.formula is None
    assert found.heldout.after < 0.6 * found.heldout.before


def test_a_jump_of_the_reading_gets_knots_beside_it():
    jumping = run(lambda t, _V, F: F + np.where(t > 188.3, 0.6, 0.0), seconds=300.0, rate=20.0)
    left = diagnosed(jumping, without=("zero_offset", "zero_drift")).unexplained
    assert left.where.quantity == "time"
    (shape,) = left.flexible
    assert any(0 < b - a < 1.0 and abs(a - 188.3) < 1.0 for a, b in pairwise(shape.knots))
