"""The lane of recorded cases: its design, its figures, and one case from seal to score."""

from dataclasses import replace

import pytest

from rig.blind.collecting import Known, collected
from rig.blind.command import designed
from rig.blind.design import Order, design
from rig.blind.score_file import read, write
from rig.blind.scoring.on_benches import bench_besides, bench_goals
from rig.blind.scoring.score import Interval, Near, Score, scored, thrust_constant
from rig.blind.store import Store
from rig.blind.workers import Lane, carry_out
from tests.rig.blind_scores import CATALOGUE, WORLD, answer, truth

BENCHED = replace(WORLD, benches=("a", "b"), recorded=("dead_band", "heating", "fouling"), recorded_version="w2")


def test_each_bench_gets_its_share_of_each_kind():
    jobs = [job for job in design(BENCHED, CATALOGUE, 4) if "bench" in job.spec]
    labels = {job.orders[0].label for job in jobs}
    assert labels == {"nothing", "pair", *(f"{s}:{e}" for s in ("clear", "plain") for e in ("dead_band", "heating"))}
    nothing = [job for job in jobs if job.orders[0].label == "nothing"]
    assert len(nothing) == 12
    assert sum(job.spec["bench"] == "a" for job in nothing) == 6
    pairs = [job.spec["effects"] for job in jobs if job.orders[0].label == "pair"]
    assert len(pairs) == 8
    assert all(set(two) == {"dead_band", "heating"} for two in pairs)
    assert {job.world for job in jobs} == {"w2"}
    asked = {job.orders[0].label: job.spec.get("rivals") for job in jobs}
    assert asked == {label: _rivals(label) for label in labels}
    assert {job.orders[0].id for job in design(BENCHED, CATALOGUE, 4, ["bench/*"])} == {j.orders[0].id for j in jobs}
    assert not [job for job in design(WORLD, CATALOGUE, 4) if "bench" in job.spec]


def _rivals(label: str) -> list[str] | None:
    """Of a single effect the other one."""
    return {"dead_band": ["heating"], "heating": ["dead_band"]}.get(label.partition(":")[2])


def score(label: str, *effects: str, **facts) -> Score:
    return Score(Order(f"bench/{label}/0"), effects, **{"said": "explained", "named": effects, **facts})


def test_figures():
    covers, misses = Interval("", "C", 0.5, True), Interval("", "C", 4.0, False)
    scores = [
        score("nothing", said="adequate", constant=covers),
        score("nothing", named=("dead_band",), constant=misses),
        score("clear:heating", "heating", constant=covers),
        score("plain:heating", "heating", said="unexplained", constant=misses),
        score("plain:heating", "heating", named=("asymmetry",), near=Near("asymmetry", 0.4)),
        score("pair", "heating", "dead_band", named=("heating",), rivals=("dead_band",)),
    ]
    found = {g.what.removeprefix("bench, "): (g.value, g.n) for g in bench_goals(scores)}
    assert found["nothing concealed: false alarms"] == (0.5, 2)
    assert found["clear: right alone"] == (1.0, 1)
    assert found["plain: right or among stated rivals"] == (0.5, 2)
    assert found["wrong names, one effect"] == (pytest.approx(1 / 3), 3)
    assert found["unexplained beside a right effect"] == (0.5, 2)
    assert found["pairs at 20: both right or among stated rivals"] == (1.0, 1)
    assert found["coverage of the 95 % interval of C"] == (1.0, 2)
    besides = {g.what: (g.value, g.n) for g in bench_besides(scores)}
    assert besides["bench, coverage of the 95 % interval of C, whatever was said"] == (0.5, 4)
    tellable = "right alone, where the nearest neighbour leaves an oracle 8 sigma"
    assert (besides[f"bench, clear: {tellable}"], besides[f"bench, plain: {tellable}"]) == ((1.0, 1), (0.0, 1))


def test_the_constant_of_an_answer(tmp_path):
    told = answer("adequate")
    value = {"value": 0.41, "std": 0.004, "low": 0.402, "high": 0.418}
    told["diagnosis"]["model"] = {"parameters": {"C": value}}
    sealed = truth() | {"baseline": {"C": 0.4}, "bench": {"name": "tank", "loop_rate": 25.0}}
    found = scored(Order("bench/nothing/0"), sealed, told)
    assert found.constant == Interval("", "C", pytest.approx(2.5), False)
    assert "bench tank, loop at 25 Hz" in found.case
    assert thrust_constant(told["diagnosis"], sealed | {"effects": truth("exponent")["effects"]}) is None
    write(tmp_path / "scores.jsonl", [Known(found, "abc", "def")])
    assert read(tmp_path / "scores.jsonl") == [Known(found, "abc", "def")]


@pytest.mark.timeout(600)
def test_one_case_from_seal_to_score(tmp_path):
    """Through drivers, bytes, loop and file, then the processes of the whole proof."""
    (job,) = designed(1, ["bench/plain:dead_band/0"])
    job = replace(job, spec={**job.spec, "plan": "interleaved", "duration": 40.0, "bench": "tunnel"})
    store = Store(tmp_path / "proof")
    carry_out([job], [Lane(store, "0", 240.0, "code")], renew=False, told=lambda _: None)
    found = collected(store, [job])
    assert (found.missing, found.undrawn) == (0, ())
    (one,) = found.scores
    assert not one.failed
    assert one.truth == ("dead_band",)
    assert one.right
    assert one.constant is not None
    assert "bench tunnel" in one.case
    assert one.near is not None
    assert one.near.rival != "dead_band"
    assert 0.0 <= one.near.left <= 41.0
