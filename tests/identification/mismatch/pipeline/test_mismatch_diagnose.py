"""Recordings in, diagnosis out: the right name with its amount, and nothing where nothing is."""

import numpy as np
import pytest

from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.pipeline import diagnose
from sim_devices import concealed
from tests.concealed.recordings import recordings
from tests.identification.diagnosed_runs import NOISE, C, dead_band, run
from tests.identification.mismatch.pipeline.whole_diagnoses import diagnosed, effects, value, within

CONCEALED = [
    # effect, seed, plan, noise, (parameter of the finding, of the truth); seen by an oracle at 60 sigma
    ("dead_band", 2, "staircase", "mixed", ("half_width", "half_width")),
    ("motor_lag", 2, "staircase", "mixed", ("time_constant", "time_constant")),
    ("zero_offset", 1, "interleaved", "white", ("offset", "offset")),
    ("load_cell_saturation", 3, "random", "white", ("limit", "limit")),
    ("strut_drag", 1, "interleaved", "white", ("coefficient", "coefficient")),
    ("reversal_loss", 1, "interleaved", "white", ("loss", "loss")),
    ("heating", 3, "random", "white", None),
    ("load_cell_creep", 2, "staircase", "mixed", None),
    ("rotation_coupling", 3, "random", "white", None),
    ("supply_sag", 1, "interleaved", "white", None),
]


@pytest.mark.parametrize(("effect", "seed", "plan", "noise", "compared"), CONCEALED, ids=[c[0] for c in CONCEALED])
def test_what_the_bench_conceals_is_named(effect, seed, plan, noise, compared):
    rng = np.random.default_rng(seed)
    case = concealed.case(rng, [effect], 60.0, plan=plan, noise=noise, sampling=30.0, duration=240.0)
    found = diagnosed(*recordings(case))
    assert found.verdict == "explained"
    assert effects(found) == {effect}
    assert found.heldout.after < 0.97 * found.heldout.before
    assert found.heldout.after == pytest.approx(found.heldout.noise, rel=0.15)
    assert found.chi2_per_dof == pytest.approx(1.0, abs=0.1)
    assert found.unexplained is None
    assert found.mismatch
    (finding,) = found.findings
    assert finding.bic_gain > 100
    assert finding.p_value < 1e-12
    assert finding.probability > 0.9
    if compared:
        theirs = concealed.truth(case)["effects"][0]["parameters"][compared[1]]
        within(finding.parameters[compared[0]], theirs, rel=0.02)


@pytest.mark.parametrize("seed", range(8))
def test_nothing_is_found_where_nothing_is(seed):
    kind, noise = concealed.PLAN_KINDS[seed % 6], ("white", "mixed", "resonant", "heavy_tailed")[seed % 4]
    rng = np.random.default_rng(100 + seed)
    found = diagnosed(*recordings(concealed.case(rng, plan=kind, noise=noise, sampling=30.0, duration=150.0)))
    assert found.verdict == "adequate"
    assert (found.findings, found.mismatch, found.unexplained, found.next_experiment) == ((), (), None, None)
    assert found.model == found.baseline
    assert found.statement.startswith("Nothing is missing: C V|V|")


def test_zero_offset_on_sines_is_not_lost_in_slow_noise():
    """Ramps and sines, whose commands tick as fast as samples come, were once taken for tables of levels."""
    rng = np.random.default_rng(1)
    case = concealed.case(rng, ["zero_offset"], 60.0, plan="sine", noise="white", sampling=20.0, duration=150.0)
    assert effects(diagnosed(*recordings(case))) == {"zero_offset"}


def test_a_dead_band_is_measured(dead):
    assert dead.verdict == "explained"
    assert effects(dead) == {"dead_band"}
    within(value(dead, "dead_band", "half_width"), 1.5)
    assert dead.model_terms == ("dead_band",)
    within(dead.model["C"], C)
    within(dead.model["tare"], 1.5)
    assert abs(dead.baseline["C"].value - C) > 20 * dead.model["C"].std, "without the term C is wrong"
    assert "1.5 V" in dead.statement
    assert dead.train.after == pytest.approx(NOISE, rel=0.05)
    assert dead.whiteness_p > 1e-3
    for place in dead.mismatch:
        assert place.channel == "thrust"
        assert 0 < place.share <= 1
        assert place.where.low < place.where.high
        assert place.where.quantity in place.statement
    (curve,) = dead.curves
    assert np.std(curve.thrust - curve.baseline) > 5 * np.std(curve.thrust - curve.model)


