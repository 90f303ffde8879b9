"""How many colours a terminal has: what was asked for, else what it says of itself."""

import pytest

from rig.screen_options import Look, colors_of, look_of


@pytest.mark.parametrize("wanted", ["full", "16", "none"])
@pytest.mark.parametrize("environ", [{}, {"NO_COLOR": "1"}, {"TERM": "dumb"}, {"TERM": "xterm-256color"}])
def test_what_was_asked_for_is_obeyed(wanted, environ):
    assert colors_of(wanted, environ) == wanted


@pytest.mark.parametrize(
    ("environ", "colors"),
    [
        ({"TERM": "xterm-256color"}, "full"),
        ({"TERM": "xterm", "COLORTERM": "truecolor"}, "full"),
        ({"TERM": "xterm"}, "16"),
        ({"TERM": "linux"}, "16"),
        ({"TERM": "dumb"}, "none"),
        ({"TERM": "vt220"}, "none"),
        ({}, "none"),
        ({"TERM": "xterm-256color", "NO_COLOR": "1"}, "none"),
        ({"TERM": "xterm-256color", "NO_COLOR": ""}, "full"),
    ],
)
def test_else_the_terminal_is_asked(environ, colors):
    assert look_of("auto", True, environ) == Look(colors, True)
