"""Options of whatever shows a run: how many colours its terminal has, and whether it rings."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Final, Literal, NamedTuple, TypeVar

import click

C = TypeVar("C", bound=Callable[..., object])
Colors = Literal["full", "16", "none"]
FEW: Final = ("linux", "cons25", "xterm", "xterm-16color", "rxvt", "screen", "ansi", "cygwin")
"""TERM of terminals that promise 16 colours at most."""
NO_COLORS: Final = ("", "dumb", "unknown", "vt100", "vt102", "vt220")


class Look(NamedTuple):
    """Of a front end on a terminal."""

    colors: Colors = "full"
    bell: bool = True


USUAL: Final = Look()


def screen_options(command: C) -> C:
    """`--colors` and `--bell/--no-bell`, as the parameters `colors` and `bell`."""
    colors = click.option(
        "--colors",
        type=click.Choice(["auto", "full", "16", "none"]),
        default="auto",
        show_default=True,
        help="Colours of the terminal. auto: by NO_COLOR, COLORTERM and TERM.",
    )
    bell = click.option(
        "--bell/--no-bell",
        default=True,
        show_default=True,
        help="Ring where somebody is wanted: mounting, start, trip, pause, end.",
    )
    return colors(bell(command))


def look_of(colors: str, bell: bool, environ: Mapping[str, str] | None = None) -> Look:
    """What the options come to on this terminal."""
    return Look(colors_of(colors, os.environ if environ is None else environ), bell)


def colors_of(wanted: str, environ: Mapping[str, str]) -> Colors:
    """`wanted`, or for `auto` what the terminal says of itself (https://no-color.org).

    >>> colors_of("auto", {"TERM": "xterm-256color"}), colors_of("auto", {"TERM": "linux"})
    ('full', '16')
    >>> colors_of("auto", {"TERM": "xterm-256color", "NO_COLOR": "1"}), colors_of("16", {"NO_COLOR": "1"})
    ('none', '16')
    """
    match wanted:
        case "full" | "16" | "none":
            return wanted
    term = environ.get("TERM", "")
    if environ.get("NO_COLOR") or term in NO_COLORS:
        return "none"
    return "16" if term in FEW and not environ.get("COLORTERM") else "full"
