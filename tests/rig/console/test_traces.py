"""Any channel on the time plot: its envelope, made short enough to draw, and how it is chosen."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.console.chooser import Chooser
from rig.console.plots import TimePlot
from rig.console.view_model import traces
from rig.console.view_model.traces import (
    MOST_DOTS,
    Band,
    bands,
    channels_to_choose,
    dots,
    merged,
    misfit_since,
    plotted,
    title,
)
from rig.console.view_model.view import View, absorb
from rig.link.front_end_messages import TracedChannel
from tests.rig.console.feeds import CHANNELS, running, snapshot
from tests.rig.console.scenes import DEVIATES
from tests.rig.console.sitting import sitting

VIEW = absorb(View(), running(), 0.0)
edges = st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)).map(sorted)


@given(st.lists(edges, min_size=1, max_size=300), st.integers(1, 200))
def test_merging_loses_no_extreme_and_moves_none_to_another_time(found, most):
    full = [Band(0.1 * n, low, high) for n, (low, high) in enumerate(found)]
    rows = [(band.time, band.low, band.high) for band in full]
    short = merged(full, rows, most)
    assert len(short) <= max(most, 1)
    assert min(band.low for band in short) == min(band.low for band in full)
    assert max(band.high for band in short) == max(band.high for band in full)
    wide = 0.1 * len(full) / most + 0.1
    for band in full:
        assert any(abs(one.time - band.time) <= wide and one.low <= band.low and one.high >= band.high for one in short)


@given(st.lists(edges, min_size=1, max_size=100), st.floats(0.01, 1e5))
def test_dots_have_both_ends_of_each_band_and_are_not_many(found, dot):
    full = [Band(float(n), low, high) for n, (low, high) in enumerate(found)]
    times, values = dots(full, dot)
    assert len(times) == len(values) <= MOST_DOTS + 3 * len(full)
    for band in full:
        column = [value for time, value in zip(times, values, strict=True) if time == band.time]
        assert (min(column), max(column)) == (band.low, band.high)


def test_a_channel_without_samples_in_a_row_is_not_drawn_there():
    rows = tuple((0.1 * n, 1.0, 1.0, *((5.0, 6.0) if n % 2 else (math.nan, math.nan))) for n in range(10))
    two = (TracedChannel("command", "", "V"), TracedChannel("slow.pressure", "", "Pa"))
    view = absorb(View(), running(trace=rows, channels=two), 0.0)
    assert [band.time for band in bands(view, "slow.pressure", 50)] == pytest.approx([0.1, 0.3, 0.5, 0.7, 0.9])
    assert bands(view, "nobody.knows", 50) == []


def test_the_thrust_is_shown_until_another_channel_is_chosen_and_what_is_not_there_is_the_thrust():
    assert plotted(View()) is None
    assert plotted(VIEW) == CHANNELS[1]
    for channel in CHANNELS:
        assert plotted(replace(VIEW, plotted=channel.channel)) == channel
    assert plotted(replace(VIEW, plotted="torque_cell.torque")) == CHANNELS[1]


def test_every_recorded_channel_can_be_chosen_by_its_name_and_unit():
    listed = channels_to_choose(VIEW)
    assert [entry.value for entry in listed] == [channel.channel for channel in CHANNELS]
    assert ("motor_temperature", "°C", "of motor_thermal") in [(e.name, e.beside, e.says) for e in listed]
    twice = (*CHANNELS, TracedChannel("second_cell.thrust", "thrust", "N"))
    names = [entry.name for entry in channels_to_choose(absorb(View(), running(channels=twice), 0.0))]
    assert "load_cell.thrust" in names
    assert "second_cell.thrust" in names


def test_where_a_run_begins_not_to_fit_is_marked_while_it_is_on_the_plot():
    assert misfit_since(VIEW) is None
    assert misfit_since(absorb(View(), running(watch=DEVIATES), 0.0)) == DEVIATES.began
    for began in (-1.0, 47.5):
        assert misfit_since(absorb(View(), running(watch=replace(DEVIATES, began=began)), 0.0)) is None


def test_titles_have_the_units():
    assert title(VIEW, wide=True) == "thrust (N), command (V, right) over time (s), last 2 min"
    assert title(replace(VIEW, plotted="command"), wide=False) == "command (V) over time (s)"
    assert title(replace(VIEW, plotted="motor_thermal.fet_temperature"), wide=False).startswith("fet_temperature (°C)")


def test_noise_at_rest_does_not_fill_the_plot():
    low, high = traces.span_of([Band(0.0, 0.001, 0.002)], "N")
    assert high - low == pytest.approx(1.0)
    low, high = traces.span_of([Band(0.0, 101873.0, 101874.0)], "mbar")
    assert high - low > 50.0


async def test_c_chooses_by_name_and_the_plot_shows_it():
    async with sitting(running(), size=(120, 40)) as desk:
        await desk.press("c", *"fet", "enter")
        await desk.draw()
        plot = desk.app.query_one(TimePlot)
        assert desk.app.chosen == "main"
        assert "fet_temperature (°C), command (V, right)" in str(plot.border_title)
        assert "°C" in desk.text(TimePlot)
        await desk.press("c", "down", "enter")
        await desk.draw()
        assert "input_current (A)" in str(desk.app.query_one(TimePlot).border_title)
        await desk.press("c", "escape")
        assert "input_current (A)" in str(desk.app.query_one(TimePlot).border_title)


async def test_where_the_plot_is_not_on_the_page_its_page_comes_up():
    async with sitting(running()) as desk:
        await desk.press("c", *"command", "enter")
        await desk.draw()
        assert desk.app.chosen == "time"
        assert str(desk.app.query_one(TimePlot).border_title).startswith("command (V) over time")
        assert desk.kinds() == []


async def test_the_choice_outlives_a_run():
    async with sitting(running(), size=(120, 40)) as desk:
        await desk.press("c", *"rot", "enter")
        await desk.play(running(thruster="T3", t=20.0))
        assert "rotation_rate (rev/s)" in str(desk.app.query_one(TimePlot).border_title)


async def test_without_channels_it_is_said():
    async with sitting(snapshot("connecting", channels=())) as desk:
        await desk.press("c")
        assert len(desk.app.screen_stack) == 1
        assert any("first data" in text for text in desk.toasts())


async def test_a_console_that_looks_on_chooses_too_and_asks_nothing():
    async with sitting(running(attended=True, clients=2), size=(120, 40)) as desk:
        await desk.press("c", *"duty", "enter")
        assert desk.app.state.plotted == "motor.duty"
        assert {request.kind for request in desk.feed.sent} <= {"watch", "lease"}


@pytest.mark.parametrize("key", ["ctrl+c", "f9"])
async def test_the_stop_key_in_the_chooser_while_plots_redraw(key):
    async with sitting(running(), size=(120, 40)) as desk:
        await desk.press("c", "r")
        for n in range(3):
            desk.feed.play(running(t=20.0 + n))
            desk.app.call_later(desk.app.show_plots)
            desk.app.simulate_key("o")
            desk.app.simulate_key(key)
            assert desk.kinds() == ["stop"] * (n + 1)  # no turn of the event loop
            await desk.pilot.pause()
        assert isinstance(desk.app.screen, Chooser)
