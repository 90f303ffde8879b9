"""Which page is shown, and which keys the bottom line offers. Pure."""

from __future__ import annotations

from typing import Final

from rich.text import Text

from rig.console.view_model.actions import ACTIONS, NAMED, PAGES, device_gone
from rig.console.view_model.view import View

PAGE_KEYS: Final = tuple((str(number), page.line) for number, page in enumerate(PAGES, 1))
_OTHERS: Final = tuple(action for action in ACTIONS if action.name not in {f"page {page.word}" for page in PAGES})
EVERY_KEY: Final = (
    *((action.key, f"{action.name}: {action.does}") for action in _OTHERS),
    (f"1 to {len(PAGES)}", ", ".join(page.word for page in PAGES)),
)
"""For a help page, the most urgent first."""


def page_of(view: View, chosen: str) -> str:
    """`preflight`, `live` or a page of its own: the operator's choice; `main` is the preflight list at first."""
    if chosen in ("results", "diagnosis", "bench", "history"):
        return chosen
    before = view.snapshot is None or view.snapshot.state in ("connecting", "preflight")
    return "preflight" if before and chosen == "main" else "live"


def key_line(view: View) -> Text:
    """The keys that mean something now."""
    text = Text(no_wrap=True, overflow="ellipsis")
    doing = ((_key(name), does) for name, does in _doing(view))
    for key, does in ((_key("keys"), "keys"), *doing, *PAGE_KEYS):
        text.append(f" {key} ", "bold #ffffff on #3a4a5a").append(f"{does} ")
    return text


def _key(name: str) -> str:
    """Of an action, the first where it has several."""
    return NAMED[name].key.partition(", ")[0]


def _doing(view: View) -> tuple[tuple[str, str], ...]:
    """(action, word for it now)"""
    snapshot = view.snapshot
    if view.looks_on and view.connected:
        return (("attend", "attend"), ("leave", "leave"))
    if snapshot is not None and snapshot.state == "done":
        return (("diagnose", "diagnose"), ("next sweep", "next sweep"), ("leave", "leave"))
    if not view.connected:
        return (("leave", "leave"),)
    leave = (("note", "note"), ("leave", "detach"))
    if snapshot is None or snapshot.state in ("connecting", "stopping", "run_done"):
        return leave
    if snapshot.state == "preflight":
        gone = device_gone(snapshot)
        start = () if NAMED["start"].not_now(view) else (("start", "start"),)
        return (*((("resume", f"retry {gone}"),) if gone else ()), *start, *leave)
    if snapshot.state == "mount":
        return (("start", "mounted"), *leave) if snapshot.mounted_by_hand else leave
    if snapshot.state == "paused":
        return (("resume", "resume"), *leave)
    measuring = snapshot.state in ("hold", "sine", "free")
    step: tuple[tuple[str, str], ...] = (
        (("accept", "accept"), ("take again", "again"), ("skip", "skip")) if measuring else ()
    )
    step = (("skip", "go on now"),) if snapshot.state == "wait" else step
    return (("pause", "pause"), *step, *leave)
