"""The scoring of the blind proof, on made-up answers."""

import numpy as np
import pytest

from rig.blind.scoring.metrics import goals, half, half_named
from rig.blind.scoring.rates import Goal, Rate, of_rate
from rig.blind.scoring.score import Near, Score, scored
from rig.blind.scoring.tables import twins
from tests.rig.blind_scores import answer, finding, order, truth


def test_right_alone_right_with_a_rival_and_wrong():
    asked, hidden = order("plain/heating/0"), truth("heating")
    alone = scored(asked, hidden, answer("explained", finding("heating")))
    assert (alone.right, alone.alone, alone.wrong, alone.answer) == (True, True, False, "heating")
    assert (alone.extra, alone.rival_only) == (False, False)
    rival = scored(asked, hidden, answer("ambiguous", finding("supply_sag", ["heating"])))
    assert (rival.right, rival.alone, rival.wrong, rival.answer) == (True, False, False, "among rivals")
    assert (rival.rival_only, rival.extra) == (True, True)
    unsure = scored(asked, hidden, answer("ambiguous", finding("heating", ["supply_sag"])))
    assert (unsure.right, unsure.alone) == (True, False)
    extra = scored(asked, hidden, answer("explained", finding("heating"), finding("asymmetry")))
    assert (extra.right, extra.alone, extra.wrong, extra.extra, extra.rival_only) == (True, False, False, True, False)
    wrong = scored(asked, hidden, answer("explained", finding("supply_sag", ["recirculation"])))
    assert (wrong.right, wrong.wrong, wrong.answer) == (False, True, "supply_sag")
    silent = scored(asked, hidden, answer("adequate"))
    assert (silent.right, silent.wrong, silent.answer) == (False, False, "adequate")


def test_a_pair_is_right_when_both_are_there():
    asked, hidden = order("pair/any/0"), truth("heating", "asymmetry")
    both = scored(asked, hidden, answer("explained", finding("asymmetry"), finding("heating")))
    assert (both.right, both.alone) == (True, True)
    one = scored(asked, hidden, answer("explained", finding("asymmetry")))
    assert (one.right, one.wrong) == (False, False)
    swapped = answer("ambiguous", finding("asymmetry"), finding("supply_sag", ["heating"]))
    assert scored(asked, hidden, swapped).right


def test_a_clean_run_is_right_when_it_is_adequate():
    assert scored(order("clean/white/0"), truth(), answer("adequate")).right
    alarm = scored(order("clean/white/0"), truth(), answer("explained", finding("motor_lag")))
    assert (alarm.right, alarm.wrong, alarm.answer) == (False, True, "motor_lag")
    assert not scored(order("clean/white/0"), truth(), answer("unexplained", place="time")).right


def test_a_lie_is_right_when_it_is_called_one():
    hidden = truth(fault={"kind": "swapped"})
    assert scored(order("fault/swapped/0"), hidden, answer("explained", finding("channel_fault"))).alone


def test_a_crash_is_a_failure():
    crash = scored(order("plain/heating/0"), truth("heating"), {"seconds": 1.0, "error": "ValueError: x", "code": ""})
    assert (crash.failed, crash.right, crash.answer, crash.outcome) == (True, False, "failed", "failed")
    clean = scored(order("clean/white/0"), truth(), {"seconds": 300.0, "error": "timeout", "code": ""})
    assert not clean.right


@pytest.mark.parametrize(
    ("said", "outcome"),
    [
        (answer("unexplained", place="time"), "located"),
        (answer("unexplained", finding("asymmetry"), place="time"), "located, named"),
        (answer("unexplained", place="flow_speed"), "misplaced"),
        (answer("explained", finding("zero_drift")), "wrong name"),
        (answer("adequate"), "missed"),
    ],
)
def test_outcomes_of_the_open_world(said, outcome):
    found = scored(order("outside/gain_step/0"), truth("gain_step"), said)
    assert found.outcome == outcome
    assert found.good == outcome.startswith("located")


def test_twins_are_not_counted_and_listed():
    near = [{"rival": "exponent", "form": "below", "left": 2.5}]
    hidden = truth("dead_band", twins=near)
    whole = scored(order("plain/dead_band/0"), hidden, answer("ambiguous", finding("dead_band", ["exponent"])))
    without = scored(order("removed/dead_band/0", "dead_band"), hidden, answer("explained", finding("exponent")))
    assert not without.counted
    (row,) = twins([whole, without])
    assert (row["effect"], row["twin"], row["left"]) == ("dead_band", "exponent", [2.5, 2.5])
    assert row["rivals_stated"]["hits"] == 1
    assert row["said_instead"] == {"exponent": 1}
    shown = {g.what: g for g in goals([whole, without])}
    assert shown["open world: a wrong name instead"].n == 0


