"""A simulated recording as the baseline of a real one: what physics does the simulation leave out?

The simulation is first diagnosed itself, with noise of the size of the real one added: its terms that matter there are
given terms of the baseline, so that what is found acts in its own stage among them. What the simulation has beyond that
description is subtracted from the real thrust as it is, a known column of scale one: the description may be rough, to
first order real less simulation is what is diagnosed. C is fitted to the real recording; a change of it is a finding.
See docs/decisions/0005-a-simulation-is-a-baseline.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.compare.simulation import Drive, held, others_of, simulate
from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.next_experiment.sweeps import Limits
from identification.mismatch.observer import UNWATCHED, Observer
from identification.mismatch.pipeline import INTERRUPTED, diagnose
from identification.mismatch.prepare.preparing import DRIVERS, Refusal
from identification.recording import Channel, Floats, Recording
from identification.twin import Twin


@dataclass(frozen=True, eq=False, slots=True)
class Compared:
    """The real recording against the simulation, and what the simulation itself was found to be."""

    real: Diagnosis
    simulation: Diagnosis
    offset: float
    """s by which the simulation's clock is late."""
    subtracted: float
    """N rms of what the simulation has beyond its own description."""
    recording: Recording
    """The real recording as it was diagnosed: less what the simulation has beyond its own description."""


def compare(
    simulation: Recording,
    real: Recording,
    seed: int = 0,
    holdout: Sequence[Recording] = (),
    limits: Limits | None = None,
    watch: Observer = UNWATCHED,
) -> Compared | Refusal:
    """What the simulation leaves out relative to the real recording.

    `holdout`: real runs that are only predicted, by the description of the simulation, for nobody simulated them.
    `limits`: of the next experiment, as for diagnose(). `watch`: of both diagnoses; one that ends the search of the
    simulation ends that of the recording too.
    """
    aligned = _aligned(simulation, real)
    if isinstance(aligned, Refusal):
        return aligned
    simulation, offset = aligned
    known = _described(simulation, real, seed, watch)
    if isinstance(known, Refusal):
        return known
    twin = known.twin
    assert twin is not None
    left = _beyond(simulation, twin, known, real)
    if isinstance(left, Refusal):
        return left
    exact = twin.covariance if np.all(left == 0) else tuple((0.0,) * len(twin.names) for _ in twin.names)
    origin = f"the simulation {_name(simulation)}"
    sources = tuple(s for s in twin.sources if s.recording_id != real.recording_id)
    lines = twin.lines if np.all(left == 0) else ()  # else they were subtracted as they are
    twin = replace(twin, thruster=real.thruster, origin=origin, sources=sources, covariance=exact, lines=lines)
    recording = _less(real, left)
    found = diagnose([recording], holdout, seed, twin, limits, watch=watch)
    if isinstance(found, Refusal):
        return found
    rms = float(np.sqrt(np.nanmean(left**2)))
    return Compared(_told(found, known, offset, rms, len(holdout)), known, offset, rms, recording)


def _name(recording: Recording) -> str:
    return recording.source or recording.recording_id


def _said(channel: Channel | None) -> str:
    return "nothing" if channel is None else str(channel.quantity)


def _driver(recording: Recording) -> Channel | None:
    found = (recording.first_of(quantity) for quantity in DRIVERS)
    return next((c for c in found if c is not None and np.any(np.isfinite(c.value))), None)


def _drive(channel: Channel) -> Drive:
    good = np.isfinite(channel.value)
    return Drive(channel.time[good], channel.value[good], stepwise=channel.quantity == "command_voltage")


def _offset(simulation: Channel, real: Channel) -> float:
    """Seconds by which the simulation is late, from the first large change of each command; 0 if that helps not."""
    a, b = _drive(simulation), _drive(real)
    starts = [_first_move(d) for d in (a, b)]
    late = starts[0] - starts[1]
    if not a.stepwise or not np.isfinite(late):
        return 0.0
    grid = np.arange(b.time[0], b.time[-1], 0.02)
    plain = float(np.mean(np.abs(held(a, grid) - held(b, grid))))
    moved = float(np.mean(np.abs(held(a, grid + late) - held(b, grid))))
    return late if moved < 0.5 * plain else 0.0


def _aligned(simulation: Recording, real: Recording) -> tuple[Recording, float] | Refusal:
    """The simulation on the clock of the recording, and the s by which its own was late; both were driven alike."""
    sim_driver, real_driver = _driver(simulation), _driver(real)
    if sim_driver is None or real_driver is None or sim_driver.quantity != real_driver.quantity:
        return Refusal(
            f"the simulation {_name(simulation)} is driven by {_said(sim_driver)}, the recording {_name(real)} by "
            f"{_said(real_driver)}; both need the same one"
        )
    offset = _offset(sim_driver, real_driver)
    moved = _shifted(simulation, -offset)
    return _disagreement(moved, real) or (moved, offset)


def _first_move(drive: Drive) -> float:
    size = float(np.max(np.abs(drive.value)))
    moving = np.flatnonzero(np.abs(drive.value) > 0.05 * size)
    return float(drive.time[moving[0]]) if moving.size else float("nan")


def _shifted(recording: Recording, by: float) -> Recording:
    if by == 0.0:
        return recording
    return replace(recording, channels=tuple(replace(c, time=c.time + by) for c in recording.channels))


