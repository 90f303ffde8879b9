"""Tables of levels: recognised by what the rows are, or asked about; never half a level late."""

import numpy as np
import pytest

from rig.errors import ConfigError, RecordingError
from tests.rig.importing.small_imports import imported, values

VOLT = {"quantity": "command_voltage", "unit": "V", "column": "U"}
FORCE = {"quantity": "thrust", "unit": "N", "column": "F"}
APART = {"drive": {"channels": {"command_voltage": VOLT}}, "cell": {"channels": {"thrust": FORCE}}}
TOGETHER = {"stand": {"channels": {"command_voltage": VOLT, "thrust": FORCE}}}


def plan_of(streams=None, kind="bollard", **time):
    return {"about": "t", "kind": kind, "time": time, "streams": streams or APART}


def rows(volts, step=5.0):
    return "t,U,F\n" + "".join(f"{step * k:g},{v:g},{0.4 * v * abs(v):g}\n" for k, v in enumerate(volts))


def places(found, recording):
    """s: where each hold begins and ends, and where its thrust stands."""
    return [(s.t_start, s.t_end) for s in recording.steps], found["thrust"].time.round(9).tolist()


@pytest.mark.parametrize("streams", [APART, TOGETHER], ids=["apart", "together"])
@pytest.mark.parametrize("changes", [None, True, False])
def test_a_level_of_stated_length_begins_with_its_command_whatever_changes_says(tmp_path, streams, changes):
    said = {} if changes is None else {"changes": changes}
    given = {
        name: {**stream, **(said if "command_voltage" in stream["channels"] else {})}
        for name, stream in streams.items()
    }
    summary, recording, found = imported(tmp_path, rows([0, 8, -4]), plan_of(given, level_duration=4.0))
    assert found["command_voltage"].time.tolist() == [0, 4, 8]
    assert places(found, recording) == ([(0, 4), (4, 8), (8, 12)], [2, 6, 10])
    assert "a table of levels ([time] level_duration = 4): one after the other" in summary.sentences[0]


def test_levels_in_one_stream_with_their_means_become_two_streams(tmp_path):
    _, _, found = imported(tmp_path, rows([0, 8, -4]), plan_of(TOGETHER, level_duration=4.0))
    assert (found["command_voltage"].stream, found["thrust"].stream) == ("stand_command", "stand")


def test_rows_that_jump_from_level_to_level_are_recognised(tmp_path):
    summary, recording, found = imported(tmp_path, rows([0, 8, -4, 6, -10, 2]), plan_of(column="t"))
    assert "a table of levels (rows 5 s apart and the command jumps from each to the next)" in summary.sentences[0]
    assert places(found, recording)[0][:2] == [(0, 5), (5, 10)]
    assert places(found, recording)[1][:2] == [2.5, 7.5]


@pytest.mark.parametrize(
    "volts", [np.linspace(-10, 10, 21), [0, 2, 4, 6, 4, 2, 0], [0, 1], np.repeat([0, 8, -4, 6, -10, 2], 3)]
)
@pytest.mark.parametrize("changes", [None, True])
def test_rows_that_may_be_levels_or_a_slow_ramp_are_asked_about(tmp_path, volts, changes):
    drive = {**APART["drive"], **({} if changes is None else {"changes": changes})}
    with pytest.raises(RecordingError, match=r"a table of levels .* or a log .* levels = true or levels = false"):
        imported(tmp_path, rows(volts), plan_of({**APART, "drive": drive}, column="t"))


@pytest.mark.parametrize(
    ("level_time", "holds", "means"),
    [
        ("start", [(0, 5), (5, 10), (10, 15)], [2.5, 7.5, 12.5]),
        ("middle", [(0, 5), (5, 10), (10, 15)], [2.5, 7.5, 12.5]),
        ("end", [(0, 5), (5, 10), (10, 15)], [2.5, 7.5, 12.5]),
    ],
)
def test_levels_that_the_map_tells_begin_and_end_as_it_says(tmp_path, level_time, holds, means):
    plan = plan_of(column="t", levels=True, level_time=level_time)
    summary, recording, found = imported(tmp_path, rows([0, 2, 4]), plan)
    assert places(found, recording) == (holds, means)
    assert f"the time is the level's {level_time}" in summary.sentences[0]


def test_the_time_of_a_row_decides_where_uneven_levels_begin(tmp_path):
    text = "t,U,F\n10,0,0\n30,2,1.6\n70,4,6.4\n"
    found = {
        place: [
            (s.t_start, s.t_end)
            for s in imported(tmp_path, text, plan_of(column="t", levels=True, level_time=place))[1].steps
        ]
        for place in ("start", "middle", "end")
    }
    assert found["start"] == [(0, 20), (20, 60), (60, 100)]
    assert found["middle"] == [(0, 20), (20, 50), (50, 90)]
    assert found["end"] == [(0, 20), (20, 40), (40, 80)]


def test_a_slow_ramp_that_the_map_tells_stays_a_log(tmp_path):
    _, recording, found = imported(tmp_path, rows([0, 2, 4]), plan_of(column="t", levels=False))
    assert recording.steps == ()
    assert found["command_voltage"].time.tolist() == found["thrust"].time.tolist() == [0, 5, 10]


@pytest.mark.parametrize(
    ("volts", "step", "kind", "says"),
    [
        (np.linspace(-10, 10, 21), 0.1, "bollard", "rows 0.1 s apart"),
        (np.repeat([0, 3, 6, 9], 8), 1.0, "bollard", "8 rows with one command"),
        (np.linspace(-10, 10, 21), 5.0, "vehicle", "a vehicle's log"),
        (np.full(9, 3.0), 5.0, "bollard", "the command never changes"),
    ],
)
def test_logs_are_recognised(tmp_path, volts, step, kind, says):
    summary, recording, _ = imported(tmp_path, rows(volts, step), plan_of(kind=kind, column="t"))
    assert f"a log ({says})" in summary.sentences[0]
    assert recording.steps == ()


def test_a_level_without_a_command_is_no_hold_and_not_the_level_before(tmp_path):
    plan = {**plan_of(level_duration=4.0), "file": {"missing": [""]}}
    _, recording, found = imported(tmp_path, "t,U,F\n0,2,1.6\n1,,5\n2,4,6.4\n", plan)
    assert [(s.command_voltage, s.t_start, s.t_end) for s in recording.steps] == [(2, 0, 4), (4, 8, 12)]
    assert np.isnan(found["command_voltage"].held_at(np.array([6.0]))[0])
    assert values(found["thrust"]) == [1.6, 5, 6.4]


def test_what_contradicts_itself_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="level_duration is for a table of levels"):
        imported(tmp_path, rows([0, 2]), plan_of(level_duration=4.0, levels=False))
    with pytest.raises(RecordingError, match="two levels have the same time"):
        imported(tmp_path, "t,U,F\n0,1,1\n0,2,2\n", plan_of(column="t", levels=True))
    with pytest.raises(RecordingError, match="one level does not tell how long"):
        imported(tmp_path, "t,U,F\n0,1,1\n", plan_of(column="t", levels=True))
