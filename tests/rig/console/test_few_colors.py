"""Sixteen colours and none: which pairs of text and background come out, and that each can be read."""

from __future__ import annotations

from itertools import product

import pytest
from rich.color import Color as RichColor
from rich.color import ColorType
from rich.segment import Segment
from rich.style import Style
from textual.color import Color
from textual.filter import Monochrome

from rig.console.few_colors import Plain, Sixteen, filters_for, plain, sixteen
from tests.rig.console.scenes import SCENES, prepare
from tests.rig.console.sitting import sitting

SCREEN = Color.parse("#1e1e1e")
DARK_ONES = ("#000000", "#aa0000", "#00aa00", "#aa5500", "#0000aa", "#aa00aa", "#00aaaa", "#aaaaaa")
BRIGHT_ONES = ("#555555", "#ff5555", "#55ff55", "#ffff55", "#5555ff", "#ff55ff", "#55ffff", "#ffffff")
VGA = DARK_ONES + BRIGHT_ONES
"""The palette of TERM=linux."""


def contrast(one: str, other: str) -> float:
    def luminance(name: str) -> float:
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in Color.parse(name).normalized]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def numbers(style: Style) -> tuple[int, int]:
    both = (style.color, style.bgcolor)
    assert {color and color.type for color in both} == {ColorType.STANDARD}
    front, back = (color.number if color and color.number is not None else -1 for color in both)
    return front, back


@pytest.mark.parametrize(
    ("style", "pair"),
    [
        ("bold #ffffff on #c02030", (15, 1)),
        ("#101010 on #f0c040", (0, 3)),
        ("#ffffff on #1f4f7f", (15, 4)),
        ("#7fd88f", (2, 0)),
        ("#f0c040", (3, 0)),
        ("bold #ff6070", (9, 0)),
        ("#9a9a9a", (7, 0)),
        ("#5ac8fa", (6, 0)),
        ("#e0e0e0 on #16202a", (15, 0)),
        ("#1e1e1e on #1e1e1e", (0, 0)),
    ],
)
def test_what_the_console_uses(style, pair):
    assert numbers(sixteen(Style.parse(style), SCREEN)) == pair


def test_whatever_could_be_read_can_be_read_on_a_console_of_16_colours():
    steps = (0, 60, 120, 180, 255)
    colors = [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in product(steps, repeat=3)]
    for text, behind in product(colors, colors[::3]):
        if contrast(text, behind) >= 2:
            front, back = numbers(sixteen(Style.parse(f"{text} on {behind}"), SCREEN))
            assert contrast(VGA[front], VGA[back]) >= 3.0, (text, behind)


def test_without_colour_what_stood_out_is_reverse():
    for style, reverse in (("#ffffff on #c02030", True), ("#7fd88f", False), ("reverse #ffffff on #c02030", False)):
        made = plain(Style.parse(style), SCREEN)
        assert made.color == made.bgcolor == RichColor.default()
        assert bool(made.reverse) is reverse


def test_without_colour_what_nobody_was_meant_to_see_is_blank():
    (segment,) = Plain().apply([Segment("▁▁", Style.parse("#1e1e1e on #1e1e1e"))], SCREEN)
    assert segment.text == "  "


def test_greys_of_the_toolkit_are_left_out():
    assert [type(each) for each in filters_for("16", [Monochrome()])] == [Sixteen]
    assert [type(each) for each in filters_for("none", [Monochrome()])] == [Plain]
    assert filters_for("full", [Monochrome()]) == []


@pytest.mark.parametrize("colors", ["16", "none"])
@pytest.mark.parametrize("scene", ["limit", "note", "keys", "leave"])
async def test_no_other_colour_reaches_the_terminal(scene, colors):
    app, play = prepare(SCENES[scene], colors)
    async with app.run_test(size=(80, 24)) as pilot:
        await play(pilot)
        styles = [s.style for strip in app.screen._compositor.render_strips() for s in strip if s.style]
    kinds = {color.type for style in styles for color in (style.color, style.bgcolor) if color is not None}
    assert kinds == {ColorType.STANDARD if colors == "16" else ColorType.DEFAULT}


async def test_states_of_readings_are_words_without_colour():
    async with sitting(SCENES["limit"].snapshots[0]) as desk:
        shown = desk.text("ReadingsPanel")
    assert "LIMIT" in shown
    assert "STALE" in shown
