"""The blind proof: its design, its scoring on made-up answers, its page, and a tiny form end to end."""

import json
import os
import signal
import sys
from dataclasses import replace
from gzip import compress
from threading import Thread
from time import monotonic, sleep
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from identification.mismatch.compare.simulation import Prediction
from rig.blind import answering, score_file
from rig.blind.answering import answered
from rig.blind.collecting import Collected, Known, collected, not_good
from rig.blind.command import _counted, designed, interruptible, prove_command
from rig.blind.design import Job, Order, design, matches
from rig.blind.report.page import proof_page
from rig.blind.scoring.metrics import goals, half, half_named
from rig.blind.scoring.places import PLACES
from rig.blind.scoring.rates import Goal, Rate, of_rate
from rig.blind.scoring.same_parameters import SAME, true_values
from rig.blind.scoring.score import Near, Score, scored
from rig.blind.scoring.tables import confusion, tables, twins, worst
from rig.blind.store import ProofError, Store, version_of_diagnosis
from rig.blind.workers import STOPPING, BrokenOff, Child, Ended, Lane, Overdue, carry_out, concealable
from rig.report.page import html
from sim_devices.concealed.sealing.on_disc import conceal
from sim_devices.tables import WorldError
from tests.rig.blind_scores import CATALOGUE, WORLD, answer, finding, order, truth, whole_proof
from tests.rig.report_reading import open_fonts


@pytest.fixture(autouse=True, scope="module")
def fonts():
    open_fonts()


