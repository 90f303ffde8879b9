"""What the proof asks: jobs (one case of the world each) with orders (one diagnosis each), cells interleaved. Pure.

>>> world = Kinds(("dead_band", "fouling"), {"dead_band": ("shrink", "jump")}, {}, ("swapped",), ("white",))
>>> [job.id for job in design(world, frozenset({"dead_band", "heating"}), 1, ["plain", "outside"])]
['outside/fouling/0', 'plain/dead_band/0']
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from hashlib import sha256
from itertools import chain
from typing import Any, Final

import numpy as np

STRENGTHS: Final = {"faint": 8.0, "clear": 15.0, "plain": 40.0}
"""d': the sigma at which an oracle sees the effect that knows it, its shape and the noise."""
ORACLE: Final = 2.326348
"""d' that an oracle which knows the effect sees in half the runs at a false-alarm rate of 1 % (one-sided)."""
WITHIN: Final = 1.5
"""Times the oracle's: the faintest strength at which an effect is to be named in half the runs."""
LADDER: Final = {"power_2.3": ORACLE, "power_3.5": WITHIN * ORACLE, "power_5": 5.0}
"""d' of the cells below faint, for that strength."""
PAIR_STRENGTH: Final = 20.0
PAIRS_PER_SEED = 10
BENCH_STRENGTHS: Final = ("clear", "plain")
BENCH_PAIRS_PER_SEED, BENCH_CLEAN_PER_SEED = 2, 3
WIRED_PER = 2
"""Seeds for each case of a fault between runs: 20 seeds are 10 of each kind, 80 with a fault and 80 without."""
CLEAN_PER_SEED = 50
"""Clean runs of all kinds of noise together: 20 seeds are 1,000 runs."""
WIDE_PER_SEED = 25
"""Clean runs of all kinds of wide noise together: 20 seeds are 500 runs."""
FIELD_EFFECTS: Final = range(2, 7)
"""Effects of field size in one recording; each number of them is a label: 20 seeds are 100 cases."""
MORE_PER_SEED, UNCHANGED_PER_SEED = 3.0, 1.5
"""Second recordings with one effect more and with none: 20 seeds are 60 and 30."""
CHANGED_PER_SEED = 3.0
"""Second recordings in which one of the effects has another amount: 20 seeds are 60."""
FIRST_EFFECTS: Final = range(2, 6)
"""Effects of field size in the first recording of a difference."""

NOT_REMOVABLE: Final = frozenset({"periodic_disturbance"})
"""Found by a search for lines, which is no term of the catalogue."""


@dataclass(frozen=True, slots=True)
class Kinds:
    """What the world can conceal: `python -m sim_devices concealable`."""

    effects: tuple[str, ...]
    forms: Mapping[str, tuple[str, ...]]
    """Of effects that have several; one is drawn where none is asked for."""
    variants: Mapping[str, tuple[str, ...]]
    """Forms that are there when asked for only: not those of the catalogue."""
    lies: tuple[str, ...]
    noise: tuple[str, ...]
    version: str = ""
    """Of the world that conceals."""
    benches: tuple[str, ...] = ()
    """On which it records in virtual time."""
    recorded: tuple[str, ...] = ()
    """Effects that a run on such a bench can show."""
    recorded_version: str = ""
    """Of the world with its benches."""
    wide_noise: tuple[str, ...] = ()
    """Noise of laws drawn wide, there when asked for only."""
    field: tuple[str, ...] = ()
    """Effects whose amounts can be drawn as the field has them."""
    added: tuple[str, ...] = ()
    """Effects that a second recording of the same thruster can have more."""
    wiring: tuple[str, ...] = ()
    """What may be wired otherwise in one of several runs; the first is nothing."""


@dataclass(frozen=True, slots=True)
class Order:
    """One diagnosis of a case, with effects taken out of the catalogue."""

    id: str
    """cell/label/number"""
    without: tuple[str, ...] = ()

    @property
    def cell(self) -> str:
        return self.id.split("/")[0]

    @property
    def label(self) -> str:
        return self.id.split("/")[1]

    @property
    def tag(self) -> str:
        """For file names; tells nothing of what was concealed when nothing was taken out."""
        return "-".join(("without", *self.without)) if self.without else "whole"


