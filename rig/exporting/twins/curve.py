"""The steady curve of a twin and its lag: what every consumer gets, as far as it can carry it.

A level's thrust is what the twin gives `SETTLED` s after a step from rest, in still water, with every channel that it
looks at as its reference has it. What acts in the stand and in the cell is left out: no vehicle has it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from identification.mismatch.compare.simulation import Drive, Prediction, simulate
from identification.mismatch.prepare.preparing import Refusal
from identification.physics.term import MEASURED
from identification.twin import Twin, TwinTerm
from rig.errors import TwinError

Floats = NDArray[np.float64]
POINTS = 41
"""Of a table: 0.2 % of the largest thrust is lost between them, where one C u|u| loses 6 %."""
COMMANDS = 200
"""At which what a consumer makes of the file is compared with the twin."""
SETTLED = 3.0
"""s"""
REST = 3.0
"""s at 0 before each level."""
RATE = "rotation_rate"
RATE_TICK = 0.005
"""s between the rates that the twin foretells for a term that looks at the measured one."""
TICK = 0.02
"""s between the times of a step response."""
STEP_RESPONSE = 2.0
"""s of it that are looked at."""
SHORTEST, LONGEST = 1e-3, 2.0
"""s, bounds of a lag."""
NOTHING = 1e-9
"""Of the largest: less is 0."""
SIGMA_95 = 1.96
NUDGE = 0.1
"""Standard deviations by which a parameter is moved for the slope of the curve."""
UNITS = {"command_voltage": "V", "motor_voltage": "V", "rotation_rate": "rev/s"}


@dataclass(frozen=True, eq=False)
class Curve:
    """Thrust over the driver, (POINTS,) each, from the largest negative to the largest positive driver."""

    thruster: str
    quantity: str
    """What drives: command_voltage, motor_voltage or rotation_rate."""
    driver: Floats
    """In `unit`, ascending; 0 is one of them."""
    thrust: Floats
    """N"""
    half_width: Floats
    """N, half of the 95 % interval, from the twin's covariance."""
    rate: Floats | None
    """rev/s; None where the twin does not know it."""
    commands: Floats
    """(COMMANDS,) drivers at which a file is compared with the twin."""
    wanted: Floats
    """(COMMANDS,) N, the twin there."""
    lag: float
    """s, the first-order lag of the driver that comes nearest to the twin's step responses; 0: it has none."""
    lag_misses: float
    """N rms in the first STEP_RESPONSE s of a step to the largest driver, with that lag."""
    without_lag: float
    """The same without one."""
    left_out: tuple[str, ...]
    """What of the twin is not in it, a clause each."""

    @property
    def unit(self) -> str:
        return UNITS[self.quantity]

    @property
    def largest(self) -> float:
        """The largest driver."""
        return float(self.driver[-1])

    def at(self, driver: Floats) -> Floats:
        """N, the table between its points by straight lines, level beyond its ends."""
        found: Floats = np.interp(driver, self.driver, self.thrust)
        return found

    @property
    def rates(self) -> Floats:
        """rev/s. Raises TwinError where the twin does not know it."""
        if self.rate is None:
            raise TwinError(
                f"{self.thruster}: this consumer computes thrust from the rotation rate, and the twin was made from"
                " recordings without one; record rotation_rate, or export a table"
            )
        return self.rate


def curve_of(twin: Twin) -> Curve:
    """Raises TwinError for a twin that cannot be acted, or whose thrust does not depend on the driver."""
    force, left_out = _thruster_alone(twin)
    places = _places(twin, force)
    largest = twin.highest_driver
    if not largest > 0.0:
        raise TwinError(f"{twin.thruster}: the twin does not say how large its driver was (highest_driver)")
    driver = np.linspace(-largest, largest, POINTS)
    commands = np.linspace(-largest, largest, COMMANDS)
    thrust, rate = settled(force, driver)
    if not np.ptp(thrust) > 0.0:
        raise TwinError(f"{twin.thruster}: the twin gives the same thrust at every level")
    wanted, _ = settled(force, commands)
    lag, misses, without = _lag(force, driver, thrust)
    return Curve(
        twin.thruster,
        twin.driver_quantity,
        driver,
        thrust,
        SIGMA_95 * _spread(force, places, driver, thrust),
        rate,
        commands,
        wanted,
        lag,
        misses,
        without,
        tuple(left_out),
    )


def _thruster_alone(twin: Twin) -> tuple[Twin, list[str]]:
    """Without what is no force of the thruster, or goes with a channel that a command alone does not give."""
    kept: list[TwinTerm] = []
    left_out = []
    foretold = {RATE} if twin.rate_per_driver else set()
    for each in twin.terms:
        others = sorted(set(each.term.needs) - foretold)
        if each.term.stage in MEASURED:
            left_out.append(f"{each.effect}: it acts in the stand or its cell, no vehicle has it")
        elif others:
            left_out.append(f"{each.effect}: as at its reference, for a command does not tell {', '.join(others)}")
        else:
            kept.append(each)
    left_out += [f"a line at {line.frequency:.4g} Hz ({line.amplitude:.3g} N)" for line in twin.lines]
    return replace(twin, terms=tuple(kept), lines=()), left_out


