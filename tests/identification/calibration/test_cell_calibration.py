"""Cells of known curves: what is found, how often its interval holds, its budget beside GTC's, and wrong weights."""

from math import inf

import GTC
import numpy as np
import pytest
from GTC import reporting

from identification.calibration.answer import answered, calibrated
from identification.calibration.loads import Forces, Load, Weight, forces_of
from identification.calibration.model import straight_line, terms_of
from identification.calibration.steps import Steps, crept, lag_shape, levels, side_of, windows_of
from identification.calibration.wrong_weight import sentence, wrong_steps
from tests.identification.calibration.weighed_cells import PLACE, SET, forces, loads, read

COURSE = loads()
FORCE = forces(COURSE)
SHAPE = {"even": 6e-6, "odd": -8e-6, "cubic": 3e-8}


def test_gain_bends_hysteresis_and_creep_are_found():
    rng = np.random.default_rng(3)
    found = calibrated(read(rng, FORCE, lag=0.06, creep=(1.5e-3, 12.0), **SHAPE), COURSE, SET, PLACE)
    later = 1.5e-3 * np.exp(-14.0 / 12.0)  # what is still to come after the usual age
    for name, truth in (SHAPE | {"creep": later}).items():
        term = found.term(name)
        assert abs(term.value - truth) < 4.0 * term.std + 0.05 * abs(truth), name
    assert found.term("lag").value == pytest.approx(-0.06, abs=0.006)
    assert 6.0 < found.time_constant < 25.0
    assert found.wrong == ()
    assert found.curve.lag == pytest.approx(0.06, abs=0.006)
    assert found.curve.creep > 0.0


def test_a_sound_cell_has_no_creep_and_no_wrong_step():
    rng = np.random.default_rng(5)
    found = [calibrated(read(rng, FORCE), COURSE, SET, PLACE) for _ in range(40)]
    assert sum(each.time_constant is not None for each in found) <= 2
    assert sum(bool(each.wrong) for each in found) <= 2


def test_the_interval_of_gain_and_force_holds():
    """120 cells, each with errors of its own in weights, gravity and lever: 95 % hold within three standard errors."""
    rng, held = np.random.default_rng(8), np.zeros(3)
    true = straight_line(FORCE.min(), FORCE.max()) @ [1.003, *SHAPE.values()]
    for _ in range(120):
        shared = rng.standard_normal()
        real = {n: Weight(n, w.mass + shared * w.std, 0.0, 7950.0) for n, w in SET.items()}
        g, lever = 1.0 + 3e-5 / 9.8055 * rng.standard_normal(), 1.0 + 5e-5 * rng.standard_normal()
        force = forces(COURSE, real) * g * lever
        steps = read(rng, force, **SHAPE)
        stated = Steps(FORCE, steps.hung, steps.time, steps.value, steps.temperature)
        found = calibrated(stated, COURSE, SET, PLACE)
        held[0] += found.gain.low <= true <= found.gain.high
        for k, f in enumerate((30.0, -160.0)):
            y = 0.6 + 1.003 * f + SHAPE["even"] * f**2 + SHAPE["odd"] * f * abs(f) + SHAPE["cubic"] * f**3
            zero = found.curve.zero - 0.6  # a run tares for itself
            _, low, high = found.force_interval(y + zero)
            held[1 + k] += low <= f <= high
    assert np.all(held / 120 > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 120)), held


def solved(rows, y):
    """Least squares by normal equations and elimination, in any arithmetic."""
    p = len(rows[0])
    square = [[sum(row[i] * row[j] for row in rows) for j in range(p)] for i in range(p)]
    right = [sum(row[i] * each for row, each in zip(rows, y, strict=True)) for i in range(p)]
    for i in range(p):
        for k in range(i + 1, p):
            share = square[k][i] / square[i][i]
            square[k] = [a - share * b for a, b in zip(square[k], square[i], strict=True)]
            right[k] = right[k] - share * right[i]
    out = [0.0] * p
    for i in reversed(range(p)):
        known = sum((square[i][j] * out[j] for j in range(i + 1, p)), 0.0)
        out[i] = (right[i] - known) / square[i][i]
    return out


