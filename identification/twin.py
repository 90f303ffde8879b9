"""A twin: a thruster's model with its numbers, their covariance, the noise and where all that came from. Data only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from identification.flexible_terms.flexible import Flexible
from identification.physics.catalogue import CATALOGUE
from identification.physics.term import Scale, Term


@dataclass(frozen=True, slots=True)
class TwinTerm:
    """One effect of the catalogue, or a flexible term, with its values. The same effect may stand there twice."""

    effect: str
    form: str
    parameters: Mapping[str, float]
    """name -> value, in the units of the catalogue."""
    scale: Scale
    """The sizes that its form refers to (an exponent is relative to a voltage)."""
    flexible: Flexible | None = None
    """The shape that `parameters` are values of, where it is none of the catalogue."""

    @property
    def values(self) -> tuple[float, ...]:
        """In the order of the catalogue."""
        return tuple(self.parameters[p.name] for p in self.term.parameters(self.scale))

    @property
    def term(self) -> Term:
        """Of the catalogue, or flexible. Raises KeyError when there is none of that effect and form."""
        return TERMS[self.effect, self.form] if self.flexible is None else self.flexible

    @property
    def known(self) -> bool:
        """Whether this program can act it."""
        return self.flexible is not None or (self.effect, self.form) in TERMS


TERMS: Mapping[tuple[str, str], Term] = {(term.id, term.form): term for term in CATALOGUE}


@dataclass(frozen=True, slots=True)
class TwinLine:
    """A periodic disturbance of the reading: a sin(2 pi f t + p), or a (n/n_a)^q sin(2 pi z theta + p)."""

    amplitude: float
    """N."""
    amplitude_std: float
    frequency: float
    """f, Hz; of a line that goes with the rotor what it was at the mean speed."""
    frequency_std: float
    ratio: float | None = None
    """z, periods per `turns` of theta; None at a fixed frequency."""
    ratio_std: float = 0.0
    turns: Literal["rev", "V s"] = "rev"
    """Of theta: V s where no rate was recorded."""
    phase: float | None = None
    """p, rad, on the clock of the first recording behind it; None where it slipped."""
    phase_std: float = 0.0
    growth: float = 0.0
    """q: 2 of a force of the rotor, 0 of one size at all speeds."""
    at_speed: float = 0.0
    """n_a, `turns` per s; 0 where the size is the same at all."""

    @property
    def kind(self) -> Literal["fixed", "rotation"]:
        return "fixed" if self.ratio is None else "rotation"


@dataclass(frozen=True, slots=True)
class TwinNoise:
    """Of one thrust sample: variances in N^2, times in s; the law of identification.mismatch.noise.covariance."""

    white: float
    proportional: float
    """Relative to |F| squared."""
    scales: tuple[float, ...] = ()
    slow: tuple[float, ...] = ()
    bands: tuple[tuple[float, float], ...] = ()
    """(Hz, quality) of damped oscillators."""
    band: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Alternative:
    """The same effects with one of them in another textbook form, refitted to the same recordings."""

    C: float
    terms: tuple[TwinTerm, ...]
    loss: float
    """By how much chi-square is more than the twin's own."""
    gain: float
    """By how much it would be more without that effect."""


@dataclass(frozen=True, slots=True)
class Source:
    """A recording that the numbers come from."""

    recording_id: str
    sha256: str = ""
    """Of the file; empty where there was none."""
    tare: float = 0.0
    """N, of that run; another run has another one."""
    file: str = ""
    """Its name, without the folder; empty where there was none."""


@dataclass(frozen=True, slots=True)
class Twin:
    """tau = C x|x| with terms, for the thruster of that name."""

    thruster: str
    driver_quantity: str
    """command_voltage, motor_voltage or rotation_rate: what drives the model."""
    C: float
    """N per unit of the driver squared."""
    terms: tuple[TwinTerm, ...]
    names: tuple[str, ...]
    """`C`, then `effect.parameter` term by term: rows of the covariance."""
    covariance: tuple[tuple[float, ...], ...]
    noise: TwinNoise
    sources: tuple[Source, ...]
    interval: float
    """s between samples of the recordings behind it."""
    highest_driver: float
    """The largest |driver| it was fitted with."""
    rate_per_driver: float | None = None
    """rev/s per unit of the driver; None where no rotation rate was recorded."""
    slip_rate_per_driver: float | None = None
    """The same before any effect was known: what a coupling to the rate refers the measured rate to, and C with it."""
    lines: tuple[TwinLine, ...] = ()
    """Periodic disturbances, the clearest first."""
    constant_interval: tuple[float, float] | None = None
    """95 % of C as it was told, with what rivals and what nothing claims would make of it; None where it is no wider
    than what the covariance says."""
    alternatives: tuple[Alternative, ...] = ()
    """What other textbook forms would have said: how far the forms may be off in another run."""
    created: str = ""
    """ISO 8601 UTC."""
    software: str = ""
    origin: str = "the twin"
    """What it is, in a sentence: `the twin T1.twin.json`, `the simulation SIM.h5`."""

    @property
    def slip_rate(self) -> float | None:
        """rev/s per unit of the driver for all runs beside it; a twin that does not say which has `rate_per_driver`."""
        return self.rate_per_driver if self.slip_rate_per_driver is None else self.slip_rate_per_driver


def names_of(terms: tuple[TwinTerm, ...]) -> tuple[str, ...]:
    """Rows of the covariance. A second term of one effect is `effect#2`."""
    out, seen = ["C"], dict[str, int]()
    for term in terms:
        seen[term.effect] = seen.get(term.effect, 0) + 1
        label = term.effect if seen[term.effect] == 1 else f"{term.effect}#{seen[term.effect]}"
        out += [f"{label}.{p.name}" for p in term.term.parameters(term.scale)]
    return tuple(out)
