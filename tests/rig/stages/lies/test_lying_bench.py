"""docs/lies.md: every row of its table is played over real bytes, in virtual time."""

import re

import pytest

from sim_devices.instruments.lies import LIES
from sim_devices.wires.serial_line import DEFAULT_AMOUNT, WIRE_FAULTS
from tests.rig.stages.lies.lying_bench import FIRST, ROOT, Lie, played

PAGE = (ROOT / "docs" / "lies.md").read_text(encoding="utf-8")
ROWS = [[cell.strip().strip("`") for cell in line.split("|")[1:-1]] for line in PAGE.splitlines() if line[:3] == "| `"]


@pytest.mark.parametrize("row", ROWS, ids=[" ".join(row[:5]) for row in ROWS])
def test_a_lie_is_found_by_what_the_page_says_and_in_time(tmp_path, row):
    device, fault, amount, begin, hold, found_by, within = row
    lie = Lie(device, fault, float(amount or DEFAULT_AMOUNT), None if begin == "start" else 12.0)
    found = played(tmp_path, lie, float(hold))
    if found_by == "nothing":
        assert (found.outcome, found.cause) == ("completed", "")
        return
    assert found.outcome == "tripped"
    assert found_by in found.cause
    assert found.after <= float(within.removesuffix(" s"))


@pytest.mark.parametrize(
    ("lie", "said"),
    [
        (
            Lie("load_cell", "factor", 2.0, None),
            "0.4 are expected (expected_C): is the scale of the force sensor right?",
        ),
        (Lie("load_cell", "sign", volts=None), "the thrust is negative at a positive voltage"),
    ],
    ids=["factor", "sign"],
)
def test_what_was_there_from_the_beginning_is_told(tmp_path, lie, said):
    found = played(tmp_path, lie, dwell=2.0)
    assert (found.outcome, found.cause) == ("completed", "")
    assert said in "\n".join(found.events)


def test_every_lie_of_a_force_sensor_is_in_the_table():
    played_faults = {fault for device, fault, *_ in ROWS if device == "load_cell"}
    assert {*LIES, *WIRE_FAULTS, "fast", "hasty", "slow", "frozen"} <= played_faults


def test_a_sound_bench_completes_and_says_what_it_learnt(tmp_path):
    found = played(tmp_path, None)
    assert (found.outcome, found.cause) == ("completed", "")
    texts = "\n".join(found.events)
    assert "the command is compared with rotation rate, current and thrust" in texts
    learnt = re.search(r"thrust per n\|n\| ([\d.]+) \+- [\d.e-]+ N \((\d) levels\)", texts)
    assert learnt is not None
    assert float(learnt[1]) == pytest.approx(0.3985, rel=0.01), "C of T2 at 1 rev/s per V"
    assert int(learnt[2]) == 4, f"the proof at 4 V, {FIRST:g}, 12 and 16 V"
    assert texts.count("watchdog proved: at rest") == 2, "before the run, and at its first rest"