def test_budget_and_coverage_factor_are_those_of_gtc():
    """The regression in GTC's uncertain arithmetic: weights, gravity, air, density and lever through it by its own
    derivatives; the scatter as one more influence with its degrees of freedom."""
    course = loads((1,), 1)
    rng = np.random.default_rng(4)
    two = read(rng, forces(course))
    one = (two.time.mean(axis=1, keepdims=True), two.value.mean(axis=1, keepdims=True))
    steps = Steps(two.force, two.hung, *one, two.temperature)  # of one window each: no creep is asked for
    names = terms_of(steps)
    found = answered(steps, forces_of(course, SET, PLACE, 0.7))
    masses = [GTC.ureal(w.mass, w.std, independent=False, label=f"mass {w.name}") for w in SET.values()]
    for i, a in enumerate(masses):
        for b in masses[i + 1 :]:
            GTC.set_correlation(0.7, a, b)
    g = GTC.ureal(PLACE.gravity, PLACE.gravity_std, label="local gravity")
    air = GTC.ureal(PLACE.air_density, PLACE.air_density_std, label="density of the air")
    lever = GTC.ureal(PLACE.lever, PLACE.lever_std, label="lever arm")
    rho = GTC.ureal(7950.0, 70.0, label="density of the weights")
    per_kg = g * lever * (1 - air / rho) * (1 - 1.2 / 8000.0) / (1 - 1.2 / rho)
    of = dict(zip(SET, masses, strict=True))
    F = [per_kg * sum((of[name] for name in load.weights), 0.0) for load in course]
    lag, t = lag_shape(steps.force), steps.time.mean(axis=1)
    when = (t - t.mean()) / 100.0
    assert set(names) <= {"zero", "gain", "even", "lag", "drift", "cubic"}
    rows = []
    for f, w, d in zip(F, lag, when, strict=True):
        shapes = {"zero": 1.0 + 0 * f, "gain": f / 100, "even": (f / 100) ** 2, "lag": w + 0 * f, "drift": d + 0 * f,
                  "cubic": (f / 100) ** 3}  # fmt: skip
        rows.append([shapes[name] for name in names])
    theta = solved(rows, steps.mean.tolist())
    line = straight_line(0.0, float(steps.force.max()))
    scaled = {"gain": line[0] / 1e2, "even": line[1] / 1e4, "cubic": line[3] / 1e6}
    scatter = found.budget[0]
    gain = sum((scaled[n] * theta[names.index(n)] for n in names if n in scaled), 0.0)
    gain = gain + GTC.ureal(0.0, scatter.std, scatter.dof, label="scatter")
    assert found.gain.value == pytest.approx(GTC.value(gain), rel=1e-9)
    # the sensitivities are ours at the fitted slope, GTC's at the readings: they differ by the residuals
    assert found.gain.std == pytest.approx(GTC.uncertainty(gain), rel=2e-4)
    assert found.gain.dof == pytest.approx(GTC.dof(gain), rel=2e-3)
    assert found.gain.coverage == pytest.approx(reporting.k_factor(GTC.dof(gain)), rel=1e-4)
    theirs = {row.label: row.u for row in reporting.budget(gain, trim=0)}
    ours = {each.name: each.std for each in found.budget}
    for name in ("local gravity", "density of the air", "density of the weights", "lever arm"):
        assert ours[name] == pytest.approx(theirs[name], rel=2e-3), name


def test_a_wrong_weight_is_named():
    rng = np.random.default_rng(11)
    course = list(COURSE)
    steps = read(rng, FORCE, **SHAPE)
    course[3] = Load(("10", "1"))  # hung: 10 alone
    typed = Steps(forces(course), steps.hung, steps.time, steps.value, steps.temperature)
    (wrong,) = calibrated(typed, course, SET, PLACE).wrong
    assert wrong.step == 3
    assert wrong.probable == Load(("10",))
    said = sentence(wrong, course[3])
    assert said.startswith("step 4: 10 + 1 (107.8")
    assert "probably it was 10; look at that step" in said


def test_two_wrong_weights_and_a_direction():
    course, steps = list(COURSE), read(np.random.default_rng(12), FORCE)
    course[2], course[13] = Load(("2",)), Load(("2",), 1)
    typed = Steps(forces(course), steps.hung, steps.time, steps.value, steps.temperature)
    found = calibrated(typed, course, SET, PLACE).wrong
    assert [each.step for each in found] == [2, 13]
    assert found[0].probable == Load(("5",))
    assert found[1].probable == Load(("5",), -1)


def test_one_that_no_combination_explains_is_said():
    steps = read(np.random.default_rng(2), FORCE)
    value = steps.value.copy()
    value[4] += 3.3
    touched = Steps(FORCE, steps.hung, steps.time, value, steps.temperature)
    (wrong,) = calibrated(touched, COURSE, SET, PLACE).wrong
    assert wrong.probable is None
    assert "no combination of the set gives that" in sentence(wrong, COURSE[4])


