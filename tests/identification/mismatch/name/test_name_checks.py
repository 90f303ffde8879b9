"""Each check that a name must pass, on a fit that fails it and on one that does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from identification.mismatch import policy
from identification.mismatch.locate.residual_structure_test import CovariateTest, ResidualStructure
from identification.mismatch.locate.stage import Located
from identification.mismatch.name import stage
from identification.mismatch.name.naming import checks as checks_of
from identification.mismatch.name.naming import name, with_joint_checks
from identification.mismatch.select.covariates import Covariate
from identification.physics.asymmetry import Asymmetry
from identification.physics.dead_band import DeadBand
from identification.physics.exponent import Exponent
from identification.physics.linear_term import LinearTerm
from identification.physics.motor_lag import MotorLag
from identification.physics.stand_resonance import StandResonance
from identification.physics.torque_crosstalk import TorqueCrosstalk
from identification.physics.winding_resistance import WindingResistance
from identification.physics.zero_offset import ZeroOffset
from tests.identification.diagnosed_runs import TOP, C, dead_band, table
from tests.identification.mismatch.small import known_noise, selected, short

BAND, UNEVEN, RING, JUMP = DeadBand(), Asymmetry(), StandResonance(), ZeroOffset()


def failed(estimate, term, data, many):
    return tuple(check.failed for check in checks_of(estimate, term, data, many) if check.failed)


def widths(of):
    """A dead band whose half width is a function of (t, V)."""

    def change(t, V, _F):
        x = np.sign(V) * np.maximum(np.abs(V) - of(t, V), 0.0)
        return C * x * np.abs(x)

    return change


def checks(recordings, values, term=BAND):
    data, estimate = known_noise(values, recordings)
    return " | ".join(failed(estimate, term, data, len(values)))


def test_a_true_effect_fails_none():
    assert checks([short(volts=dead_band(1.2))], {BAND: (1.0,)}) == ""
    assert checks([short(volts=dead_band(1.2), seed=s, seconds=50.0) for s in (0, 1)], {BAND: (1.0,)}) == ""


def test_a_faint_one_fails_none_by_chance():
    """Twenty runs of an effect of some twenty sigma, four checks each."""
    assert [checks([short(volts=dead_band(0.02), seed=s)], {BAND: (0.1,)}) for s in range(20)] == [""] * 20


@pytest.mark.parametrize(
    ("of", "says"),
    [
        (lambda t, V: np.where(t < 40, 0.4, 1.4), "in both halves of the run"),
        (lambda t, V: np.where(V < 0, 0.4, 1.4), "in both directions"),
        (lambda t, V: np.where(np.abs(V) > 5, 0.4, 1.4), "at all levels"),
    ],
    ids=["time", "direction", "level"],
)
def test_a_parameter_that_is_not_the_same_everywhere(of, says):
    assert f"its parameter is not the same {says}" in checks([short(change=widths(of))], {BAND: (1.0,)})


def test_a_parameter_that_is_not_the_same_in_all_runs():
    runs = [short(volts=dead_band(w), seed=s, seconds=50.0) for s, w in enumerate((0.4, 1.4))]
    assert "its parameter is not the same in all runs" in checks(runs, {BAND: (1.0,)})


def test_a_table_in_the_order_of_its_levels_has_no_halves():
    flat = table(lambda v: C * dead_band(1.5)(v) * np.abs(dead_band(1.5)(v)), number=121)
    data, estimate = known_noise({BAND: (1.0,)}, [flat], 0.05)
    assert failed(estimate, BAND, data, 1) == ()

    def uneven_thrust(v):
        x = dead_band(np.where(v < 0, 1.0, 2.0))(v)
        return C * x * np.abs(x)

    uneven = table(uneven_thrust, number=121)
    data, estimate = known_noise({BAND: (1.0,)}, [uneven], 0.05)
    said = " ".join(failed(estimate, BAND, data, 1))
    assert "in both directions" in said
    assert "halves" not in said


def test_a_value_at_the_end_of_what_is_possible():
    """Thrust with the third power: no propeller."""
    run = short(volts=lambda V: np.sign(V) * np.abs(V) ** 2.2 / TOP**1.2)
    told = checks([run], {Exponent(): (2.5,)}, Exponent())
    assert "it would take values that are not possible: exponent 3.5" in told


def test_ringing_faster_than_the_samples_show():
    """8 samples/s show 4 Hz."""
    data, estimate = known_noise({RING: (1.0, 3.0, 0.2)}, [short()])

    def said(frequency):
        theta = replace(estimate.fit.theta, terms=((1.0, frequency, 0.2),))
        return " ".join(failed(replace(estimate, fit=replace(estimate.fit, theta=theta)), RING, data, 1))

    assert "faster than the samples can show" in said(5.0)
    assert "faster" not in said(3.0)


@pytest.mark.parametrize(("known_to", "told"), [(0.0, False), (0.001, False), (0.003, True)])
def test_a_lag_within_what_the_times_of_the_samples_are_known_to_is_no_name(known_to, told):
    """2 ms."""
    data, estimate = known_noise({MotorLag(): (0.002,)}, [short()])
    vague = replace(data, histories=tuple(replace(h, delay_std=known_to) for h in data.histories))
    assert ("the recording knows its own times to 3 ms" in " ".join(failed(estimate, MotorLag(), vague, 1))) == told


@pytest.mark.parametrize(("form", "told"), [("first_order", True), ("quadratic", False)])
def test_a_lag_that_is_slower_at_small_levels_is_judged_by_the_usual_one(form, told):
    """2 ms at the largest level: 4 ms at half of it, where the times of the samples are known to 3."""
    lag = MotorLag(form)
    data, estimate = known_noise({lag: (0.002,)}, [short()])
    vague = replace(data, histories=tuple(replace(h, delay_std=0.003) for h in data.histories))
    assert ("the recording knows its own times to 3 ms" in " ".join(failed(estimate, lag, vague, 1))) == told


# ---------------------------------------------------------------- gains and rivals


def test_a_name_has_the_gain_of_a_refit_without_it():
    recording = short(lambda t, V, F: F + 2.0 * (t > 40), volts=dead_band(1.2))
    values = {BAND: (1.0,), JUMP: (1.0, 40.0)}
    data, estimate = known_noise(values, [recording])
    named = {n.term: n for n in name(estimate, data, [])}
    alone = {t: known_noise({u: v for u, v in values.items() if u != t}, [recording])[1].fit for t in values}
    for term, n in named.items():
        gain = alone[term].chi2 - estimate.fit.chi2
        assert n.chi2_gain == pytest.approx(gain, rel=0.02)
        assert n.bic_gain == pytest.approx(n.chi2_gain - len(n.theta) * np.log(estimate.fit.residual.size))
        assert n.p_value == pytest.approx(max(n.searched * chi2.sf(n.chi2_gain, len(n.theta)), 1e-300), rel=1e-3)
        assert n.theta == estimate.fit.values[term]
        assert n.rivals == ()
        assert n.probability == 1.0
    assert [n.chi2_gain for n in name(estimate, data, [])] == sorted(
        (n.chi2_gain for n in named.values()), reverse=True
    )


def test_what_cannot_be_told_apart_is_a_rival_with_half_the_probability():
    """At levels of one sign each an asymmetry is what a torque does to a cell."""
    data, estimate = known_noise({UNEVEN: (1.0,)}, [short(change=lambda _t, V, F: np.where(V < 0, 0.9, 1.0) * F)])
    (found,) = name(estimate, data, [UNEVEN, TorqueCrosstalk(), BAND])
    assert [r.term.id for r in found.rivals] == ["torque_crosstalk"]
    assert abs(found.rivals[0].bic_loss) < 1.0
    assert found.probability == pytest.approx(0.5, abs=0.1)


def test_two_shapes_that_repair_each_other_doubt_each_other():
    """A power of 1.9 is neither: a straight line does most of it, a winding's resistance too, both do all."""
    flat = table(lambda v: 0.6 * np.sign(v) * np.abs(v) ** 1.9, number=161, noise=0.05)
    data, estimate = known_noise({WindingResistance(): (0.1,), LinearTerm(): (0.1,)}, [flat], 0.05)
    named = name(estimate, data, [])
    assert all(any("mend each other" in text for text in n.failed_checks) for n in named)
    each = table(lambda v: C * dead_band(1.5)(v) * np.abs(dead_band(1.5)(v)) * np.where(v < 0, 0.8, 1.0), number=161)
    data, estimate = known_noise({BAND: (0.5,), UNEVEN: (1.0,)}, [each], 0.05)
    assert all(n.failed_checks == () for n in name(estimate, data, []))


