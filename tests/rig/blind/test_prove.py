"""The blind proof: its page, its command, and a tiny form end to end."""

import json
from dataclasses import replace

import pytest
from click.testing import CliRunner

from rig.blind.collecting import Collected, Known, collected, not_good
from rig.blind.command import designed, prove_command
from rig.blind.design import Job
from rig.blind.report.page import proof_page
from rig.blind.scoring.tables import confusion, tables, worst
from rig.blind.store import ProofError, Store
from rig.blind.workers import Lane, carry_out
from rig.report.page import html
from tests.rig.blind_scores import whole_proof


def test_figures_of_a_whole_proof_are_json_and_a_page():
    scores = whole_proof()
    figures = json.loads(json.dumps(tables(scores, 4, ("abc", "def"), ("faint/x/0: no",)), allow_nan=False))
    assert sum(confusion(scores, "plain")["heating"].values()) == 4
    assert figures["goals"][0]["n"] == 20
    assert {row["cell"] for row in figures["open_world"]} == {"outside", "removed"}
    assert worst(scores)[0]["failures"] >= worst(scores)[-1]["failures"]
    told = store_less(scores)
    assert told.versions == ("abc", "def")
    page = html(proof_page(told, figures))
    for text in ("Open world", "False alarms by kind of noise", "Twins", "Detection power", "✗ missed", "--renew"):
        assert text in page


def store_less(scores):
    versions = ["abc" if i % 3 else "def" for i in range(len(scores))]
    known = tuple(Known(s, v, "") for s, v in zip(scores, versions, strict=True))
    return Collected(known, 0, ("faint/x/0: no",))


def test_the_page_names_the_form_that_could_not_be_drawn():
    found = Collected((), 0, ("variant/dead_band:smooth/2: no such case", "variant/dead_band:smooth/3: no"))
    assert "at that strength: variant/dead_band:smooth (2)." in html(proof_page(found, tables([], 1, (), ())))


def test_a_page_of_nothing_is_still_a_page():
    figures = tables([], 1, (), ())
    assert "not measured" in html(proof_page(collected(Store(None), []), figures))


TINY = ("clean/white/0", "plain/dead_band/0", "plain/asymmetry/0", "removed/asymmetry/0", "outside/gain_step/0")


@pytest.mark.timeout(600)
def test_a_tiny_proof_end_to_end(tmp_path):
    """Shortened recordings; the same road as the whole proof: three processes, seals, answers, page, resumed."""
    jobs = [shortened(job) for job in designed(1, TINY)]
    store = Store(tmp_path / "proof")
    lane = Lane(store, "0", 120.0, "code")
    carry_out(jobs[:2], [lane], renew=False, told=lambda _: None)
    assert collected(store, jobs).missing > 0
    lane = Lane(store, "0", 120.0, "code")
    carry_out([j for j in jobs if store.pending(j)], [lane], renew=False, told=lambda _: None)
    found = collected(store, jobs)
    assert (found.missing, found.undrawn, found.versions) == (0, (), ("code",))
    by_id = {s.order.id: s for s in found.scores}
    assert set(by_id) == set(TINY)
    assert not any(s.failed for s in found.scores)
    assert by_id["plain/asymmetry/0"].right
    assert by_id["plain/asymmetry/0"].held_out.left < 0.3
    assert "asymmetry" not in by_id["removed/asymmetry/0"].named
    assert by_id["removed/asymmetry/0"].near is not None
    assert not list(store.opened.iterdir())  # recordings are dropped once they are answered
    assert not any(store.pending(job) for job in jobs)
    again = {o.id for job in not_good(found, jobs) for o in job.orders}
    assert again == {name for name, s in by_id.items() if not s.good}
    assert all(store.pending(job, "other code") for job in jobs)
    with pytest.raises(ProofError, match="of another design"):
        store.truth(replace(jobs[0], spec={}))


def shortened(job: Job) -> Job:
    return replace(job, spec={**job.spec, "duration": 120.0, "sampling": 25.0, "plan": "interleaved"})


def test_the_command_says_what_is_wrong(tmp_path):
    done = CliRunner().invoke(prove_command, ["--only", "plain/nothing", "--store", str(tmp_path)])
    assert done.exit_code == 2
    assert "no case is called plain/nothing" in done.output


@pytest.mark.parametrize("limit", ["-5", "0", "nan", "inf"])
def test_a_limit_that_no_diagnosis_can_keep_is_refused(tmp_path, limit):
    """Below 0 each answer was a timeout; the others ended in a traceback."""
    done = CliRunner().invoke(prove_command, ["--limit", limit, "--no-run", "--store", str(tmp_path)])
    assert done.exit_code == 2
    assert "--limit must be above 0 s" in done.output


def test_the_command_tells_an_empty_store(tmp_path):
    out = tmp_path / "figures.json"
    words = ["--no-run", "--seeds", "1", "--store", str(tmp_path), "--json", str(out)]
    done = CliRunner().invoke(prove_command, words)
    assert done.exit_code == 0, done.output
    assert "0 answers" in done.output
    assert json.loads(out.read_text(encoding="utf-8"))["format"] == "thruster-rig-proof"
