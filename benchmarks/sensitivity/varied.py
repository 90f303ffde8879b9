"""A value that is another one in some settings, and a process that forks where it has to know which.

It goes through sums, products and functions of numpy as several values, and what comes out has several, too, or one
where all are the same. Only where the program has to know (a condition, an index, a text) and the values do not say the
same, the process forks: the child goes on with the setting's value alone, to the end, and the parent without that
setting. (Values of several faces are those of Austin and Flanagan, Multiple facets for dynamic information flow, POPL
2012, doi:10.1145/2103656.2103677; there they stand for who may see what, and nothing forks.)
"""

from __future__ import annotations

import operator
import os
import pickle
import signal
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import copysign
from typing import Any

import numpy as np

ATTRIBUTES = frozenset({"T", "dtype", "ndim", "shape", "size"})
METHODS = frozenset({"all", "any", "argmax", "argmin", "max", "mean", "min", "sum"})
"""Of an array, that change nothing."""


@dataclass(slots=True)
class Tree:
    """Where this process stands."""

    branch: str = ""
    """The setting that it works out; empty in the parent."""
    gone: set[str] = field(default_factory=set)
    """Settings that have branched off."""
    told: dict[str, tuple[Any, float]] = field(default_factory=dict)
    """Answer of each of those, and the s of CPU since it branched."""
    pipe: int = -1
    """Where a branch writes its answer."""


HERE = Tree()


def open_settings(value: Any) -> Iterator[str]:
    """Settings in which a value, or what is in it, may be another one."""
    if isinstance(value, Varied):
        yield from (setting for setting in value.others if setting not in HERE.gone)
    elif type(value) in (list, tuple):
        for each in value:
            yield from open_settings(each)
    elif type(value) is dict:
        yield from open_settings(list(value.values()))


def at(value: Any, setting: str) -> Any:
    """A value, or what is in it, in a setting; in this process' own where that is empty."""
    if isinstance(value, Varied):
        return value.others.get(setting or HERE.branch, value.base)
    if type(value) in (list, tuple):
        return type(value)(at(each, setting) for each in value)
    if type(value) is dict:
        return {key: at(each, setting) for key, each in value.items()}
    return value


def lift(act: Callable[..., Any], *given: Any, **named: Any) -> Any:
    """What `act` makes of several values: several, or the one that all make."""
    if HERE.branch:
        return act(*at(given, ""), **at(named, ""))
    settings = sorted({*open_settings(given), *open_settings(named)})
    try:
        base = act(*at(given, ""), **at(named, ""))
    except Exception as error:
        if not isinstance(error, TimeoutError) and _branch(settings):  # what fails here need not fail there
            return act(*at(given, ""), **at(named, ""))
        raise
    if HERE.branch:  # branched within, where the values of the parent had been put in
        return act(*at(given, ""), **at(named, ""))
    others = {}
    for setting in settings:
        try:
            value = _put_in(setting, act, given, named)
        except TimeoutError:
            raise
        except Exception:  # noqa: BLE001  # it is raised again where it belongs
            if _branch([setting]):
                return act(*at(given, ""), **at(named, ""))
            continue
        if not _same(value, base):
            others[setting] = value
    return Varied(base, others) if others else base


def _put_in(setting: str, act: Callable[..., Any], given: Any, named: Any) -> Any:
    """What `act` makes of the values of one setting: within it whatever is read is of that setting, and none forks."""
    HERE.branch = setting
    try:
        return act(*at(given, ""), **at(named, ""))
    finally:
        HERE.branch = ""


def settled(value: Any) -> Any:
    """The value that counts in this process; the settings in which it is another one branch off first."""
    if not HERE.branch:
        _branch(sorted(set(open_settings(value))))
    return at(value, "")