# ---------------------------------------------------------------- all terms and what is left together


def left_over(quantity, statistic, p):
    only = Covariate(quantity, (np.zeros(1),), "1", (np.zeros((1, 1)),), "")
    return ResidualStructure((CovariateTest(only, statistic, 5, p, 0.1),), p)


@pytest.fixture(scope="module")
def one():
    data, estimate = known_noise({BAND: (1.0,)}, [short(volts=dead_band(1.2))])
    return data, name(estimate, data, [])


def test_more_left_over_its_own_covariate_than_a_shape_may_leave(one):
    _, named = one
    gain = named[0].chi2_gain
    much = left_over("command_voltage", gain, 1e-30)
    (doubted,) = with_joint_checks(named, much, measured=False)
    assert doubted.failed_checks == ("what is left still goes with command voltage",)
    for harmless in (
        left_over("time", gain, 1e-30),
        left_over("command_voltage", 1e-4 * gain, 1e-30),
        left_over("command_voltage", gain, 0.5),
        None,
    ):
        assert with_joint_checks(named, harmless, measured=False)[0].failed_checks == ()


def test_many_shapes_on_one_static_curve_make_any_curve(one):
    _, (named,) = one
    shapes = [BAND, Exponent(), LinearTerm(), WindingResistance()][: policy.name.CURVE_OF_ANY_SHAPE_TERMS]
    many = with_joint_checks([replace(named, term=t) for t in shapes], None, measured=False)
    assert all(f"{len(shapes)} shapes on one static curve can draw any curve" in n.failed_checks for n in many)
    fewer = with_joint_checks([replace(named, term=t) for t in shapes[:-1]], None, measured=False)
    assert all(n.failed_checks == () for n in fewer)
    lags = with_joint_checks([replace(named, term=MotorLag("first_order"))] * 4, None, measured=False)
    assert all(n.failed_checks == () for n in lags), "a lag is on no static curve"


def test_the_stage_takes_into_account_what_is_left_only_where_it_is_more_than_noise(one):
    data, named = one
    chosen = replace(selected({BAND: (1.0,)}, [short(volts=dead_band(1.2))]), data=data)
    _, estimate = known_noise({BAND: (1.0,)}, [short(volts=dead_band(1.2))])
    gain = named[0].chi2_gain
    noisy = stage.run(chosen, Located(estimate, left_over("command_voltage", gain, 0.2)))
    assert noisy[0].failed_checks == ()
    plain = stage.run(chosen, Located(estimate, left_over("command_voltage", gain, 1e-30)))
    assert len(plain[0].failed_checks) == 1