def _disagreement(simulation: Recording, real: Recording) -> Refusal | None:
    """Where the two were not driven alike, or not at the same time."""
    a, b = _driver(simulation), _driver(real)
    thrust, sim_thrust = real.first_of("thrust"), simulation.first_of("thrust")
    for recording, channel in ((simulation, sim_thrust), (real, thrust)):
        if channel is None or np.count_nonzero(np.isfinite(channel.value)) < 2:
            return Refusal(f"{_name(recording)} has no thrust channel (quantity thrust): there is nothing to compare")
    assert a is not None
    assert b is not None
    assert thrust is not None
    assert sim_thrust is not None
    inside = (thrust.time >= sim_thrust.time[0]) & (thrust.time <= sim_thrust.time[-1])
    if np.mean(inside) < policy.compare.SIMULATION_COVERS:
        return Refusal(
            f"the simulation {_name(simulation)} ends after {sim_thrust.time[-1] - sim_thrust.time[0]:.4g} s, the "
            f"recording {_name(real)} after {thrust.time[-1] - thrust.time[0]:.4g} s; simulate the whole run"
        )
    grid = np.arange(max(thrust.time[0], sim_thrust.time[0]), min(thrust.time[-1], sim_thrust.time[-1]), 0.02)
    given, done = held(_drive(a), grid), held(_drive(b), grid)
    far = np.abs(given - done) > policy.compare.COMMANDS_DIFFER * max(float(np.max(np.abs(done))), 1e-300)
    if np.mean(far) <= policy.compare.COMMANDS_DIFFER_TIME:
        return None
    at = int(np.flatnonzero(far)[_long(far)])
    unit = "rev/s" if b.quantity == "rotation_rate" else "V"
    return Refusal(
        f"the simulation {_name(simulation)} was not driven as {_name(real)} was: at {grid[at]:.4g} s it has "
        f"{given[at]:.4g} {unit}, the recording {done[at]:.4g} {unit} ({100 * np.mean(far):.0f} % of the time they "
        "differ); simulate the command of the recording (rig simulate --twin TWIN REAL -o SIM)"
    )


def _long(far: NDArray[np.bool_]) -> int:
    """Which of the differing points is the first one of a stretch that is no matter of clocks."""
    index = np.flatnonzero(far)
    breaks = np.flatnonzero(np.diff(index, prepend=-10) > 1)
    lengths = np.diff(np.append(breaks, index.size)) * 0.02
    good = np.flatnonzero(lengths > policy.compare.CLOCKS_DIFFER)
    return int(breaks[good[0]]) if good.size else 0


def sample_noise(channel: Channel) -> float:
    """N per sample, robustly, from second differences (a straight line has none)."""
    good = channel.value[np.isfinite(channel.value)]
    second = np.diff(good, 2)
    return float(np.median(np.abs(second)) / 0.6745 / np.sqrt(6)) if second.size else 0.0


def _described(simulation: Recording, real: Recording, seed: int, watch: Observer) -> Diagnosis | Refusal:
    """The diagnosis of the simulation, made as noisy as needed."""
    thrust, measured = simulation.first_of("thrust"), real.first_of("thrust")
    assert thrust is not None
    assert measured is not None
    size = float(np.nanmax(np.abs(thrust.value)))
    wanted = max(sample_noise(measured), 1e-5 * size)
    added = float(np.sqrt(max(wanted**2 - sample_noise(thrust) ** 2, 0.0)))
    noisy = thrust.value + added * np.random.default_rng([seed, 1]).standard_normal(thrust.value.size)
    return diagnose([_with_thrust(simulation, thrust, noisy)], seed=seed, watch=watch)


def _with_thrust(recording: Recording, thrust: Channel, value: Floats) -> Recording:
    channels = tuple(replace(c, value=value) if c is thrust else c for c in recording.channels)
    return replace(recording, channels=channels)


def _beyond(simulation: Recording, twin: Twin, known: Diagnosis, real: Recording) -> Floats | Refusal:
    """(n,) N at the real thrust samples: simulation less its own description; 0 where that is all its own noise."""
    thrust, measured, driver = simulation.first_of("thrust"), real.first_of("thrust"), _driver(simulation)
    assert thrust is not None
    assert measured is not None
    assert driver is not None
    if known.unexplained is None and sample_noise(thrust) > policy.compare.NOISY_SIMULATION * sample_noise(measured):
        return np.zeros(measured.time.size)
    good = np.isfinite(thrust.value)
    drive = replace(_drive(driver), others=others_of(simulation))
    found = simulate(replace(twin, lines=()), drive, thrust.time[good])
    if isinstance(found, Refusal):
        return found
    tare = next((v.value for name, v in known.model.items() if name == "tare"), 0.0)
    left: Floats = np.interp(
        measured.time, found.time, thrust.value[good] - found.thrust - tare, left=np.nan, right=np.nan
    )
    return left


def _less(real: Recording, left: Floats) -> Recording:
    thrust = real.first_of("thrust")
    assert thrust is not None
    return _with_thrust(real, thrust, thrust.value - left)


def _told(found: Diagnosis, known: Diagnosis, offset: float, rms: float, held_out: int) -> Diagnosis:
    """With what was done to the simulation."""
    terms = ", ".join(known.model_terms) or "nothing else"
    notes = [note for note in known.notes if note.startswith(INTERRUPTED)]
    notes += [f"The simulation was found to be {known.baseline_model} with {terms}; these are part of the baseline."]
    if rms > 0:
        notes.append(
            f"What it has beyond that ({rms:.3g} N rms) was subtracted as it is; a twin that is saved does not hold it."
        )
    if rms > 0 and held_out:
        notes.append("It was not subtracted from what was held out: those runs were not simulated.")
    if offset:
        notes.append(f"Its clock was moved by {-offset:+.4g} s, so that the commands begin together.")
    return replace(found, notes=(*found.notes, *notes))