def test_the_same_seed_gives_the_same_answer(dead):
    assert diagnosis_json(diagnosed(run(volts=dead_band(1.5)))) == diagnosis_json(dead)


def test_two_effects_are_both_named():
    found = diagnosed(run(lambda t, V, F: F + 2.0 * (t > 80), volts=dead_band(1.5)))
    assert found.verdict == "explained"
    assert effects(found) == {"dead_band", "zero_offset"}
    within(value(found, "dead_band", "half_width"), 1.5)
    within(value(found, "zero_offset", "offset"), 2.0)
    assert value(found, "zero_offset", "at").value == pytest.approx(80.0, abs=0.2)


def test_each_run_has_a_tare_of_its_own():
    one, two = run(seed=1, seconds=90.0, tare=5.0), run(seed=2, seconds=90.0, tare=-3.0)
    found = diagnosed(one, two)
    assert found.verdict == "adequate"
    assert found.recordings == (one.recording_id, two.recording_id)
    within(found.model[f"tare[{one.recording_id}]"], 5.0)
    within(found.model[f"tare[{two.recording_id}]"], -3.0)
    assert "tare" not in found.model


def test_a_parameter_that_differs_from_run_to_run_earns_no_name():
    found = diagnosed(run(seed=1, seconds=90.0, volts=dead_band(0.4)), run(seed=2, seconds=90.0, volts=dead_band(1.4)))
    assert found.verdict == "unexplained"
    assert "dead_band" not in effects(found)
    assert found.heldout.after > 5 * NOISE  # a flexible term may fit a part of it, a name does not
    assert found.heldout.after > 1.3 * found.heldout.noise


def test_held_out_runs_judge_both_models():
    kept = run(seed=3, volts=dead_band(1.5), tare=-4.0, seconds=90.0)
    found = diagnosed(run(volts=dead_band(1.5)), holdout=[kept])
    assert kept.recording_id in found.heldout.what
    assert found.heldout.before > 4 * found.heldout.after
    assert found.heldout.after == pytest.approx(NOISE, rel=0.1)
    other = diagnosed(run(volts=dead_band(1.5)), holdout=[run(seed=3, seconds=90.0)])
    assert other.heldout.after > 3 * other.heldout.noise, "a run without the effect is not described by it"


def test_of_several_runs_each_is_judged_by_the_others():
    """A zero of its own in each, and a dead band in all."""
    runs = [run(seed=seed, volts=dead_band(0.8), tare=float(seed)) for seed in range(3)]
    found = diagnose(runs)
    assert found.heldout.what.startswith("each run by a model fitted to the others")
    assert found.heldout.after == pytest.approx(NOISE, rel=0.03)
    assert found.heldout.before > 2 * NOISE


def test_a_short_run_judges_no_other():
    found = diagnose([run(seed=1, volts=dead_band(0.8)), run(seed=2, seconds=40.0, volts=dead_band(0.8))])
    assert found.heldout.what.startswith("every fourth of the blocks of time")


def test_a_hold_out_that_lies_is_found_and_put_right():
    lying = run(lambda t, V, F: -F, seed=2)
    found = diagnose([run(seed=1)], holdout=[lying])
    (fault,) = found.findings
    assert fault.effect == "channel_fault"
    assert lying.recording_id in fault.statement
    assert found.heldout.after < 1.1 * NOISE


def test_a_name_must_predict_what_was_not_fitted():
    found = diagnose([run(seed=1, volts=dead_band(0.8))], holdout=[run(seed=2)])
    assert found.verdict == "unexplained"
    assert any("predicted better without it" in text for text in found.unexplained.resembles)


def test_a_jump_of_one_run_need_not_be_in_another():
    found = diagnose([run(lambda t, V, F: F + 3.0 * (t > 75.0), seed=1)], holdout=[run(seed=2)])
    assert [f.effect for f in found.findings] == ["zero_offset"]


def test_blocks_kept_back_say_what_they_are(dead):
    assert "every fourth of the blocks of time" in dead.heldout.what
    assert dead.heldout.after == pytest.approx(NOISE, rel=0.1)
