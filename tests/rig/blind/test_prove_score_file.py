"""Scores that come from a file: counted, asked again, or refused."""

import json
from dataclasses import replace
from gzip import compress

import pytest
from click.testing import CliRunner

from rig.blind import score_file
from rig.blind.collecting import Known, collected
from rig.blind.command import designed, prove_command
from rig.blind.design import Order, design
from rig.blind.scoring.score import Score
from rig.blind.store import Store, version_of_diagnosis
from tests.rig.blind_scores import CATALOGUE, WORLD, answer, truth, whole_proof


def test_scores_of_another_machine_come_back_as_they_were(tmp_path):
    jobs = {order.id: job for job in design(WORLD, CATALOGUE, 2) for order in job.orders}
    known = [Known(s, "abc", jobs[s.order.id].digest) for s in whole_proof(2)]
    for name in ("scores.jsonl", "scores.jsonl.gz"):
        score_file.write(tmp_path / name, [*known, *known])
        assert score_file.read(tmp_path / name) == sorted(known, key=lambda each: each.score.order.id)
    assert score_file.read(tmp_path / "none.jsonl") == []


def test_scores_of_another_version_or_design_are_asked_again():
    one, other = jobs = design(WORLD, CATALOGUE, 1, ["plain/asymmetry/0", "plain/heating/0"])
    asked = one.orders[0]
    score = Score(asked, ("asymmetry",), "explained")
    told = [Known(score, "abc", one.digest), Known(score, "old", one.digest)]
    known = {asked.id: told[0]}
    assert score_file.usable(told, jobs, "abc") == score_file.usable(told, jobs, "abc", others=True) == known
    assert score_file.usable(told, jobs, "new") == {}
    assert set(score_file.usable(told, jobs, "new", others=True)) == {asked.id}
    assert score_file.usable(told, [replace(one, spec={}), other], "abc") == {}
    assert {o.id for job in score_file.unanswered(jobs, known) for o in job.orders} == {
        o.id for job in jobs for o in job.orders
    } - {asked.id}


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.jsonl", b'{"version": "abc"}\n'),
        ("a.jsonl", b"scores\n"),
        ("a.jsonl", b"null\n"),
        ("a.jsonl.gz", b"{}"),
        ("a.jsonl.gz", compress(b"{}", mtime=0)[:12] + b"broken broken"),
        ("a.jsonl", b"\xff\xfe"),
    ],
)
def test_a_file_that_holds_no_scores_is_refused(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    words = ["--no-run", "--only", "plain/heating/0", "--store", str(tmp_path / "s"), "--scores", str(tmp_path / name)]
    done = CliRunner().invoke(prove_command, words)
    assert done.exit_code == 2
    assert f"{name}" in done.output
    assert "rig prove --scores" in done.output
    assert (tmp_path / name).read_bytes() == content


def test_what_a_file_of_scores_holds_is_counted_and_not_asked(tmp_path):
    (job,) = designed(1, ["plain/heating/0"])
    score = Score(job.orders[0], ("heating",), "explained", named=("heating",))
    older = Score(Order("plain/dead_band/0"), ("dead_band",), "adequate")
    file = tmp_path / "scores.jsonl.gz"
    score_file.write(file, [Known(score, version_of_diagnosis(), job.digest), Known(older, "old", "0")])
    words = ["--only", "plain/heating/0", "--seeds", "1", "--store", str(tmp_path / "s"), "--scores", str(file)]
    done = CliRunner().invoke(prove_command, words)
    assert done.exit_code == 0, done.output
    assert "1 answers, 0 of them crashed, refused or overdue; 0 still to come" in done.output
    assert not (tmp_path / "s").exists(), "nothing was asked"
    assert {k.score.order.id for k in score_file.read(file)} == {"plain/heating/0", "plain/dead_band/0"}


def test_scores_that_another_proof_wrote_meanwhile_are_kept(tmp_path, monkeypatch):
    file = tmp_path / "scores.jsonl"
    theirs = Known(Score(Order("clean/white/7"), (), "adequate"), "abc", "0")
    monkeypatch.setattr("rig.blind.command.run", lambda *_, **__: score_file.write(file, [theirs]))
    words = ["--only", "plain/heating/0", "--seeds", "1", "--store", str(tmp_path / "s"), "--scores", str(file)]
    assert CliRunner().invoke(prove_command, words).exit_code == 0
    assert score_file.read(file) == [theirs]


def test_failures_that_the_file_of_scores_tells_are_asked_again(tmp_path, monkeypatch):
    file, names, asked = tmp_path / "scores.jsonl", ["plain/heating/0", "plain/asymmetry/0"], []
    jobs = designed(1, names)
    scores = [Score(job.orders[0], ("asymmetry",), "explained", (job.id.split("/")[1],)) for job in jobs]
    score_file.write(file, [Known(s, "old", job.digest) for s, job in zip(scores, jobs, strict=True)])
    monkeypatch.setattr("rig.blind.command.run", lambda _, jobs, *__, **___: asked.extend(job.id for job in jobs))
    words = ["--failures", "--seeds", "1", "--store", str(tmp_path / "s"), "--scores", str(file)]
    done = CliRunner().invoke(prove_command, [*words, *(word for name in names for word in ("--only", name))])
    assert done.exit_code == 0, done.output
    assert asked == ["plain/heating/0"]


def test_a_newer_score_from_elsewhere_counts_before_an_older_answer_of_the_store(tmp_path):
    (job,) = design(WORLD, CATALOGUE, 1, ["plain/heating/0"])
    order = job.orders[0]
    store = Store(tmp_path)
    (tmp_path / "sealed").mkdir()
    seal = truth("heating") | {"asked": job.asked()}
    (tmp_path / "sealed" / f"{job.token}.json").write_text(json.dumps(seal), encoding="utf-8")
    store.put(job, order, answer("adequate") | {"code": "old"})
    newer = Known(Score(order, ("heating",), "explained", named=("heating",)), "new", job.digest)
    for version, said in (("new", "explained"), ("old", "adequate"), ("", "adequate")):
        found = collected(store, [job], {order.id: newer}, version)
        assert [s.said for s in found.scores] == [said]
    file = tmp_path / "scores.jsonl"
    score_file.write(file, [newer, *collected(store, [job]).known])
    assert {k.version for k in score_file.read(file)} == {"new", "old"}, "neither is lost"
