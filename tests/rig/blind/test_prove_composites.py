"""The lanes of composites and of a second recording: their design, their figures, and one case each to its score."""

from dataclasses import replace

import pytest

from rig.blind.collecting import Collected, Known, collected
from rig.blind.command import designed
from rig.blind.design import Order, design
from rig.blind.report.page import proof_page
from rig.blind.score_file import read, write
from rig.blind.scoring.composites import composite_besides, composite_rows, difference_goals, field_goals
from rig.blind.scoring.score import HeldOut, Near, Score, scored
from rig.blind.scoring.tables import tables
from rig.blind.store import Store
from rig.blind.workers import Lane, carry_out, concealable
from rig.report.page import html
from tests.rig.blind_scores import CATALOGUE, WORLD, answer, finding, truth

COMPOSED = replace(
    WORLD, field=("asymmetry", "dead_band", "heating", "fouling"), added=("exponent", "time_skew", "dead_band")
)


def test_the_lanes_have_their_labels_and_shares():
    jobs = [job for job in design(COMPOSED, CATALOGUE, 20) if "field" in job.spec]
    count = {
        label: sum(job.id.startswith(f"{label}/") for job in jobs) for label in {j.id.rsplit("/", 1)[0] for j in jobs}
    }
    both = {"difference/one_more": 60, "difference/nothing": 30, "difference/changed": 60}
    assert count == {"field/2_effects": 20, "field/3_effects": 20, **both}
    for job in jobs:
        assert set(job.spec["field"]) <= {"asymmetry", "dead_band", "heating"}  # fouling is in no catalogue
        if job.id.startswith("field/"):
            assert len(job.spec["field"]) == int(job.id.split("/")[1][0])
        elif job.id.startswith("difference/nothing/"):
            assert job.spec["more"] == ""
        elif job.id.startswith("difference/changed/"):
            assert job.spec["more"] == ""
            assert job.spec["changed"] in job.spec["field"]
        else:
            assert job.spec["more"] in {"exponent", "time_skew", "dead_band"} - set(job.spec["field"])
            assert job.spec["strength"] == 15.0
            assert not {job.spec["more"], *job.spec["field"]} & set(job.spec["rivals"])
    again = [job for job in design(COMPOSED, CATALOGUE, 20) if "field" in job.spec]
    assert again == jobs
    other = [job for job in design(COMPOSED, CATALOGUE, 20, draw="autumn") if "field" in job.spec]
    assert [job.spec for job in other] != [job.spec for job in jobs]
    assert not [job for job in design(WORLD, CATALOGUE, 20) if "field" in job.spec]


def test_the_world_can_do_what_is_designed():
    kinds = concealable()
    assert len(kinds.field) == 7
    assert set(kinds.field) < set(kinds.added) < set(kinds.effects)


def field(*found, said="explained", error=1.0):
    """Of a case that hides winding loss and a dead band clearly, heating faintly."""
    hidden, seen = ("winding_resistance", "dead_band", "heating"), (300.0, 20.0, 4.0)
    named, rivals = (tuple(f for f in found if ("~" in f) == among) for among in (False, True))
    rivals = tuple(f.strip("~") for f in rivals)
    held = HeldOut(error, 3.0, 0.1)
    return Score(Order("field/3_effects/0"), hidden, said, named, rivals, held_out=held, strengths=seen)


def test_figures_of_composites():
    scores = [
        field("winding_resistance", "dead_band"),
        field("winding_resistance", "dead_band", "heating", error=1.2),
        field("winding_resistance", "~dead_band", said="ambiguous", error=2.0),
        field("winding_resistance", "exponent", said="unexplained"),
    ]
    assert [s.good for s in scores] == [True, True, True, False]
    found = {g.what.removeprefix("field"): (g.value, g.n) for g in field_goals(scores)}
    assert found[", effects at 15 or more: named"] == (0.75, 8)
    assert found[", effects at 15 or more: named or among stated rivals"] == (0.875, 8)
    assert found[": a name that is not there"] == (0.25, 4)
    assert found[": unexplained"] == (0.25, 4)
    assert found[", held-out error over that of the true model, median"] == (pytest.approx(1.1), 4)
    besides = {g.what: (g.value, g.n) for g in composite_besides(scores, ())}
    assert besides["field, effects below 15: named"] == (0.25, 4)
    assert besides["field: all effects at 15 or more named, and no other"] == (0.5, 4)
    rows = {row["effect"]: row for row in composite_rows(scores)}
    assert rows["dead_band"]["clear"] == 4
    assert (rows["dead_band"]["named"], rows["dead_band"]["among_rivals"]) == (2, 1)
    assert rows["dead_band"]["said_where_missed"] == {"exponent": 1}
    assert (rows["heating"]["clear"], rows["heating"]["faint_named"]) == (0, 1)


def again(label, truth_, *named, said="explained", rivals=(), near=None):
    seen = (15.0,) * len(truth_)
    return Score(Order(f"difference/{label}/0"), truth_, said, named, rivals, strengths=seen, near=near)