@dataclass(frozen=True, slots=True)
class Job:
    """One case and what is asked of it. `id` and `draw` decide the seed: it is the same in every proof of that draw."""

    id: str
    spec: Mapping[str, Any]
    """What is not left to chance, as `sim_devices conceal` reads it."""
    orders: tuple[Order, ...]
    draw: str = ""
    world: str = ""
    """Version of the world that is to make it."""

    @property
    def token(self) -> str:
        return sha256(f"{self.id}{self._salt}".encode()).hexdigest()[:16]

    @property
    def seed(self) -> list[int]:
        digest = sha256(f"seed of {self.id}{self._salt}".encode()).digest()
        return [int.from_bytes(digest[i : i + 4], "big") for i in range(0, 16, 4)]

    @property
    def _salt(self) -> str:
        return f" in draw {self.draw}" if self.draw else ""

    def asked(self) -> dict[str, Any]:
        """The line that the world reads."""
        return {"token": self.token, "seed": self.seed, "world": self.world, **self.spec}

    @property
    def digest(self) -> str:
        """Hash of `asked`."""
        return sha256(json.dumps(self.asked(), sort_keys=True).encode()).hexdigest()[:12]


def design(world: Kinds, catalogue: Collection[str], seeds: int, only: Sequence[str] = (), draw: str = "") -> list[Job]:
    """All jobs, so ordered that a proof that is broken off has all cells evenly.

    `catalogue`: ids that the diagnosis can name; `seeds` per cell; `only`: patterns of cell/label (`plain/*`), some of
    the orders; `draw`: any other text draws other cases.
    """
    rows = chain(
        _alone(world, catalogue, seeds),
        _open(world, catalogue, seeds),
        _others(world, catalogue, seeds, draw),
        _recorded(world, catalogue, seeds, draw),
        _composites(world, catalogue, seeds, draw),
        _wired(world, seeds),
    )
    found = []
    for place, job in rows:
        orders = tuple(order for order in job.orders if matches(order.id, only))
        if orders:
            version = world.recorded_version if "bench" in job.spec else world.version
            found.append((place, job.id, Job(job.id, job.spec, orders, draw, version)))
    return [job for _, _, job in sorted(found, key=lambda row: row[:2])]


def matches(order: str, only: Sequence[str]) -> bool:
    """Whether an order's id is asked for.

    >>> matches("plain/heating/3", ["plain"]), matches("plain/heating/3", ["*/dead_band"]), matches("clean/white/0", [])
    (True, False, True)
    """
    return not only or any(fnmatchcase(order, p) or fnmatchcase(order, f"{p.rstrip('/')}/*") for p in only)


def _many(cell: str, label: str, count: int, spec: Mapping[str, Any]) -> Iterator[tuple[float, Job]]:
    """`count` jobs with their places in the order: evenly over 0..1, each cell with a start of its own."""
    first = int(sha256(f"{cell}/{label}".encode()).hexdigest()[:8], 16) / 16**8
    for number in range(count):
        name = f"{cell}/{label}/{number}"
        yield (number + first) / count, Job(name, spec, (Order(name),))


def _alone(world: Kinds, catalogue: Collection[str], seeds: int) -> Iterator[tuple[float, Job]]:
    """One effect of the catalogue, at each strength; at plain strength once more with it taken out."""
    known = [effect for effect in world.effects if effect in catalogue]
    for cell, strength in {**LADDER, **STRENGTHS}.items():
        for effect in known:
            spec: dict[str, Any] = {"effects": [effect], "strength": strength}
            if cell == "plain":
                spec["rivals"] = _others_of(effect, known)
            for place, job in _many(cell, effect, seeds, spec):
                orders = job.orders
                if cell == "plain" and effect not in NOT_REMOVABLE:
                    orders += (Order(f"removed/{job.id.split('/', 1)[1]}", (effect,)),)
                yield place, Job(job.id, spec, orders)
    for lie in world.lies:
        yield from _many("fault", lie, seeds, {"lie": lie})


def _others_of(effect: str, known: Collection[str]) -> list[str]:
    return [other for other in known if other != effect]


def _open(world: Kinds, catalogue: Collection[str], seeds: int) -> Iterator[tuple[float, Job]]:
    """Effects outside the catalogue."""
    rivals = [effect for effect in world.effects if effect in catalogue]
    for effect in world.effects:
        if effect not in catalogue:
            spec = {"effects": [effect], "strength": STRENGTHS["plain"], "rivals": rivals}
            yield from _many("outside", effect, seeds, spec)


