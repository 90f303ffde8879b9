"""Which page is shown, and which keys the bottom line offers. Pure."""

from __future__ import annotations

from rich.text import Text

from rig.console.view_model.view import View
from rig.link.front_end_messages import Snapshot

VIEW_KEYS = (
    ("1", "main"),
    ("2", "V|V|"),
    ("3", "time"),
    ("4", "log"),
    ("5", "table"),
    ("6", "physics"),
    ("7", "bench"),
)
EVERY_KEY = (
    ("F9, Ctrl+C", "STOP: 0 V now, the campaign ends; everywhere"),
    ("F5", "start; the thruster is on the bench"),
    ("p", "pause: 0 V at once"),
    ("r", "resume; in the preflight: try a device again"),
    ("a", "accept: end the hold now, keep its data"),
    ("x", "extend: the hold may last as long again"),
    ("t", "take the running step again"),
    ("b", "back: the step before once more, and on from it"),
    ("k", "skip: leave the running step out"),
    ("m", "mark as bad what was measured last"),
    ("n", "a note into the recording"),
    ("f", "filter events: this run, warnings and worse, all"),
    ("g", "diagnose, once the campaign has ended"),
    ("l", "attend, where this console only looks on"),
    ("d, Ctrl+Q", "leave; a dialog says first what that does"),
    ("1 to 7", "main, V|V|, time, events, results, diagnosis, bench"),
    ("?", "these keys"),
)
"""For a help page, the most urgent first."""


def page_of(view: View, chosen: str) -> str:
    """`preflight`, `live` or a page of its own: the operator's choice; `main` is the preflight list at first."""
    if chosen in ("results", "diagnosis", "bench"):
        return chosen
    before = view.snapshot is None or view.snapshot.state in ("connecting", "preflight")
    return "preflight" if before and chosen == "main" else "live"


def key_line(view: View) -> Text:
    """The keys that mean something now."""
    text = Text(no_wrap=True, overflow="ellipsis")
    for key, does in (("?", "keys"), *_doing(view), *VIEW_KEYS):
        text.append(f" {key} ", "bold #ffffff on #3a4a5a").append(f"{does} ")
    return text


def device_gone(snapshot: Snapshot) -> str:
    """The first device whose row is red; empty: they are all there. Devices are the rows before those of their streams,
    and streams are named after them."""
    devices = {reading.channel.partition(".")[0] for reading in snapshot.readings}
    return next((c.name for c in snapshot.checks if c.verdict == "failed" and c.name in devices), "")


def _doing(view: View) -> tuple[tuple[str, str], ...]:
    snapshot = view.snapshot
    if view.looks_on and view.connected:
        return (("l", "attend"), ("d", "leave"))
    if snapshot is not None and snapshot.state == "done":
        return (("g", "diagnose"), ("d", "leave"))
    if not view.connected:
        return (("d", "leave"),)
    leave = (("n", "note"), ("d", "detach"))
    if snapshot is None or snapshot.state in ("connecting", "stopping", "run_done"):
        return leave
    if snapshot.state == "preflight":
        gone = device_gone(snapshot)
        return (*((("r", f"retry {gone}"),) if gone else ()), ("F5", "start"), *leave)
    if snapshot.state == "mount":
        return (("F5", "mounted"), *leave) if snapshot.mounted_by_hand else leave
    if snapshot.state == "paused":
        return (("r", "resume"), *leave)
    measuring = snapshot.state in ("hold", "sine", "free")
    step: tuple[tuple[str, str], ...] = (("a", "accept"), ("t", "again"), ("k", "skip")) if measuring else ()
    step = (("k", "go on now"),) if snapshot.state == "wait" else step
    return (("p", "pause"), *step, *leave)
