"""One diagnosis for many settings of the thresholds: it branches where one of them first turns a decision.

A threshold that is moved is one number with several values (varied.py): its own, and that of each setting. Up to the
first decision that it turns, its setting would have done the very same, bit for bit, so it costs only what comes after;
and one that turns none has the same answer, but for numbers that are told in it. What goes round numpy has to know the
value, and would branch early for nothing: PURE and CASTING name what need not.
"""

from __future__ import annotations

import os
import pickle
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from types import FunctionType, ModuleType
from typing import Any

from varied import HERE, Varied, at, lift, open_settings

from identification.mismatch import policy
from identification.mismatch.policy.record.every import ROOMS

PURE = ("allowed", "chi2_isf", "noncentral_chi2_sf", "p_of_largest", "part_check")
"""Functions of the engine whose result depends on their arguments alone: of several values each is put in by itself."""
CASTING = (
    "tails",
    "screening",
    "hidden",
    "stepwise",
    "family_wise",
    "shape_error",
    "residual_structure_test",
    "named_term",
)
"""Modules in which float(...) of several values is several values; elsewhere it has to know."""


def _lifted(act: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(act)
    def method(*given: Any, **named: Any) -> Any:
        if HERE.branch or not (any(open_settings(given)) or any(open_settings(named))):
            return act(*at(given, ""), **at(named, ""))
        return lift(act, *given, **named)

    return method


def _cast(*value: Any) -> Any:
    return lift(float, *value) if isinstance(value[0], Varied) else float(*value)


def _reader(moved: Mapping[str, Any]) -> Callable[[str], Any]:
    def read(constant: str) -> Any:
        if constant not in moved:
            raise AttributeError(constant)
        value = moved[constant]
        return value if any(open_settings(value)) and not HERE.branch else at(value, "")

    return read


def _engine() -> list[ModuleType]:
    return [module for name, module in sys.modules.items() if name.startswith("identification.")]


@contextmanager
def _varied(moved: Mapping[str, Mapping[str, float]]) -> Iterator[None]:
    """Thresholds with several values: qualified name -> setting -> value."""
    known = dict(policy.thresholds())
    undo: list[tuple[dict[str, Any], str, Any]] = []
    for module in _engine():
        names, short = vars(module), module.__name__.rpartition(".")[2]
        for name in PURE:
            if isinstance(act := names.get(name), FunctionType):
                undo.append((names, name, act))
                names[name] = _lifted(act)
        if short in CASTING:
            undo.append((names, "float", None))
            names["float"] = _cast
    for room in ROOMS:
        short, names = room.__name__.rpartition(".")[2], vars(room)
        mine = {}
        for name, others in moved.items():
            if name.startswith(f"{short}."):
                constant = name.partition(".")[2]
                mine[constant] = Varied(known[name], {each: known[name].moved(v) for each, v in others.items()})
                undo.append((names, constant, names.pop(constant)))
        undo.append((names, "__getattr__", None))
        names["__getattr__"] = _reader(mine)
    try:
        yield
    finally:
        for names, name, was in undo:
            if was is None:
                del names[name]
            else:
                names[name] = was


def answers(moved: Mapping[str, Mapping[str, float]], work: Callable[[], Any]) -> tuple[Any, dict[str, Any]]:
    """What `work` gives with all thresholds at their values; and in each setting, with the s of CPU that it cost more.

    `moved`: qualified name of a threshold -> setting -> its value there. Raises EOFError where a branch died.
    """
    HERE.branch, HERE.gone, HERE.told, HERE.pipe = "", set(), {}, -1
    try:
        with _varied(moved):
            found = work()
    except BaseException:
        if HERE.branch:
            os._exit(1)
        raise
    if HERE.branch:
        _end(found)
    every = {setting for others in moved.values() for setting in others}
    return at(found, ""), {each: HERE.told.get(each, (at(found, each), 0.0)) for each in every}


def _end(found: Any) -> None:
    """A branch tells its answer, and is no more."""
    try:
        with os.fdopen(HERE.pipe, "wb") as file:
            pickle.dump((at(found, ""), time.process_time()), file)
    finally:
        os._exit(0)
