"""What a whole diagnosis holds as JSON, and that a term without a name must predict."""

import json
from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.forward_selection import search
from identification.mismatch.validate.held_out import Score
from identification.mismatch.validate.prediction import predicting, predicts, without_each, worse_predicted
from identification.mismatch.validate.train_test_split import train_test_split
from identification.mismatch.value import Where
from identification.physics.dead_band import DeadBand
from identification.physics.zero_offset import ZeroOffset
from tests.identification.diagnosed_runs import TOP, dead_band, run

PARAMETER = {"value", "std", "low", "high", "unit", "determined"}


def no_nan(node):
    if isinstance(node, dict):
        return all(map(no_nan, node.values()))
    if isinstance(node, list):
        return all(map(no_nan, node))
    return node is None or isinstance(node, bool | str | int) or bool(np.isfinite(node))


@pytest.mark.parametrize("which", ["dead", "uneven"])
def test_the_json_holds_what_the_contract_promises(which, request):
    told = json.loads(json.dumps(diagnosis_json(request.getfixturevalue(which)), allow_nan=False))
    assert no_nan(told)
    assert (told["format"], told["version"]) == ("thruster-rig-diagnosis", 1)
    assert told.keys() >= {
        *("recordings", "thruster", "verdict", "statement", "baseline", "mismatch", "findings", "unexplained"),
        *("model", "fit", "next_experiment", "notes"),
    }
    assert told["verdict"] in ("adequate", "explained", "ambiguous", "unexplained")
    assert told["baseline"]["model"] == "C V|V|"
    assert told["baseline"]["parameters"]["C"].keys() == PARAMETER
    for place in told["mismatch"]:
        assert place.keys() >= {"channel", "where", "share", "p_value", "statement"}
        assert place["where"].keys() >= {"quantity", "from", "to"}
    (finding,) = told["findings"]
    assert finding.keys() >= {
        *("effect", "statement", "parameters", "p_value", "bic_gain", "probability", "rivals"),
    }
    assert all(p.keys() == PARAMETER for p in finding["parameters"].values())
    assert all(p["low"] <= p["value"] <= p["high"] for p in finding["parameters"].values())
    assert all(isinstance(rival, str) for rival in finding["rivals"])
    assert [r["effect"] for r in finding["rival_details"]] == finding["rivals"]
    assert told["fit"].keys() >= {"train", "heldout", "chi2_per_dof", "whiteness_p"}
    assert told["fit"]["train"].keys() >= {"rmse_before", "rmse_after"}
    assert told["fit"]["heldout"].keys() >= {"rmse_before", "rmse_after", "noise", "what"}
    if told["verdict"] == "ambiguous":
        assert told["next_experiment"]["why"]
        steps = told["next_experiment"]["steps"]
        assert all(abs(s["command_voltage"]) <= TOP and s["duration"] > 0 for s in steps)
        assert 0 <= told["next_experiment"]["expected_power"] <= 1


def test_a_doubt_that_no_sweep_settles_has_no_steps_and_says_what_would(uneven):
    """Without a torque channel asymmetry and torque cross-talk are one curve at any command."""
    told = diagnosis_json(uneven)
    assert told["verdict"] == "ambiguous"
    assert told["next_experiment"]["steps"] == []
    assert "torque" in told["next_experiment"]["why"]


def test_numbers_that_are_not_finite_become_null(dead):
    strange = replace(
        dead,
        whiteness_p=float("nan"),
        chi2_per_dof=float("inf"),
        mismatch=(replace(dead.mismatch[0], where=Where("time", -np.inf, 3.0, "s")),),
    )
    told = diagnosis_json(strange)
    assert told["fit"]["whiteness_p"] is None
    assert told["fit"]["chi2_per_dof"] is None
    assert told["mismatch"][0]["where"] == {"quantity": "time", "from": None, "to": 3.0, "unit": "s"}
    json.dumps(told, allow_nan=False)


def test_unexplained_is_told_with_its_table(bump):
    told = json.loads(json.dumps(diagnosis_json(bump), allow_nan=False))
    left = told["unexplained"]
    assert left.keys() >= {"where", "share", "p_value", "shape", "statement", "resembles"}
    assert all(row.keys() == {"at", "residual", "std", "determined"} for row in left["shape"])
    assert 0 < left["share"] <= 1


def unnamed(recording, term, values):
    """The model that `predicting` leaves of C V|V| with one term whose name was not earned."""
    found = search((history_of(recording),), np.random.default_rng(0))
    first = found.before.fit
    fitted = fit(*first.more(term, values), found.data, found.before.weights)
    after = replace(found.before, fit=fitted)
    return predicting(after, train_test_split(after, found.data, ()), found.data, found.terms, [term], ())


def test_a_term_without_a_name_stays_where_it_predicts():
    after = unnamed(run(volts=dead_band(0.8)), DeadBand(), (0.5,))
    assert [t.id for t in after.fit.model.terms] == ["dead_band"]


def test_a_term_without_a_name_goes_where_it_only_describes():
    """The zero is back where it was in the last block of time, which judges."""
    knocked = run(lambda t, _V, F: F + 3.0 * ((t > 128.0) & (t < 144.0)))
    after = unnamed(knocked, ZeroOffset(), (3.0, 128.0))
    assert after.fit.model.terms == ()


@pytest.fixture(scope="module")
def late():
    """Selected in a run with a dead band whose force comes late."""
    return search(
        (history_of(run(lambda t, _V, F: np.interp(t - 0.2, t, F), volts=dead_band(0.8))),), np.random.default_rng(0)
    )


def judged(split, chi2, rmse):
    """The same, whose models have these scores where they lack a term."""
    every = len(split.estimate.fit.model.terms)
    return replace(
        split,
        judge=lambda fitted: Score(1.0, 100.0) if len(fitted.model.terms) == every else Score(rmse, chi2),
    )


def worse(split, terms, *, same_run):
    return worse_predicted(without_each(split, terms, same_run=same_run), same_run=same_run)


def test_a_clock_of_one_run_is_not_that_of_another(late):
    assert {t.id for t in late.after.fit.model.terms} == {"dead_band", "time_skew"}
    better = judged(train_test_split(late.after, late.data, ()), 50.0, 0.9)
    terms = late.after.fit.model.terms
    assert {t.id for t in worse(better, terms, same_run=True)} == {
        "dead_band",
        "time_skew",
    }
    assert {t.id for t in worse(better, terms, same_run=False)} == {"dead_band"}


def test_of_other_runs_the_error_must_fall_as_well(late):
    quieter = judged(train_test_split(late.after, late.data, ()), 50.0, 1.1)
    terms = late.after.fit.model.terms
    assert worse(quieter, terms, same_run=False) == ()
    assert len(worse(quieter, terms, same_run=True)) == 2


def test_what_predicts_is_better_than_the_baseline(late):
    assert predicts(late.after, late.before, late.data, ())
    assert not predicts(late.before, late.after, late.data, ())