def test_figures_of_differences():
    one = ("heating",)
    scores = [
        again("one_more", one, "heating"),
        again("one_more", one, "heating", said="ambiguous", rivals=("supply_sag",)),
        again("one_more", one, "heating", "thrust_constant"),
        again("one_more", one, "heating", said="unexplained"),
        again("one_more", one, "exponent", near=Near("amounts of the known", 2.0)),
        again("nothing", (), said="adequate"),
        again("nothing", (), "thrust_constant"),
        again("changed", one, "heating"),
        again("changed", one, "heating", "dead_band"),
    ]
    assert [s.good for s in scores] == [True, True, False, False, False, True, False, True, False]
    found = {g.what.removeprefix("difference, "): (g.value, g.n) for g in difference_goals(scores)}
    assert found == {
        "one more: right or among stated rivals": (0.8, 5),
        "one more: exactly it": (0.4, 5),
        "one more: wrong names": (0.2, 5),
        "nothing changed: alarms": (0.5, 2),
        "another amount: right or among stated rivals": (1.0, 2),
        "another amount: exactly it": (0.5, 2),
        "another amount: wrong names": (0.0, 2),
    }
    besides = {g.what: (g.value, g.n) for g in composite_besides((), scores)}
    assert besides["difference, one more: exactly it, and no rival stated"] == (0.2, 5)
    assert besides["difference, one more: exactly it, where all else leaves an oracle 8 sigma"] == (0.5, 4)
    assert besides["difference: a thrust constant that is said to have changed"] == (pytest.approx(2 / 9), 9)


def test_what_the_first_could_not_show_is_claimed_where_nothing_else_is():
    def told(truth_, *found, verdict="explained"):
        sealed = truth(*truth_) if truth_ else truth() | {"effects": []}
        return scored(Order(f"difference/{'one_more' if truth_ else 'nothing'}/0"), sealed, answer(verdict, *found))

    new, maybe = finding("heating") | {"since": "changed"}, finding("dead_band") | {"since": "not shown before"}
    beside = told(("heating",), new, maybe)
    assert (beside.named, beside.not_shown) == (("heating",), ("dead_band",))
    assert (beside.exact, beside.extra, beside.wrong) == (True, False, False)
    only = told(("dead_band",), maybe)
    assert (only.right, only.exact, only.wrong) == (True, True, False)
    assert not told(("heating",), maybe).right
    assert told((), maybe).right
    assert not told((), new, maybe).right
    assert not told((), maybe, verdict="unexplained").right


def test_only_what_came_on_top_is_hidden_in_a_second_recording(tmp_path):
    sealed = truth("asymmetry", "heating") | {"known": ["asymmetry"]}
    told = answer("explained", finding("heating"), finding("asymmetry", ratio=(0.7, 0.01)))
    found = scored(Order("difference/one_more/0"), sealed, told)
    assert (found.truth, found.strengths) == (("heating",), (40.0,))
    assert (found.right, found.exact, found.extra) == (True, False, True)
    assert found.known == ("asymmetry",)
    not_new = {g.what: g.value for g in composite_besides((), [found])}
    assert not_new["difference: a name that is not new, for the first recording has it as well"] == 1.0
    assert found.intervals == ()  # what comes on top of a known effect is not that effect's own value
    write(tmp_path / "scores.jsonl", [Known(found, "abc", "def")])
    assert read(tmp_path / "scores.jsonl") == [Known(found, "abc", "def")]


def test_the_page_has_both_lanes():
    scores = [
        field("winding_resistance"),
        again("one_more", ("heating",), "heating"),
        again("nothing", (), said="adequate"),
    ]
    figures = tables(scores, 1, ("abc",), ())
    page = html(proof_page(Collected(tuple(Known(s, "abc", "") for s in scores), 0, ()), figures))
    for text in ("Composites and differences", "One effect more in a second recording", "nothing changed: alarms"):
        assert text in page


@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", ["field/2_effects/1", "difference/nothing/0"])
def test_one_case_from_seal_to_score(tmp_path, name):
    (job,) = designed(2, [name])
    spec = {**job.spec, "field": ["asymmetry", "winding_resistance"], "duration": 90.0, "sampling": 25.0}
    job = replace(job, spec=spec | {"plan": "interleaved", "noise": "white"})
    store = Store(tmp_path / "proof")
    carry_out([job], [Lane(store, "0", 240.0, "code")], renew=False, told=lambda _: None)
    found = collected(store, [job])
    assert (found.missing, found.undrawn) == (0, ())
    (one,) = found.scores
    assert not one.failed
    assert one.held_out is not None
    if name.startswith("field/"):
        assert set(one.clear) <= {*one.named, *one.rivals}
        assert "first" not in store.answer(job, job.orders[0])
    else:
        assert one.truth == ()
        first = store.answer(job, job.orders[0])["first"]
        assert {f["effect"] for f in first["findings"]} & {"asymmetry", "winding_resistance"}
