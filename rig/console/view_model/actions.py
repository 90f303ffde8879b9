"""Every action of the console, once: key help, the bottom line, the bindings and the command palette are made of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from rig.console.view_model.view import View
from rig.link.front_end_messages import RequestKind, Snapshot
from rig.sequence.requests import ASKED

PageName = Literal["main", "fit", "time", "log", "results", "diagnosis", "bench", "history"]


@dataclass(frozen=True, slots=True)
class Page:
    """One of the pages that a digit brings up."""

    name: PageName
    line: str
    """On the bottom line."""
    word: str
    """Among the keys."""
    shows: str
    """In the palette."""


PAGES: Final = (
    Page("main", "main", "main", "readings, events; at first the preflight"),
    Page("fit", "V|V|", "V|V|", "thrust over V|V|, running fit, residuals"),
    Page("time", "time", "time", "a channel and the command over time"),
    Page("log", "log", "events", "all events"),
    Page("results", "table", "results", "the table of results"),
    Page("diagnosis", "physics", "diagnosis", "the diagnosis"),
    Page("bench", "bench", "bench", "devices, and how well each is heard"),
    Page("history", "history", "history", "what was measured before; compare two"),
)
"""In the order of their digits, from 1."""


def _always(_: View) -> str:
    return ""


@dataclass(frozen=True, slots=True)
class Action:
    """What an operator may do at the console."""

    name: str
    key: str
    """As it is printed on keyboards, several with commas."""
    run: str
    """The application's name for it."""
    does: str
    bound: str = ""
    """The toolkit's names of the keys, with commas; empty: `key` itself."""
    not_now: Callable[[View], str] = _always
    """Why it is not possible now; empty: it is."""
    first: str = ""
    """Toolkit's names of keys that come before those of the focused widget."""


def _nobody(view: View) -> str:
    """Why nothing can be asked of the controller."""
    if not view.connected:
        return "the controller is gone"
    if view.snapshot is None:
        return "no data came yet"
    return "this console looks on; l attends" if view.looks_on else ""


def _asks(kind: RequestKind, lacks: str) -> Callable[[View], str]:
    def not_now(view: View) -> str:
        nobody = _nobody(view)
        if nobody or view.snapshot is None:
            return nobody
        return "" if view.snapshot.state in ASKED[kind][0] else lacks

    return not_now


def _start(view: View) -> str:
    nobody = _nobody(view)
    if nobody or view.snapshot is None:
        return nobody
    if view.snapshot.state == "mount":
        return "" if view.snapshot.mounted_by_hand else "a command puts the thruster on the bench"
    if view.snapshot.state != "preflight":
        return "the controller waits for no start"
    failed = [check.name for check in view.snapshot.checks if check.verdict == "failed"]
    waiting = [check.name for check in view.snapshot.checks if check.verdict == "waiting"]
    if failed or waiting:
        return f"{failed[0]} FAILED" if failed else f"the check of {waiting[0]} still runs"
    return "" if view.snapshot.checks else "the checks have not begun"


def _again(view: View) -> str:
    snapshot = view.snapshot
    if snapshot is not None and snapshot.state == "preflight" and not _nobody(view):
        return "" if device_gone(snapshot) else "every device is there"
    return _asks("resume", "nothing is paused")(view)


def _diagnose(view: View) -> str:
    ended = view.snapshot is not None and view.snapshot.state == "done"
    return "" if ended else "the campaign has not ended"


def _channel(view: View) -> str:
    return "" if view.snapshot is not None and view.snapshot.channels else "no data came yet"


def _attend(view: View) -> str:
    if not view.connected:
        return "the controller is gone"
    return "" if view.looks_on else "this console attends"


def _page(number: int, page: Page) -> Action:
    return Action(f"page {page.word}", str(number), f"view('{page.name}')", page.shows)


ACTIONS: Final = (
    Action("STOP", "F9, Ctrl+C", "stop", "0 V now, the campaign ends; everywhere"),
    Action("start", "F5", "go", "the campaign; or: the thruster is on the bench", "f5", _start),
    Action("pause", "p", "ask('pause')", "0 V at once", not_now=_asks("pause", "no run is under way")),
    Action("resume", "r", "again", "end a pause; in the preflight: try again", not_now=_again),
    Action("accept", "a", "ask('accept')", "end the hold now, keep its data",
           not_now=_asks("accept", "nothing is measured")),
    Action("extend", "x", "ask('extend')", "the hold may last as long again", not_now=_asks("extend", "no hold runs")),
    Action("take again", "t", "ask('repeat')", "the running step from its beginning",
           not_now=_asks("repeat", "nothing is measured")),
    Action("back", "b", "ask('back')", "the step before anew, and on from it",
           not_now=_asks("back", "no step is under way")),
    Action("skip", "k", "ask('skip')", "leave the step out; break off a wait",
           not_now=_asks("skip", "nothing is measured or waited for")),
    Action("mark as bad", "m", "ask('bad')", "what was measured last; no fit takes it",
           not_now=_asks("bad", "no run is under way")),
    Action("note", "n", "note", "a line of text into the recording", not_now=_nobody),
    Action("filter events", "f", "filter", "this run, warnings and worse, all"),
    Action("channel", "c", "channel", "which one the time plot shows", not_now=_channel),
    Action("diagnose", "g", "diagnose", "once the campaign has ended", not_now=_diagnose),
    Action("next sweep", "s", "next_sweep", "of a diagnosis, as a campaign; asks first", not_now=_diagnose),
    Action("interrupt", "Escape", "interrupt", "a diagnosis that is under way", "escape", _diagnose),
    Action("attend", "l", "take_lease", "where this console only looks on", not_now=_attend),
    Action("leave", "d, Ctrl+Q", "leave", "a dialog says first what that does", "d", first="ctrl+q"),
    *(_page(number, page) for number, page in enumerate(PAGES, 1)),
    Action("palette", ":, Ctrl+P", "palette", "every action by its name", ":,ctrl+p"),
    Action("keys", "?", "help", "what each key does"),
)  # fmt: skip
"""The most urgent first."""
NAMED: Final[Mapping[str, Action]] = MappingProxyType({action.name: action for action in ACTIONS})


def bindings() -> list[tuple[str, str, str, bool]]:
    """(keys as the toolkit names them, what to run, name, whether before the focused widget's own) of every action but
    the stop: its key is seen before any binding."""
    found = [(a.bound or a.key, a.run, a.name, False) for a in ACTIONS if a.name != "STOP"]
    return found + [(a.first, a.run, a.name, True) for a in ACTIONS if a.first]


def device_gone(snapshot: Snapshot) -> str:
    """The first device whose row is red; empty: they are all there. Devices are the rows before those of their streams,
    and streams are named after them."""
    devices = {reading.channel.partition(".")[0] for reading in snapshot.readings}
    return next((c.name for c in snapshot.checks if c.verdict == "failed" and c.name in devices), "")
