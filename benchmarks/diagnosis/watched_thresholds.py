"""Which thresholds, moved, could change an answer at all: told from one diagnosis, by what is compared with them.

A diagnosis is a chain of comparisons. Where every comparison in which a threshold took part would have come out the
same with it at another value, the whole chain would have been the same, and so would the answer. A `Watched` number
goes through sums, products and powers of numbers together with its other values, and notes each comparison that one of
them would have turned. Where it becomes something that cannot be watched (a plain float), all its other values count as
told apart; a function of numpy or scipy raises TypeError for it, rather than take its value silently.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from identification.mismatch import policy
from identification.mismatch.policy.record.every import ROOMS

COMPARED = frozenset(
    {
        "select.PLAIN_DIRECTION_SIGMA",
        "select.RIVALS_EQUAL_BIC",
        "select.RIVAL_STATED_BIC",
        "select.PRESSED_TERM_HANDICAP",
        "estimate.PRESSED_AT_BOUND_SIGMA",
        "locate.RESIDUAL_FALSE_ALARM",
        "locate.PLAIN_STRUCTURE_P",
        "name.INCONSTANT_P",
        "name.OWN_COVARIATE_P",
        "name.REPAIR_SHARE",
        "validate.PREDICTED_WORSE_CHI2",
        "periodic.LINE_FALSE_ALARM",
    }
)
"""Those that are compared, or scaled and compared; of the others only whether they were read is watched."""


class Watched(float):
    """A number, and what it would be in other settings."""

    __array_ufunc__ = None
    __hash__ = float.__hash__

    others: Mapping[str, float]
    """Setting -> value there."""
    told: set[str]
    """Settings in which a comparison came out otherwise."""

    def __new__(cls, value: float, others: Mapping[str, float], told: set[str]) -> Watched:
        made = float.__new__(cls, value)
        made.others, made.told = others, told
        return made

    def plain(self) -> float:
        return float.__float__(self)

    def __float__(self) -> float:
        self.told.update(self.others)
        return self.plain()

    def __format__(self, how: str) -> str:
        return format(self.plain(), how)


def _calculated(act: Callable[[Any, Any], Any], *, reflected: bool = False) -> Callable[[Watched, Any], Any]:
    def method(self: Watched, other: Any) -> Any:
        one, two = (other, self) if reflected else (self, other)
        if isinstance(other, np.ndarray) and other.ndim:
            self.told.update(self.others)
            return act(_at(one, ""), _at(two, ""))
        settings = {**self.others, **(other.others if isinstance(other, Watched) else {})}
        values = {setting: float(act(_at(one, setting), _at(two, setting))) for setting in settings}
        return Watched(float(act(_at(one, ""), _at(two, ""))), values, self.told)

    return method


def _compared(act: Callable[[Any, Any], Any]) -> Callable[[Watched, Any], Any]:
    def method(self: Watched, other: Any) -> Any:
        found = act(_at(self, ""), _at(other, ""))
        for setting in {**self.others, **(other.others if isinstance(other, Watched) else {})}:
            if not np.array_equal(found, act(_at(self, setting), _at(other, setting))):
                self.told.add(setting)
        return found

    return method


def _at(value: Any, setting: str) -> Any:
    return value.others.get(setting, value.plain()) if isinstance(value, Watched) else value


for _name, _act in {"add": operator.add, "sub": operator.sub, "mul": operator.mul, "truediv": operator.truediv}.items():
    setattr(Watched, f"__{_name}__", _calculated(_act))
    setattr(Watched, f"__r{_name}__", _calculated(_act, reflected=True))
Watched.__pow__ = _calculated(operator.pow)  # type: ignore[assignment,method-assign]
Watched.__neg__ = lambda self: self * -1.0  # type: ignore[method-assign]
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Watched, f"__{_name}__", _compared(getattr(operator, _name)))


@contextmanager
def watched(moved: Mapping[str, Mapping[str, float]]) -> Iterator[set[str]]:
    """The settings that could have changed what was worked out within the block; complete at its end.

    `moved`: qualified name of a threshold -> setting -> its value there.
    """
    told: set[str] = set()
    rooms = {room.__name__.rpartition(".")[2]: room for room in ROOMS}
    known = {name: value for name, value in policy.thresholds() if name in moved}
    for short, room in rooms.items():
        mine = {name.partition(".")[2]: name for name in moved if name.startswith(f"{short}.")}
        vars(room)["__getattr__"] = _reader(mine, known, moved, told)
        for name in mine:
            delattr(room, name)
    try:
        yield told
    finally:
        for room in rooms.values():
            del vars(room)["__getattr__"]
        for name, value in known.items():
            short, _, constant = name.partition(".")
            setattr(rooms[short], constant, value)


def _reader(
    mine: Mapping[str, str], known: Mapping[str, float], moved: Mapping[str, Mapping[str, float]], told: set[str]
) -> Callable[[str], float]:
    def read(constant: str) -> float:
        name = mine.get(constant)
        if name is None:
            raise AttributeError(constant)
        if name in COMPARED:
            return Watched(known[name], moved[name], told)
        told.update(moved[name])
        return known[name]

    return read
