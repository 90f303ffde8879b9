"""The same bench from a second terminal: it looks on, takes the lease, the first one leaves, and F9 there stops."""

from __future__ import annotations

import time

from benchmarks.operating.at_keys import DayError, Operator
from benchmarks.operating.one_day import HOLDS, READY
from benchmarks.operating.place import Place
from benchmarks.operating.preparing import STOP_WITHIN


def second_terminal(first: Operator, second: Operator, place: Place) -> None:
    """Both windows have a shell in the bench's folder."""
    transcript = first.transcript
    transcript.chapter("A second terminal: read-only, then it attends, the first one leaves, F9 in the second")
    first.types("clear; rig run campaign.toml --no-report; echo status=$?", "the preflight passes", READY)
    begun = time.monotonic_ns()
    second.types(
        f"clear; rig console {place.campaign}; echo status=$?", "it looks on", "READ-ONLY: press l to attend", READY
    )
    second.presses("F5", "no start from here", "This console looks on. Press l to attend")
    if place.driven(begun):
        raise DayError("the motor was driven by a console that looks on")
    transcript.fact("by the truth log: nothing was driven by a console that looks on")
    first.presses("F5", "started where somebody attends", HOLDS)
    place.until_driven()
    second.sees("it sees the same", HOLDS, "READ-ONLY")
    asked = time.monotonic_ns()
    second.presses("p", "no pause from here", "This console looks on. Press l to attend")
    second.presses("n", "nor a note", "This console looks on. Press l to attend")
    second.presses("l", "it attends", "attended: stops without you")
    if any(line["event"] == "command" and not line["value"] for line in place.events(asked)):
        raise DayError("a console that looks on has stopped the motor")
    second.presses("n", "the dialog", "Note for the recording")
    second.types("seen from the gallery", "kept")
    first.presses("4", "all events", "note.*seen from the gallery")
    first.presses("d", "what leaving does", "The campaign goes on without this console")
    first.presses("Tab", "from one button to the other", "Leave, campaign goes on")
    first.presses("Enter", "left", "the run goes on in", "status=0", within=30.0)
    place.until_driven()
    pressed = time.monotonic_ns()
    second.presses("F9", "stopped", "ABORTED.*stopped by console", "at rest")
    place.zero_after(pressed, STOP_WITHIN)
    second.presses("d", "back at the shell", "status=1", within=240.0)
