"""campaign.jsonl: what survives, what is refused, and that a full disk holds nobody up."""

import json
import os
from pathlib import Path

import pytest

from rig.errors import RecordingError
from rig.recording.ledger import FILE_NAME, Ledger, attempts, finished_runs, kept_steps, read, recordings_before
from rig.recording.line_writer import CAPACITY, LineWriter

STEP = {"thruster": "T1", "index": 3, "phase": "hold", "t_end": 4.5}
END = {"fact": "end", "outcome": "completed", "cause": ""}


def test_facts_come_back_in_order(tmp_path):
    ledger = Ledger.open(tmp_path)
    ledger.write("step", **STEP)
    ledger.write("end", outcome="completed", cause="")
    ledger.close()
    assert ledger.settled
    assert read(tmp_path) == [{"fact": "step", **STEP}, END]


def test_written_at_once_it_is_there_at_once(tmp_path):
    ledger = Ledger.open(tmp_path, at_once=True)
    ledger.write("step", **STEP)
    assert ledger.settled
    assert read(tmp_path) == [{"fact": "step", **STEP}]
    ledger.close()


def test_torn_line_is_no_fact_and_going_on_after_it_works(tmp_path):
    for torn in ('{"fact": "run_st', json.dumps(END)):  # also when it is torn before its newline alone
        (tmp_path / FILE_NAME).write_text(json.dumps({"fact": "step", **STEP}) + "\n" + torn)
        assert [fact["fact"] for fact in read(tmp_path)] == ["step"]
        ledger = Ledger.open(tmp_path)
        ledger.write("end", outcome="aborted", cause="a test")
        ledger.close()
        assert [fact["fact"] for fact in read(tmp_path)] == ["step", "end"]


def test_folder_without_a_ledger(tmp_path):
    with pytest.raises(RecordingError, match="expected a campaign folder"):
        read(tmp_path)
    os.mkfifo(tmp_path / FILE_NAME)
    with pytest.raises(RecordingError, match="expected a campaign folder"):
        read(tmp_path)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("hello", "not a line of JSON"),
        ("", "not a line of JSON"),
        ('{"fact": "step", "thru', "not a line of JSON"),
        ("[" * 100_000, "not a line of JSON"),
        ("9" * 5000, "not a line of JSON"),
        (b"\xff\xfe{}", "not a line of JSON"),
        (b"\0" * 40, "not a line of JSON"),
        ("[]", "expected a JSON object with a text `fact`"),
        ('{"fact": 3}', "expected a JSON object with a text `fact`"),
        ('{"fact": "steps"}', "unknown fact 'steps'; expected start, resume"),
        (json.dumps({"fact": "step", **STEP, "colour": 1}), "unknown field 'colour' of the fact step"),
        (json.dumps({"fact": "step", "thruster": "T1"}), "the fact step lacks its field index"),
        (json.dumps({"fact": "step", **STEP, "index": "3"}), "index of the fact step is '3'; expected a whole number"),
        (json.dumps({"fact": "step", **STEP, "index": True}), "index of the fact step is 'True'; expected a whole"),
        (json.dumps({"fact": "step", **STEP, "t_end": float("nan")}), "t_end of the fact step is 'nan'; expected a f"),
        (json.dumps({"fact": "step", **STEP, "thruster": ["T1"]}), "thruster of the fact step"),
        (
            json.dumps({"fact": "kept", "thruster": "T1", "recordings": [1], "continues": "", "steps": []}),
            "recordings of the fact kept is '\\[1\\]'; expected a list of texts",
        ),
    ],
)
def test_damaged_ledger_is_not_believed(tmp_path, line, said):
    line = line if isinstance(line, bytes) else line.encode()
    (tmp_path / FILE_NAME).write_bytes(b"\n".join([json.dumps(END).encode(), line, json.dumps(END).encode(), b""]))
    with pytest.raises(RecordingError, match=rf"campaign\.jsonl:2: {said}.*put the original back, or begin anew"):
        read(tmp_path)


def test_ledger_of_an_earlier_version_is_read(tmp_path):
    old = {"fact": "run_start", "thruster": "T1", "recording": "T1.h5", "recording_t0_ns": 5, "attempt": 1}
    (tmp_path / FILE_NAME).write_text(json.dumps(old) + "\n")
    assert read(tmp_path) == [old]


def test_what_was_kept_holds_until_the_next_run():
    kept = {"fact": "kept", "thruster": "T1", "recordings": ["T1.h5"], "continues": "a", "steps": [0, 1]}
    run = {"fact": "run_start", "thruster": "T1", "recording": "/data/T1-2.h5"}
    assert kept_steps([kept], "T1") == kept
    assert kept_steps([kept], "T2") is None
    assert kept_steps([kept, {"fact": "run_start", "thruster": "T2"}], "T1") == kept
    assert kept_steps([kept, run], "T1") is None
    assert recordings_before([{**run, "recording": "/data/T1.h5"}, kept], Path("/new")) == ["/new/T1.h5"]


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
