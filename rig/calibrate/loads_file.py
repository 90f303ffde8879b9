"""The plan of a calibration: TOML of weights, place and order into frozen data, or a sentence on what is wrong."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from identification.calibration.loads import Load, Place, Weight, gravity_at
from rig.errors import ConfigError
from rig.names import require_name
from rig.toml_tables import Table, construct, decode, read_toml, refuse_unknown, table_at

TABLES: Final = ("calibration", "place", "weights", "steps", "hang")


@dataclass(frozen=True, slots=True)
class About:
    """`[calibration]`"""

    certificate: str = ""
    """Number of the weights' certificate, or where it is."""
    operator: str = ""
    valid_days: int = 365
    """From the day of the calibration on."""
    stability: float = 0.0
    """Relative standard uncertainty of what the gain does in that time, from earlier calibrations."""
    tare: bool = False
    """Zero inside the instrument before the first load: for a cell whose hook takes it near the end of its range."""
    thermometer: str = ""
    """`<stream>.<channel>` of the bench in degC; empty: nobody measures."""

    def __post_init__(self) -> None:
        if self.valid_days < 1:
            raise ValueError(f"valid_days must be at least 1, but is {self.valid_days}")
        if not 0.0 <= self.stability < 0.1:
            raise ValueError(f"stability is relative (0.0005 = 0.05 %) and below 0.1, but is {self.stability:g}")


@dataclass(frozen=True, slots=True)
class PlaceTable:
    """`[place]`: `gravity`, or `latitude` to have it computed."""

    gravity: float | None = None
    """m/s^2, measured or from a gravity service."""
    gravity_std: float = 0.0
    latitude: float | None = None
    """Degrees."""
    height: float = 0.0
    """m above the sea."""
    air_density: float = 1.2
    """kg/m^3"""
    air_density_std: float = 0.04
    lever: float = 1.0
    """Force on the cell over force of the weight."""
    lever_std: float = 0.0

    def __post_init__(self) -> None:
        if (self.gravity is None) == (self.latitude is None):
            raise ValueError("give gravity (m/s^2), or latitude (degrees) and height to have it computed: one of them")

    def place(self) -> Place:
        g, std = self.gravity or 0.0, self.gravity_std
        if self.latitude is not None:
            g, computed = gravity_at(self.latitude, self.height)
            std = std or computed
        return Place(g, std, self.air_density, self.air_density_std, self.lever, self.lever_std)


@dataclass(frozen=True, slots=True)
class Piece:
    """`[weights.pieces.<name>]`: `mass` and one of `std`, `expanded` or `tolerance`."""

    mass: float
    """kg, conventional, as the certificate has it."""
    std: float | None = None
    """kg, standard uncertainty."""
    expanded: float | None = None
    """kg, U of the certificate; divided by `coverage`."""
    coverage: float = 2.0
    """k of the certificate."""
    tolerance: float | None = None
    """kg, maximum permissible error of the class (OIML R 111): anywhere within it with the same probability."""

    def __post_init__(self) -> None:
        if sum(each is not None for each in (self.std, self.expanded, self.tolerance)) != 1:
            raise ValueError("say how well the mass is known, in kg, by one of std, expanded (U) or tolerance (class)")
        if self.coverage <= 0.0:
            raise ValueError(f"coverage must be above 0, but is {self.coverage:g}")

    @property
    def standard(self) -> float:
        """Kg"""
        if self.tolerance is not None:
            return self.tolerance / math.sqrt(3.0)
        return self.std if self.std is not None else (self.expanded or 0.0) / self.coverage


@dataclass(frozen=True, slots=True)
class SetTable:
    """`[weights]` beside its pieces."""

    correlation: float = 1.0
    """Between the errors of any two: 1 when all were compared with one reference."""
    density: float = 8000.0
    """kg/m^3"""
    density_std: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.correlation <= 1.0:
            raise ValueError(f"correlation must be between 0 and 1, but is {self.correlation:g}")


