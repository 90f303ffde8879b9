"""What a campaign's end writes by itself: when it does, how long it may take, and that it changes nothing else."""

import os
import shutil
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import pytest

from identification.mismatch.observer import UNWATCHED, Interrupted
from rig.campaign_report.answers import TimeIsUp, Told, diagnosed
from rig.campaign_report.at_end import in_time, write
from rig.campaign_report.command import REPORT_FILE
from rig.campaign_report.folder import Run
from rig.campaign_report.results import lead, results_section
from rig.campaign_report.thruster import thruster_section
from rig.cli import main
from rig.fit.answer import fit_recordings
from rig.link.live_runs import Run as LiveRun
from rig.link.live_runs import register
from rig.operate.last_page import unsafe, write_page
from tests.rig.campaign_report.hold_recordings import recording
from tests.rig.console.feeds import running
from tests.rig.report_reading import read

DONE = replace(running("done"), outcome="completed", stop_confirmed=True)


def told(name="T1", bend=1.0):
    found = replace(recording(name, bend=bend), thruster=name)
    (answer,) = fit_recordings([found])
    return Told(name, (Run(name, Path(f"{name}.h5"), "completed", "", found),), answer)


def test_only_what_the_model_does_not_fit_is_diagnosed_while_there_is_time():
    good, bad, late = told("T1"), told("T2", bend=0.8), told("T3", bend=0.8)
    clock = iter([0.0, 1.0, 1.0, 99.0])
    first, second, third = in_time([good, bad, late], "folder", 60.0, lambda: next(clock))
    assert first.diagnosis is None
    assert first.why_no_diagnosis.startswith("its model fits its points")
    assert second.diagnosis is not None
    assert third.diagnosis is None
    assert third.why_no_diagnosis.startswith("there was no time for it at the campaign's end")
    assert "`rig report folder`" in third.why_no_diagnosis
    shown = repr(results_section([first, second, third]))
    assert "does NOT fit" in shown
    assert "next: `rig diagnose T2.h5`" in shown
    assert second.diagnosis.headline in shown


def test_a_search_ends_when_its_time_is_over():
    clock = iter([1.0, 3.0])
    watching = TimeIsUp(UNWATCHED, 2.0, lambda: next(clock))
    watching.stage("select")
    watching.trying("this")
    assert not watching.over
    with pytest.raises(Interrupted):
        watching.trying("that")
    assert watching.over


def test_an_answer_that_was_cut_short_is_told_as_one():
    (found,) = diagnosed([told("T2", bend=0.8)], 0.0, lambda: nullcontext(UNWATCHED), lambda text: None)
    assert found.cut_short
    assert "(its search was cut short)" in repr(results_section([found]))
    assert "this is not its last word" in repr(thruster_section(found, "folder"))


def test_the_head_of_the_page_names_what_does_not_fit(completed):
    from rig.campaign_report.folder import campaign_in

    campaign = campaign_in(completed)
    assert "the model does NOT fit T2" in lead(campaign, [told("T1"), told("T2", bend=0.8)])


def test_the_page_is_written_into_the_folder(completed, tmp_path):
    folder = shutil.copytree(completed, tmp_path / completed.name)
    assert read(write(folder).read_text(encoding="utf-8")).text.count("Not made: its model fits its points") == 2
    assert not list(folder.glob(".*")), "no draft is left"


@pytest.mark.parametrize(
    ("last", "gone", "why"),
    [
        (DONE, True, ""),
        (replace(DONE, outcome="tripped", stop_confirmed=None), True, ""),
        (DONE, False, "the controller is still there"),
        (replace(DONE, stop_confirmed=False), True, "the propeller was not seen to stop"),
        (running("hold"), True, "the controller ended without telling that the propeller rests"),
    ],
)
def test_nothing_is_written_while_a_motor_may_turn(last, gone, why):
    assert unsafe(last, gone=gone) == why


def test_a_page_that_can_not_be_written_is_one_line(tmp_path, capsys):
    write_page(DONE, tmp_path, gone=True)
    out, err = capsys.readouterr()
    assert out == "writing the report; Ctrl+C leaves it out\n"
    assert err.count("\n") == 1
    assert "rig: no report: RecordingError:" in err
    assert f"`rig report {tmp_path}` writes it" in err


def test_a_campaign_that_is_going_on_has_no_page_yet(tmp_path, capsys):
    announced = register(LiveRun(os.getpid(), "no socket", str(tmp_path.resolve()), "campaign", "bench"))
    try:
        assert main(["report", str(tmp_path)]) == 2
    finally:
        announced.unlink()
    assert "is still going on; its report is written when it has ended" in capsys.readouterr().err


def test_the_page_is_written_by_a_process_of_its_own(completed, tmp_path, capsys):
    folder = shutil.copytree(completed, tmp_path / completed.name)
    write_page(DONE, folder, gone=True)
    assert capsys.readouterr().out.splitlines()[-1] == f"report: {folder / REPORT_FILE}"
    assert (folder / REPORT_FILE).read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
