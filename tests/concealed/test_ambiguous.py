"""A recording that cannot tell two effects, and one more from the same bench: the loop of `rig settle` in virtual time.

How often the answer is right is the matter of benchmarks/experiments/settle.py.
"""

import numpy as np

from tests.concealed.ambiguous import OPENING, Bench, drawn


def test_the_bench_goes_on_where_it_was_and_the_loop_counts_its_time():
    """On a staircase that only goes up, a clipped command and a clipped cell are one: the flat top is the same."""
    ambiguous = drawn(10, "staircase", "command_saturation")
    assert "load_cell_saturation" in ambiguous.twins
    bench = Bench(ambiguous, budget=200.0)
    course, end = bench.settle()
    assert course.first.verdict == "ambiguous"
    assert any({"command_saturation", "load_cell_saturation"} <= alike for alike in course.first.doubt)
    assert end.reason in ("settled", "budget", "same_doubt", "hopeless")
    assert len(bench.diagnoses) == len(course.rounds) + 1 == 2
    first, second = bench.recordings
    assert abs(course.on_bench - second.duration - OPENING) < 0.1
    volts = second.first_of("command_voltage").value
    assert np.max(np.abs(volts)) <= ambiguous.case.scale.voltage
    assert volts[0] == volts[-1] == 0.0
    assert first.recording_id != second.recording_id