@dataclass(frozen=True, slots=True)
class Pace:
    """`[steps]`: what hangs, in which order, and how long it is read."""

    ladder: tuple[tuple[str, ...], ...]
    """Loads from none to the largest, each the names of its weights; it is gone up and down again."""
    directions: tuple[int, ...] = (1,)
    """`[1, -1]` where the stand can be pulled both ways."""
    repetitions: int = 2
    preloads: int = 1
    """Times that the largest load hangs before each ladder and is not read: loops are then the same in each."""
    settle: float = 5.0
    """s at least from the loading to the reading."""
    steady: float = 0.05
    """N that the reading may still move within half of `settle`."""
    patience: float = 60.0
    """s until a reading that does not settle is given up."""
    hold: float = 10.0
    """s of reading."""

    def __post_init__(self) -> None:
        if not self.directions or any(way not in (1, -1) for way in self.directions):
            raise ValueError(f"directions must be of 1 and -1, but are {list(self.directions)}")
        if len(self.ladder) < 2 or self.repetitions < 1 or self.preloads < 0:
            raise ValueError("a ladder needs two loads at least, repetitions at least 1, preloads at least 0")
        if not (self.settle > 0.0 and self.hold > 0.0 and self.steady > 0.0 and self.patience >= self.settle):
            raise ValueError("settle, hold and steady must be above 0, patience not below settle")

    def loads(self) -> tuple[tuple[Load, ...], frozenset[int]]:
        """Up and down in each direction, `repetitions` times, nothing twice at a turn; and which are not read."""
        out: list[Load] = []
        unread: set[int] = set()
        for way in self.directions * self.repetitions:
            up = [Load(names, way) for names in self.ladder]
            for _ in range(self.preloads):
                unread |= {len(out), len(out) + 1}
                out += [up[-1], up[0]]
            if self.preloads:
                unread.discard(len(out) - 1)  # its last load is the ladder's first
                out.pop()
            course = [*up, *up[-2::-1]]
            same = bool(out) and out[-1].weights == course[0].weights == ()
            out += course[1:] if same else course
        return tuple(out), frozenset(unread)


@dataclass(frozen=True, slots=True)
class Hang:
    """`[hang]`: what puts the weights on where nobody is at the bench; a simulated one, or a machine."""

    command: tuple[str, ...] = ()
    """argv; `{force}` is the force in N with its sign, `{weights}` their names with commas, `{bench_dir}` the bench
    file's folder, `{python}` the interpreter."""
    timeout: float = 60.0
    """s"""

    def __post_init__(self) -> None:
        self.words(0.0, Load(), Path())

    def words(self, force: float, load: Load, bench_dir: Path) -> list[str]:
        """The command with its braces filled. Raises ValueError for braces that mean nothing."""
        fill = {"force": f"{force:.9g}", "weights": ",".join(load.weights)}
        fill |= {"bench_dir": str(bench_dir), "python": sys.executable}
        try:
            return [word.format(**fill) for word in self.command]
        except (KeyError, ValueError, IndexError) as error:
            raise ValueError(f"command has braces that mean nothing ({error}); known are {', '.join(fill)}") from error


@dataclass(frozen=True)
class LoadsPlan:
    """A loads file."""

    path: Path
    text: str
    about: About
    place: Place
    weights: Mapping[str, Weight]
    correlation: float
    pace: Pace
    hang: Hang
    loads: tuple[Load, ...]
    unread: frozenset[int]
    """Places of the loads that hang before a ladder and are not read."""

    @property
    def shortest(self) -> float:
        """s, of all readings, without what a person takes to hang the weights."""
        return len(self.loads) * (self.pace.settle + self.pace.hold)


def load_plan(path: Path) -> LoadsPlan:
    """Read a loads file. Raises ConfigError."""
    text, content = read_toml(path, "loads file")
    refuse_unknown(path, "", content, TABLES)
    about = decode(About, table_at(path, content, "calibration", optional=True), path, "calibration")
    where = decode(PlaceTable, table_at(path, content, "place"), path, "place")
    weights, correlation = _weights(path, table_at(path, content, "weights"))
    pace = decode(Pace, table_at(path, content, "steps"), path, "steps")
    hang = decode(Hang, table_at(path, content, "hang", optional=True), path, "hang")
    loads, unread = _loads(path, pace)
    for name in dict.fromkeys(name for load in loads for name in load.weights):
        if name not in weights:
            raise ConfigError(f"{path}: steps.ladder hangs {name!r}, but [weights.pieces] has {', '.join(weights)}")
    try:
        place = where.place()
    except ValueError as error:
        raise ConfigError(f"{path}: [place]: {error}") from None
    return LoadsPlan(path, text, about, place, weights, correlation, pace, hang, loads, unread)


def _loads(path: Path, pace: Pace) -> tuple[tuple[Load, ...], frozenset[int]]:
    try:
        return pace.loads()
    except ValueError as error:
        raise ConfigError(f"{path}: steps.ladder: {error}") from None


def _weights(path: Path, table: Table) -> tuple[dict[str, Weight], float]:
    shared = decode(SetTable, {key: value for key, value in table.items() if key != "pieces"}, path, "weights")
    pieces = table_at(path, table, "pieces", "weights")
    found = {}
    for name in pieces:
        require_name(path, "a name in [weights.pieces]", name)
        piece = decode(Piece, table_at(path, pieces, name, "weights.pieces"), path, f"weights.pieces.{name}")
        facts = {"name": name, "mass": piece.mass, "std": piece.standard}
        facts |= {"density": shared.density, "density_std": shared.density_std}
        found[name] = construct(Weight, facts, path, f"weights.pieces.{name}")
    return found, shared.correlation
