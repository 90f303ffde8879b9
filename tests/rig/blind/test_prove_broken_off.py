"""A blind proof that is broken off, goes on, or finds its store broken."""

import json
import os
import signal
import sys
from dataclasses import replace
from threading import Thread
from time import monotonic, sleep

import pytest
from click.testing import CliRunner

from rig.blind.command import _counted, designed, prove_command
from rig.blind.design import design
from rig.blind.scoring.score import scored
from rig.blind.store import ProofError, Store
from rig.blind.workers import STOPPING, BrokenOff, Child, Lane, carry_out
from rig.workers.interrupting import interruptible
from tests.rig.blind_scores import CATALOGUE, WORLD, answer, finding, order, truth


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