def test_temperature_of_gain_and_zero():
    rng = np.random.default_rng(6)
    steps = read(rng, FORCE)
    warm = np.linspace(-4.0, 4.0, FORCE.size)
    rng.shuffle(warm)
    value = steps.value + (warm * (0.01 + 2e-5 * FORCE))[:, None]
    found = calibrated(Steps(FORCE, steps.hung, steps.time, value, 18.0 + warm), COURSE, SET, PLACE)
    for name, truth in (("gain_temperature", 2e-5), ("zero_temperature", 0.01)):
        assert abs(found.term(name).value - truth) < 4.0 * found.term(name).std < 0.8 * truth
    assert found.term("drift") is None
    assert (found.term("gain_temperature").unit, found.term("zero_temperature").unit) == ("1/K", "N/K")


def test_a_zero_that_remembers_the_direction():
    steps = read(np.random.default_rng(9), FORCE, lag=0.03)
    value = steps.value + 0.05 * side_of(FORCE)[:, None]
    found = calibrated(Steps(FORCE, steps.hung, steps.time, value, steps.temperature), COURSE, SET, PLACE)
    assert found.term("remanence").value == pytest.approx(0.05, abs=0.004)
    assert found.curve.remanence == pytest.approx(0.05, abs=0.004)
    assert found.gain.low < 1.003 < found.gain.high


def test_a_load_that_was_not_read_is_remembered():
    """Creep of a load that hung before the first step; and the way by which the first step was reached."""
    steps = Steps(np.array([0.0, 5.0]), np.array([20.0, 40.0]), np.array([[25.0], [50.0]]), np.zeros((2, 1)),
                  np.full(2, np.nan), unread=((0.0, 10.0),))  # fmt: skip
    left = 10.0 * (1.0 - np.exp(-20.0 / 8.0)) * np.exp(-5.0 / 8.0)
    assert crept(steps, 8.0)[0, 0] == pytest.approx(left)
    assert steps.of_history(side_of).tolist() == [1.0, 1.0]
    assert steps.of_history(lag_shape).tolist() == [0.0, 1.0]
    assert steps.without(np.array([False, True])).unread == ((0.0, 10.0),)


def test_without_stated_sources_only_the_scatter_counts():
    steps = read(np.random.default_rng(7), FORCE)
    found = answered(steps, Forces(FORCE), quantum=0.02, stability=1e-4)
    assert [each.kind for each in found.budget] == ["A", "B", "B"]
    assert found.budget[2].std == pytest.approx(1e-4, rel=0.01)
    assert found.budget[2].dof == inf


def test_few_steps_tell_few_terms():
    up = loads((1,), 1)
    assert set(terms_of(read(np.random.default_rng(1), forces(up)))) == {"zero", "gain", "even", "lag", "cubic"}
    few = up[:5]
    assert terms_of(read(np.random.default_rng(1), forces(few))) == ("zero", "gain")
    with pytest.raises(ValueError, match="steps are too few"):
        answered(read(np.random.default_rng(1), forces(up[:3])), Forces(forces(up[:3])))
    with pytest.raises(ValueError, match="no step had a load"):
        wrong_steps(read(np.random.default_rng(1), np.zeros(6)))
    flat = read(np.random.default_rng(1), forces(up), gain=0.0, noise=0.0)
    with pytest.raises(ValueError, match="does not change with the force"):
        answered(flat, Forces(forces(up)))


def test_levels_and_windows():
    assert (levels(np.array([0.0, 10.0, 10.000001, -5.0]), 1), levels(np.array([0.0, 10.0]), -1)) == (1, 0)
    time, mean = windows_of(np.arange(8.0), np.array([np.nan, 1, 1, 1, 2, 2, 2, 2]), 1.5, 2)
    assert (time.tolist(), mean.tolist()) == ([3.0, 6.0], [pytest.approx(4 / 3), 2.0])
    with pytest.raises(ValueError, match="too few"):
        windows_of(np.arange(3.0), np.ones(3), 2.0, 2)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"force": np.array([0.0, np.nan])}, "finite"),
        ({"time": np.array([[5.0], [5.5]])}, "each read after its load"),
        ({"value": np.ones((2, 2))}, "must both be"),
        ({"temperature": np.ones(3)}, "2 temperatures"),
    ],
)
def test_steps_that_are_none(change, said):
    sound = {"force": np.array([0.0, 9.8]), "hung": np.array([0.0, 10.0]), "time": np.array([[5.0], [15.0]]),
             "value": np.array([[0.0], [9.8]]), "temperature": np.full(2, np.nan)}  # fmt: skip
    with pytest.raises(ValueError, match=said):
        Steps(**(sound | change))
