"""What `rig diagnose --explain` shows is what the stages handed on."""

import re
from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.answer.explained.explain import WIDTH, explained
from identification.mismatch.answer.explained.explain_search import best_trials, searches
from identification.mismatch.faults.channel_faults import Fault
from identification.mismatch.name.naming import Check
from identification.mismatch.periodic.periodic_disturbances import Line
from identification.mismatch.pipeline import traced
from identification.mismatch.select.rounds import Round
from tests.identification.diagnosed_runs import dead_band, run

LINE = Line("fixed", 7.3, 0.002, None, None, 0.25, 0.01, 0.1, 0.05, 1e-9, 412.0, "Periodic disturbance.")


@pytest.fixture(scope="module")
def trace():
    return traced([run(volts=dead_band(1.5), seconds=60.0, rate=10.0)])


def section(trace, words):
    """Lines of the one section whose title holds these words."""
    (found,) = [s.lines for s in explained(trace) if words in s.title]
    return "\n".join(found)


def with_rounds(trace, rounds):
    """The same trace, its search in these rounds."""
    selected = replace(trace.selected, rounds=rounds)
    return replace(trace, chosen=replace(trace.chosen, selected=selected))


def numbers(text):
    return [float(x) for x in re.findall(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", text)]


def test_every_stage_has_a_section_of_lines_that_fit_a_terminal(trace):
    titles = [s.title.split(":")[0] for s in explained(trace)]
    assert list(dict.fromkeys(titles)) == [
        *("prepare", "faults", "select", "periodic", "locate", "name", "validate", "unnamed"),
        *("next experiment", "answer"),
    ]
    assert all(len(s.lines) <= 40 for s in explained(trace))
    assert max(len(line) for s in explained(trace) for line in s.lines) <= WIDTH


def test_the_runs_are_as_prepared(trace):
    (history,) = trace.sound.histories
    said = section(trace, "prepare")
    assert f"{history.sample_time.size} samples of thrust (10/s)" in said
    assert f"{history.driver.size} intervals" in said
    assert "driven by command_voltage, -12 to 12" in said


def test_baseline_and_noise_are_those_of_the_first_estimate(trace):
    said, first = section(trace, "baseline"), trace.first.before
    assert numbers(said.splitlines()[0])[:2] == pytest.approx([first.fit.theta.C, first.fit.std[0]], rel=0.05)
    noise = first.noise
    at_rest = np.sqrt(noise.white + sum(noise.slow))
    assert numbers(said.splitlines()[-1])[0] == pytest.approx(at_rest, rel=0.01)
    assert f"white {np.sqrt(noise.white):.3g} N" in said


def test_each_round_shows_its_screening_and_what_came_of_it(trace):
    search, resumed = searches(trace.selected)
    assert not resumed
    assert [r.after is None for r in search] == [*(len(search) - 1) * [False], True]
    for i, one in enumerate(search, 1):
        said = section(trace, f"round {i}")
        assert f"{one.screening.largest:.4g} sigma" in said
        assert f"threshold of {one.screening.threshold:.4g}" in said
        for term, sigma, counted in best_trials(one.screening):
            assert re.search(rf"{term.id}.* {sigma:.4g} +{counted:.4g}", said)
        for c in one.fitted:
            assert f"{c.chi2_gain:.5g}" in said
    first = search[0]
    assert "added: dead_band (shrink): most gain for its parameters" in section(trace, "round 1")
    gains = {c.term: c.chi2_gain - c.price for c in first.fitted if not c.at_bound}
    assert gains[first.after[0]] >= policy.select.SIMPLER_TERM_GAIN * max(gains.values())
    assert "the search ends" in section(trace, f"round {len(search)}")


def test_places_have_statistic_dof_and_p_value(trace):
    said = section(trace, "locate")
    rows = [line.split() for line in said.splitlines()]
    for g in trace.located.left.groups:
        assert [g.covariate.quantity, f"{g.statistic:.4g}", str(g.dof), f"{g.p_value:.2g}"] in rows
    assert f"family-wise p = {trace.located.left.p_value:.2g}" in said


def test_names_have_every_check(trace):
    said = section(trace, "name:")
    (named,) = trace.completed.earned
    assert "dead_band (shrink) half_width" in said
    assert said.count("passed") + said.count("  -  ") == len(named.checks)
    doubted = replace(named, checks=(*named.checks, Check("own_covariate", "it is so", "it is not so")))
    other = replace(trace, completed=replace(trace.completed, earned=(), unearned=(doubted,)))
    assert "FAILED  it is not so" in section(other, "name:")
    assert "NOT earned" in section(other, "name:")


def test_scores_on_what_was_not_fitted_are_shown_with_and_without_each_term(trace):
    said, scores = section(trace, "validate"), trace.validated.scores
    assert f"{scores.whole.rmse:.4g}" in said
    for term, score in scores.less.items():
        assert re.search(rf"without {term.id} .*{score.rmse:.4g} +{score.chi2:.5g}", said)
    assert scores.less.keys() == {n.term for n in trace.named}


def test_the_verdict_has_its_reason(trace):
    assert section(trace, "answer").startswith(f"explained: 1 finding(s), none with a rival within {4} BIC")
    assert section(trace, "next experiment") == "none is needed"
    assert section(trace, "unnamed") == "not asked: nothing is left, and every term has its name"


def test_faults_are_told_or_that_there_is_none(trace):
    assert section(trace, "faults") == "none"
    fault = Fault("run", "torque", "reversed", "torque goes the other way.", 1e-5)
    other = replace(trace, sound=replace(trace.sound, faults=(fault,)))
    assert section(other, "faults") == "reversed: torque goes the other way. (p = 1e-05; put right for the model)"


def test_the_way_back_after_a_line_is_shown(trace):
    other = replace(trace, cleaned=replace(trace.cleaned, lines=(LINE,), bands=((3.0, 5.0),)))
    said = section(other, "periodic")
    assert "fixed: 7.3 +- 0.002 Hz, 0.25 +- 0.01 N, chi-square 412, p = 1e-09: taken out" in said
    assert "broad peak of the noise at 3 Hz, quality 5" in said
    assert "the way goes back" in said
    assert section(other, "select again: the baseline") == section(trace, "the baseline and its noise")
    assert "no line" in section(trace, "periodic")


def test_the_way_back_after_an_exchange_is_shown(trace):
    last = trace.selected.rounds[-1]
    rounds = (*trace.selected.rounds, Round((), last.screening, (), hidden=None, after=None))
    other = with_rounds(trace, rounds)
    said = section(other, "rivals")
    assert "exchanged: dead_band (shrink) -> no term; the way goes back: the search is resumed" in said
    assert "exchanged: no term -> dead_band (shrink)" in said


def test_a_search_that_begins_with_a_model_and_adds_nothing_is_no_exchange(trace):
    (*_, last) = trace.selected.rounds
    assert last.model == trace.selected.after.fit.model.terms
    other = with_rounds(trace, (last,))
    assert section(other, "rivals").startswith("none was exchanged")
