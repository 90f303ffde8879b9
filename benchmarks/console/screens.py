"""Every screen of the console, by the keys that lead to it, from its own table of keys: a new page joins by itself."""

from __future__ import annotations

from dataclasses import dataclass

from textual.binding import Binding

from rig.console.app import ConsoleApp

ESCAPE = b"\x1b"
TYPED = {"note": b"weed on the duct, cleared by hand", "palette": b"no", "command_palette": b"no", "channel": b"thr"}
"""What is typed into the text field of a dialog, by the action that opens it."""
DIALOGS = ("note", "leave", "help", "palette", "command_palette", "channel", "choose", "chooser")
"""Actions that open something over the page; those that the console has are used."""
TERMINAL = {"?": b"?", "question_mark": b"?", "ctrl+p": b"\x10", "ctrl+k": b"\x0b", "colon": b":", "slash": b"/"}


@dataclass(frozen=True)
class Screen:
    """Where the stop key is pressed."""

    name: str
    opens: bytes
    """Keys from the main page to it."""
    with_the_key: bytes = b""
    """Keys in one write with the stop key: it is pressed while they are still worked off."""
    closes: bytes = b""
    """Keys after each press, where it is to be opened anew for the next."""


def screens() -> dict[str, Screen]:
    """By name: pages, dialogs, and what is pressed in the very moment in which one opens."""
    bindings = [each for each in ConsoleApp.BINDINGS if isinstance(each, Binding)]
    pages = {b.action[6:-2]: _bytes(b.key) for b in bindings if b.action.startswith("view('")}
    found = [Screen(f"page {name}", key) for name, key in pages.items()]
    dialogs = {b.action.removeprefix("app."): _bytes(b.key) for b in bindings}
    for action in DIALOGS:
        if action in dialogs:
            typed = TYPED.get(action, b"")
            found.append(Screen(f"dialog {action}" + (" with text" if typed else ""), dialogs[action] + typed))
    first, second = list(pages.values())[:2]
    found.append(Screen("a page is being turned", b"", with_the_key=second, closes=first))
    found.append(Screen("a note is being opened", b"", with_the_key=dialogs["note"] + b"weed", closes=ESCAPE))
    return {each.name: each for each in found}


def _bytes(key: str) -> bytes:
    """As a terminal sends it; of several the first."""
    key = key.split(",", maxsplit=1)[0] or key
    if key.startswith("ctrl+") and len(key) == 6:
        return bytes([ord(key[-1]) & 0x1F])
    return TERMINAL.get(key, key.encode())
