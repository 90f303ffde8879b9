"""What is not drawn again, because it has not changed: the stop key waits for what is drawn."""

from __future__ import annotations

from dataclasses import replace

from textual.widget import Widget

from rig.console.panels import LogPanel, ReadingsPanel, StandingPanel
from rig.console.plots import FitPlot, TimePlot
from rig.link.front_end_messages import Watching
from tests.rig.console.feeds import CHANNELS, running
from tests.rig.console.sitting import Desk, sitting

WIDE = (160, 48)


def drawn(desk: Desk, what: type[Widget]) -> object:
    """Another object once the widget was drawn again."""
    return desk.app.query_one(what)._render_cache


async def test_a_plot_whose_points_are_the_same_is_not_drawn_again():
    now = running(t=47.0)
    async with sitting(now, size=WIDE) as desk:
        fit, time = drawn(desk, FitPlot), drawn(desk, TimePlot)
        await desk.play(replace(now, time=47.1, trace=((47.1, *(4.0,) * (2 * len(CHANNELS))),)))
        assert drawn(desk, FitPlot) is fit
        assert drawn(desk, TimePlot) is not time
        await desk.play(running(t=52.0))
        assert drawn(desk, FitPlot) is not fit


async def test_titles_that_are_the_same_refresh_nothing():
    async with sitting(running(), size=WIDE) as desk:
        log, plot = desk.app.query_one(LogPanel), desk.app.query_one(FitPlot)
        log._dirty_regions.clear()
        plot._dirty_regions.clear()
        desk.app.show_text()
        desk.app.show_plots()
        assert not log._dirty_regions
        assert not plot._dirty_regions


async def test_a_panel_that_comes_to_have_more_lines_gets_the_room():
    now = running()
    async with sitting(now, size=WIDE) as desk:
        low = desk.app.query_one(ReadingsPanel).size.height, desk.app.query_one(StandingPanel).size.height
        more = (*now.readings, replace(now.readings[-1], channel="tank.level", value=1.5))
        await desk.play(replace(now, readings=more, watch=Watching("mismatch", "thrust -2.6 %")))
        high = desk.app.query_one(ReadingsPanel).size.height, desk.app.query_one(StandingPanel).size.height
        assert high == (low[0] + 1, low[1] + 1)
        assert "level" in desk.text(ReadingsPanel)
        assert "DOES NOT FIT: thrust -2.6 %" in desk.text(StandingPanel)
