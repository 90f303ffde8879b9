"""Numbers and states in words. Pure: values in, text out. Never colour alone: every state has a word."""

from __future__ import annotations

import math
from typing import Final

from rig.console.view_model.view import View
from rig.link.front_end_messages import Progress, Reading, Snapshot, State

DECIMALS: Final[dict[str, int]] = {
    "N": 2,  # load cells of this size resolve 0.01 N
    "V": 2,
    "A": 2,
    "rev/s": 2,
    "m/s": 3,  # Vectrino prints mm/s
    "degC": 1,
    "Pa": 0,
}
"""Digits after the point: about one below the noise of the instruments in use."""
PRETTY_UNITS: Final = {"degC": "°C", "N/V^2": "N/V²", "kg/m^3": "kg/m³"}

STATE_WORDS: Final[dict[State, str]] = {
    "connecting": "connecting",
    "preflight": "preflight",
    "mount": "waiting for thruster",
    "proving": "proving watchdog",
    "tare": "tare",
    "ramp": "ramp",
    "hold": "hold",
    "rest": "rest",
    "wait": "wait",
    "sine": "sine",
    "free": "free run",
    "paused": "PAUSED",
    "stopping": "STOPPING",
    "run_done": "run finished",
    "done": "ended",
}
TURNING: Final[frozenset[State]] = frozenset(
    {"proving", "ramp", "hold", "rest", "wait", "sine", "free", "stopping", "tare"}
)
"""States in which a run is under way."""


def unit(name: str) -> str:
    """`degC` as °C; others as they are."""
    return PRETTY_UNITS.get(name, name)


def number(value: float | None, of_unit: str) -> str:
    """With the digits that the unit deserves. None and NaN are a dash: no number is ever invented."""
    if value is None or not math.isfinite(value):
        return "—"
    if of_unit in DECIMALS:
        return f"{value:.{DECIMALS[of_unit]}f}"
    return f"{value:.0f}" if value == round(value) else f"{value:.3f}"


def limits(reading: Reading) -> str:
    """The band allowed, in the reading's unit; empty: no limit is set."""
    low, high = reading.low, reading.high
    if low is not None and high is not None:
        return f"{low:g} … {high:g}"
    if high is not None:
        return f"≤ {high:g}"
    return f"≥ {low:g}" if low is not None else ""


def age(seconds: float | None) -> str:
    """Short: `0.02 s`, `12.3 s`, `4 min`."""
    if seconds is None or not math.isfinite(seconds):
        return "never"
    if seconds < 10.0:
        return f"{seconds:.2f} s"
    return f"{seconds:.1f} s" if seconds < 120.0 else f"{seconds / 60.0:.0f} min"


def clock(seconds: float) -> str:
    """A duration as m:ss or h:mm:ss."""
    if not math.isfinite(seconds):
        return "-:--"
    whole = max(0, round(seconds))
    hours, rest = divmod(whole, 3600)
    minutes, left = divmod(rest, 60)
    return f"{hours}:{minutes:02d}:{left:02d}" if hours else f"{minutes}:{left:02d}"


def verdict(reading: Reading, live: bool) -> str:
    """The reading's state in a word. What is not live is OLD, whatever the guard thought of it then."""
    if not live:
        return "OLD"
    return {"ok": "ok", "stale": "STALE", "limit": "LIMIT", "none": "no data"}[reading.state]


def bar(fraction: float, width: int) -> str:
    """`fraction` 0..1 of `width` cells."""
    full = round(min(1.0, max(0.0, fraction)) * width)
    return "█" * full + "░" * (width - full)


def activity(snapshot: Snapshot) -> str:
    """What the bench does, in a few words with the command's unit."""
    words = STATE_WORDS[snapshot.state]
    if snapshot.state in ("connecting", "preflight", "done"):
        return words
    return f"{snapshot.thruster} {words} {snapshot.command:+.2f} V"


def link(view: View) -> str:
    """Whether the figures on the screen are the present."""
    if view.condition == "live" and view.snapshot is not None and view.snapshot.replay:
        return "REPLAY of a recording, nothing turns"
    if view.condition == "live":
        return f"LIVE, data {view.silence:.1f} s old"
    if view.condition == "waiting":
        return "waiting for the controller"
    if view.condition == "disconnected" and view.snapshot is not None and view.snapshot.state == "done":
        whole = view.snapshot.outcome == "completed"
        return f"the controller has ended{', as it should after a campaign' if whole else ''}"
    name = "NO FRESH DATA" if view.condition == "stale" else "DISCONNECTED"
    return f"{name}, last came {age(view.silence)} ago"


def campaign_line(progress: Progress, thruster: str, width: int) -> str:
    """Progress of the campaign in one line of `width` cells."""
    head = f"campaign {thruster:>4}, {progress.run + 1} of {progress.runs} "
    tail = f" {100.0 * progress.fraction:3.0f} %  {clock(progress.elapsed)} gone  about {clock(progress.eta)} left"
    return head + bar(progress.fraction, max(5, width - len(head) - len(tail))) + tail


def step_line(progress: Progress, snapshot: Snapshot, width: int) -> str:
    """Progress of the step in one line of `width` cells."""
    if not progress.steps:
        return STATE_WORDS[snapshot.state]
    head = f"step {progress.step + 1:>3} of {progress.steps:<3} {STATE_WORDS[snapshot.state]:<8.8} "
    expected = progress.step_expected
    tail = f" {progress.step_elapsed:5.1f} s of about {expected:.1f} s"
    fraction = progress.step_elapsed / expected if expected > 0.0 else 0.0
    return head + bar(fraction, max(5, width - len(head) - len(tail))) + tail
