"""Flexible terms: knots where the shape is, a model that predicts what was not fitted, a twin that keeps it."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from identification.flexible_terms.flexible import MULTIPLIERS, Flexible, turned
from identification.flexible_terms.formula import Monomial
from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.compare.simulation import Drive, Prediction, others_of, simulate
from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.model.data import Data
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.prepare.scales import scale_of
from identification.mismatch.unnamed.formula import monomials_of, term_of
from identification.mismatch.unnamed.spline_knot_selection import Moments, choose, heights, nodes_of
from identification.physics.term import Scale, TermContext
from identification.recording import Channel
from identification.run_history.history import History
from identification.run_history.remembered import RememberedRun
from identification.run_history.splines import spline
from rig.diagnose.report.page import diagnosis_page
from rig.diagnose.text import diagnosis_text
from rig.errors import TwinError
from rig.twin.reading import read_twin
from rig.twin.writing import twin_json, write_twin
from tests.identification.diagnosed_runs import C, run


def diagnosed(*runs, **how):
    found = diagnose(runs, **how)
    assert isinstance(found, Diagnosis), found
    return found


# ---------------------------------------------------------------- knots


def moments(x, y, noise, constant=False):
    """Of hats over x against y with white noise; constants are projected out unless they are part of the spline."""
    nodes = nodes_of(x)
    hats = spline(x, nodes, np.eye(nodes.size), 1) / noise
    if not constant:
        hats = hats - hats.mean(axis=0)
        y = y - y.mean()
    return Moments(nodes, hats.T @ hats, hats.T @ (y / noise), x.size, (constant,))


def fitted(x, y, noise=0.1):
    m = moments(x, y, noise)
    found = choose(m)
    knots = m.nodes[list(found.knots)]
    values = heights(m, found.knots, found.degree, [tuple(range(1, len(found.knots)))])
    return found, knots, spline(x, knots, np.array([0.0, *values]), found.degree)


def test_a_wave_takes_a_cubic_with_knots_along_it():
    x = np.linspace(0.0, 10.0, 1500)
    y = np.sin(x)
    found, knots, curve = fitted(x, y + 0.1 * np.random.default_rng(1).standard_normal(x.size))
    assert found.degree == 3
    assert 5 <= knots.size <= 12
    assert np.std(curve - y) < 0.02


def test_a_jump_takes_a_broken_line_with_two_knots_close_together():
    x = np.linspace(0.0, 10.0, 1500)
    y = np.where(x < 6.3, 0.0, 1.0)
    found, knots, curve = fitted(x, y + 0.1 * np.random.default_rng(1).standard_normal(x.size))
    assert found.degree == 1
    assert np.min(np.abs(knots - 6.3)) < 0.3
    assert np.std(curve - y) < 0.1


def test_noise_takes_no_knots_and_gains_nothing():
    x = np.linspace(0.0, 10.0, 1500)
    found, knots, _ = fitted(x, 0.1 * np.random.default_rng(3).standard_normal(x.size))
    assert found.gain < 0
    assert knots.size == 2


def test_levels_are_nodes_and_zero_stays_one():
    assert nodes_of(np.repeat([-2.0, 1.0], 20), (0.0,)).tolist() == [-2.0, 0.0, 1.0]
    assert nodes_of(np.linspace(-1, 1, 5000), (0.0,)).size <= 66


# ---------------------------------------------------------------- the term


def history(M=40, **others):
    edges = np.linspace(0.0, 20.0, M + 1)
    volts = np.where(edges[:-1] < 10, 4.0, -8.0)
    middle = 0.5 * (edges[1:] + edges[:-1])
    return History(
        "r",
        "command_voltage",
        edges,
        volts,
        np.zeros(M),
        np.ones(M, dtype=np.int64),
        middle,
        np.zeros(M),
        others=others,
    )


SCALE = Scale(8.0, "V", 32.0, 20.0, 0.5)


def lagging(F, dt, tau, parts=2000):
    """Means over intervals of y' = (F - y)/tau from 0, in small steps of the midpoint rule."""
    y, out = 0.0, []
    for f in F:
        total = 0.0
        for _ in range(parts):
            middle = y + 0.5 * (dt / parts) * (f - y) / tau
            y += (dt / parts) * (f - middle) / tau
            total += middle
        out.append(total / parts)
    return np.array(out)


@pytest.mark.parametrize("multiplier", MULTIPLIERS)
def test_what_a_spline_multiplies(multiplier):
    h = history()
    F = C * h.driver * np.abs(h.driver)
    expected = {
        "force": np.ones_like(F),
        "gain": F,
        "even": np.abs(F),
        "step": F - C * h.previous * np.abs(h.previous),
        "rate": np.abs(h.driver) / 8.0,
        "drive": np.ones_like(F),
        "reversed": np.where(
            np.where(F > 0, np.minimum.accumulate(h.driver) < 0, np.maximum.accumulate(h.driver) > 0), F, 0.0
        ),
        "late": lagging(F, 0.5, 2.0) - F,
    }[multiplier]
    term = Flexible("time", "s", (0.0, 5.0, 10.0), (0,), (multiplier,), degree=1, memory=2.0)
    known = term.parameters(SCALE)
    theta = tuple(0.1 * float(p.name.split("_")[-1]) for p in known)
    now = TermContext(RememberedRun(h), SCALE, C, 0.0, h.driver)
    moved = term.apply(F, now, theta) - F
    assert moved == pytest.approx(0.1 * np.minimum(h.middle, 10.0) * expected, rel=1e-5), "constant beyond the knots"
    assert term.apply(F, now, (0.0,) * len(known)) == pytest.approx(F)


