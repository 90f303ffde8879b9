"""What a chooser lists and how typing narrows it; of the command palette every action, by name and key. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rig.console.view_model.actions import ACTIONS
from rig.console.view_model.view import View


@dataclass(frozen=True, slots=True)
class Entry:
    """One line to choose from."""

    value: str
    """What is chosen by it."""
    name: str
    beside: str
    """A few letters in a column of their own: a key, a unit."""
    says: str
    not_now: str = ""
    """Why it cannot be chosen now; empty: it can."""


def commands(view: View) -> tuple[Entry, ...]:
    """Every action; those that are possible now come first, and of them the stop last: an Enter too many is no stop."""
    found = [Entry(a.run, a.name, a.key, a.does, a.not_now(view)) for a in ACTIONS if a.name != "palette"]
    return tuple(sorted(found, key=lambda entry: (entry.not_now != "", entry.value == "stop")))


def matching(entries: Sequence[Entry], typed: str) -> tuple[Entry, ...]:
    """Those that `typed` may mean, the likeliest first: the beginning of the name, of a word of it, a part of it, a
    part of what it says, the letters of the name in order with others between.

    >>> names = [Entry("", name, "", "") for name in ("take again", "pause", "page time")]
    >>> [entry.name for entry in matching(names, "pa")], [entry.name for entry in matching(names, "tka")]
    (['pause', 'page time'], ['take again'])
    """
    wanted = typed.strip().lower()
    if not wanted:
        return tuple(entries)
    ranked = [(_rank(entry, wanted), n, entry) for n, entry in enumerate(entries)]
    return tuple(entry for rank, _, entry in sorted(ranked, key=lambda row: row[:2]) if rank < _NOT)


_NOT = 5


def _rank(entry: Entry, wanted: str) -> int:
    name = entry.name.lower()
    ways = (
        name.startswith(wanted),
        any(word.startswith(wanted) for word in name.split()),
        wanted in name,
        wanted in entry.says.lower(),
        _in_order(wanted, name),
    )
    return next((rank for rank, fits in enumerate(ways) if fits), _NOT)


def _in_order(letters: str, name: str) -> bool:
    rest = iter(name)
    return all(letter in rest for letter in letters)