def _branch(settings: Iterable[str]) -> bool:
    """Whether this is one of the branches. The parent waits for each: there is one process at a time."""
    for setting in settings:
        left = signal.setitimer(signal.ITIMER_PROF, 0.0)[0]
        read, write = os.pipe()
        process = os.fork()
        if not process:
            os.close(read)
            HERE.branch, HERE.pipe = setting, write
            signal.setitimer(signal.ITIMER_PROF, left)
            return True
        os.close(write)
        with os.fdopen(read, "rb") as answers:
            said = answers.read()
        os.waitpid(process, 0)
        HERE.gone.add(setting)
        HERE.told[setting] = pickle.loads(said)
        signal.setitimer(signal.ITIMER_PROF, left)
    return False


def _same(one: Any, other: Any) -> bool:
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, float | np.floating):
        return bool(one == other and copysign(1.0, one) == copysign(1.0, other)) or bool(
            np.isnan(one) and np.isnan(other)
        )
    if isinstance(one, np.ndarray):
        return bool(one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes())
    if isinstance(one, bool | int | str | np.generic):
        return bool(one == other)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(_same, one, other))
    return False


def _attribute(name: str) -> Callable[[Any], Any]:
    return lambda value: getattr(value, name)


def _method(name: str) -> Callable[..., Any]:
    return lambda value, *given, **named: getattr(value, name)(*given, **named)


class Varied:
    """A value, and what it is in other settings. It is no float: what would read it past this class fails."""

    __slots__ = ("base", "others")

    def __init__(self, base: Any, others: Mapping[str, Any]) -> None:
        self.base, self.others = base, others

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        array = isinstance(self.base, np.ndarray | np.generic)
        if array and name in METHODS:
            return lambda *given, **named: lift(_method(name), self, *given, **named)
        if not array or name in ATTRIBUTES:
            return lift(_attribute(name), self)
        return getattr(settled(self), name)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.array(settled(self), dtype=dtype, copy=copy)

    def __array_ufunc__(self, act: Any, method: str, *given: Any, **named: Any) -> Any:
        if named.get("out") is not None:
            return getattr(act, method)(*settled(given), **settled(named))
        return lift(getattr(act, method), *given, **named)

    def __array_function__(self, act: Any, types: Any, given: Any, named: Any) -> Any:
        return lift(act, *given, **named)

    def __hash__(self) -> int:
        return hash(at(self, ""))

    def __setitem__(self, key: Any, value: Any) -> None:
        settled(self)[settled(key)] = settled(value)

    def __iter__(self) -> Iterator[Any]:
        return iter(settled(self))

    def __call__(self, *given: Any, **named: Any) -> Any:
        return settled(self)(*given, **named)


def _unary(name: str, act: Callable[[Any], Any]) -> None:
    setattr(Varied, f"__{name}__", lambda self: lift(act, self))


def _binary(name: str, act: Callable[[Any, Any], Any]) -> None:
    setattr(Varied, f"__{name}__", lambda self, other: lift(act, self, other))


def _reflected(name: str, act: Callable[[Any, Any], Any]) -> None:
    setattr(Varied, f"__r{name}__", lambda self, other: lift(act, other, self))


def _known(name: str, act: Callable[..., Any]) -> None:
    """What has to be known: Python takes no other answer of these."""
    setattr(Varied, f"__{name}__", lambda self, *how: settled(lift(act, self, *how)))


for _name in ("neg", "pos", "abs", "invert"):
    _unary(_name, getattr(operator, _name))
for _name in ("lt", "le", "gt", "ge", "eq", "ne", "getitem"):
    _binary(_name, getattr(operator, _name))
for _name in ("add", "sub", "mul", "truediv", "floordiv", "mod", "pow", "matmul", "and", "or", "xor"):
    _binary(_name, getattr(operator, f"__{_name}__"))
    _reflected(_name, getattr(operator, f"__{_name}__"))
for _act in (bool, float, int, len, str, repr, format, round):
    _known(_act.__name__, _act)
_known("index", operator.index)