@pytest.mark.parametrize(
    "quantity", ["time", "time_since_step", "previous_voltage", "direction", "direction_of_change", "load_history"]
)
def test_coordinates_that_every_run_has(quantity):
    h = history()
    term = Flexible(quantity, "1", (0.5, 2.0), (), ("force",), memory=5.0)
    assert term.over(RememberedRun(h), h.driver, SCALE).shape == h.driver.shape
    assert term.needs == ()
    assert term.trials(SCALE) == term.finer((0.0,), SCALE) == ()


def test_time_since_it_turned_the_other_way_is_seen_on_a_sine():
    """No step, and rests between: what was lost last is counted from the last interval of the other direction."""
    t = np.arange(0.0, 40.0, 0.5)
    V = 8.0 * np.sin(2 * np.pi * t / 20)
    h = history()
    h = replace(h, edges=np.append(t, 40.0), driver=V, thrust=V, count=np.ones(t.size, int), sampled=t, within=0.0 * t)
    since, known = turned(h, V, SCALE)
    assert not known[t < 10.0].any()
    assert known[t > 10.5].all()
    away = known & (np.abs(V) > 0.5)
    assert since[away] == pytest.approx((t[away] + 0.25) % 10.0, abs=0.76)
    term = Flexible("time_since_step", "s", (0.5, 10.0), (1,), ("reversed",))
    assert term.over(RememberedRun(h), V, SCALE) == pytest.approx(since)


def test_a_recorded_quantity_is_needed():
    term = Flexible("water_temperature", "degC", (10.0, 20.0), (0,), ("gain",))
    assert term.needs == ("water_temperature",)
    warm = history(water_temperature=np.full(40, 15.0))
    F = np.ones(40)
    assert term.apply(F, TermContext(RememberedRun(warm), SCALE, C, 0.0, F), (-0.2,)) == pytest.approx(0.9 * F)
    assert Flexible("rotation_rate", "V", (-1.0, 0.0), (1,), ("drive",)).stage == "rotor"


# ---------------------------------------------------------------- end to end


@pytest.fixture(scope="module")
def wave():
    """A gain that comes and goes."""
    recording = run(lambda t, _V, F: F * (1 + 0.05 * np.sin(2 * np.pi * t / 80)), seconds=150.0, rate=10.0)
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
    assert "A flexible term over time" in text
    assert "flexible:time" in text
    page = diagnosis_page(found)
    assert any("Flexible term over time" in getattr(part, "title", "") for s in page.sections for part in s.parts)


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
    assert np.std(error) < 1.15 * 0.3
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


# ---------------------------------------------------------------- formulas


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
    return run(lambda _t, V, F: F * (1 - 0.2 * ((V > 7) & (V < 9))), seed=seed, seconds=80.0, rate=10.0)


def test_a_run_that_was_not_fitted_judges_the_flexible_term():
    found = diagnosed(dented(0), holdout=(dented(1),))
    left = found.unexplained
    assert left.flexible[0].covariate == "command_voltage"
    assert found.heldout.after < 0.5 * left.heldout_without
    assert "whole runs" in found.heldout.what


def test_a_step_in_gain_is_no_formula():
    found = diagnosed(run(lambda t, _V, F: F * np.where(t < 70, 1.0, 0.93), rate=20.0))
    left = found.unexplained
    assert found.findings == ()
    assert left.where.quantity == "time"
    assert left.formula is None
    assert found.heldout.after < 0.6 * found.heldout.before


def test_products_of_the_grammar():
    found = monomials_of(["a", "b", "c"])
    assert len(found) == 9 + 9
    assert all(sum(p for _, p in powers) <= 3 for powers in found)


def test_nodes_reach_beyond_common_levels_and_crowd_at_the_ends():
    """Times since a step are common up to the shortest hold only; a limit shows within the last of a sine."""
    since = np.concatenate([np.tile(np.arange(0.01, 0.31, 0.02), 40), np.linspace(0.3, 12.0, 200)])
    assert nodes_of(since)[-1] == pytest.approx(12.0)
    sine = np.sin(np.linspace(0, 60, 20000))
    assert np.count_nonzero(nodes_of(sine) > 0.99) >= 3


def test_a_jump_of_the_reading_gets_knots_beside_it():
    jumping = run(lambda t, _V, F: F + np.where(t > 188.3, 0.6, 0.0), seconds=300.0, rate=20.0)
    left = diagnosed(jumping, without=("zero_offset", "zero_drift")).unexplained
    assert left.where.quantity == "time"
    (shape,) = left.flexible
    assert any(0 < b - a < 1.0 and abs(a - 188.3) < 1.0 for a, b in pairwise(shape.knots))