def test_a_crash_on_a_twin_is_a_failure_that_the_open_world_does_not_count():
    hidden = truth("dead_band", twins=[{"rival": "exponent", "form": "below", "left": 2.5}])
    crash = {"seconds": 1.0, "error": "ValueError: x", "code": ""}
    found = scored(order("removed/dead_band/0", "dead_band"), hidden, crash)
    assert (found.failed, found.counted, found.good) == (True, False, False)
    assert twins([found])[0]["said_instead"] == {"failed": 1}
    assert {g.what: g for g in goals([found])}["open world: unexplained, right place"].n == 0


def test_what_a_measured_rate_explains_is_a_twin():
    hidden = truth("motor_lag", twins=[{"rival": "time_skew", "form": "", "left": 30.0}])
    with_rate = hidden | {"channels": ["rotation_rate"]}
    said = answer("explained", finding("rotation_coupling"))
    asked = order("removed/motor_lag/0", "motor_lag")
    assert scored(asked, hidden, said).counted
    assert not scored(asked, with_rate, said).counted
    whole = scored(order("plain/motor_lag/0"), with_rate, said)
    assert whole.near == Near("time_skew", 30.0), "the catalogue holds it: the rate tells more, not less"


def test_intervals_and_held_out_errors():
    asked, hidden = order("clear/dead_band/0"), truth("dead_band", form="shrink", half_width=0.5)
    told = answer("explained", finding("dead_band", form="shrink", half_width=(0.53, 0.01)))
    t = np.linspace(0.0, 1.0, 400)
    noise = 0.1 * np.random.default_rng(1).standard_normal(t.size)
    found = scored(asked, hidden, told, (t, t + noise), {"model": t + 3.0, "baseline": 0.0 * t})
    (interval,) = found.intervals
    assert interval.z == pytest.approx(3.0)
    assert not interval.covers
    wide = answer("explained", finding("dead_band", form="shrink", half_width=(0.53, 0.01)))
    wide["diagnosis"]["findings"][0]["parameters"]["half_width"]["low"] = 0.49
    assert scored(asked, hidden, wide).intervals[0].covers, "as it was told, lopsided"
    assert found.held_out.model == pytest.approx(1.0, abs=0.01)  # a constant is a tare, not an error
    assert found.held_out.baseline > 2.0
    other = scored(asked, hidden, answer("explained", finding("dead_band", form="jump", half_width=(0.5, 0.1))))
    assert other.intervals == ()


def test_alarms_under_wide_noise_are_goals_beside_the_plain_ones():
    clean = [Score(order(f"clean/white/{i}"), (), "adequate") for i in range(9)]
    alarm = [Score(order(f"wide/wide_slow/{i}"), (), "adequate" if i else "explained") for i in range(10)]
    told = {g.what: g for g in goals([*clean, *alarm])}
    assert told["false alarms, clean recordings"].value == 0.0
    assert told["false alarms, clean recordings with wide noise"].value == pytest.approx(0.1)
    assert told["false alarms, wide_slow noise"].value == pytest.approx(0.1)
    assert not [name for name in (g.what for g in goals(clean)) if "wide" in name]


def test_rates_have_wilson_s_interval_and_goals_four_states():
    assert (Rate(0, 20).low, Rate(0, 20).high) == (0.0, pytest.approx(0.1611, abs=1e-4))
    assert (Rate(20, 20).low, Rate(20, 20).high) == (pytest.approx(0.8389, abs=1e-4), pytest.approx(1.0))
    assert of_rate("", Rate(99, 100), least=0.92).met == "yes"
    assert of_rate("", Rate(95, 100), least=0.92).met == "reached"
    assert of_rate("", Rate(90, 100), least=0.92).met == "open"
    assert of_rate("", Rate(70, 100), least=0.92).met == "no"
    assert of_rate("", Rate(0, 0), least=0.92).met == of_rate("", Rate(3, 4)).met == ""
    assert of_rate("", Rate(0, 1000), least=0.003, most=0.02).met == "open"  # too silent is no virtue
    assert Goal("", 0.0, 1.05, 1.2, 1.2, 1.2, 30, percent=False).met == "no"


def test_the_strength_that_is_named_in_half_the_runs():
    assert half({2.0: Rate(5, 20), 4.0: Rate(15, 20)}) == pytest.approx(np.sqrt(8.0))
    dip = {2.0: Rate(0, 10), 4.0: Rate(6, 10), 8.0: Rate(4, 10)}  # chance: 0.5 at both
    assert half(dip) == pytest.approx(4.0)
    assert half({2.0: Rate(0, 10), 4.0: Rate(2, 10)}) == np.inf
    only_plain = [Score(order("plain/heating/0"), ("heating",), "explained", ("heating",))]
    assert half_named(only_plain) == []  # its fainter strengths were not tried