def test_the_design_has_every_cell_and_breaks_off_evenly():
    jobs = design(WORLD, CATALOGUE, 6)
    orders = [o.id for job in jobs for o in job.orders]
    assert len(set(orders)) == len(orders)
    assert len({job.token for job in jobs}) == len(jobs)
    cells = {o.split("/")[0] for o in orders}
    assert cells >= {
        "faint",
        "clear",
        "plain",
        "removed",
        "outside",
        "form",
        "variant",
        "fault",
        "pair",
        "clean",
        "power_2.3",
    }
    half_done = [job.id for job in jobs[: len(jobs) // 2]]
    for label in ("faint/dead_band", "plain/heating", "outside/fouling", "fault/frozen"):
        assert 2 <= sum(name.startswith(f"{label}/") for name in half_done) <= 4
    assert sum(name.startswith("clean/") for name in orders) == 300
    assert all(not set(job.token) - set("0123456789abcdef") for job in jobs)  # the token tells nothing


def test_the_physics_that_is_taken_out_is_asked_of_the_same_recording():
    (job,) = [job for job in design(WORLD, CATALOGUE, 1) if job.id == "plain/heating/0"]
    assert [(o.id, o.without) for o in job.orders] == [("plain/heating/0", ()), ("removed/heating/0", ("heating",))]
    assert "heating" not in job.spec["rivals"]
    (only,) = design(WORLD, CATALOGUE, 1, ["removed/heating"])
    assert [o.id for o in only.orders] == ["removed/heating/0"]
    assert (only.token, only.seed) == (job.token, job.seed)


def test_another_draw_has_the_same_orders_and_other_cases():
    first, second = (design(WORLD, CATALOGUE, 2, draw=draw) for draw in ("", "autumn"))
    assert [job.id for job in first] == [job.id for job in second]
    assert [o for job in first for o in job.orders] == [o for job in second for o in job.orders]
    assert not {job.token for job in first} & {job.token for job in second}
    assert not {tuple(job.seed) for job in first} & {tuple(job.seed) for job in second}
    pairs = [[job.spec["effects"] for job in jobs if job.id.startswith("pair/")] for jobs in (first, second)]
    assert pairs[0] != pairs[1]


def test_a_case_is_of_one_world(tmp_path):
    (job,) = design(replace(WORLD, version="abc"), CATALOGUE, 1, ["plain/heating"])
    assert job.asked()["world"] == "abc"
    with pytest.raises(WorldError, match="asked was abc"):
        conceal(job.asked(), tmp_path)
    assert job.digest != replace(job, world="abd").digest


def test_orders_are_asked_for_by_pattern():
    assert matches("clean/white/12", ["clean/white/12"])
    assert matches("clean/white/12", ["faint", "clean/*"])
    assert not matches("clean/white/12", ["clean/white/1"])


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


def test_parameters_that_mean_the_same_are_known_for_effects_of_the_world():
    known = set(concealable().effects)
    assert set(SAME) <= known
    assert known == set(PLACES)
    told = truth("cavitation", form="linear", slope=0.1, onset=12.0)
    assert true_values("cavitation", "linear", told) == {"slope": 0.2, "onset": 6.0}
    line = true_values("periodic_disturbance", "rotation", truth("periodic_disturbance", amplitude=0.3, blades=4))
    assert line == {"amplitude": 0.3, "periods_per_turn": 4.0, "periods_per_volt_second": 8.0}


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


def test_the_diagnosing_process_cannot_open_a_seal(tmp_path):
    for name in ("open", "sealed", "answers"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x.json").write_text("{}", encoding="utf-8")
    code = (
        "import sys; from pathlib import Path; from rig.blind.answering import Sealed, blindfold\n"
        "root = Path(sys.argv[1]); blindfold(root, root / 'open', root / 'answers')\n"
        "(root / 'open/x.json').read_text(); (root / 'answers/y.json').write_text('')\n"
        "list((root / 'open').iterdir())\n"
        "seen = []\n"
        "for act in ((root / 'sealed/x.json').read_text, lambda: list((root / 'sealed').iterdir()),\n"
        "            (root / 'open/../sealed/x.json').read_text, lambda: open(bytes(root / 'sealed/x.json')),\n"
        "            (root / 'answers/x.json').read_text, lambda: list((root / 'answers').iterdir()),\n"
        "            lambda: (root / 'open/z.json').write_text('')):\n"
        "    try: act()\n"
        "    except Sealed: seen.append(1)\n"
        "assert len(seen) == 7, seen\n"
        "assert not [m for m in sys.modules if m.startswith('sim_devices')]\n"
    )
    child = Child([sys.executable, "-c", code, str(tmp_path)], tmp_path / "log")
    with pytest.raises(Ended, match="exit status 0"):
        child.ask({}, 60.0)


def test_a_diagnosis_that_crashes_has_an_answer(tmp_path):
    said, arrays = answered(tmp_path)  # no recording at all
    assert said["error"] == "refused: no recording was given"
    assert arrays == {}


def test_predictions_of_an_earlier_answer_do_not_stay_beside_a_new_one(tmp_path, monkeypatch):
    (job,) = design(WORLD, CATALOGUE, 1, ["plain/heating/0"])
    store, line = Store(tmp_path), {"token": job.token, "tag": "whole", "without": [], "code": "abc"}
    arrays = {"model": np.ones(3), "baseline": np.zeros(3)}
    monkeypatch.setattr(answering, "answered", lambda *_: (answer("explained"), arrays))
    answering.work(store.opened, store.answers, line)
    assert store.predictions(job, job.orders[0])["model"].tolist() == [1.0, 1.0, 1.0]
    arrays.clear()
    answering.work(store.opened, store.answers, line)
    assert store.predictions(job, job.orders[0]) is None
    assert [path.name for path in (store.answers / job.token).iterdir()] == ["whole.json"]


def test_a_prediction_that_runs_away_is_none(tmp_path, monkeypatch):
    """It would make every quantile of the errors no number, and the JSON of the proof impossible."""
    columns = [{"stream": "drive", "name": "u", "quantity": "command_voltage", "unit": "V", "thruster": ""}]
    about = np.array(json.dumps({"recording_id": "a", "thruster": "T1", "columns": columns, "steps": []}))
    t = np.arange(3.0)
    np.savez(tmp_path / "drive.npz", about=about, time0=t, value0=t, at=t)
    found = SimpleNamespace(twin="a twin", baseline={"C": SimpleNamespace(value=0.4)})
    for thrust, predicted in (([0.0, 1.0, 2.0], ["model", "baseline"]), ([0.0, np.inf, 2.0], [])):
        monkeypatch.setattr(answering, "simulate", lambda *_, thrust=thrust: Prediction(t, np.array(thrust), None))
        why, arrays = answering.predictions(found, tmp_path / "drive.npz")
        assert list(arrays) == predicted
        assert (why is None) == bool(predicted)


def test_a_child_that_is_late_is_killed_and_started_again(tmp_path):
    code = "import sys\nfor line in sys.stdin:\n    print('ok' if 'x' in line else input(), flush=True)"
    child = Child([sys.executable, "-c", code], tmp_path / "log")
    child.ask({"x": 1}, 30.0)
    with pytest.raises(Overdue):
        child.ask({}, 0.2)
    child.ask({"x": 1}, 30.0)
    child.close()


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


def test_what_is_broken_off_is_no_answer(tmp_path):
    """Ctrl+C while a diagnosis thinks: no answer, and no process is started for the orders that follow."""
    jobs = design(WORLD, CATALOGUE, 1, ["plain/heating/0", "removed/heating/0"])
    store = Store(tmp_path)
    lane = Lane(store, "0", 60.0, "code")
    begun = tmp_path / "begun"
    sleeps = f"import pathlib, time; input(); pathlib.Path({str(begun)!r}).touch(); time.sleep(60)"
    says = f"import pathlib; input(); pathlib.Path({str(store.opened / jobs[0].token)!r}).mkdir(); print('made')"
    lane.world = Child([sys.executable, "-c", says], tmp_path / "world.log")
    lane.diagnosis = Child([sys.executable, "-c", sleeps], tmp_path / "log")
    seal = truth("heating") | {"asked": jobs[0].asked()}
    (tmp_path / "sealed").mkdir()
    (tmp_path / "sealed" / f"{jobs[0].token}.json").write_text(json.dumps(seal), encoding="utf-8")
    seen = []
    thread = Thread(target=lambda: seen.append(_raised(lambda: lane.carry_out(jobs[0]))))
    thread.start()
    end = monotonic() + 30.0
    while not begun.exists() and monotonic() < end:
        sleep(0.01)
    lane.close(0.0)
    thread.join(30.0)
    assert seen == [BrokenOff]
    assert lane.diagnosis.process is None
    assert not list(store.answers.rglob("*.json"))
    assert len(store.pending(jobs[0])) == 2


def test_ctrl_c_in_the_terminal_does_not_reach_a_child(tmp_path):
    """It goes to the group of the processes that the terminal started; a child that died of it counted as a failure."""
    child = Child([sys.executable, "-c", "input(); print('ok')"], tmp_path / "log")
    child.ask({}, 30.0)
    assert os.getpgid(child.process.pid) == child.process.pid != os.getpgrp()
    child.close()


def test_a_proof_that_is_killed_ends_its_diagnoses_as_on_ctrl_c():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as under nohup
    try:
        with interruptible():
            os.kill(os.getpid(), signal.SIGHUP)
        with pytest.raises(KeyboardInterrupt), interruptible():
            os.kill(os.getpid(), signal.SIGTERM)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_proof_that_is_broken_off_waits_for_nobody(tmp_path):
    """Though no job is waiting any more: the last diagnoses may think for minutes, one lane after the other."""
    jobs = design(WORLD, CATALOGUE, 2, ["plain/heating"])
    store = Store(tmp_path)
    (tmp_path / "sealed").mkdir()
    for job in jobs:
        seal = truth("heating") | {"asked": job.asked()}
        (tmp_path / "sealed" / f"{job.token}.json").write_text(json.dumps(seal), encoding="utf-8")
        (store.opened / job.token).mkdir(parents=True)
        store.recordings_are_whole(job)
    quick, slow = lanes = [Lane(store, name, 60.0, "code") for name in "01"]
    quick.diagnosis = Child([sys.executable, "-c", "input(); print('answered')"], tmp_path / "quick.log")
    slow.diagnosis = Child([sys.executable, "-c", "import time; time.sleep(60)"], tmp_path / "slow.log")

    def interrupted(_):
        raise KeyboardInterrupt

    begun = monotonic()
    with pytest.raises(KeyboardInterrupt):
        carry_out(jobs, lanes, renew=False, told=interrupted)
    assert monotonic() - begun < STOPPING
    assert not list(store.answers.rglob("*.json"))


def _raised(act):
    try:
        act()
    except Exception as error:  # noqa: BLE001  # which one is what is asked
        return type(error)
    return None


def test_a_diagnosis_given_up_early_is_asked_again_with_more_time(tmp_path):
    (job,) = design(WORLD, CATALOGUE, 1, ["plain/heating/0"])
    store = Store(tmp_path)
    store.put(job, job.orders[0], {"seconds": 10.0, "error": "timeout", "limit": 10.0, "code": "abc"})
    assert store.pending(job, "", 300.0) == job.orders
    assert store.pending(job, "", 10.0) == store.pending(job) == ()


def test_one_proof_at_a_time_works_in_a_store(tmp_path):
    store = Store(tmp_path / "proof")
    with store.locked(), pytest.raises(ProofError, match="another proof works"), store.locked():
        pass
    with store.locked():
        pass


def test_one_case_is_made_anew_whatever_world_made_it_before(tmp_path, monkeypatch):
    monkeypatch.setattr("rig.blind.command.STORE", tmp_path / "prove")
    store, (job,) = Store(tmp_path / "prove-case"), designed(1, ["plain/heating/0"])
    job = replace(job, orders=job.orders[:1])
    seal = store.root / "sealed" / f"{job.token}.json"
    seal.parent.mkdir(parents=True)
    seal.write_text(json.dumps({"asked": {**job.asked(), "world": "another"}}), encoding="utf-8")
    store.put(job, job.orders[0], answer("adequate"))
    pending = []
    monkeypatch.setattr("rig.blind.command.run", lambda store, jobs, *_, **__: pending.extend(map(store.pending, jobs)))
    monkeypatch.setattr("rig.blind.command._told", lambda *_, **__: "told")
    done = CliRunner().invoke(prove_command, ["--case", "plain/heating/0"])
    assert (done.exit_code, done.output, pending) == (0, "told\n", [job.orders])


def test_a_case_is_told_by_what_counts_in_its_cell():
    plain = scored(order("plain/heating/0"), truth("heating"), answer("explained", finding("heating")))
    assert _counted(plain) == "right: True, alone: True, wrong: False"
    located = answer("unexplained", place="time")
    assert _counted(scored(order("outside/gain_step/0"), truth("gain_step"), located)) == "outcome: located"
    twin = truth("dead_band") | {"twins": [{"rival": "exponent", "form": "", "left": 1.0}]}
    missed = scored(order("removed/dead_band/0", "dead_band"), twin, answer("adequate"))
    assert _counted(missed) == "outcome: missed (not counted: a neighbour is too near)"


def test_recordings_half_made_are_made_again(tmp_path):
    (job,) = design(WORLD, CATALOGUE, 1, ["plain/heating/0"])
    store = Store(tmp_path)
    (tmp_path / "sealed").mkdir()
    seal = truth("heating") | {"asked": job.asked()}
    (tmp_path / "sealed" / f"{job.token}.json").write_text(json.dumps(seal), encoding="utf-8")
    (store.opened / job.token).mkdir(parents=True)
    (store.opened / job.token / "0.npz").write_bytes(b"half of it")
    assert not store.has_recordings(job)
    store.recordings_are_whole(job)
    assert store.has_recordings(job)
    store.drop_recordings(job)
    assert not store.has_recordings(job)


@pytest.mark.parametrize("part", ["sealed", "answers"])
def test_a_broken_file_of_the_store_is_named(tmp_path, part):
    (job,) = designed(1, ["plain/heating/0"])
    file = tmp_path / (f"sealed/{job.token}.json" if part == "sealed" else f"answers/{job.token}/whole.json")
    file.parent.mkdir(parents=True)
    file.write_text('{"asked": ', encoding="utf-8")
    done = CliRunner().invoke(prove_command, ["--no-run", "--only", "plain/heating/0", "--store", str(tmp_path)])
    assert done.exit_code == 2
    assert f"{file} is broken" in done.output
