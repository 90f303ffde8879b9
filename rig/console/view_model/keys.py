"""Which page is shown, and which keys the bottom line offers. Pure."""

from __future__ import annotations

from rich.text import Text

from rig.console.view_model.view import View
from rig.link.front_end_messages import Snapshot

VIEW_KEYS = (("1", "main"), ("2", "V|V|"), ("3", "time"), ("4", "log"), ("5", "table"), ("6", "diagnosis"))
EVERY_KEY = (
    ("F9, Ctrl+C", "STOP: 0 V now, the campaign ends, the recording is closed. Works everywhere"),
    ("F5", "start once the preflight has passed; the thruster is on the bench"),
    ("p", "pause: 0 V at once"),
    ("r", "resume: the step under way is taken again. Preflight: try a device again"),
    ("a", "accept: the running hold or sine ends now, its data are kept"),
    ("x", "extend: the running hold may last as long again"),
    ("t", "take again: the running step from its beginning"),
    ("b", "back: measure the step before once more, and go on from there"),
    ("k", "skip: the running step is left out"),
    ("m", "mark as bad what was measured last: no fit takes it"),
    ("n", "a note into the recording"),
    ("l", "attend, where another console does and this one only looks on"),
    ("d, Ctrl+Q", "leave; a dialog says first what that does"),
    ("g", "diagnose the recordings, once the campaign has ended"),
    ("1 to 6", "main page, thrust over V|V|, over time, events, results, diagnosis"),
    ("?", "these keys"),
)
"""For a help page, the most urgent first."""


def page_of(view: View, chosen: str) -> str:
    """`preflight`, `live`, `results` or `diagnosis`: the operator's choice; `main` is the preflight list at first."""
    if chosen in ("results", "diagnosis"):
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
    step = (("a", "accept"), ("t", "again"), ("k", "skip")) if measuring else ()
    return (("p", "pause"), *step, *leave)
