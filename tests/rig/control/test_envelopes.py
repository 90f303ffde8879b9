"""The envelope that plots are drawn from: it holds the extremes of every sample, whatever comes and whenever."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.protocols import Channel, Sample, Stream
from rig.control.envelopes import PERIOD, Envelopes
from rig.link.front_end_messages import TraceRow

STREAMS = (
    Stream("cell", "cell", (Channel("thrust", "thrust", "N"),), 0.001),
    Stream("motor", "motor", (Channel("rate", "rotation_rate", "rev/s"), Channel("raw", None, "1")), 0.02),
)
T0 = 5_000_000_000
"""ns, where the recording begins."""
number = st.one_of(st.floats(allow_nan=True, allow_infinity=False), st.integers(-5, 5).map(float))
tick = st.tuples(
    st.lists(st.tuples(st.just("cell"), st.tuples(number)) | st.tuples(st.just("motor"), st.tuples(number, number))),
    st.one_of(st.none(), st.floats(-48.0, 48.0)),
    st.sampled_from([0.02, 0.02, 0.02, 0.1, 0.35]),
)  # fmt: skip


def run(ticks: list[tuple[list[tuple[str, tuple[float, ...]]], float | None, float]]) -> list[TraceRow]:
    """All rows, that of the recording's end too."""
    envelopes, now, rows = Envelopes(STREAMS), T0 * 1e-9, list[TraceRow | None]()
    for samples, command, later in ticks:
        now += later
        taken = [Sample(stream, round(now * 1e9), values) for stream, values in samples]
        rows.append(envelopes.advance(taken, command, T0, now))
    rows.append(envelopes.advance((), None, None, now + 0.02))
    return [row for row in rows if row is not None]


def extremes(values: list[float]) -> tuple[float, float] | None:
    numbers = [value for value in values if not math.isnan(value)]
    return (min(numbers), max(numbers)) if numbers else None


@given(st.lists(tick, max_size=40))
def test_no_extreme_of_any_sample_is_lost_and_none_is_invented(ticks):
    rows = run(ticks)
    given_values = [
        [command for _, command, _ in ticks if command is not None],
        *([v[0] for samples, _, _ in ticks for stream, v in samples if stream == "cell"],),
        *([v[n] for samples, _, _ in ticks for stream, v in samples if stream == "motor"] for n in (0, 1)),
    ]
    for place, values in enumerate(given_values):
        shown = [edge for row in rows for edge in row[1 + 2 * place : 3 + 2 * place]]
        assert extremes(shown) == extremes(values)


@given(st.lists(tick, max_size=40))
def test_rows_are_in_order_a_tenth_of_a_second_apart_at_least_and_whole(ticks):
    rows = run(ticks)
    assert all(later[0] - row[0] > PERIOD * 0.99 for row, later in pairwise(rows))
    assert {len(row) for row in rows} <= {9}
    for row in rows:
        for low, high in zip(row[1::2], row[2::2], strict=True):
            assert low <= high or (math.isnan(low) and math.isnan(high))


def test_a_spike_of_one_sample_in_ten_thousand_is_in_its_own_tenth_of_a_second():
    envelopes, rows = Envelopes(STREAMS), list[TraceRow]()
    for n in range(500):  # 50 ticks a second, 1000 samples a second
        now = 5.0 + 0.02 * (n + 1)
        samples = [Sample("cell", round(now * 1e9), (99.0 if 20 * n + k == 5007 else 1.0,)) for k in range(20)]
        row = envelopes.advance(samples, 4.0, T0, now)
        rows += [row] if row is not None else []
    (spike,) = [row for row in rows if row[4] > 1.0]
    assert spike[3:5] == (1.0, 99.0)
    assert spike[0] == pytest.approx(5.02, abs=0.06)
    assert len(rows) == pytest.approx(100, abs=1)


def test_what_came_before_the_recording_is_left_out_and_the_next_one_begins_anew():
    envelopes = Envelopes(STREAMS)
    envelopes.advance([Sample("cell", T0 - 1, (7.0,)), Sample("cell", T0 + 1, (1.0,))], 0.0, T0, 5.01)
    last = envelopes.advance((), 0.0, None, 5.03)
    assert last is not None
    assert last[1:5] == (0.0, 0.0, 1.0, 1.0)
    assert all(math.isnan(value) for value in last[5:])
    assert envelopes.advance((), 0.0, None, 6.0) is None
    assert envelopes.advance((), 3.0, 7 * 10**9, 7.01) is None
    row = envelopes.advance((), 3.0, 7 * 10**9, 7.11)
    assert row is not None
    assert row[:3] == (0.05, 3.0, 3.0)
    assert math.isnan(row[3])


def test_channels_are_named_as_in_the_recording():
    assert [one.channel for one in Envelopes(STREAMS).channels] == ["command", "cell.thrust", "motor.rate", "motor.raw"]
    assert [one.unit for one in Envelopes(STREAMS).channels] == ["V", "N", "rev/s", "1"]
