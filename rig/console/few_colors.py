"""The screen on a terminal of 16 colours, and of none: what stands out still does, and nothing becomes unreadable.

Terminals choose the nearest of their colours by themselves, and put grey on grey. Here every pair of text and
background is chosen together: black, or one of few backgrounds with black or white on it; without colour such a
background is reverse video.
"""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

from rich.color import Color as RichColor
from rich.segment import Segment
from rich.style import Style
from textual.color import Color
from textual.filter import LineFilter, Monochrome

DARK: Final = 0.05
"""Relative luminance below which a background is the screen's own."""
BRIGHT: Final = 0.5
"""Relative luminance from which a grey text is white."""
COLORED: Final = 0.35
"""Saturation from which something is not grey."""
HIDDEN: Final = 1.15
"""Contrast below which nobody was meant to see the text, such as the groove of a scrollbar."""
BLACK, WHITE, BRIGHT_WHITE = 0, 7, 15
HUES: Final = ((30, 1), (80, 3), (165, 2), (200, 6), (265, 4), (330, 5), (361, 1))
"""Degrees up to which a hue is that of the eight colours: red, yellow, green, cyan, blue, magenta."""
ON_BLACK: Final = {1: 9, 2: 2, 3: 3, 4: 6, 5: 13, 6: 6, WHITE: WHITE}
"""Texts by hue: red, blue and magenta are too dark on black, bright green and cyan are greys in some palettes."""
LIGHT: Final = (2, 3, 6, WHITE)
"""Backgrounds on which text is black."""


class Sixteen(LineFilter):
    """The sixteen colours that every terminal with colours has."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        return [Segment(s.text, s.style and sixteen(s.style, background), s.control) for s in segments]


class Plain(LineFilter):
    """No colour: bold, underlined and reverse."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        return [_plain(s, background) if s.style else s for s in segments]


def filters_for(colors: str, given: Sequence[LineFilter]) -> Sequence[LineFilter]:
    """Those of a screen of `colors` (`full`, `16`, `none`) after the `given` ones, less Textual's own greys."""
    kept = [each for each in given if not isinstance(each, Monochrome)]
    match colors:
        case "16":
            return [*kept, Sixteen()]
        case "none":
            return [*kept, Plain()]
        case _:
            return kept


@lru_cache(4096)
def sixteen(style: Style, background: Color) -> Style:
    """The nearest pair of the sixteen colours that can be read."""
    front, behind = _pair(style, background)
    back = BLACK if _luminance(behind) < DARK else _of_eight(behind)
    if _contrast(front, behind) < HIDDEN:
        text = back
    elif back != BLACK:
        text = BLACK if back in LIGHT else BRIGHT_WHITE
    elif _saturation(front) >= COLORED:
        text = ON_BLACK[_of_eight(front)]
    else:
        text = BRIGHT_WHITE if _luminance(front) >= BRIGHT else WHITE
    return style + Style(color=_ansi(text), bgcolor=_ansi(back), dim=False)


def _plain(segment: Segment, background: Color) -> Segment:
    text, style, control = segment
    assert style is not None
    front, behind = _pair(style, background)
    hidden = _contrast(front, behind) < HIDDEN
    return Segment(" " * segment.cell_length if hidden and not control else text, plain(style, background), control)


@lru_cache(4096)
def plain(style: Style, background: Color) -> Style:
    """Without its colours; a background that stood out is reverse."""
    stood_out = _luminance(_pair(style, background)[1]) >= DARK
    default = RichColor.default()
    return style + Style(color=default, bgcolor=default, dim=False, reverse=stood_out != bool(style.reverse))


def _pair(style: Style, background: Color) -> tuple[Color, Color]:
    behind = Color.from_rich_color(style.bgcolor) if style.bgcolor else background
    front = Color.from_rich_color(style.color) if style.color else behind.get_contrast_text(1.0)
    return front, behind


def _ansi(number: int) -> RichColor:
    return RichColor.from_ansi(number)


def _of_eight(color: Color) -> int:
    if _saturation(color) < COLORED:
        return WHITE
    hue = 360.0 * colorsys.rgb_to_hsv(color.r / 255, color.g / 255, color.b / 255)[0]
    return next(number for up_to, number in HUES if hue < up_to)


def _saturation(color: Color) -> float:
    return colorsys.rgb_to_hsv(color.r / 255, color.g / 255, color.b / 255)[1]


def _luminance(color: Color) -> float:
    """Relative luminance, https://www.w3.org/TR/WCAG22/#dfn-relative-luminance."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in color.normalized]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _contrast(one: Color, other: Color) -> float:
    """From 1 to 21, https://www.w3.org/TR/WCAG22/#dfn-contrast-ratio."""
    low, high = sorted((_luminance(one), _luminance(other)))
    return (high + 0.05) / (low + 0.05)
