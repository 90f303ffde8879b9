"""campaign.jsonl: what survives, what is refused, and that a full disk holds nobody up."""

import json
import os

import pytest

from rig.errors import RecordingError
from rig.recording.ledger import FILE_NAME, Ledger, attempts, finished_runs, read
from rig.recording.line_writer import CAPACITY, LineWriter


def test_facts_come_back_in_order(tmp_path):
    ledger = Ledger.open(tmp_path)
    ledger.write("start", thrusters=["T1", "T3"])
    ledger.write("run_start", thruster="T1")
    ledger.close()
    assert [fact["fact"] for fact in read(tmp_path)] == ["start", "run_start"]


def test_torn_line_is_no_fact_and_going_on_after_it_works(tmp_path):
    (tmp_path / FILE_NAME).write_text('{"fact": "start"}\n{"fact": "run_st')
    assert [fact["fact"] for fact in read(tmp_path)] == ["start"]
    ledger = Ledger.open(tmp_path)
    ledger.write("resume")
    ledger.close()
    assert [fact["fact"] for fact in read(tmp_path)] == ["start", "resume"]


def test_edited_or_missing_ledger_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="expected a campaign folder"):
        read(tmp_path)
    (tmp_path / FILE_NAME).write_text('{"fact": "start"}\nhello\n{"fact": "end"}\n')
    with pytest.raises(RecordingError, match=r"campaign\.jsonl:2: not a line of JSON"):
        read(tmp_path)


def test_what_is_finished():
    facts = [
        {"fact": "run_start", "thruster": "T1"},
        {"fact": "run_end", "thruster": "T1", "outcome": "aborted", "recording": "T1.h5"},
        {"fact": "run_start", "thruster": "T1"},
        {"fact": "run_end", "thruster": "T1", "outcome": "completed", "recording": "T1-2.h5"},
    ]
    assert finished_runs(facts) == {"T1": "T1-2.h5"}
    assert attempts(facts, "T1") == 2
    assert attempts(facts, "T2") == 0


def test_full_disk_is_an_error_that_can_be_read_and_nothing_is_raised():
    writer = LineWriter(os.fdopen(os.open("/dev/full", os.O_WRONLY), "wb"), sync=True)
    writer.write(json.dumps({"fact": "start"}))
    writer.write("and more")
    writer.close()
    assert "No space left on device" in writer.error


def test_stuck_disk_holds_nobody_up(tmp_path):
    """A pipe that nobody reads takes 64 KiB and then blocks its writer."""
    reading, writing = os.pipe()
    writer = LineWriter(os.fdopen(writing, "wb"), sync=False)
    for _ in range(CAPACITY + 200):
        writer.write("x" * 1000)
    assert "the disk is stuck" in writer.error
    os.close(reading)
    writer.close()