def _others(world: Kinds, catalogue: Collection[str], seeds: int, draw: str) -> Iterator[tuple[float, Job]]:
    """Pairs, textbook forms, clean recordings."""
    known = [effect for effect in world.effects if effect in catalogue]
    for cell, table in (("form", world.forms), ("variant", world.variants)):
        for effect, forms in table.items():
            for form in forms if effect in catalogue else ():
                spec = {"effects": [effect], "strength": STRENGTHS["plain"], "forms": [form]}
                yield from _many(cell, f"{effect}:{form}", seeds, spec)
    for place, job in _many("pair", "any", PAIRS_PER_SEED * seeds if len(known) > 1 else 0, {}):
        seed = replace(job, draw=draw).seed
        two = np.random.default_rng(seed).choice(known, 2, replace=False).tolist()
        yield place, Job(job.id, {"effects": two, "strength": PAIR_STRENGTH}, job.orders)
    for cell, kinds, per_seed in (("clean", world.noise, CLEAN_PER_SEED), ("wide", world.wide_noise, WIDE_PER_SEED)):
        for kind in kinds:
            yield from _many(cell, kind, -(-per_seed * seeds // len(kinds)), {"noise": kind})


def _wired(world: Kinds, seeds: int) -> Iterator[tuple[float, Job]]:
    """Several runs in one of which something is wired otherwise, and as many cases in which nothing is."""
    each = -(-seeds // WIRED_PER)
    for kind in world.wiring:
        count = each * (len(world.wiring) - 1) if kind == world.wiring[0] else each
        yield from _many("wiring", kind, count, {"wiring": kind})


def _recorded(world: Kinds, catalogue: Collection[str], seeds: int, draw: str) -> Iterator[tuple[float, Job]]:
    """Recorded through drivers and bytes, on each bench in turn: single effects, pairs, nothing."""
    known = [effect for effect in world.recorded if effect in catalogue]
    cells: list[tuple[str, int, dict[str, Any]]] = [("nothing", BENCH_CLEAN_PER_SEED * seeds, {})]
    cells += [
        (
            f"{name}:{effect}",
            seeds,
            {"effects": [effect], "strength": STRENGTHS[name], "rivals": _others_of(effect, known)},
        )
        for name in BENCH_STRENGTHS
        for effect in known
    ]
    cells += [("pair", BENCH_PAIRS_PER_SEED * seeds if len(known) > 1 else 0, {"strength": PAIR_STRENGTH})]
    for index, (label, count, spec) in enumerate(cells if world.benches else ()):
        for number, (place, job) in enumerate(_many("bench", label, count, spec)):
            on: dict[str, Any] = {"bench": world.benches[(index + number) % len(world.benches)]}
            if label == "pair":
                seed = replace(job, draw=draw).seed
                on["effects"] = np.random.default_rng(seed).choice(known, 2, replace=False).tolist()
            yield place, Job(job.id, {**spec, **on}, job.orders)


def _composites(world: Kinds, catalogue: Collection[str], seeds: int, draw: str) -> Iterator[tuple[float, Job]]:
    """Several effects of field size at once; and a thruster with such a composite again, with one more, with another
    amount of one, or as it was."""
    known = [effect for effect in world.field if effect in catalogue]
    more = [effect for effect in world.added if effect in catalogue]
    for count in FIELD_EFFECTS:
        for place, job in _many("field", f"{count}_effects", seeds if count <= len(known) else 0, {}):
            yield place, Job(job.id, {"field": _some(known, count, _rng(job, draw))}, job.orders)
    fewest = FIRST_EFFECTS[0] <= len(known)
    labels = (("one_more", MORE_PER_SEED), ("nothing", UNCHANGED_PER_SEED), ("changed", CHANGED_PER_SEED))
    for label, per_seed in labels:
        for place, job in _many("difference", label, int(np.ceil(per_seed * seeds)) if fewest else 0, {}):
            rng = _rng(job, draw)
            first = _some(known, min(int(rng.choice(FIRST_EFFECTS)), len(known)), rng)
            spec: dict[str, Any] = {"field": first, "more": "", "strength": STRENGTHS["clear"]}
            if label == "one_more":
                beside = [effect for effect in more if effect not in first]
                spec["more"] = str(rng.choice(beside))
                spec["rivals"] = _others_of(spec["more"], beside)
            if label == "changed":
                spec["changed"] = str(rng.choice(first))
            yield place, Job(job.id, spec, job.orders)


def _rng(job: Job, draw: str) -> np.random.Generator:
    return np.random.default_rng(replace(job, draw=draw).seed)


def _some(names: Sequence[str], count: int, rng: np.random.Generator) -> list[str]:
    found: list[str] = rng.choice(names, count, replace=False).tolist()
    return found
