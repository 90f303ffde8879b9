"""What is said at the head of every file: where it is from, what it loses, a row to check it by, what is not in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from identification.twin import Twin
from rig.exporting.twins.curve import SETTLED, STEP_RESPONSE, Curve, Floats

PULSE = (1100.0, 1500.0, 1900.0)
"""us: full astern, neutral, full ahead of most ESCs."""
LEAST_LAG = 1e-3
"""s: written where there is none, for consumers whose first-order lag takes no 0."""
CHECK_AT = 0.7
"""Of the largest driver: the self-check row."""


@dataclass(frozen=True, eq=False)
class Asked:
    """A twin, its curve, and what only the user knows."""

    twin: Twin
    curve: Curve
    source: str
    """Name of the twin's file."""
    diameter: float | None = None
    """m, of the propeller."""
    density: float = 1000.0
    """kg/m^3"""
    pulse: tuple[float, float, float] = PULSE
    """us: full astern, neutral, full ahead; the largest drivers of the twin are these."""

    @property
    def name(self) -> str:
        """Of the thruster, as a name that XML, YAML and C take."""
        safe = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in self.curve.thruster)
        return safe if safe and not safe[0].isdigit() else f"thruster_{safe}"


@dataclass(frozen=True, eq=False)
class Carried:
    """What a consumer makes of its file."""

    thrust: Callable[[Floats], Floats]
    """N of drivers, by the consumer's own equation with the file's numbers."""
    lag: bool = False
    """Whether it acts the lag."""
    lost: tuple[str, ...] = field(default=())
    """What else this consumer does not carry, a sentence each."""


@dataclass(frozen=True, slots=True)
class Loss:
    """N, of what a consumer makes of the file against the twin."""

    rms: float
    worst: float
    at: float
    """The driver of the worst."""
    largest: float
    """N, of the twin's thrust."""

    @property
    def share(self) -> float:
        """rms, of the largest thrust."""
        return self.rms / self.largest


def loss_of(carried: Carried, curve: Curve) -> Loss:
    """At the COMMANDS commands of the curve."""
    error = carried.thrust(curve.commands) - curve.wanted
    worst = int(np.argmax(np.abs(error)))
    largest = float(np.max(np.abs(curve.wanted)))
    return Loss(float(np.sqrt(np.mean(error**2))), float(np.abs(error[worst])), float(curve.commands[worst]), largest)


def head(asked: Asked, carried: Carried) -> list[str]:
    """Lines of text, for the comment of whatever kind the file has."""
    return [*_origin(asked), *summary(asked, carried)]


def summary(asked: Asked, carried: Carried) -> list[str]:
    """What is lost, the self-check, what is not carried."""
    return [*_losses(asked.curve, carried), *_check(asked.curve, carried), *_lost(asked.curve, carried)]


def _origin(asked: Asked) -> Iterator[str]:
    curve, twin = asked.curve, asked.twin
    yield f"Thruster {curve.thruster}, from {asked.source} ({twin.created}), by rig export"
    yield (
        f"Input {curve.quantity} in {curve.unit}, {curve.driver[0]:.6g} to {curve.driver[-1]:.6g}; thrust in N,"
        f" {SETTLED:g} s after a step from rest, in still water"
    )


def _losses(curve: Curve, carried: Carried) -> Iterator[str]:
    loss = loss_of(carried, curve)
    yield (
        f"Loss against the twin at {curve.commands.size} commands: {loss.rms:.3g} N rms ({100 * loss.share:.2g} % of"
        f" the largest), at worst {loss.worst:.3g} N at {loss.at:.4g} {curve.unit}"
    )
    half = float(np.max(curve.half_width))
    yield f"The twin itself is known to +-{half:.2g} N or better (95 %)"
    if curve.lag and carried.lag:
        yield (
            f"First-order lag of the input: {curve.lag:.4g} s. In the first {STEP_RESPONSE:g} s of a full step"
            f" {curve.lag_misses:.3g} N rms are left of {curve.without_lag:.3g} N"
        )


def _check(curve: Curve, carried: Carried) -> Iterator[str]:
    at = CHECK_AT * curve.largest
    here = float(carried.thrust(np.array([at]))[0])
    twin, half = float(curve.at(np.array([at]))[0]), float(np.interp(at, curve.driver, curve.half_width))
    yield (
        f"Self-check: {at:.6g} {curve.unit} -> {here:.6g} N by this file; the twin gives {twin:.6g} N"
        f" ({twin - half:.6g} to {twin + half:.6g}, 95 %)"
    )


def _lost(curve: Curve, carried: Carried) -> Iterator[str]:
    if curve.lag and not carried.lag:
        yield (
            f"Not carried: the lag of {curve.lag:.3g} s, {curve.without_lag:.3g} N rms in the first {STEP_RESPONSE:g} s"
            " of a full step"
        )
    yield from (f"Not carried: {each}" for each in (*curve.left_out, *carried.lost))


def put(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def band_lines(curve: Curve) -> list[str]:
    """The table's 95 % band, for a comment."""
    return [
        f"95 % band: {u:.6g} {curve.unit} -> {t - h:.6g} to {t + h:.6g} N"
        for u, t, h in zip(curve.driver, curve.thrust, curve.half_width, strict=True)
    ]


def xml_comment(lines: list[str]) -> list[str]:
    """No two hyphens in a row may stand in it."""
    return ["<!--", *(f"  {line.replace('--', '- -')}" for line in lines), "-->"]


def hashed(lines: list[str], mark: str = "#") -> list[str]:
    return [f"{mark} {line}".rstrip() for line in lines]


def numbers(values: Floats) -> str:
    return " ".join(f"{value:.9g}" for value in values)