def settled(twin: Twin, levels: Floats) -> tuple[Floats, Floats | None]:
    """Thrust in N, and rev/s where the twin knows them, `SETTLED` s after a step from rest to each level."""
    begins = np.arange(levels.size) * (REST + SETTLED)
    time = np.sort(np.concatenate([begins, begins + REST]))
    value = np.zeros(time.size)
    value[1::2] = levels
    return _acted(twin, Drive(time, value), np.asarray(begins + REST + SETTLED, np.float64))


def _acted(twin: Twin, drive: Drive, times: Floats) -> tuple[Floats, Floats | None]:
    """Just before `times`, evenly spaced. A rate that thrust follows is the one that the twin foretells."""
    if any(RATE in term.term.needs for term in twin.terms):
        alone = replace(twin, terms=tuple(term for term in twin.terms if RATE not in term.term.needs))
        every = np.arange(drive.time[0], times[-1], RATE_TICK)
        rate = _simulated(alone, drive, every).rate
        drive = replace(drive, others={RATE: (every, np.zeros(every.size) if rate is None else rate)})
    found = _simulated(twin, drive, times - TICK)
    return _whole(found.thrust), None if found.rate is None else _whole(found.rate)


def _simulated(twin: Twin, drive: Drive, times: Floats) -> Prediction:
    found = simulate(twin, drive, times)
    if isinstance(found, Refusal):
        raise TwinError(f"{twin.thruster}: {found.reason}")
    return found


def _whole(values: Floats) -> Floats:
    """Without what a lag leaves of a level long ago."""
    out: Floats = np.where(np.abs(values) < NOTHING * np.max(np.abs(values), initial=0.0), 0.0, values)
    return out


def _places(twin: Twin, force: Twin) -> list[int]:
    """Of C and of the first parameter of each term that is left: rows of the covariance."""
    firsts, place = [0], 1
    for term in twin.terms:
        if any(term is kept for kept in force.terms):
            firsts.append(place)
        place += len(term.term.parameters(term.scale))
    return firsts


def _spread(twin: Twin, places: Sequence[int], driver: Floats, thrust: Floats) -> Floats:
    """(POINTS,) N, the standard error of the curve: slopes over the parameters with the twin's covariance."""
    covariance = np.array(twin.covariance)
    slopes = np.zeros((driver.size, covariance.shape[0]))
    for place, moved, step in _moved(twin, places, np.sqrt(np.diag(covariance))):
        slopes[:, place] = (settled(moved, driver)[0] - thrust) / step
    spread: Floats = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, covariance, slopes), 0.0))
    return spread


def _moved(twin: Twin, places: Sequence[int], std: Floats) -> Iterator[tuple[int, Twin, float]]:
    """(row of the covariance, the twin with that parameter moved, by how much)."""
    if std[0] > 0.0:
        yield 0, replace(twin, C=twin.C + NUDGE * std[0]), NUDGE * std[0]
    for i, (term, first) in enumerate(zip(twin.terms, places[1:], strict=True)):
        for place, p in enumerate(term.term.parameters(term.scale), first):
            step, value = NUDGE * std[place], term.parameters[p.name]
            if step > 0.0:
                step = step if value + step <= p.high else -step
                new = replace(term, parameters={**term.parameters, p.name: value + step})
                yield place, replace(twin, terms=(*twin.terms[:i], new, *twin.terms[i + 1 :])), step


def _lag(twin: Twin, driver: Floats, thrust: Floats) -> tuple[float, float, float]:
    """The lag that comes nearest in steps to the ends and to half of them; rms in N with it and without."""
    largest = driver[-1]
    time = np.arange(0.0, STEP_RESPONSE, TICK) + TICK
    targets = [largest, -largest, largest / 2, -largest / 2]
    responses = [_acted(twin, Drive(np.array([-REST, 0.0]), np.array([0.0, u])), time + TICK)[0] for u in targets]

    def missed(lag: float, which: Sequence[int]) -> float:
        shares = 1.0 - np.exp(-time / lag) if lag > 0.0 else np.ones(time.size)
        errors = [np.interp(targets[i] * shares, driver, thrust) - responses[i] for i in which]
        return float(np.sqrt(np.mean(np.square(errors))))

    every, ends = range(len(targets)), range(2)
    found = minimize_scalar(
        lambda log: missed(float(np.exp(log)), every), bounds=(np.log(SHORTEST), np.log(LONGEST)), method="bounded"
    )
    lag = float(np.exp(found.x))
    if missed(lag, every) >= missed(0.0, every) or lag < 2 * SHORTEST:
        lag = 0.0
    return lag, missed(lag, ends), missed(0.0, ends)
